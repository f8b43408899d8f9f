//! `[run]` values in force: one list, the same in `--plan` and run.json.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

const SPEC: &str = r#"
whisker = { D = 10, d = 4, L_a = 50 }
gauge = { x_ss = 5, l = 2 }
tap = { a = [30, 40], theta = 2 }
[run]
backend = "reference"
tolerance = 1e-4
"#;

fn sweep(folder: &Path, more: &[&str]) -> Value {
    fs::write(folder.join("spec.toml"), SPEC).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_vibrissa"))
        .args(["sweep", "spec.toml", "--json"])
        .args(more)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Value in force of a key and whether it is a default; exactly one entry, or none.
fn entry(list: &Value, key: &str) -> Option<(String, bool)> {
    let mut found = list.as_array().unwrap().iter().filter(|e| e["key"] == key);
    let entry = found.next()?;
    assert!(found.next().is_none(), "{key} stands twice in {list}");
    Some((entry["value"].as_str().unwrap().to_owned(), entry["default"].as_bool().unwrap()))
}

fn is(value: &str, default: bool) -> Option<(String, bool)> {
    Some((value.to_owned(), default))
}

#[test]
fn the_command_line_wins_and_defaults_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sweep(folder.path(), &["--plan", "--backend", "cpu", "--threads", "2", "--force"]);
    let list = &plan["result"]["in_force"];
    assert_eq!(entry(list, "run.backend"), is("\"cpu\"", false));
    assert_eq!(entry(list, "run.threads"), is("2", false));
    assert_eq!(entry(list, "run.tolerance"), is("0.0001", false));
    assert_eq!(entry(list, "run.precision"), is("\"f32\"", true));
    assert_eq!(entry(list, "run.out"), is("\"results/spec\"", true));
    assert_eq!(entry(list, "run.force"), is("true", false));
    assert_eq!(entry(list, "run.plan"), is("true", false));
    assert_eq!(entry(list, "run.quiet"), is("false", true));
    assert_eq!(entry(list, "run.adapter"), None);
    assert_eq!(entry(list, "whisker.D"), is("10", false));
    assert!(!folder.path().join("results").exists());
}

#[test]
fn the_reference_ignores_precision_and_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    sweep(folder.path(), &["--precision", "f32", "--out", "there"]);
    let run: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("there/run.json")).unwrap()).unwrap();
    let list = &run["in_force"];
    assert_eq!(entry(list, "run.backend"), is("\"reference\"", false));
    assert_eq!(entry(list, "run.precision"), is("\"f64\"", true));
    assert_eq!(entry(list, "run.tolerance"), None);
    assert_eq!(entry(list, "run.out"), is("\"there\"", false));
    assert_eq!(entry(list, "run.force"), is("false", true));
    assert_eq!(run["material_fit"], Value::Null);
}

#[test]
fn what_auto_takes_is_no_choice_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sweep(folder.path(), &["--plan", "--backend", "auto"]);
    let list = &plan["result"]["in_force"];
    let taken = plan["backend"]["name"].as_str().unwrap();
    assert_eq!(entry(list, "run.backend"), is(&format!("{taken:?}"), true));
    let adapter = plan["backend"]["adapter"].as_str().map(|a| (format!("{a:?}"), true));
    assert_eq!(entry(list, "run.adapter"), adapter);
}
