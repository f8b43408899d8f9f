//! The terminal output of a sweep: the best rows by the ranking column, and the names of the errors.

use crate::common::program::{Desk, SPEC};
use crate::common::sweeping::number;

fn best(stdout: &str) -> Vec<&str> {
    let table = stdout.lines().skip_while(|line| !line.starts_with("best "));
    table.take_while(|line| !line.starts_with("error_rms_mm is")).collect()
}

fn column(lines: &[&str], name: &str) -> Vec<f64> {
    let at = lines[1].split_whitespace().position(|word| word == name).unwrap_or_else(|| panic!("no {name}"));
    let cell = |line: &&str| line.split_whitespace().nth(at).unwrap().trim_end_matches('°').parse().unwrap();
    lines[2..].iter().map(cell).collect()
}

fn many(output: &str) -> String {
    let spec = SPEC.replace("d = [4, 7]", "d = { from = 4, to = 10, steps = 20 }");
    spec.replace("theta = [1, 4]", "theta = { from = 1, to = 7, steps = 7 }") + output
}

fn smallest(desk: &Desk, name: &str) -> Vec<f64> {
    let rows = desk.table("out/designs.csv").rows;
    let mut all: Vec<f64> = rows.iter().filter_map(|row| number(row, name)).collect();
    all.sort_by(f64::total_cmp);
    all.truncate(8);
    all
}

#[track_caller]
fn agree(shown: &[f64], exact: &[f64]) {
    assert_eq!(shown.len(), exact.len(), "{shown:?} {exact:?}");
    let near = shown.iter().zip(exact).all(|(a, b)| (a / b - 1.0).abs() < 1e-3);
    assert!(near, "{shown:?} {exact:?}");
}

#[test]
fn the_best_rows_of_all_are_shown_by_the_column_that_ranks() {
    for by in ["K_sd", "error_max_mm", "total_rms_mm", "force_max_N"] {
        let desk = Desk::new(&many(&format!("[output]\nby = \"{by}\"\n")));
        let ran = desk.sweep(&["--out", "out"]).exits(0);
        let lines = best(&ran.stdout);
        assert_eq!(lines[0], format!("best 8 of 140 complete rows by {by}:"));
        agree(&column(&lines, by), &smallest(&desk, by));
        let json = desk.sweep(&["--out", "out", "--json"]).exits(0).json();
        assert_eq!((&json["result"]["by"], &json["result"]["ranked_rows"]), (&by.into(), &140.into()));
    }
}

#[test]
fn bias_noise_and_total_are_named() {
    let desk = Desk::new(SPEC);
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    let header = best(&ran.stdout)[1];
    for name in ["K_sd", "error_rms_mm", "noise_rms_mm", "total_rms_mm"] {
        assert!(header.contains(name), "{header}");
    }
    // With noise, rows are listed by the total error, unless `top` selects them by another column.
    assert!(best(&ran.stdout)[0].ends_with("by total_rms_mm:"), "{}", ran.stdout);
    assert!(ran.stdout.starts_with("Of 4 complete rows, the whisker with d = "), "{}", ran.stdout);
    desk.write("spec.toml", format!("{SPEC}[output]\ntop = 3\n"));
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    for part in ["by K_sd:", "error_rms_mm is the bias", "K_sd holds no noise", "by = \"total_rms_mm\""] {
        assert!(ran.stdout.contains(part), "`{part}`: {}", ran.stdout);
    }
    // No remark where K_sd was requested, or without noise.
    desk.write("spec.toml", format!("{SPEC}[output]\nby = \"K_sd\"\n"));
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(ran.stdout.contains("total_rms_mm") && !ran.stdout.contains("holds no noise"), "{}", ran.stdout);
    desk.write("spec.toml", SPEC.replace("noise_strain = 1e-6\n", ""));
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(!ran.stdout.contains("total_rms_mm") && ran.stdout.contains("bias"), "{}", ran.stdout);
}

#[test]
fn where_no_row_is_complete_that_is_said() {
    let desk = Desk::new(&SPEC.replace("a = [21, 33, 48]", "a = 33"));
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(ran.stdout.starts_with("no complete row to rank by total_rms_mm"), "{}", ran.stdout);
}
