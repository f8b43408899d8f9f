//! `vibrissa verify`: the built-in configurations on every backend, specs, broken bounds, bad input.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::program::{Desk, SPEC};
use crate::common::{configuration, sweeping::Table};
use vibrissa::progress::Progress;
use vibrissa::scene::{BackendChoice, Contact, Drive, Geometry, RunOptions, Setup, Tuple};
use vibrissa::verify::write::COLUMNS;
use vibrissa::verify::{
    self, Case, Place,
    configuration::{QUICK, all},
};

struct Silent;

impl Progress for Silent {
    fn at(&mut self, _: u64, _: u64) {}
}

/// Work and gaps of one configuration on the built-in taps: largest mean and largest number of sweeps of a tap in f32 and f64,
/// and taps that only the reference solves. A slower solver, or one that gives up sooner, is noticed.
struct Pin(&'static str, [(f64, f64); 2], usize);

const PINS: [Pin; 63] = [
    Pin("linear", [(0.0, 0.0), (0.0, 0.0)], 0),
    Pin("linear-shear", [(0.0, 0.0), (0.0, 0.0)], 0),
    Pin("linear-hub", [(0.0, 0.0), (0.0, 0.0)], 0),
    Pin("linear-passive", [(0.0, 0.0), (0.0, 0.0)], 0),
    Pin("hooke", [(3.9, 23.0), (5.7, 36.0)], 0),
    Pin("surface", [(6.2, 35.0), (7.8, 76.0)], 0),
    Pin("timoshenko", [(5.7, 44.0), (7.8, 41.0)], 0),
    Pin("neo", [(7.1, 75.0), (10.1, 77.0)], 0),
    Pin("mooney-coulomb", [(9.6, 65.0), (11.4, 89.0)], 2),
    Pin("stick", [(19.9, 147.0), (20.4, 246.0)], 2),
    Pin("pole-far", [(6.8, 78.0), (9.3, 87.0)], 0),
    Pin("yeoh", [(7.1, 71.0), (10.3, 123.0)], 0),
    Pin("shear", [(5.8, 45.0), (7.8, 41.0)], 0),
    Pin("extension", [(5.4, 39.0), (6.8, 37.0)], 0),
    Pin("extension-far", [(5.4, 39.0), (6.8, 37.0)], 0),
    Pin("pole", [(5.3, 36.0), (6.8, 35.0)], 0),
    Pin("coulomb", [(5.9, 28.0), (6.9, 44.0)], 5),
    Pin("sticking", [(11.7, 92.0), (12.9, 113.0)], 2),
    Pin("rolling", [(16.6, 142.0), (24.4, 256.0)], 1),
    Pin("coulomb-pole", [(5.6, 26.0), (6.9, 46.0)], 2),
    Pin("mooney-coulomb-pole-far-hub", [(14.5, 70.0), (19.6, 95.0)], 4),
    Pin("mooney-coulomb-pole-passive", [(7.9, 55.0), (11.6, 95.0)], 3),
    Pin("neo-alone", [(7.0, 75.0), (9.1, 69.0)], 0),
    Pin("mooney-alone", [(6.9, 70.0), (9.1, 69.0)], 0),
    Pin("yeoh-alone", [(7.3, 78.0), (10.1, 123.0)], 0),
    Pin("softening", [(8.4, 63.0), (8.2, 59.0)], 5),
    Pin("coulomb-zero", [(6.2, 34.0), (7.9, 76.0)], 0),
    Pin("coulomb-huge", [(11.9, 97.0), (9.4, 58.0)], 0),
    Pin("hooke-hub", [(7.5, 87.0), (8.3, 84.0)], 0),
    Pin("timoshenko-hub", [(8.5, 88.0), (10.1, 91.0)], 0),
    Pin("neo-hub", [(10.8, 95.0), (13.1, 164.0)], 0),
    Pin("mooney-coulomb-hub", [(12.3, 75.0), (17.3, 133.0)], 5),
    Pin("stick-hub", [(18.5, 113.0), (17.4, 123.0)], 2),
    Pin("hooke-passive", [(4.4, 20.0), (6.0, 32.0)], 0),
    Pin("neo-passive", [(7.2, 51.0), (11.0, 110.0)], 0),
    Pin("mooney-coulomb-passive", [(8.3, 58.0), (10.5, 94.0)], 3),
    Pin("stick-passive", [(17.5, 134.0), (23.6, 398.0)], 1),
    Pin("pole-far-passive", [(6.4, 40.0), (9.2, 85.0)], 0),
    Pin("linear-tilted", [(0.0, 0.0), (0.0, 0.0)], 0),
    Pin("hooke-tilted", [(3.0, 16.0), (4.4, 27.0)], 1),
    Pin("timoshenko-tilted", [(4.3, 16.0), (6.1, 27.0)], 1),
    Pin("neo-tilted", [(5.9, 21.0), (7.2, 31.0)], 1),
    Pin("pole-far-tilted", [(5.4, 28.0), (6.1, 33.0)], 2),
    Pin("sticking-tilted", [(11.9, 94.0), (13.1, 115.0)], 2),
    Pin("neo-hub-tilted", [(8.6, 32.0), (9.9, 43.0)], 1),
    Pin("neo-passive-tilted", [(6.5, 52.0), (8.8, 59.0)], 3),
    // Of these contacts within some 0.8 D of the base go to the reference. A device that rounds otherwise takes other steps: a tenth of the mean and a fifth of the most are left for that.
    Pin("root", [(13.4, 57.0), (15.5, 90.0)], 6),
    Pin("power", [(8.1, 86.0), (10.3, 69.0)], 22),
    Pin("hollow", [(7.3, 50.0), (17.9, 167.0)], 26),
    Pin("cored", [(8.4, 62.0), (9.7, 93.0)], 23),
    Pin("curved", [(7.6, 60.0), (9.8, 101.0)], 23),
    Pin("curved-neo-passive", [(7.4, 59.0), (9.9, 89.0)], 23),
    Pin("moment", [(12.7, 56.0), (14.9, 83.0)], 6),
    Pin("solid", [(6.9, 102.0), (10.1, 150.0)], 4),
    Pin("solid-far-hub", [(10.5, 106.0), (10.5, 156.0)], 6),
    Pin("solid-passive", [(6.6, 60.0), (7.4, 38.0)], 5),
    Pin("foil", [(3.7, 28.0), (5.0, 37.0)], 6),
    Pin("solid-foil-far", [(7.9, 109.0), (8.8, 83.0)], 4),
    Pin("glued-stick", [(16.4, 132.0), (22.2, 253.0)], 1),
    Pin("socket-tilted", [(6.4, 32.0), (6.5, 30.0)], 1),
    Pin("clamp", [(4.1, 28.0), (5.5, 35.0)], 0),
    Pin("indentation", [(5.4, 49.0), (5.6, 32.0)], 2),
    Pin("section", [(5.7, 53.0), (6.0, 32.0)], 0),
];

/// What the program verifies without a spec, on the CPU; on a device one configuration for each of its kernels, whose numbers in f64 `agreement` compares.
/// `vibrissa verify` has them all.
#[test]
fn built_in_configurations_hold() {
    let cases = Case::built_in(12, 1, false);
    hold(&cases, &["cpu f32", "cpu f64"]);
    const KERNELS: [&str; 13] = [
        "hooke",
        "timoshenko-hub",
        "mooney-coulomb",
        "stick",
        "pole-far-passive",
        "yeoh",
        "neo-hub-tilted",
        "root",
        "power",
        "hollow",
        "cored",
        "curved-neo-passive",
        "glued-stick",
    ];
    let cases: Vec<Case> = cases.into_iter().filter(|case| KERNELS.contains(&case.name.as_str())).collect();
    assert_eq!(cases.len(), KERNELS.len());
    hold(&cases, &["gpu f32"]);
}

/// Verifies `cases` on the backends with these labels.
fn hold(cases: &[Case], needed: &[&str]) {
    let mut places = verify::present(&RunOptions::default(), None).expect("backends");
    places.retain(|place| needed.contains(&place.label().as_str()));
    let labels: Vec<String> = places.iter().map(Place::label).collect();
    for needed in needed {
        assert!(labels.iter().any(|l| l == needed), "no {needed} (Debian: apt install mesa-vulkan-drivers)");
    }
    let (mut lines, never) = (Vec::new(), AtomicBool::new(false));
    let done = verify::run(cases, &mut places, &never, &mut Silent, &mut |line| lines.push(line));
    assert_eq!(done.expect("it runs"), cases.iter().map(|c| c.tuples.len() as u64).sum::<u64>());
    assert_eq!(lines.len(), cases.len() * places.len());
    let mut faults = Vec::new();
    for line in &lines {
        let place = &labels[line.place];
        let (mean, max) = line.sweeps;
        let worst = line.errors[0].map_or(f64::NAN, |f| f.worst);
        println!(
            "{:<22} {place}: worst {worst:.1e}, sweeps {mean:.1} {max}, unsolved {}, referred {}",
            line.configuration, line.unsolved, line.referred
        );
        if !line.faults().is_empty() {
            faults.push(format!("{} on {place}: {:?} {:?}", line.configuration, line.faults(), line.at));
        }
        let Some(Pin(_, work, unsolved)) = PINS.iter().find(|p| p.0 == line.configuration) else {
            faults.push(format!("{} has no pin", line.configuration));
            continue;
        };
        let (most_mean, most) = work[usize::from(place.ends_with("f64"))];
        if mean > most_mean || max > most || line.unsolved + line.referred > *unsolved {
            faults.push(format!(
                "{} on {place}: sweeps {mean:.2} (at most {most_mean}), {max} ({most}), left to the reference {} ({unsolved})",
                line.configuration,
                line.unsolved + line.referred
            ));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_configurations_of_the_model_are_among_them() {
    let names = ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];
    for name in names {
        let built_in = all().into_iter().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}"));
        let setup = built_in.setup();
        assert_eq!((setup.model, setup.gauge.side), configuration(name), "{name}");
    }
}

#[test]
fn a_quick_run_has_a_configuration_of_each_kind() {
    let cases = Case::built_in(1, 1, true);
    assert_eq!(cases.len(), QUICK.len());
    assert!(cases.iter().any(|c| c.setup.model.geometry == Geometry::Linear));
    assert!(
        cases.iter().any(|c| c.setup.hub > 0.0) && cases.iter().any(|c| c.setup.drive == Drive::Displacement)
    );
    assert!(cases.iter().any(|c| c.setup.model.contact == Contact::Stick));
    let desk = Desk::new(SPEC);
    let json = desk.run(&["verify", "--quick", "--backend", "cpu", "--json"]).exits(0).json();
    assert_eq!(json["result"]["census"].as_array().map(Vec::len), Some(2 * QUICK.len()));
    assert_eq!(desk.whole("results/verify")["stopped"], serde_json::Value::Null);
}

/// A signal between two parts: the taps so far are a census of their own.
#[test]
fn a_stopped_run_has_the_lines_of_its_taps() {
    struct StopAt<'a>(&'a AtomicBool, u64);
    impl Progress for StopAt<'_> {
        fn at(&mut self, done: u64, _: u64) {
            self.0.store(done >= self.1, Ordering::Relaxed);
        }
    }
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
    let mut places = verify::present(&options, None).expect("the CPU");
    let (mut lines, stop) = (Vec::new(), AtomicBool::new(false));
    let cases = [case("one"), case("two")];
    let done =
        verify::run(&cases, &mut places, &stop, &mut StopAt(&stop, 1200), &mut |line| lines.push(line));
    let done = done.expect("it runs");
    assert!((1200..2000).contains(&done), "{done}");
    let told: Vec<(&str, usize, u64)> =
        lines.iter().map(|l| (l.configuration.as_str(), l.place, l.taps as u64)).collect();
    let left = done - 1000;
    assert_eq!(told, [("one", 0, 1000), ("one", 1, 1000), ("two", 0, left), ("two", 1, left)]);
    assert!(lines.iter().all(|l| l.faults().is_empty() && l.compared == l.taps));
}

