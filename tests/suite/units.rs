//! Numbers that were meant in another unit: told with the place and the likely unit; no real whisker is doubted.

use std::fmt::Write;
use std::path::Path;

use crate::common::measuring::prototype;
use crate::common::program::{Desk, SPEC};
use crate::common::specs::{GOOD, parse, with};
use vibrissa::api::{BackendChoice, Drive, RunOptions, Setup, Taps, Tuple};
use vibrissa::spec;
use vibrissa::status::Status;

/// The warnings about a spec that is read.
#[track_caller]
fn doubts(text: &str) -> Vec<String> {
    parse(text).unwrap_or_else(|e| panic!("{e}")).warnings
}

/// Fails unless exactly one warning about `text` begins with `start` and holds each of `parts`.
#[track_caller]
fn doubted(text: &str, start: &str, parts: &[&str]) {
    let said = doubts(text);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].starts_with(start), "{said:?}");
    parts.iter().for_each(|part| assert!(said[0].contains(part), "`{part}` is not in {said:?}"));
}

/// A whole spec of these numbers.
fn whisker([base, tip, length, place, grid, a]: [f64; 6], rest: &str) -> String {
    format!(
        "[whisker]\nD = {base}\nd = {tip}\nL_a = {length}\n[gauge]\nx_ss = {place}\nl = {grid}\n[tap]\na = {a}\n{rest}"
    )
}

/// Changes of a line of a whole spec; the number and the key that the only warning begins with, and what it takes the number for.
#[test]
fn numbers_of_another_unit_are_doubted() {
    for (line, change, place, meant) in [
        ("D = 10.0", "D = 0.01", "3: whisker.D = 0.01: ", "10 mm, written in metres"),
        ("d = 4", "d = 0.004", "4: whisker.d = 0.004: ", "4 mm, written in metres"),
        ("x_ss = 6.0", "x_ss = 0.006", "7: gauge.x_ss", "6 mm, written in metres"),
        ("l = 2.0", "l = 0.002", "8: gauge.l", "2 mm, written in metres"),
        ("[30, 50, 70]", "[0.03, 0.05, 0.07]", "10: tap.a = 0.03: ", "30 mm"),
        ("D = 10.0", "+hub = 0.012", "4: whisker.hub", "12 mm"),
        ("[estimate]", "+range = [0.03, 0.07]", "14: estimate.range", "30 mm"),
        ("[model]", "+pole_radius = 0.003", "13: model.pole_radius", "3 mm"),
        ("theta = {", "drive = \"displacement\"\ndelta = 0.002 # {", "12: tap.delta", "2 mm, written in"),
        ("D = 10.0", "D = [10, 0.01]", "3: whisker.D = 0.01", "written in metres"),
        ("D = 10.0", "D = { from = 0.008, to = 0.012, steps = 3 }", "3: whisker.D.from = 0.008", "metres"),
        ("D = 10.0", "D = { min = 0.008, max = 0.012, samples = 4 }", "3: whisker.D.min = 0.008", "metres"),
        ("D = 10.0", "D = 10000", "3: whisker.D", "10 mm, written in micrometres"),
        ("L_a = 96.0", "L_a = 96000", "5: whisker.L_a", "96 mm, written in micrometres"),
        ("d = 4", "d = 4000", "4: whisker.d", "4 mm, written in micrometres"),
        (THETA, "0.05", "11: tap.theta = 0.05: ", "2.8648°, written in radians"),
        (THETA, "{ from = 0.01, to = 0.1, steps = 3 }", "11: tap.theta.to", "5.7296°"),
        // What stands beside the whisker is measured by it.
        ("D = 10.0", "+hub = 5000", "4: whisker.hub", "5 mm, written in micrometres"),
        ("[model]", "+pole_radius = 500", "13: model.pole_radius", "0.5 mm, written in micrometres"),
        ("l = 2.0", "+factor = 221", "9: gauge.factor", "2.21, written in percent"),
        ("l = 2.0", "+factor = 2.21e-6", "9: gauge.factor", "2.21, written in 1/microstrain"),
        ("l = 2.0", "+factor = 0.00221", "9: gauge.factor", "2.21, written in 1/millistrain"),
        ("[model]", "+material = { hooke = 3200000 }", "13: model.material", "3.2 MPa, written in pascals"),
        ("[model]", "+material = { neo-hookean = 50000 }", "13: model.material", "0.05 MPa, written in pasc"),
        ("[model]", "+material = { yeoh = [5e5, 0, 0] }", "13: ", "3 MPa, written in pascals"),
        ("[model]", "+material = { neo-hookean = 3200 }", "13: ", "3.2 MPa, written in kPa"),
        ("[model]", "+material = { hooke = 0.0032 }", "13: ", "3.2 MPa, written in GPa"),
        ("l = 2.0", "+noise_strain = 0.015", "9: gauge.noise_strain", "1.5e-5, written in millistrain"),
        ("l = 2.0", "+strain_limit = 5", "9: gauge.strain_limit", "0.05, written in percent"),
        ("l = 2.0", "+strain_limit = 50000", "9: ", "0.05, written in microstrain"),
        ("l = 2.0", "+noise_strain = 1e-13", "9: gauge.noise_strain", "less noise than any gauge"),
    ] {
        doubted(&changed(line, change), &format!("whisker.toml:{place}"), &[meant]);
    }
    doubted(&with("D = 10.0", "D = 0.01"), "whisker.toml:3", &["hair"]);
    // A rod of 30 mm and 300 mm, one or both in metres.
    let rod = whisker([0.03, 12.0, 300.0, 6.0, 2.0, 150.0], "theta = 3\n");
    doubted(&rod, "whisker.toml:2: whisker.D", &["30 mm"]);
    let all = whisker([0.03, 0.012, 0.3, 0.006, 0.002, 0.15], "theta = 3\n");
    doubted(&all, "", &["300 mm, written in metres"]);
}

