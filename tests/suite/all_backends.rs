//! `vibrissa verify`: the built-in configurations on every backend, specs, broken bounds, bad input.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::cases::rows;
use crate::common::program::{Desk, SPEC, says};
use vibrissa::census::cases::{QUICK, all};
use vibrissa::census::verify::{self, Case, CensusNews};
use vibrissa::census::{Taps, present};
use vibrissa::evaluate::{Evaluator, Outcome, Referral};
use vibrissa::scene::{BackendChoice, Contact, Drive, Geometry, RunOptions, Setup, Tuple};
use vibrissa::sink::heading::heading;

/// Only counts of sweeps are checked: `vibrissa verify`, which `tests/run` calls, checks the errors of these taps against the reference.
#[test]
fn kernels_take_no_more_sweeps_than_they_did() {
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let (pins, mut faults) = (rows("pins"), Vec::new());
    for (case, place) in Case::built_in(12, 1, false)
        .iter()
        .flat_map(|c| present(&options, None).unwrap().into_iter().map(move |p| (c, p)))
    {
        let taps = Taps::of(&case.setup, &case.tuples);
        let mut evaluator =
            Evaluator::new(&taps.setup, place.choice.open(&taps.setup.model).expect("the CPU"));
        let unknown = vec![Outcome::NOTHING; taps.tasks.len()];
        let found = evaluator
            .run_alike(&taps.designs, &taps.tasks, Referral::ALL, Some(&unknown))
            .expect("the CPU answers");
        let (name, label) = (&case.name, place.label());
        let Some(pin) = pins.iter().find(|pin| pin["configuration"] == *name) else {
            faults.push(format!("{name} has no pin"));
            continue;
        };
        let at = |column: &str| pin[column].parse::<f64>().expect("a number");
        let precision = if label.ends_with("f64") { "f64" } else { "f32" };
        let [most_mean, most] = ["mean", "most"].map(|what| at(&format!("{what}_{precision}")));
        let sweeps = || found.iter().map(|o| f64::from(o.sweeps));
        let (mean, max) = (sweeps().sum::<f64>() / found.len() as f64, sweeps().fold(0.0, f64::max));
        let left = found.iter().filter(|o| o.referred).count();
        println!("{name:<22} {label}: sweeps {mean:.1} {max}, left to the reference {left}");
        if mean > most_mean || max > most || left as f64 > at("left") {
            faults.push(format!(
                "{name} on {label}: sweeps {mean:.2}, {max}, left to the reference {left}; {pin:?}"
            ));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_quick_run_has_a_configuration_of_each_kind() {
    let cases = Case::built_in(1, 1, true);
    assert_eq!(cases.len(), QUICK.len());
    let has = |kind: &dyn Fn(&Setup) -> bool| assert!(cases.iter().any(|c| kind(&c.setup)));
    has(&|s| s.model.geometry == Geometry::Linear);
    has(&|s| s.hub > 0.0);
    has(&|s| s.drive == Drive::Displacement);
    has(&|s| s.model.contact == Contact::Stick);
    let desk = Desk::new(SPEC);
    let json = desk.json("verify --quick --backend cpu");
    assert_eq!(json["result"]["census"].as_array().map(Vec::len), Some(2 * QUICK.len()));
    assert_eq!(desk.whole("results/verify")["stopped"], serde_json::Value::Null);
}

#[test]
fn a_stopped_run_has_the_lines_of_its_taps() {
    let study = Setup::default().linear();
    let tuple =
        Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, a: 33.0, drive: 4.0, ..Tuple::default() };
    let case = |name: &str| Case {
        name: name.to_owned(),
        setup: study.clone(),
        study: None,
        tuples: (0..1000).map(|i| Tuple { drive: 1.0 + f64::from(i) / 1e3, ..tuple }).collect(),
    };
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let places = present(&options, None).expect("the CPU");
    let (mut lines, mut done, stop) = (Vec::new(), 0, AtomicBool::new(false));
    let cases = [case("one"), case("two")];
    let ran = verify::run(&cases, &places, &stop, &mut |news| match news {
        CensusNews::Done(done) => stop.store(done >= 1200, Ordering::Relaxed),
        CensusNews::Lines(with, more) => {
            done = with;
            lines.extend(more);
        }
    });
    ran.expect("it runs");
    assert!((1200..2000).contains(&done), "{done}");
    let told: Vec<(&str, usize, u64)> =
        lines.iter().map(|l| (l.configuration.as_str(), l.place, l.taps as u64)).collect();
    let left = done - 1000;
    assert_eq!(told, [("one", 0, 1000), ("one", 1, 1000), ("two", 0, left), ("two", 1, left)]);
    assert!(lines.iter().all(|l| l.faults().is_empty() && l.compared == l.taps));
}

/// 160 000 ranked taps: the table also has a row for the chart.
#[test]
fn the_chart_of_a_ranked_spec_is_verified() {
    let desk = Desk::new(
        "[whisker]\nD = { from = 8, to = 12, steps = 40 }\nd = { from = 3, to = 9, steps = 40 }\nL_a = 50\n\
         [gauge]\nx_ss = 5\nl = 2\n[tap]\na = { from = 20, to = 48, steps = 10 }\n\
         theta = { from = 0.5, to = 10, steps = 10 }\n[output]\ntop = 10\n",
    );
    let verified = |precision: &str| {
        let taps = "--samples 3000 --backend cpu --force --precision";
        desk.json(format!("verify spec.toml {taps} {precision}"))["result"]["census"].clone()
    };
    let census = verified("f32");
    assert_eq!(census.as_array().map(Vec::len), Some(2), "{census}");
    let (chart, kernel) = (&census[0], &census[1]);
    assert_eq!((&chart["configuration"], &kernel["configuration"]), (&"spec chart".into(), &"spec".into()));
    assert_eq!((&chart["compared"], &chart["verdict"]), (&3000.into(), &"ok".into()), "{chart}");
    let worst = chart["strain_error_worst"].as_f64().expect("an error");
    assert!(worst > 0.0 && worst < 3e-6, "{worst:.1e}");
    assert_eq!(verified("f64").as_array().map(Vec::len), Some(1));
}

#[test]
fn a_spec_is_verified_on_every_backend() {
    let desk = Desk::new(SPEC);
    let json = desk.json("verify spec.toml");
    assert_eq!((&json["ok"], &json["command"]), (&true.into(), &"verify".into()));
    assert_eq!(desk.names("results/spec-verify"), ["run.json", "verify.csv"]);
    let table = desk.table("results/spec-verify/verify.csv");
    assert_eq!(table.columns, heading("verify").names_as(&[]));
    let labels: Vec<String> =
        table.rows.iter().map(|r| format!("{} {}", r["backend"], r["precision"])).collect();
    assert_eq!(labels, ["cpu f32", "cpu f64", "gpu f32", "gpu f64"]);
    for (row, census) in table.rows.iter().zip(json["result"]["census"].as_array().expect("lines")) {
        assert_eq!((row["taps"].as_str(), row["compared"].as_str()), ("12", "12"));
        assert_eq!((row["verdict"].as_str(), row["strain_over"].as_str()), ("ok", "0"));
        let worst: f64 = row["strain_error_worst"].parse().expect("a number");
        assert!(worst > 0.0 && worst <= row["bound"].parse().expect("a number"), "{row:?}");
        let again = census["strain_error_worst"].as_f64().expect("a number");
        assert!((again / worst - 1.0).abs() < 1e-12, "{again} {worst}");
        assert_eq!((row["theta_deg"].is_empty(), row["delta_mm"].as_str()), (false, ""));
        assert!(row["sweeps_mean"].parse::<f64>().expect("a number") > 0.0);
    }
    let run = desk.whole("results/spec-verify");
    assert_eq!((&run["command"], &run["spec"]["text"]), (&"verify".into(), &SPEC.into()));
    assert_eq!(run["counts"]["comparisons"], 48);
    assert_eq!(run["backends"].as_array().expect("backends").len(), 4);
}

#[test]
fn samples_of_a_large_spec_are_taps_of_its_space() {
    let spec = SPEC.replace("a = [21, 33, 48]", "a = { from = 20, to = 48, steps = 1000 }");
    let desk = Desk::new(&spec.replace("theta = [1, 4]", "drive = \"displacement\"\ndelta = [0.5, 2]"));
    let run = |seed: u32, out: &str| {
        desk.ok(format!("verify spec.toml --backend cpu --samples 50 --seed {seed} --out {out}"));
        desk.table(format!("{out}/verify.csv"))
    };
    let (one, again, other) = (run(5, "one"), run(5, "again"), run(6, "other"));
    assert_eq!(one, again);
    assert_ne!(one, other);
    assert_eq!(one.rows.len(), 2);
    for row in &one.rows {
        assert_eq!(row["taps"], "50");
        assert!(["0.5", "2"].contains(&row["delta_mm"].as_str()) && row["theta_deg"].is_empty(), "{row:?}");
    }
}

#[test]
fn a_broken_bound_exits_1_and_says_where() {
    let desk = Desk::new(SPEC);
    let line = "verify spec.toml --backend cpu --precision f32 --bound 1e-12";
    let ran = desk.line(line).exits(1);
    let place = ["spec on cpu f32 (strain+K", "strain error", "on 12 of 12 taps", "D_mm=10", "theta_deg="];
    says(&ran.stderr, &place);
    says(&ran.stdout, &["strain+K"]);
    let table = desk.table("results/spec-verify/verify.csv");
    assert!(table.rows[0]["verdict"].starts_with("strain+K"), "{:?}", table.rows);
    assert_eq!(table.rows[0]["strain_over"], "12");

    let quiet = desk.line(format!("{line} --quiet")).exits(1);
    assert!(quiet.stdout.is_empty() && quiet.stderr.contains("break a bound"), "{}", quiet.stderr);
    let json = desk.line(format!("{line} --json")).exits(1).json();
    assert_eq!(json["ok"], false);
    assert!(json["error"]["message"].as_str().expect("a message").contains("strain error"));
    assert_eq!(json["result"]["census"][0]["strain_over"], 12);
}

#[test]
fn the_tolerance_scales_the_bound() {
    let desk = Desk::new(SPEC);
    let bound = |precision: &str, tolerance: &str| {
        let line = format!("verify spec.toml --backend cpu --precision {precision} --tolerance {tolerance}");
        desk.json(line)["result"]["census"][0]["bound"].as_f64().expect("a bound")
    };
    assert_eq!((bound("f32", "2e-6"), bound("f64", "1e-10")), (2e-6, 2e-10));
}

#[test]
fn taps_without_an_answer_are_no_comparison() {
    // The material limit is reached, and every contact lies before the gauge.
    let spec = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 6\ntheta = 80\n\
                [model]\nmaterial = { yeoh = [0.5, -0.3, 0.0] }\n";
    let desk = Desk::new(spec);
    let ran = desk.ok("verify spec.toml --backend cpu --json");
    for line in ran.json()["result"]["census"].as_array().expect("lines") {
        assert_eq!((&line["compared"], &line["neither"]), (&0.into(), &1.into()), "{line}");
        assert!(line["strain_error_worst"].is_null());
    }
}

#[test]
fn a_plan_writes_nothing() {
    let desk = Desk::new(SPEC);
    let plan = desk.ok("verify spec.toml --plan").stdout;
    says(&plan, &["12 of its taps", "nothing was run"]);
    let json = desk.json("verify --plan --backend cpu --samples 7");
    assert_eq!(json["counts"]["lines"], 2 * all().len());
    assert_eq!(desk.names("."), ["spec.toml"]);
}

#[test]
fn options_of_the_spec_narrow_it() {
    let desk = Desk::new(&format!("{SPEC}[run]\nbackend = \"cpu\"\nprecision = \"f64\"\nout = \"there\"\n"));
    let json = desk.json("verify spec.toml");
    let census = json["result"]["census"].as_array().expect("lines");
    assert_eq!((census.len(), &census[0]["precision"]), (1, &"f64".into()));
    assert_eq!(desk.names("there-verify"), ["run.json", "verify.csv"]);
    let all = desk.json("verify spec.toml --precision f32 --backend auto");
    assert_eq!(all["result"]["census"].as_array().expect("lines").len(), 2);
}