#[test]
fn taps_are_those_of_the_seed() {
    let taps = |seed| -> Vec<_> { Case::built_in(5, seed, true).into_iter().map(|c| c.tuples).collect() };
    assert_eq!(taps(3), taps(3));
    assert_ne!(taps(3), taps(4));
}

/// 160 000 ranked taps: the chart that stands in for the kernel has a line of its own.
#[test]
fn the_chart_of_a_ranked_spec_is_verified() {
    let desk = Desk::new(
        "[whisker]\nD = { from = 8, to = 12, steps = 40 }\nd = { from = 3, to = 9, steps = 40 }\nL_a = 50\n\
         [gauge]\nx_ss = 5\nl = 2\n[tap]\na = { from = 20, to = 48, steps = 10 }\n\
         theta = { from = 0.5, to = 10, steps = 10 }\n[output]\ntop = 10\n",
    );
    let taps = ["--samples", "3000", "--backend", "cpu", "--precision", "f32", "--json"];
    let ran = desk.run(&[&["verify", "spec.toml"], &taps[..]].concat()).exits(0);
    let census = &ran.json()["result"]["census"];
    assert_eq!(census.as_array().map(Vec::len), Some(2), "{census}");
    let (chart, kernel) = (&census[0], &census[1]);
    assert_eq!((&chart["configuration"], &kernel["configuration"]), (&"spec chart".into(), &"spec".into()));
    assert_eq!((&chart["compared"], &chart["verdict"]), (&3000.into(), &"ok".into()), "{chart}");
    let worst = chart["strain_error_worst"].as_f64().expect("an error");
    assert!(worst > 0.0 && worst < 3e-6, "{worst:.1e}");
    // A sweep that solves every tap has no chart.
    let ran = desk
        .run(&[&["verify", "spec.toml", "--precision", "f64", "--force"], &taps[..4], &["--json"]].concat());
    assert_eq!(ran.exits(0).json()["result"]["census"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_spec_is_verified_on_every_backend() {
    let desk = Desk::new(SPEC);
    let ran = desk.run(&["verify", "spec.toml", "--json"]).exits(0);
    let json = ran.json();
    assert_eq!(json["ok"], true);
    assert_eq!(json["command"], "verify");
    let folder = "results/spec-verify";
    assert_eq!(desk.names(folder), ["run.json", "verify.csv"]);
    let table = Table::read(&desk.path(folder).join("verify.csv"));
    assert_eq!(table.columns, COLUMNS);
    let labels: Vec<String> =
        table.rows.iter().map(|r| format!("{} {}", r["backend"], r["precision"])).collect();
    assert_eq!(labels, ["cpu f32", "cpu f64", "gpu f32", "gpu f64"]);
    for (row, census) in table.rows.iter().zip(json["result"]["census"].as_array().expect("lines")) {
        // The spec has 2 designs, 3 distances, 2 angles.
        assert_eq!((row["taps"].as_str(), row["compared"].as_str()), ("12", "12"));
        assert_eq!((row["verdict"].as_str(), row["strain_over"].as_str()), ("ok", "0"));
        let worst: f64 = row["strain_error_worst"].parse().expect("a number");
        assert!(worst > 0.0 && worst <= row["bound"].parse().expect("a number"), "{row:?}");
        let again = census["strain_error_worst"].as_f64().expect("a number");
        assert!((again / worst - 1.0).abs() < 1e-12, "{again} {worst}");
        assert_eq!((row["theta_deg"].is_empty(), row["delta_mm"].as_str()), (false, ""));
        assert!(row["sweeps_mean"].parse::<f64>().expect("a number") > 0.0);
    }
    let run: serde_json::Value =
        serde_json::from_str(&desk.read("results/spec-verify/run.json")).expect("JSON");
    assert_eq!((&run["command"], &run["spec"]["text"]), (&"verify".into(), &SPEC.into()));
    assert_eq!(run["counts"]["comparisons"], 48);
    assert_eq!(run["backends"].as_array().expect("backends").len(), 4);
}

#[test]
fn samples_of_a_large_spec_are_taps_of_its_space() {
    let spec = SPEC.replace("a = [21, 33, 48]", "a = { from = 20, to = 48, steps = 1000 }");
    let desk = Desk::new(&spec.replace("theta = [1, 4]", "drive = \"displacement\"\ndelta = [0.5, 2]"));
    let run = |seed: &str, out: &str| {
        let arguments =
            ["verify", "spec.toml", "--backend", "cpu", "--samples", "50", "--seed", seed, "--out", out];
        desk.run(&arguments).exits(0);
        Table::read(&desk.path(out).join("verify.csv"))
    };
    let (one, again, other) = (run("5", "one"), run("5", "again"), run("6", "other"));
    assert_eq!(one, again);
    assert_ne!(one, other);
    let places = ["cpu f32", "cpu f64"];
    assert_eq!(one.rows.len(), places.len());
    for row in &one.rows {
        assert_eq!(row["taps"], "50");
        assert!(["0.5", "2"].contains(&row["delta_mm"].as_str()) && row["theta_deg"].is_empty(), "{row:?}");
    }
}

#[test]
fn a_broken_bound_exits_1_and_says_where() {
    let desk = Desk::new(SPEC);
    let arguments = ["verify", "spec.toml", "--backend", "cpu", "--precision", "f32", "--bound", "1e-12"];
    let ran = desk.run(&arguments).exits(1);
    for word in ["spec on cpu f32", "strain error", "> 1.0e-12", "of 12 taps", "D_mm=10", "theta_deg="] {
        assert!(ran.stderr.contains(word), "{word}: {}", ran.stderr);
    }
    assert!(ran.stdout.contains("strain+K"), "{}", ran.stdout);
    // The census is there for whoever wants to know more.
    let table = Table::read(&desk.path("results/spec-verify/verify.csv"));
    assert!(table.rows[0]["verdict"].starts_with("strain+K"), "{:?}", table.rows);
    assert_eq!(table.rows[0]["strain_over"], "12");

    let quiet = desk.run(&[&arguments[..], &["--quiet"]].concat()).exits(1);
    assert!(quiet.stdout.is_empty() && quiet.stderr.contains("break a bound"), "{}", quiet.stderr);
    let json = desk.run(&[&arguments[..], &["--json"]].concat()).exits(1).json();
    assert_eq!(json["ok"], false);
    assert!(json["error"]["message"].as_str().expect("a message").contains("strain error"));
    assert_eq!(json["result"]["census"][0]["strain_over"], 12);
}

#[test]
fn the_tolerance_scales_the_bound() {
    let desk = Desk::new(SPEC);
    let bound = |precision: &str, tolerance: &str| {
        let arguments = [
            "verify",
            "spec.toml",
            "--backend",
            "cpu",
            "--precision",
            precision,
            "--tolerance",
            tolerance,
            "--json",
        ];
        desk.run(&arguments).exits(0).json()["result"]["census"][0]["bound"].as_f64().expect("a bound")
    };
    assert_eq!((bound("f32", "2e-6"), bound("f64", "1e-10")), (2e-6, 2e-10));
    let both = desk.run(&["verify", "spec.toml", "--tolerance", "1e-9"]).exits(2);
    assert!(both.stderr.contains("--tolerance"), "{}", both.stderr);
}

#[test]
fn taps_without_an_answer_are_no_comparison() {
    // Every contact lies before the gauge of a material that ends there.
    let spec = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 6\ntheta = 80\n\
                [model]\nmaterial = { yeoh = [0.5, -0.3, 0.0] }\n";
    let desk = Desk::new(spec);
    let ran = desk.run(&["verify", "spec.toml", "--backend", "cpu", "--json"]).exits(0);
    for line in ran.json()["result"]["census"].as_array().expect("lines") {
        assert_eq!((&line["compared"], &line["neither"]), (&0.into(), &1.into()), "{line}");
        assert!(line["strain_error_worst"].is_null());
    }
}

#[test]
fn a_plan_runs_nothing() {
    let desk = Desk::new(SPEC);
    let ran = desk.run(&["verify", "spec.toml", "--plan"]).exits(0);
    assert!(
        ran.stdout.contains("12 of its taps") && ran.stdout.contains("nothing was run"),
        "{}",
        ran.stdout
    );
    assert_eq!(desk.names("."), ["spec.toml"]);
    let json =
        desk.run(&["verify", "--plan", "--json", "--backend", "cpu", "--samples", "7"]).exits(0).json();
    assert_eq!(json["counts"]["configurations"], all().len());
    assert_eq!(json["counts"]["lines"], 2 * all().len());
}

#[test]
fn bad_input_is_refused_before_anything_is_written() {
    let desk = Desk::new(SPEC);
    desk.write("broken.toml", "[whisker]\nD = -1\n");
    let cases: [(&[&str], &str); 11] = [
        (&["spec.toml", "--samples", "0"], "--samples"),
        (&["spec.toml", "--samples", "ten"], "--samples"),
        (&["spec.toml", "--seed", "-1"], "--seed"),
        (&["none.toml"], "none.toml"),
        (&["broken.toml"], "whisker.D"),
        (&["spec.toml", "--bound", "0"], "--bound"),
        (&["spec.toml", "--bound", "-1e-5"], "--bound"),
        (&["spec.toml", "--bound", "nan"], "--bound"),
        (&["spec.toml", "--backend", "reference"], "--backend"),
        (&["spec.toml", "--adapter", "no such adapter"], "--adapter"),
        (&["spec.toml", "--precision", "f32", "--tolerance", "1e-9"], "--tolerance"),
    ];
    for (arguments, word) in cases {
        let ran = desk.run(&[&["verify"], arguments].concat()).exits(2);
        assert!(ran.stderr.contains(word), "{arguments:?}: {}", ran.stderr);
    }
    assert_eq!(desk.names("."), ["broken.toml", "spec.toml"]);
    let json = desk.run(&["verify", "spec.toml", "--backend", "reference", "--json"]).exits(2).json();
    assert_eq!(json["error"]["key"], "--backend");
}

#[test]
fn a_folder_of_something_else_is_kept() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("mine")).expect("a folder");
    desk.write("mine/notes.txt", "mine");
    let arguments = ["verify", "spec.toml", "--backend", "cpu", "--out", "mine"];
    desk.run(&arguments).exits(2);
    assert_eq!(desk.names("mine"), ["notes.txt"]);
    desk.run(&[&arguments[..], &["--force"]].concat()).exits(0);
    assert_eq!(desk.names("mine"), ["notes.txt", "run.json", "verify.csv"]);
}

#[test]
fn options_of_the_spec_narrow_it() {
    let desk = Desk::new(&format!("{SPEC}[run]\nbackend = \"cpu\"\nprecision = \"f64\"\nout = \"there\"\n"));
    let json = desk.run(&["verify", "spec.toml", "--json"]).exits(0).json();
    let census = json["result"]["census"].as_array().expect("lines");
    assert_eq!((census.len(), &census[0]["precision"]), (1, &"f64".into()));
    // A sweep of the spec goes to `there`.
    assert_eq!(desk.names("there-verify"), ["run.json", "verify.csv"]);
    let all = desk
        .run(&["verify", "spec.toml", "--json", "--precision", "f32", "--backend", "auto"])
        .exits(0)
        .json();
    assert_eq!(all["result"]["census"].as_array().expect("lines").len(), 2);
}
