//! Seconds of `run.json`: all of them are in the total.

use crate::common::program::Desk;

/// A ranked sweep of a model whose charts take longer to make than to read.
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
}

/// Both are timed here. What else the machine does slows one of them at times, so that they are compared again.
#[test]
fn a_plan_counts_the_making_of_charts() {
    let desk = Desk::new(RANKED);
    let counted = || {
        desk.sweep(&["--out", "out", "--force"]).exits(0);
        let took = desk.whole("out")["seconds"]["chart"].as_f64().expect("a chart is made");
        let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
        plan["seconds"]["expected"].as_f64().expect("seconds") > 0.3 * took
    };
    assert!((0..6).any(|_| counted()), "plans say less than making the charts took");
}

#[test]
fn where_no_chart_was_tried_none_is_told() {
    let desk = Desk::new(&RANKED.replace("66000", "300").replace("top = 10", ""));
    desk.sweep(&["--out", "out"]).exits(0);
    assert!(desk.whole("out")["seconds"].get("chart").is_none());
}

/// Taps that kernels leave to the reference, which takes a good part of a second for each without optimisation.
#[test]
fn a_plan_of_taps_that_take_long_is_there_at_once() {
    let hard = "[whisker]\nD = 1e9\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = { from = 21, to = 48, steps = 10 }\n\
                theta = { from = 0.5, to = 10, steps = 11 }\n[model]\nshear = true\nextension = true\nsurface = true\n\
                material = { neo-hookean = 3.2 }\n";
    let desk = Desk::new(hard);
    let begun = std::time::Instant::now();
    let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
    let (took, expected) =
        (begun.elapsed().as_secs_f64(), plan["seconds"]["expected"].as_f64().expect("seconds"));
    assert!(plan["counts"]["taps"] == 110 && expected > 3.0, "{plan}");
    assert!(took < 0.3 * expected, "{took} of {expected}");
}
