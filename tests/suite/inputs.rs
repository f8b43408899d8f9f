//! No command replaces or removes a file that it reads, by whatever name and whether forced or not.

use crate::common::program::{Desk, SPEC};

/// One whisker at several distances and angles.
const RIG: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                   [tap]\na = { from = 21, to = 48, step = 3 }\ntheta = [1, 2, 4]\n";
const LIST: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n10,4,50,5,2,33,1\n";

/// Runs `arguments` with and without `--force`; both are refused, name `input` and change nothing in `folder`.
#[track_caller]
fn refused(desk: &Desk, folder: &str, input: &str, arguments: &[&str]) {
    let files = || -> Vec<(String, Vec<u8>)> {
        let names = desk.names(folder).into_iter();
        names.map(|n| (n.clone(), std::fs::read(desk.path(folder).join(n)).unwrap_or_default())).collect()
    };
    let before = files();
    for more in [&[][..], &["--force"]] {
        let ran = desk.run(&[arguments, more].concat()).exits(2);
        assert!(ran.stderr.contains(input) && ran.stderr.contains("--out"), "{more:?}: {}", ran.stderr);
        assert!(files() == before, "{more:?} changed {folder}: {:?}", desk.names(folder));
    }
}

#[test]
fn the_tuple_file_of_a_sweep_is_kept() {
    let desk = Desk::new("[tuples]\nfile = \"tuples.csv\"\n");
    desk.write("tuples.csv", LIST);
    refused(&desk, ".", "tuples.csv is read", &["sweep", "spec.toml", "--backend", "cpu", "--out", "."]);
}

#[cfg(unix)]
#[test]
fn an_input_is_known_behind_links() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    desk.write("list.csv", LIST);
    for (out, hard) in [("soft", false), ("hard", true)] {
        std::fs::create_dir(desk.path(out)).unwrap();
        let (from, to) = (desk.path("list.csv"), desk.path(out).join("tuples.csv"));
        if hard { std::fs::hard_link(from, to) } else { std::os::unix::fs::symlink(from, to) }.unwrap();
        refused(&desk, out, "tuples.csv is read", &["sweep", "spec.toml", "--backend", "cpu", "--out", out]);
    }
    std::fs::create_dir(desk.path("there")).unwrap();
    std::os::unix::fs::symlink("there", desk.path("here")).unwrap();
    desk.write("there/tuples.csv", LIST);
    desk.write("spec.toml", "[tuples]\nfile = \"there/tuples.csv\"\n");
    refused(
        &desk,
        "there",
        "tuples.csv is read",
        &["sweep", "spec.toml", "--backend", "cpu", "--out", "here"],
    );
}

#[test]
fn the_curve_of_a_material_is_kept() {
    let desk = Desk::new(&format!("{SPEC}[model]\nmaterial = {{ curve = \"designs.csv\" }}\n"));
    let rows: String =
        (1..20).map(|i| format!("{},{}\n", f64::from(i) * 0.02, f64::from(i) * 0.06)).collect();
    desk.write("designs.csv", format!("strain,stress_MPa\n{rows}"));
    refused(&desk, ".", "designs.csv is read", &["sweep", "spec.toml", "--backend", "cpu", "--out", "."]);
}

#[test]
fn a_spec_that_a_search_wrote_is_kept() {
    let desk = Desk::new(SPEC);
    let search = RIG.replace("theta = [1, 2, 4]", "");
    let search = format!(
        "{search}[optimise]\nobjective = \"distance\"\nbudget = {{ evaluations = 50 }}\nvariables = {{ theta = [1, 5] }}\n"
    );
    desk.write("search.toml", search);
    desk.run(&["optimise", "search.toml", "--backend", "cpu", "--out", "found"]).exits(0);
    refused(&desk, "found", "best.toml is read", &["sweep", "found/best.toml", "--out", "found"]);
    desk.whole("found");
    // It is nobody's result elsewhere.
    std::fs::copy(desk.path("found/best.toml"), desk.path("best.toml")).unwrap();
    desk.run(&["sweep", "best.toml", "--out", ".", "--force"]).exits(0);
    assert_eq!(desk.read("best.toml"), desk.read("found/best.toml"));
}

#[test]
fn measurements_whisker_calibration_and_readings_are_kept() {
    let desk = Desk::new(RIG);
    desk.run(&["simulate", "spec.toml", "--repeats", "2", "--out", "sim"]).exits(0);
    let data = "sim/measurements.csv";
    let calibrate = ["calibrate", data, "--whisker", "spec.toml", "--out"];
    refused(&desk, "sim", "measurements.csv is read", &[&calibrate[..], &["sim"]].concat());
    desk.run(&[&calibrate[..], &["cal"]].concat()).exits(0);
    std::fs::copy(desk.path(data), desk.path("cal/rows.csv")).unwrap();
    let again = ["calibrate", "cal/rows.csv", "--whisker", "spec.toml", "--out", "cal"];
    refused(&desk, "cal", "rows.csv is read", &again);
    let locate = ["locate", "cal/calibration.toml", data, "--out"];
    refused(&desk, "cal", "calibration.toml is read", &[&locate[..], &["cal"]].concat());
    desk.run(&[&locate[..], &["loc"]].concat()).exits(0);
    std::fs::copy(desk.path(data), desk.path("loc/located.csv")).unwrap();
    let again = ["locate", "cal/calibration.toml", "loc/located.csv", "--out", "loc"];
    refused(&desk, "loc", "located.csv is read", &again);

    // Both inputs of a calibration, in the folder that is to hold it.
    std::fs::create_dir(desk.path("desk")).unwrap();
    std::fs::copy(desk.path(data), desk.path("desk/measurements.csv")).unwrap();
    desk.write("desk/best.toml", RIG);
    let here =
        ["calibrate", "desk/measurements.csv", "--whisker", "desk/best.toml", "--out", "desk", "--force"];
    desk.run(&here).exits(0);
    assert_eq!(desk.read("desk/best.toml"), RIG);
    assert_eq!(desk.read("desk/measurements.csv"), desk.read(data));
    desk.whole("desk");
}
