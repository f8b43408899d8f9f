#!/usr/bin/env python3
"""Every table of every shipped spec and example, written by two builds of the program: the same bytes, or how far apart.

    benches/same_tables.py BEFORE AFTER

BEFORE and AFTER are two `vibrissa` programs. One line per run; exit code 1 where any file differs. run.json, which holds times, is not
compared. Relative differences are of the numbers of each column, "words" counts fields that are no numbers."""
import csv
import filecmp
import os
import subprocess
import sys
import tempfile


def runs():
    for spec in ["prototypes", "practical", "effects", "million"]:
        path = f"sweeps/{spec}.toml"
        for backend in ["cpu", "gpu"]:
            for precision in ["f32", "f64"]:
                if spec != "million" or (backend, precision) == ("cpu", "f32"):
                    yield ["sweep", path, "--backend", backend, "--precision", precision]
        if spec in ("prototypes", "practical"):
            yield ["sweep", path, "--backend", "reference"]
    yield ["tap", "sweeps/best-tap.toml", "--backend", "cpu"]
    yield ["optimise", "sweeps/design.toml", "--backend", "cpu"]
    for name in ["d4", "d7", "d10"]:
        yield ["simulate", f"examples/prototype-{name}.toml"]
        yield ["calibrate", f"examples/prototype-{name}.csv", "--whisker", f"examples/prototype-{name}.toml"]


def apart(one, other):
    """The difference between two files, in words, or an empty text."""
    if not (os.path.exists(one) and os.path.exists(other)):
        return "written by one of them only"
    if filecmp.cmp(one, other, shallow=False):
        return ""
    if not one.endswith(".csv"):
        return "differs"
    with open(one) as a, open(other) as b:
        a, b = list(csv.reader(a)), list(csv.reader(b))
    if len(a) != len(b) or a[0] != b[0]:
        return f"{len(a)} and {len(b)} rows, or other columns"
    worst, words = {}, 0
    for row, twin in zip(a[1:], b[1:]):
        for column, x, y in zip(a[0], row, twin):
            if x != y:
                try:
                    off = abs(float(x) - float(y)) / max(abs(float(x)), 1e-300)
                    worst[column] = max(worst.get(column, 0.0), off)
                except ValueError:
                    words += 1
    return ", ".join([f"{c} {off:.1e}" for c, off in worst.items()] + [f"{words} words"] * (words > 0))


def main():
    programs = [os.path.abspath(p) for p in sys.argv[1:3]]
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    differ = False
    for arguments in runs():
        with tempfile.TemporaryDirectory() as folder:
            outs = [os.path.join(folder, name) for name in ("before", "after")]
            for program, out in zip(programs, outs):
                subprocess.run([program, *arguments, "--out", out, "--quiet"], check=True)
            names = sorted(set(os.listdir(outs[0])) | set(os.listdir(outs[1])))
            found = {n: apart(*(os.path.join(o, n) for o in outs)) for n in names if n != "run.json"}
        differ |= any(found.values())
        print(" ".join(arguments), "|", "; ".join(f"{n}: {what or 'same'}" for n, what in found.items()), flush=True)
    sys.exit(differ)


if __name__ == "__main__":
    main()
