"""The program that results are compared with, and what tests share."""

import csv
import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def program():
    """The built program: VIBRISSA, or the newest in target/."""
    named = os.environ.get("VIBRISSA")
    if named:
        return pathlib.Path(named)
    built = [p for kind in ("debug", "release") if (p := ROOT / "target" / kind / "vibrissa").exists()]
    assert built, "build the program first (cargo build), or name it in VIBRISSA"
    return max(built, key=lambda p: p.stat().st_mtime)


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def cli():
    """Runs the program in the root of the repository; standard output."""
    path = program()

    def run(*args, **options):
        done = subprocess.run([path, *map(str, args)], capture_output=True, text=True, cwd=ROOT, **options)
        assert done.returncode == 0, f"{args}: {done.stderr}"
        return done.stdout

    return run


def same_table(table, path):
    """Every field of a CSV file is what the table holds, numbers to the last bit."""
    with open(path, newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert table.columns == header
    assert len(table) == len(rows)
    for k, (name, kind) in enumerate(zip(header, table.kinds())):
        cells, values = [row[k] for row in rows], table[name]
        if kind == "words":
            assert [v or "" for v in values] == cells, name
        else:
            expected = np.array([float(c) if c else np.nan for c in cells], dtype=values.dtype if kind == "count" else float)
            different = np.flatnonzero(~((values == expected) | (np.isnan(values) & np.isnan(expected))))
            assert not len(different), f"{name} in row {different[0]}: {values[different[0]]!r}, {cells[different[0]]}"
    assert not rows or any(kind != "words" for kind in table.kinds())
