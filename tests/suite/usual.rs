//! Numbers outside the usual range of their key: warned about with their place; those of real whiskers are not.

use std::fmt::Write;
use std::path::Path;

use crate::common::ROOT;
use crate::common::measuring::prototype;
use crate::common::program::{Desk, SPEC};
use crate::common::specs::{GOOD, parse};
use crate::refused::changed;
use vibrissa::api::{BackendChoice, Drive, RunOptions, Setup, Taps, Tuple};
use vibrissa::spec;
use vibrissa::status::Status;

#[track_caller]
fn warnings(text: &str) -> Vec<String> {
    parse(text).unwrap_or_else(|e| panic!("{e}")).warnings
}

fn whisker([base, tip, length, place, grid, a]: [f64; 6], rest: &str) -> String {
    format!(
        "[whisker]\nD = {base}\nd = {tip}\nL_a = {length}\n[gauge]\nx_ss = {place}\nl = {grid}\n[tap]\na = {a}\n{rest}"
    )
}

#[test]
fn unusual_numbers_are_warned_about_and_no_others() {
    let table = std::fs::read_to_string(format!("{ROOT}/tests/data/unusual.txt")).expect("the table");
    for row in table.lines().filter(|row| !row.starts_with('#')) {
        let mut fields = row.split(" | ").map(str::trim);
        let said = warnings(&changed(GOOD, fields.next().expect("a change")).0);
        let Some(place) = fields.next() else {
            assert_eq!(said, [""; 0], "{row}");
            continue;
        };
        assert!(said.len() == 1 && said[0].starts_with(&format!("whisker.toml:{place}")), "{row}: {said:?}");
        fields.for_each(|part| assert!(said[0].contains(part), "{row}: {said:?}"));
    }
}

#[test]
fn what_no_whisker_measures_is_no_geometry() {
    // A spec or a tuple file with it is refused; taps that are given as numbers have a status.
    for (drive, amount) in [(Drive::Angle, 4.0), (Drive::Displacement, 1.0)] {
        let setup = Setup { drive, ..Setup::default() };
        let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
        let good = Tuple { a: 30.0, drive: amount, ..whisker };
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
fn real_whiskers_are_usual() {
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
            assert_eq!(warnings(&whisker(sizes, rest)), [""; 0], "{sizes:?} {rest}");
        }
    }
    assert_eq!(warnings(GOOD), [""; 0]);
    for folder in ["sweeps", "examples"] {
        let folder = Path::new(ROOT).join(folder);
        let specs = folder.read_dir().unwrap().map(|e| e.unwrap().path());
        for path in specs.filter(|p| p.extension().is_some_and(|e| e == "toml")) {
            let (text, label) = (std::fs::read_to_string(&path).unwrap(), path.display().to_string());
            let read = spec::parse_search(&label, &text, &folder)
                .map(|(spec, _)| spec)
                .or_else(|_| spec::parse_with("whisker.toml", &text, &folder, "[tap]\na = 30\ntheta = 1\n"));
            let spec = read.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert_eq!(spec.warnings, [""; 0], "{}", path.display());
        }
    }
}

#[test]
fn a_tuple_file_has_one_warning_of_a_column() {
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
        for part in ["taps.csv: ", "D_mm = 0.01: ", "outside the usual 0.02 … 500 mm"] {
            assert!(said[0].contains(part), "`{part}` is not in {said:?}");
        }
        desk.write("taps.csv", rows(n, "10,4,50,5,2,33,0.0"));
        let said = spec::read(&desk.path("spec.toml")).unwrap().warnings;
        assert!(
            said.len() == 1 && said[0].contains("theta_deg") && said[0].contains("0.2 … 90 degrees"),
            "{said:?}"
        );
        desk.write("taps.csv", rows(n, "10,4,50,5,2,33,"));
        assert_eq!(spec::read(&desk.path("spec.toml")).unwrap().warnings, [""; 0]);
    }
    desk.write("taps.csv", rows(2, "1e300,4,50,5,2,33,"));
    let error = spec::read(&desk.path("spec.toml")).unwrap_err();
    assert_eq!((error.line, error.key.as_deref()), (Some(3), Some("D_mm")), "{error}");
}

#[test]
fn bounds_of_a_search_are_judged_too() {
    let text = "[whisker]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33]\n[optimise]\nobjective = \"sd\"\n\
                variables = { D = [0.008, 0.012], d = [2, 7], theta = [0.01, 0.1] }\nlimits = { strain = 5 }\n";
    let (spec, _) = spec::parse_search("search.toml", text, Path::new("")).unwrap();
    let said = &spec.warnings;
    for (place, part) in [
        ("search.toml:10: optimise.variables.D = 0.012: ", "0.02 … 500 mm"),
        ("search.toml:10: optimise.variables.theta = 0.1: ", "degrees"),
        ("search.toml:11: optimise.limits.strain = 5: ", "1e-6 … 1:"),
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
        let parts = ["warning: spec.toml:2: whisker.D = 0.01: ", "outside the usual"];
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
    let ran = desk.line("calibrate sim/measurements.csv --whisker spec.toml");
    assert!(ran.stderr.contains("gauge.x_ss") && ran.stderr.contains("outside the usual"), "{}", ran.stderr);
}