const THETA: &str = "{ from = 2, to = 4, steps = 3 }";

/// The whole spec with `change` in place of `line`, or after it where it begins with +.
fn changed(line: &str, change: &str) -> String {
    let after = change.strip_prefix('+').map(|more| format!("{line}\n{more}"));
    with(line, &after.unwrap_or_else(|| change.to_owned()))
}

#[test]
fn numbers_of_the_right_unit_are_not_doubted() {
    for (line, change) in [
        // Small angles among others are a study of small angles.
        (THETA, "[0.01, 0.1, 1.0]"),
        ("D = 10.0", "+hub = 500"),
        ("[model]", "+pole_radius = 200"),
        ("l = 2.0", "+factor = 0.8"),
        ("l = 2.0", "+factor = 2.21"),
        ("l = 2.0", "+factor = 175"),
        ("[model]", "+material = { hooke = 0.05 }"),
        ("[model]", "+material = { neo-hookean = 0.05 }"),
        ("[model]", "+material = { hooke = 10000 }"),
        ("[model]", "+material = { hooke = 200000 }"),
        ("[model]", "+material = { neo-hookean = 100 }"),
        ("l = 2.0", "+noise_strain = 0"),
        ("l = 2.0", "+noise_strain = 20e-6"),
        ("l = 2.0", "+noise_strain = 1e-3"),
        ("l = 2.0", "+strain_limit = 1.0"),
    ] {
        assert_eq!(doubts(&changed(line, change)), [""; 0], "{change}");
    }
    // More noise than strain: nothing sensible follows. Nor of less than nothing that counts.
    for (noise, said) in [("15", "15 microstrain are 15e-6"), ("0.5", ""), ("1e-300", "0: none")] {
        let error = parse(&changed("l = 2.0", &format!("+noise_strain = {noise}"))).expect_err(noise);
        assert_eq!((error.line, error.key.as_deref()), (Some(9), Some("gauge.noise_strain")));
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn a_calibration_is_doubted_as_its_spec_was() {
    let rig = prototype(10.0, &["[tap]\na = [21, 30, 40]\ntheta = [2, 4, 6]\n"]);
    let desk = Desk::new(&rig.replace("x_ss = 5", "x_ss = 5\nfactor = 221"));
    desk.ok("simulate spec.toml --out sim");
    desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
    let run = desk.whole("cal");
    assert!(run["warnings"][0].as_str().is_some_and(|w| w.contains("gauge.factor")), "{run}");
    let ran = desk.pipe(&["locate", "cal/calibration.toml"], "4,0.02\n").exits(0);
    let parts = ["cal/calibration.toml:", "gauge.factor", "2.21, written in percent"];
    assert!(parts.iter().all(|part| ran.stderr.contains(part)), "{}", ran.stderr);
    let read = vibrissa::measure::Rig::read(&desk.path("spec.toml"), None).unwrap();
    assert!(read.warnings.len() == 1 && read.warnings[0].contains("spec.toml"), "{:?}", read.warnings);
}

#[test]
fn absurd_numbers_are_refused() {
    for (line, change, key) in [
        ("D = 10.0", "D = 1e300", "whisker.D"),
        ("D = 10.0", "D = [10, 1e300]", "whisker.D"),
        ("to = 4", "to = 1e300", "tap.theta.to"),
        ("D = 10.0", "+hub = 1e300", "whisker.hub"),
        ("l = 2.0", "+factor = 1e300", "gauge.factor"),
        ("l = 2.0", "+strain_limit = 1e300", "gauge.strain_limit"),
        ("[estimate]", "+K = 1e300", "estimate.K"),
        ("[estimate]", "+range = [1, 1e300]", "estimate.range"),
        ("[model]", "+material = { hooke = 1e300 }", "model.material.hooke"),
        ("[model]", "+material = { yeoh = [1, 1e300, 0] }", "model.material.yeoh"),
        ("[model]", "+extension = true\ncontact = { coulomb = 1e300 }", "model.contact.coulomb"),
    ] {
        let error = parse(&changed(line, change)).expect_err(key);
        assert_eq!(error.key.as_deref(), Some(key), "{error}");
        assert!(error.line.is_some() && error.to_string().contains("1e300"), "{error}");
    }
    let desk = Desk::new(&SPEC.replace("D = 10", "D = 1e300"));
    desk.refuses("sweep spec.toml", &["whisker.D", "large"]);
}

const TAP: Tuple = Tuple {
    D: 10.0,
    d: 4.0,
    L_a: 50.0,
    x_ss: 5.0,
    l: 2.0,
    a: 30.0,
    tilt: 0.0,
    lean: 0.0,
    drive: 4.0,
    rig: 0,
};

#[test]
fn taps_that_are_given_one_by_one_are_doubted_as_those_of_a_spec() {
    let said = |n: usize, tap: &(dyn Fn(usize) -> Tuple + Sync)| {
        let said = |ends| {
            spec::doubts_of_taps(Drive::Angle, n, ends, tap, |column| column.name(Drive::Angle).to_owned())
        };
        // Where the ends of the columns are known, the same.
        let mut ends = [spec::NO_ENDS; 9];
        for k in 0..n {
            ends.iter_mut().zip(tap(k).to_array()).for_each(|(ends, v)| *ends = spec::widened(*ends, v));
        }
        assert_eq!(said(Some(ends)), said(None));
        said(None)
    };
    assert_eq!(said(3, &|_| TAP), [""; 0]);
    let one = |tap: Tuple| said(1, &move |_| tap);
    let of_spec =
        |theta: f64| doubts(&whisker([10.0, 4.0, 50.0, 5.0, 2.0, 30.0], &format!("theta = {theta}\n")));
    let words =
        |all: &[String]| all.iter().map(|s| s.rsplit(": ").next().unwrap().to_owned()).collect::<Vec<_>>();
    assert_eq!(words(&one(Tuple { drive: 0.07, ..TAP })), words(&of_spec(0.07)));
    assert_eq!(
        one(Tuple { drive: 0.07, ..TAP })[0],
        "theta_deg = 0.07: 0.07° is hardly a tap; is it 4.0107°, written in radians?"
    );
    assert!(one(Tuple { D: 0.01, ..TAP })[0].contains("is it 10 mm, written in metres?"));
    // What is no number, or outside every domain, has a status, not another unit.
    for x in [f64::NAN, 0.0, -0.0, -0.07, f64::INFINITY, 1e300] {
        assert_eq!(one(Tuple { D: x, d: x, ..TAP }), [""; 0], "{x}");
        assert_eq!(one(Tuple { drive: x, ..TAP }), [""; 0], "{x}");
        assert_eq!(one(Tuple { L_a: x, ..TAP }), [""; 0], "{x}");
    }
    // Of many, by several threads: the first of them, how many, and the largest angle.
    let many = |k: usize| Tuple {
        d: if k % 1000 == 7 { 0.001 + k as f64 * 1e-9 } else { 4.0 },
        drive: 0.05 + (k % 3) as f64 / 100.0,
        ..TAP
    };
    let found = said(50_000, &many);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found[0].starts_with("d_mm = 0.001000007: ") && found[0].ends_with("(50 of 50000 rows)"),
        "{found:?}"
    );
    assert!(found[1].starts_with("theta_deg = 0.07") && found[1].ends_with("(the largest)"), "{found:?}");
}

#[test]
fn what_no_whisker_measures_is_no_geometry() {
    // A spec or a tuple file with it is refused; taps that are given as numbers have a status.
    for (drive, amount) in [(Drive::Angle, 4.0), (Drive::Displacement, 1.0)] {
        let setup = Setup { drive, ..Setup::default() };
        let good = Tuple { drive: amount, ..TAP };
        let wide = Tuple { D: 1e300, d: 1e300, ..good };
        let long = Tuple { L_a: 1e13, ..good };
        let far = Tuple { drive: 1e300, ..good };
        for backend in [BackendChoice::Cpu, BackendChoice::Reference] {
            let options = RunOptions { backend: Some(backend), ..RunOptions::default() };
            let taps = Taps::new(setup.clone(), &options).unwrap();
            let (mut told, mut strains) = ([(0.0, Status::OK); 4], [0.0; 4]);
            let all = [good, wide, long, far];
            taps.solve(|i| all[i], |o| (o.strain, o.status), &mut told).unwrap();
            taps.strains(|i| all[i], &mut strains).unwrap();
            assert!(told[0].0 > 0.0 && told[0].1 == Status::OK, "{told:?}");
            let none = |told: &(f64, Status)| told.0.is_nan() && told.1 == Status::INVALID_GEOMETRY;
            assert!(told[1..].iter().all(none), "{told:?}");
            assert!(strains[0] > 0.0 && strains[1..].iter().all(|s| s.is_nan()), "{strains:?}");
        }
    }
}

#[test]
fn real_whiskers_are_not_doubted() {
    for sizes in [
        // A rat's, a mouse's, a seal's; rubber; a fibre; a steel rod; a short stub.
        [0.2, 0.005, 40.0, 1.0, 0.3, 20.0],
        [0.05, 0.002, 15.0, 0.5, 0.2, 8.0],
        [0.9, 0.1, 120.0, 3.0, 1.0, 80.0],
        [30.0, 30.0, 300.0, 20.0, 5.0, 250.0],
        [30.0, 3.0, 300.0, 0.0, 2.0, 299.0],
        [0.1, 0.1, 100.0, 2.0, 0.5, 60.0],
        [2.0, 2.0, 1000.0, 20.0, 3.0, 900.0],
        [4.0, 1.0, 12.0, 1.0, 1.0, 6.0],
        // An antenna of three metres with a foil gauge at its base.
        [30.0, 10.0, 3000.0, 2.0, 2.0, 2000.0],
    ] {
        for rest in ["theta = 0.5\n", "theta = [1, 20]\n", "drive = \"displacement\"\ndelta = 0.5\n"] {
            assert_eq!(doubts(&whisker(sizes, rest)), [""; 0], "{sizes:?} {rest}");
        }
    }
    assert_eq!(doubts(GOOD), [""; 0]);
    for folder in ["sweeps", "examples"] {
        let folder = Path::new(crate::common::ROOT).join(folder);
        let specs = folder.read_dir().unwrap().map(|e| e.unwrap().path());
        for path in specs.filter(|p| p.extension().is_some_and(|e| e == "toml")) {
            let (text, label) = (std::fs::read_to_string(&path).unwrap(), path.display().to_string());
            let read = spec::parse_search(&label, &text, &folder)
                .map(|(spec, _)| spec)
                .or_else(|_| spec::read_with(&path, "[tap]\na = 30\ntheta = 1\n"));
            let spec = read.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert_eq!(spec.warnings, [""; 0], "{}", path.display());
        }
    }
}

#[test]
fn a_tuple_file_has_one_warning() {
    let desk = Desk::new("[tuples]\nfile = \"taps.csv\"\n");
    let rows = |n: usize, row: &str| {
        let mut text = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n# measured\n".to_owned();
        (0..n).for_each(|i| writeln!(text, "{row}{}", 1 + i % 9).unwrap());
        text
    };
    for n in [3, 600] {
        desk.write("taps.csv", rows(n, "0.01,4,50,5,2,33,"));
        let said = spec::read(&desk.path("spec.toml")).unwrap().warnings;
        assert_eq!(said.len(), 1, "{said:?}");
        for part in
            ["taps.csv:3: ", "D_mm = 0.01: ", "10 mm, written in metres", &format!("({n} of {n} rows)")]
        {
            assert!(said[0].contains(part), "`{part}` is not in {said:?}");
        }
        desk.write("taps.csv", rows(n, "10,4,50,5,2,33,0.0"));
        let said = spec::read(&desk.path("spec.toml")).unwrap().warnings;
        assert!(said.len() == 1 && said[0].contains("theta_deg") && said[0].contains("radians"), "{said:?}");
        desk.write("taps.csv", rows(n, "10,4,50,5,2,33,"));
        assert_eq!(spec::read(&desk.path("spec.toml")).unwrap().warnings, [""; 0]);
    }
    desk.write("taps.csv", rows(2, "1e300,4,50,5,2,33,"));
    let error = spec::read(&desk.path("spec.toml")).unwrap_err();
    assert_eq!((error.line, error.key.as_deref()), (Some(3), Some("D_mm")), "{error}");
}

#[test]
fn bounds_of_a_search_are_doubted_too() {
    let text = "[whisker]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33]\n[optimise]\nobjective = \"sd\"\n\
                variables = { D = [0.008, 0.012], d = [2, 7], theta = [0.01, 0.1] }\nlimits = { strain = 5 }\n";
    let (spec, _) = spec::parse_search("search.toml", text, Path::new("")).unwrap();
    let said = &spec.warnings;
    for (place, part) in [
        ("search.toml:10: optimise.variables.D = 0.008: ", "8 mm, written in metres"),
        ("search.toml:10: optimise.variables.theta = 0.1: ", "radians"),
        ("search.toml:11: optimise.limits.strain = 5: ", "0.05, written in percent"),
    ] {
        assert!(said.iter().any(|s| s.starts_with(place) && s.contains(part)), "{place} {part}: {said:?}");
    }
}

#[test]
fn every_command_that_reads_a_spec_says_it() {
    let doubtful = SPEC.replace("D = 10", "D = 0.01").replace("d = [4, 7]", "d = 0.004");
    let desk = Desk::new(&doubtful);
    for line in ["sweep", "tap", "verify"].map(|c| format!("{c} spec.toml --backend cpu --plan")) {
        let said = desk.ok(&line).stderr;
        let parts = ["warning: spec.toml:2: whisker.D = 0.01: ", "10 mm, written in metres"];
        assert!(parts.iter().all(|part| said.contains(part)), "{line}: {said}");
    }
    desk.ok("simulate spec.toml");
    desk.refuses("simulate spec.toml --noise 15", &["--noise", "15e-6"]);
    let run = desk.whole("results/spec-simulate");
    assert!(run["warnings"][0].as_str().is_some_and(|w| w.contains("whisker.D")), "{run}");
    desk.sweep(&["--out", "out"]).exits(0);
    let run = desk.whole("out");
    assert!(run["warnings"][0].as_str().is_some_and(|w| w.contains("whisker.D")), "{run}");

    let rig = prototype(10.0, &["[tap]\na = [21, 30, 40]\ntheta = [2, 4, 6]\n"]);
    let desk = Desk::new(&rig);
    desk.ok("simulate spec.toml --out sim");
    desk.write("spec.toml", rig.replace("x_ss = 5", "x_ss = 0.005 #"));
    let ran = desk.run(&["calibrate", "sim/measurements.csv", "--whisker", "spec.toml"]);
    assert!(ran.stderr.contains("gauge.x_ss") && ran.stderr.contains("metres"), "{}", ran.stderr);
}
