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

/// Designs sampled over the ranges of a lab with ten distances each, of the model that a practical whisker has.
fn practical(samples: u32, contact: &str, rest: &str) -> String {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = {samples} }}");
    format!(
        "[whisker]\nD = {}\nd = {}\nL_a = 50\n[gauge]\nx_ss = {}\nl = 2\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {}\n\
         [model]\nsurface = true\nshear = true\nextension = true\nmaterial = {{ neo-hookean = 3.2 }}\n{contact}\n{rest}",
        axis(8.0, 12.0),
        axis(2.0, 7.0),
        axis(3.0, 15.0),
        axis(0.5, 10.0)
    )
}

fn counts(text: &str) -> serde_json::Value {
    let run = ["sweep", "spec.toml", "--json", "--backend", "cpu"];
    Desk::new(text).run(&run).exits(0).json()["counts"].clone()
}

/// Taps solved for ten charts, and what they hold: what reading a tap costs.
#[test]
fn charts_cost_few_taps_and_hold_few_terms() {
    for (contact, most) in [("", [22_000, 16_000]), ("contact = { coulomb = 0.3 }", [120_000, 90_000])] {
        let counts = counts(&practical(20_000, contact, "[output]\ntop = 10\n"));
        let of = |key: &str| counts["chart"][key].as_u64().unwrap();
        assert!(of("solved") <= most[0] && of("coefficients") <= most[1], "{counts}");
        assert!(counts["solved"].as_u64().unwrap() < of("solved") + 40_000, "{counts}");
    }
}

/// Sweeps of solved taps: friction is one solution of most, and a contact that sticks is found as fast as one that slides.
#[test]
fn solved_taps_take_few_sweeps() {
    let extension = "[whisker]\nD = { from = 8, to = 12, steps = 10 }\nd = { from = 2, to = 7, steps = 10 }\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n\
         [tap]\na = { from = 21, to = 48, steps = 10 }\ntheta = [1, 4, 10]\n[model]\nextension = true\n";
    for (contact, most) in [
        ("contact = \"frictionless\"", 5.0),
        ("contact = \"stick\"", 8.0),
        ("contact = { coulomb = 0.3 }", 9.0),
    ] {
        let counts = counts(&format!("{extension}{contact}\n"));
        assert_eq!(counts["interpolated"], 0, "{counts}");
        let mean = counts["sweeps_mean"].as_f64().unwrap();
        assert!(mean > 0.0 && mean < most, "{contact}: {counts}");
    }
}
