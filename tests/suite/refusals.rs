//! Specs that the program refuses: exit 2, a message that a stranger can act on, nothing written.

use crate::common::program::{Desk, SPEC};

/// Runs `spec.toml` of `desk`, expects exit 2 with all of `parts` on stderr and in JSON, and nothing new in the folder.
#[track_caller]
fn refused_on(desk: &Desk, file: &str, line: Option<usize>, key: &str, value: &str, parts: &[&str]) {
    let before = desk.names(".");
    let ran = desk.sweep(&[]).exits(2);
    assert_eq!(ran.stdout, "");
    for part in parts {
        assert!(ran.stderr.contains(part), "`{part}` is not in: {}", ran.stderr);
    }
    let place = line.map_or(file.to_owned(), |line| format!("{file}:{line}:"));
    assert!(ran.stderr.contains(&place), "`{place}` is not in: {}", ran.stderr);
    let error = desk.sweep(&["--json"]).exits(2).json()["error"].clone();
    assert!(error["file"].as_str().is_some_and(|f| f.ends_with(file)), "{error}");
    assert_eq!(error["line"].as_u64(), line.map(|l| l as u64), "{error}");
    assert_eq!(
        (error["key"].as_str().unwrap_or(""), error["value"].as_str().unwrap_or("")),
        (key, value),
        "{error}"
    );
    assert_eq!(desk.names("."), before);
}

/// `SPEC` with one change.
#[track_caller]
fn refused(old: &str, new: &str, line: usize, key: &str, value: &str, parts: &[&str]) {
    assert!(SPEC.contains(old));
    refused_on(&Desk::new(&SPEC.replacen(old, new, 1)), "spec.toml", Some(line), key, value, parts);
}

#[test]
fn specs() {
    refused("x_ss = 5", "xss = 5", 6, "gauge.xss", "5", &["unknown key", "did you mean x_ss?"]);
    refused("D = 10", "D = \"10 mm\"", 2, "whisker.D", "\"10 mm\"", &["without unit and quotes", "> 0 mm"]);
    refused("D = 10", "D = 10 mm", 2, "", "", &["cannot be understood", "numbers without unit"]);
    refused("x_ss = 5", "x_ss = 49", 6, "gauge.x_ss", "49", &["beyond the whisker", "x_ss + l ≤ 50 mm"]);
    let crowd = "[1, 4]\n[run]\nthreads = 10_000_000";
    refused("[1, 4]", crowd, 13, "run.threads", "10_000_000", &["too large", "1 … 4096"]);
}

const HEADER: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg";

#[track_caller]
fn list_refused(list: &[u8], line: Option<usize>, key: &str, value: &str, parts: &[&str]) {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    desk.write("list.csv", list);
    refused_on(&desk, "list.csv", line, key, value, parts);
}

#[test]
fn tuple_files() {
    let good = "10,4,50,5,2,33,1";
    let list = |rows: &str| format!("{HEADER}\n{good}\n{rows}\n").into_bytes();
    let short = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm";
    let rows = format!("{short}\n10,4,50,5,2,33\n");
    list_refused(rows.as_bytes(), Some(1), "theta_deg", short, &["column theta_deg is missing"]);
    list_refused(&list("10,4,50,5,2,near,1"), Some(3), "a_mm", "near", &["not a finite number", "mm"]);
    list_refused(&list("10,4,50,5,2,nan,1"), Some(3), "a_mm", "nan", &["not a finite number"]);
    list_refused(&list("10,4,50,5,2,33"), Some(3), "theta_deg", "10,4,50,5,2,33", &["6 fields", "has 7"]);
    list_refused(b"D_mm,d_mm\n10,\xff\n", Some(2), "", "", &["not UTF-8"]);
    list_refused(b"", None, "", "", &["empty", HEADER]);
}

#[test]
fn tuples_outside_are_rows_not_errors() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    desk.write("list.csv", format!("{HEADER}\n10,4,50,5,2,33,1\n-10,4,50,5,2,33,1\n10,4,50,5,2,60,1\n10,4,50,5,2,33,90\n10,4,50,49,2,33,1\n"));
    desk.sweep(&[]).exits(0);
    let text = desk.read("results/spec/tuples.csv");
    let statuses: Vec<_> = text.lines().skip(1).map(|line| line.rsplit(',').next().unwrap()).collect();
    assert_eq!((statuses[0], &statuses[1..]), ("ok", &["invalid_geometry"; 4][..]));
    let row = text.lines().nth(2).unwrap();
    assert_eq!(row, "-10,4,50,5,2,33,1,,,,,,,,,,,,invalid_geometry");
}

#[test]
fn ignored_columns_are_said_once() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    desk.write("list.csv", format!("{HEADER},note\n10,4,50,5,2,33,1,x\n10,4,50,5,2,21,1,y\n"));
    let ran = desk.sweep(&[]).exits(0);
    assert_eq!(ran.stderr.matches("ignored columns note").count(), 1, "{}", ran.stderr);
}

#[test]
fn paths_in_a_spec_are_relative_to_it() {
    let desk = Desk::new("");
    std::fs::create_dir(desk.path("specs")).unwrap();
    desk.write("specs/listed.toml", "[tuples]\nfile = \"list.csv\"\n");
    desk.write("specs/list.csv", format!("{HEADER}\n10,4,50,5,2,33,1\n"));
    desk.ok("sweep specs/listed.toml --backend cpu");
    assert_eq!(desk.names("results/listed").len(), 4);
}
