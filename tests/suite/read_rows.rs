//! Tables of designs whose rows are read from charts, column by column against the same reduced from taps solved in f64.

use std::collections::HashMap;

use crate::common::program::Desk;

const SAMPLES: usize = 13_200;

/// Designs of a lab with drives of their own, unless `drive` lists them.
fn spec(whisker: &str, gauge: &str, tap: &str, rest: &str) -> String {
    let text = format!(
        "[whisker]\nD = {{ min = 8, max = 12, samples = N }}\n{whisker}\n[gauge]\nx_ss = {{ min = 3, max = 15, samples = N }}\nl = {{ min = 1, max = 4, samples = N }}\nnoise_strain = 2e-5\n{gauge}\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{tap}\n{rest}\n[output]\ntuples = false\ndistances = false\n"
    );
    text.replace('N', &SAMPLES.to_string())
}

/// Columns of designs.csv.
fn columns(desk: &Desk, folder: &str) -> HashMap<String, Vec<String>> {
    let text = desk.read(&format!("{folder}/designs.csv"));
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let rows: Vec<Vec<String>> = lines.collect();
    names
        .into_iter()
        .enumerate()
        .map(|(k, name)| (name, rows.iter().map(|r| r[k].clone()).collect()))
        .collect()
}

/// The same words in all rows but some at a threshold, every column to its tolerance, `read` of the rows from charts.
#[track_caller]
fn agrees(text: &str, read: std::ops::Range<f64>) {
    let desk = Desk::new(text);
    let run = |precision: &str| {
        let arguments = ["sweep", "spec.toml", "--backend", "cpu", "--precision", precision];
        let out = desk.run(&[&arguments[..], &["--out", precision, "--json"]].concat()).exits(0).json();
        (out, columns(&desk, precision))
    };
    let ((told, got), (solved, want)) = (run("f32"), run("f64"));
    let taps = told["counts"]["taps"].as_f64().unwrap();
    assert_eq!(taps, solved["counts"]["taps"].as_f64().unwrap());
    let share = told["counts"]["interpolated"].as_f64().unwrap() / taps;
    assert!(read.contains(&share), "{share}: {}", told["counts"]);
    assert!(solved["counts"]["chart"].is_null());

    let n = got["status"].len();
    assert_eq!(n, want["status"].len());
    let other = (0..n).filter(|&i| got["status"][i] != want["status"][i]).count();
    assert!(other <= 2, "{other} rows with other words");
    for (word, count) in solved["counts"]["status"].as_object().unwrap() {
        let (a, b) = (told["counts"]["status"][word].as_u64().unwrap_or(0), count.as_u64().unwrap());
        assert!(a.abs_diff(b) <= 4, "{word}: {a} {b}");
    }
    let number = |columns: &HashMap<String, Vec<String>>, name: &str, i: usize| {
        let column = columns.get(name).or_else(|| columns.get(&format!("{name}_mm"))).unwrap();
        column[i].parse::<f64>().ok()
    };
    for (name, scale, most, usual) in [
        ("K_mean", "K_mean", 1e-5, 1e-5),
        ("K_sd", "K_sd", 1e-3, 3e-4),
        ("error_rms_mm", "error_rms_mm", 2e-3, 3e-4),
        ("error_max_mm", "error_max_mm", 2e-3, 3e-4),
        ("error_mean_mm", "error_rms_mm", 2e-3, 3e-4),
        ("noise_rms_mm", "noise_rms_mm", f64::INFINITY, 1e-3),
        ("total_rms_mm", "total_rms_mm", f64::INFINITY, 1e-3),
        ("strain_max", "strain_max", 1e-5, 1e-5),
        ("force_max_N", "force_max_N", 1e-4, 1e-4),
        ("n", "n", 1e-9, 1e-9),
    ] {
        let mut beyond = 0;
        for i in (0..n).filter(|&i| got["status"][i] == want["status"][i]) {
            match (number(&got, name, i), number(&want, name, i)) {
                (Some(x), Some(y)) => {
                    let error = (x - y).abs() / number(&want, scale, i).unwrap().abs().max(1e-12);
                    assert!(error < most, "{name}, row {i}: {x} {y}");
                    beyond += usize::from(error > usual);
                }
                (x, y) => assert_eq!(x.is_some(), y.is_some(), "{name}, row {i}"),
            }
        }
        assert!(beyond <= n / 100, "{name}: {beyond} rows");
    }
}

const TIPS: &str = "d = { min = 2.5, max = 7, samples = N }\nL_a = 50";
const OWN: &str = "theta = { min = 0.5, max = 10, samples = N }";
const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

#[test]
fn ideal_and_practical_whiskers() {
    agrees(&spec(TIPS, "", OWN, ""), 0.9..1.0001);
    agrees(&spec(TIPS, "", OWN, PRACTICAL), 0.9..1.0001);
}

#[test]
fn drives_that_all_designs_share() {
    let text = spec(TIPS, "", "theta = [10, 0.5, 3]", PRACTICAL);
    agrees(&text.replace(&SAMPLES.to_string(), "4500"), 0.9..1.0001);
}

#[test]
fn contacts_that_slip_off_do_not_count() {
    let short = "d = { min = 2.5, max = 7, samples = N }\nL_a = 48.3";
    agrees(&spec(short, "", "theta = { min = 2, max = 20, samples = N }", PRACTICAL), 0.6..1.0001);
}

#[test]
fn whiskers_that_are_too_short_are_no_whiskers() {
    let mixed = "d = { min = 2.5, max = 7, samples = N }\nL_a = { min = 46, max = 52, samples = N }";
    agrees(&spec(mixed, "", OWN, ""), 0.5..0.8);
}

#[test]
fn a_hub_a_pole_a_far_gauge_and_a_given_k() {
    let rig = format!("{TIPS}\nhub = 8");
    let model = "[model]\nsurface = true\nshear = true\npole_radius = 2\nmaterial = { yeoh = [0.5, -0.08, 0.02] }\n[estimate]\nK = 1";
    agrees(&spec(&rig, "side = \"far\"", OWN, model), 0.9..1.0001);
}

#[test]
fn timoshenkos_theory_and_elongations() {
    let model = "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"\nconvention = \"elongation\"";
    agrees(&spec(TIPS, "", OWN, model), 0.9..1.0001);
}

#[test]
fn displaced_objects_and_whiskers_that_widen() {
    let widening = "d = { min = 8, max = 14, samples = N }\nL_a = 50";
    let moved = "drive = \"displacement\"\ndelta = { min = 0.2, max = 4, samples = N }";
    agrees(&spec(widening, "", moved, "[model]\nextension = true"), 0.0..1.0001);
}

#[test]
fn friction() {
    let model = format!("{PRACTICAL}\ncontact = {{ coulomb = 0.3 }}");
    agrees(&spec(TIPS, "", OWN, &model), 0.9..1.0001);
}
