//! `--plan` says about how long a sweep takes, and why: the way its taps go decides, not their number.

use crate::common::program::Desk;

const WHISKERS: &str = "[whisker]\nD = { from = 8, to = 12, steps = 400 }\nd = { from = 2, to = 7, steps = 400 }\nL_a = 50\n\
                        [gauge]\nx_ss = { from = 3, to = 15, steps = 25 }\nl = 2\n";
const WHISKER: &str = "[whisker]\nD = 10\nd = 0.2\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n";

/// Seconds and way of a plan.
fn planned(text: &str, arguments: &[&str]) -> (f64, String) {
    let ran =
        Desk::new(text).run(&[&["sweep", "spec.toml", "--plan", "--json"], arguments].concat()).exits(0);
    let seconds = ran.json()["seconds"].clone();
    (seconds["expected"].as_f64().expect("a number"), seconds["way"].as_str().expect("words").to_owned())
}

fn taps(a: u32, theta: u32, rest: &str) -> String {
    format!(
        "[tap]\na = {{ from = 21, to = 48, steps = {a} }}\ntheta = {{ from = 0.5, to = 80, steps = {theta} }}\n{rest}"
    )
}

#[test]
fn a_ranked_sweep_of_billions_is_planned_in_seconds() {
    let ranked = format!(
        "{WHISKERS}[tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {{ from = 0.1, to = 10, steps = 100 }}\n\
         [output]\ntuples = false\ndistances = false\ntop = 100\n"
    );
    let (seconds, way) = planned(&ranked, &["--backend", "cpu", "--threads", "2"]);
    assert_eq!(way, "ranked from a chart");
    let (each, way) = planned(&ranked, &["--backend", "cpu", "--threads", "2", "--precision", "f64"]);
    assert_eq!(way, "solved tap by tap");
    // Seconds are those of this machine, whatever it is: only how they compare is to test.
    assert!((1e-5 * each..each).contains(&seconds), "{each} and {seconds}");
}

#[test]
fn a_plan_says_which_way_the_taps_go() {
    let way =
        |theta, rest: &str| planned(&format!("{WHISKER}{}", taps(5, theta, rest)), &["--backend", "cpu"]).1;
    assert_eq!(way(6, ""), "solved tap by tap");
    assert_eq!(way(60, "[model]\ngeometry = \"linear\"\n"), "solved tap by tap");
    let reference = format!("{WHISKER}{}", taps(5, 60, ""));
    assert_eq!(planned(&reference, &["--backend", "reference"]).1, "solved by the reference");
}

/// Sharp tips turned far with friction are left to the reference: 48 such taps take seconds, and as many that a kernel solves next to nothing.
#[test]
fn friction_that_the_reference_must_solve_is_planned_for() {
    let friction = "[model]\nextension = true\ncontact = { coulomb = 0.3 }\n";
    let hard = format!("{WHISKER}{}", taps(8, 6, friction));
    let easy = hard.replace("d = 0.2", "d = 4").replace("to = 80", "to = 10");
    assert_ne!(hard, easy);
    let [slow, fast] = [hard, easy].map(|text| planned(&text, &["--backend", "cpu"]).0);
    assert!(slow > 10.0 * fast, "{slow} and {fast}");
}
