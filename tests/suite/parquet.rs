//! Parquet tables: what pandas, polars and DuckDB read is what the CSV files say, with units and provenance.

use crate::common::program::{Desk, SPEC};

const READ: &str = r#"
import json, sys
import duckdb, pandas as pd, polars as pl, pyarrow.parquet as pq

for table in ["tuples", "designs", "distances"]:
    text, path = pd.read_csv(f"csv/{table}.csv", keep_default_na=True), f"parquet/{table}.parquet"
    for name, read in {
        "pandas": pd.read_parquet(path),
        "polars": pl.read_parquet(path).to_pandas(),
        "duckdb": duckdb.sql(f"select * from '{path}'").df(),
    }.items():
        assert list(read.columns) == list(text.columns), (table, name, read.columns)
        assert len(read) == len(text), (table, name)
        for column in text.columns:
            a, b = text[column], read[column]
            assert (a.isna().to_numpy() == b.isna().to_numpy()).all(), (table, name, column, "missing values")
            assert (a.dropna().to_numpy() == b.dropna().to_numpy()).all(), (table, name, column, "values")
        kinds = {c: str(read[c].dtype) for c in read.columns}
        assert all(k == "float64" for c, k in kinds.items() if c.endswith(("_mm", "_deg", "_N"))), kinds
        assert kinds.get("n", "int64") in ("int64", "Int64"), kinds
    facts = {k.decode(): json.loads(v) for k, v in pq.read_metadata(path).metadata.items()}
    units = facts["vibrissa.units"]
    assert list(units) == list(text.columns) and units["D_mm"] == "mm" and units["status"] == "1", units
    assert units.get("theta_deg", "deg") == "deg" and units.get("normal_force_N", "N") == "N", units
    provenance, run = facts["vibrissa.provenance"], json.load(open("parquet/run.json"))
    for key in ["command", "version", "commit", "spec"]:
        assert provenance[key] == run[key], key
    assert provenance["backend"]["tolerance"] == run["backend"]["tolerance"]
    values = {e["key"]: e["value"] for e in provenance["in_force"]}
    assert values["output.format"] == '"parquet"' and "run.threads" not in values, values
statuses = set(pl.read_parquet("parquet/tuples.parquet")["status"])
assert {"ok", "slipped_off", "invalid_geometry"} <= statuses, statuses
print("read", sorted(statuses))
"#;

/// The Python with the readers (`tests/run` makes it).
fn python() -> std::path::PathBuf {
    let root = std::path::Path::new(crate::common::ROOT);
    let named = std::env::var_os("VIBRISSA_PYTHON").map(std::path::PathBuf::from);
    let python = named.unwrap_or_else(|| root.join("target/python/bin/python"));
    assert!(
        python.exists(),
        "tests/run installs pandas, polars and DuckDB for this test: python3 -m venv target/python && target/python/bin/pip install -r tests/requirements.txt"
    );
    python
}

#[test]
fn pandas_polars_and_duckdb_read_what_csv_says() {
    // Designs that are no whiskers, taps that slip off, one drive without a spread.
    let spec = SPEC
        .replace("d = [4, 7]", "d = [2, 4, 7, 10]")
        .replace("theta = [1, 4]", "theta = [1, 4, 20, 40]")
        .replace("x_ss = 5", "x_ss = [5, 45]")
        .replace("L_a = 50", "L_a = [46, 50]");
    let desk = Desk::new(&spec);
    desk.write("pq/spec.toml", format!("{spec}[output]\nformat = \"parquet\"\n"));
    desk.sweep(&["--out", "csv"]).exits(0);
    desk.ok("sweep pq/spec.toml --backend cpu --out parquet");
    assert_eq!(desk.names("parquet"), ["designs.parquet", "distances.parquet", "run.json", "tuples.parquet"]);
    desk.whole("parquet");
    let ran =
        std::process::Command::new(python()).current_dir(desk.path(".")).args(["-c", READ]).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(ran.status.success(), "{said}");
}

#[test]
fn an_empty_table_has_its_columns() {
    let desk = Desk::new(&format!(
        "{}[output]\nformat = \"parquet\"\ntop = 5\n",
        SPEC.replace("a = [21, 33, 48]", "a = 0.5")
    ));
    desk.sweep(&["--out", "out"]).exits(0);
    let file = std::fs::File::open(desk.path("out/designs.parquet")).unwrap();
    let mut reader = vibrissa::sink::parquet::Reader::new(&desk.path("out/designs.parquet"), file).unwrap();
    assert_eq!(reader.frame().names.last().map(AsRef::as_ref), Some("status"));
    assert!(reader.next_group().unwrap().is_none());
}
