//! `--plan` estimates seconds from the way taps are solved. Work that a small input could make endless is refused or bounded.

use std::time::Instant;

use crate::common::program::{Desk, SPEC, large};
use crate::common::specs::parse;
use crate::common::world::{GUARD, shell};
use vibrissa::backend::PAYS;
use vibrissa::plan::of_study;
use vibrissa::scene::{Precision, RunOptions};

const WHISKERS: &str = "[whisker]\nD = { from = 8, to = 12, steps = 400 }\nd = { from = 2, to = 7, steps = 400 }\nL_a = 50\n\
                        [gauge]\nx_ss = { from = 3, to = 15, steps = 25 }\nl = 2\n";
const WHISKER: &str = "[whisker]\nD = 10\nd = 0.2\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n";

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
    // Times depend on the machine: only their ratio is tested.
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

/// Seconds of a CPU with four threads: a device pays where they are many.
#[test]
fn large_sweeps_pay_and_small_ones_do_not() {
    let whisker =
        WHISKER.replace("D = 10", "D = { min = 8, max = 12, samples = 40_000_000 }").replace("0.2", "4");
    let of = |rest: &str, precision, model_error| {
        let text = format!(
            "{whisker}[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{rest}\n[output]\ntop = 100\n"
        );
        let options = RunOptions { threads: Some(4), precision, model_error, ..RunOptions::default() };
        of_study(&parse(&text).expect("a spec").study, &options)
    };
    let work = |rest: &str, precision| of(rest, precision, None);
    let double = Some(Precision::F64);
    let [read, solved] =
        [None, double].map(|precision| work("theta = 4", precision).expect("work of a device"));
    assert!(read > PAYS && read < 20.0 && solved > 10.0 * read, "{read} {solved}");
    assert_eq!(work("theta = 4\n[model]\ngeometry = \"linear\"", double), Some(0.0));
    assert!(work("theta = { from = 1, to = 10, steps = 10 }", None) < Some(read));
    // Solved on the CPU alone: a clamp beyond rod theory, and a root that gives way.
    let bonded = "theta = 4\n[model]\nshear = true\nclamp = \"bonded\"";
    assert_eq!(work(bonded, double), None);
    assert!(of(bonded, double, Some(0.01)).is_some(), "the clamp may be left off");
    assert_eq!(work("theta = 4\n[whisker.root]\nk_theta = 900", None), None);
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

/// A ranked sweep whose charts take longer to make than to read.
const RANKED: &str = "[whisker]\nD = { min = 8, max = 12, samples = 66000 }\nd = { min = 3, max = 7, samples = 66000 }\nL_a = 50\n\
                      [gauge]\nx_ss = 5\nl = 2\n[tap]\na = [24, 36]\ntheta = { min = 1, max = 6, samples = 66000 }\n\
                      [model]\nsurface = true\n[output]\ntop = 10\n";

#[test]
fn making_charts_counts() {
    let desk = Desk::new(RANKED);
    desk.sweep(&["--out", "out"]).exits(0);
    let run = desk.whole("out");
    let seconds =
        |key: &str| run["seconds"][key].as_f64().unwrap_or_else(|| panic!("{key} in {}", run["seconds"]));
    assert!(run["counts"]["chart"].is_object(), "{}", run["counts"]);
    assert!(seconds("chart") > 0.0 && seconds("solve") > 0.0);
    assert!(seconds("total") >= seconds("chart") + seconds("solve") + seconds("open"), "{}", run["seconds"]);
    let rate = run["counts"]["taps"].as_f64().expect("taps") / seconds("total");
    let told = run["taps_per_second"].as_f64().expect("a rate");
    assert!((rate - told).abs() <= 1e-9 * rate, "{rate} {told}");
    // What else the machine does slows a sweep or its plan at times, so that they are compared again.
    let counted = || {
        desk.sweep(&["--out", "again", "--force"]).exits(0);
        let took = desk.whole("again")["seconds"]["chart"].as_f64().expect("a chart is made");
        let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
        plan["seconds"]["expected"].as_f64().expect("seconds") > 0.3 * took
    };
    assert!((0..6).any(|_| counted()), "plans say less than making the charts took");
    desk.write("spec.toml", RANKED.replace("66000", "300").replace("top = 10", ""));
    desk.sweep(&["--out", "none"]).exits(0);
    assert!(desk.whole("none")["seconds"].get("chart").is_none());
}

/// Kernels leave these taps to the reference, which takes a good part of a second for each in a debug build.
#[test]
fn a_plan_of_taps_that_take_long_is_there_at_once() {
    let hard = "[whisker]\nD = 1e9\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = { from = 21, to = 48, steps = 10 }\n\
                theta = { from = 0.5, to = 10, steps = 11 }\n[model]\nshear = true\nextension = true\nsurface = true\n\
                material = { neo-hookean = 3.2 }\n";
    let desk = Desk::new(hard);
    let begun = Instant::now();
    let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
    let (took, expected) =
        (begun.elapsed().as_secs_f64(), plan["seconds"]["expected"].as_f64().expect("seconds"));
    assert!(plan["counts"]["taps"] == 110 && expected > 3.0, "{plan}");
    assert!(took < 0.3 * expected, "{took} of {expected}");
}

/// Fails if `f`, which would take hours without its bound, hangs.
#[track_caller]
fn soon<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = f();
    assert!(start.elapsed() < GUARD, "{what} took {:?}", start.elapsed());
    result
}

#[test]
fn a_plan_of_2_to_the_32_points_comes_at_once() {
    const POINTS: &str = "samples = 4294967296 }";
    let designs = format!("D = {{ min = 8, max = 12, {POINTS}");
    let text = SPEC.replace("D = 10", &designs) + "[output]\ntop = 3\n";
    let planned = soon("designs", || Desk::new(&text).sweep(&["--plan", "--json"]).exits(0).json());
    assert_eq!(planned["counts"]["designs_total"], 2u64 << 32);
}

#[test]
#[cfg(target_os = "linux")]
fn auto_takes_the_cpu_where_the_address_space_is_limited() {
    let desk = Desk::new(&large());
    for limit in [600_000, 1_000_000, 3_000_000] {
        let ran = shell(&desk, &format!("ulimit -v {limit}; exec \"$PROGRAM\" sweep spec.toml --plan"));
        let said = [&ran.stdout, &ran.stderr].map(|text| String::from_utf8_lossy(text)).concat();
        assert!(ran.status.success(), "{limit}: {said}");
        assert!(said.contains("on cpu with") && said.contains("the address space is limited to"), "{said}");
    }
}
