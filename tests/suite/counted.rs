//! Counts of run.json that are means: of the taps that they name, on every way that taps go.

use crate::common::program::Desk;

/// A grid whose taps are solved one by one, read over the drives, or ranked from a chart, as `rest` says.
fn spec(designs: u32, theta: &str, rest: &str) -> String {
    format!(
        "[whisker]\nD = {{ from = 8, to = 12, steps = {designs} }}\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n\
         [tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {theta}\n{rest}"
    )
}

#[test]
fn mean_sweeps_are_those_of_the_taps_solved_on_every_path() {
    let fine = "{ from = 0.5, to = 10, steps = 60 }";
    let paths = [
        ("tap by tap", spec(20, "{ from = 1, to = 10, steps = 10 }", "")),
        ("over drives", spec(2, fine, "")),
        ("charted", spec(300, fine, "[output]\ntop = 5\n")),
    ];
    for backend in ["cpu", "gpu"] {
        for (path, text) in &paths {
            let ran =
                Desk::new(text).run(&["sweep", "spec.toml", "--json", "--backend", backend]).exits(0).json();
            let counts = &ran["counts"];
            let number = |key: &str| counts[key].as_f64().unwrap_or(f64::NAN);
            let (mean, most) = (number("sweeps_mean"), number("sweeps_max"));
            assert!((1.0..12.0).contains(&mean) && mean <= most, "{path} on {backend}: {counts}");
            assert_eq!(number("interpolated") > 0.0, *path != "tap by tap", "{path} on {backend}");
            assert_eq!(!counts["chart"].is_null(), *path == "charted");
        }
    }
}

#[test]
fn a_reference_run_has_no_sweeps() {
    let ran =
        Desk::new(&spec(2, "[1, 4]", "")).run(&["sweep", "spec.toml", "--json", "--backend", "reference"]);
    let counts = ran.exits(0).json()["counts"].clone();
    assert_eq!((&counts["sweeps_mean"], &counts["sweeps_max"]), (&0.0.into(), &0.0.into()));
}
