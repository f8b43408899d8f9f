"""Parquet tables of the program: what pandas, polars and DuckDB read is what the CSV files say, with units and provenance."""

import json

import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

# Designs that are no whiskers, taps that slip off, one drive without a spread.
SPEC = """[whisker]
D = 10
d = [2, 4, 7, 10]
L_a = [46, 50]
[gauge]
x_ss = [5, 45]
l = 2
noise_strain = 1e-6
[tap]
a = [21, 33, 48]
theta = [1, 4, 20, 40]
[output]
format = "KIND"
"""


@pytest.fixture(scope="module")
def tables(cli, tmp_path_factory):
    """A folder with the same sweep in csv and in parquet."""
    folder = tmp_path_factory.mktemp("tables")
    for kind in ("csv", "parquet"):
        (folder / kind).mkdir()
        (folder / kind / "spec.toml").write_text(SPEC.replace("KIND", kind))
        cli("sweep", folder / kind / "spec.toml", "--backend", "cpu", "--quiet", "--out", folder / kind / "out")
    return folder


@pytest.mark.parametrize("table", ["tuples", "designs", "distances"])
def test_every_reader_sees_what_csv_says(table, tables):
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed here")
    text, path = pd.read_csv(tables / f"csv/out/{table}.csv", keep_default_na=True), tables / f"parquet/out/{table}.parquet"
    for name, read in {
        "pandas": pd.read_parquet(path),
        "polars": pl.read_parquet(path).to_pandas(),
        "duckdb": duckdb.sql(f"select * from '{path}'").df(),
    }.items():
        assert list(read.columns) == list(text.columns) and len(read) == len(text), name
        for column in text.columns:
            a, b = text[column], read[column]
            assert (a.isna().to_numpy() == b.isna().to_numpy()).all(), (name, column, "missing values")
            assert (a.dropna().to_numpy() == b.dropna().to_numpy()).all(), (name, column, "values")
        kinds = {c: str(read[c].dtype) for c in read.columns}
        assert all(k == "float64" for c, k in kinds.items() if c.endswith(("_mm", "_deg", "_N"))), kinds
        assert kinds.get("n", "int64") in ("int64", "Int64"), kinds
    facts = {k.decode(): json.loads(v) for k, v in pq.read_metadata(path).metadata.items()}
    units = facts["vibrissa.units"]
    assert list(units) == list(text.columns) and units["D_mm"] == "mm" and units["status"] == "1", units
    assert units.get("theta_deg", "deg") == "deg" and units.get("normal_force_N", "N") == "N", units
    provenance, run = facts["vibrissa.provenance"], json.loads((tables / "parquet/out/run.json").read_text())
    assert all(provenance[key] == run[key] for key in ["command", "version", "commit", "spec"])
    assert provenance["backend"]["tolerance"] == run["backend"]["tolerance"]
    values = {e["key"]: e["value"] for e in provenance["in_force"]}
    assert values["output.format"] == '"parquet"' and "run.threads" not in values, values


def test_the_words_are_there(tables):
    words = set(pl.read_parquet(tables / "parquet/out/tuples.parquet")["status"])
    assert {"ok", "slipped_off", "invalid_geometry"} <= words, words
