//! Charts of every model: ranked sweeps, tables and single taps against the same solved in f64, which reads no chart.

use serde_json::Value;

use crate::common::program::Desk;
use vibrissa::chart::{
    axis::AXES,
    distance::{DistanceChart, room},
    taps::Taps,
};
use vibrissa::kernel::gpu::SOFTWARE_RANKS;
use vibrissa::scene::{Contact, Drive, Estimate, Material, Setup, Theory};

const SAMPLES: usize = 13_200;

/// Designs sampled over the ranges of a lab, ten distances each: their own drives, or drives that they share.
fn spec(rig: &str, side: &str, drive: &str, model: &str, output: &str) -> String {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = {SAMPLES} }}");
    let gridded = drive.contains("from");
    let n = |lo: f64, hi: f64, steps: usize| match gridded {
        true => format!("{{ from = {lo}, to = {hi}, steps = {steps} }}"),
        false => axis(lo, hi),
    };
    let drive = drive.replace("SAMPLES", &SAMPLES.to_string());
    format!(
        "[whisker]\nD = {}\nd = {}\nL_a = 50\n{rig}\n[gauge]\nx_ss = {}\nl = {}\nnoise_strain = 2e-5\n{side}\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{drive}\n{model}\n[output]\ntuples = false\ndistances = false\n{output}\n",
        n(8.0, 12.0, 7),
        n(2.5, 7.0, 6),
        n(3.0, 15.0, 8),
        n(1.0, 4.0, 1),
    )
    .replace("{ from = 1, to = 4, steps = 1 }", "2")
}

fn rows(desk: &Desk, folder: &str) -> Vec<Vec<String>> {
    let text = desk.read(&format!("{folder}/designs.csv"));
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// The same rows, the same words, and the ranked value to 5e-4 of itself.
#[track_caller]
fn agrees(text: &str, by: &str) {
    let desk = Desk::new(text);
    let run = |precision: &str| -> (Value, Vec<Vec<String>>) {
        let arguments = [
            "sweep",
            "spec.toml",
            "--backend",
            "cpu",
            "--precision",
            precision,
            "--out",
            precision,
            "--json",
        ];
        (desk.run(&arguments).exits(0).json(), rows(&desk, precision))
    };
    let ((charted, got), (solved, want)) = (run("f32"), run("f64"));
    let (charted, solved) = (&charted["counts"], &solved["counts"]);
    assert!(solved["chart"].is_null());
    let taps = charted["taps"].as_u64().unwrap();
    let sharp = text.contains("1.25");
    if !sharp {
        assert!(charted["interpolated"].as_u64().unwrap() > taps * 9 / 10, "{charted}");
        assert!(charted["solved"].as_u64().unwrap() < taps / 2, "{charted}");
    }
    for (word, n) in solved["status"].as_object().unwrap() {
        let found = charted["status"][word].as_u64().unwrap_or(0);
        assert!(found.abs_diff(n.as_u64().unwrap()) <= 2 + taps / 20_000, "{word}: {charted} {solved}");
    }
    let rank = got[0].iter().position(|name| name.starts_with(by)).unwrap();
    assert_eq!(got.len(), want.len());
    assert!(got.len() > 20);
    let value = |row: &[String]| row[rank].parse::<f64>().unwrap();
    for (a, b) in got[1..].iter().zip(&want[1..]) {
        assert!((value(a) / value(b) - 1.0).abs() < 5e-4, "{a:?} {b:?}");
        // Rows that rank the same may change places.
        assert!(a[..6] == b[..6] || (value(a) / value(b) - 1.0).abs() < 5e-4);
    }
    ranks_alike_on_a_device(&desk, charted, &got, rank);
}

/// A device ranks from the same charts: the same words, rows and ranks to single precision.
#[track_caller]
fn ranks_alike_on_a_device(desk: &Desk, charted: &Value, rows_of_cpu: &[Vec<String>], rank: usize) {
    let arguments = ["sweep", "spec.toml", "--backend", "gpu", "--out", "gpu", "--json"];
    let ran = desk.run_with(&arguments, &[(SOFTWARE_RANKS, "1")]).exits(0);
    let (json, got) = (ran.json(), rows(desk, "gpu"));
    // Friction over shared drives takes more rounds than Mesa's software device does.
    let text = desk.read("spec.toml");
    let lanes = text.contains("coulomb") && text.contains("theta = { from");
    // Of sharp tips alone there may be no charts that rank.
    assert!(charted["chart"]["ranked_by"] == "lanes" || text.contains("min = 1.25"), "{charted}");
    let by = match charted["chart"]["ranked_by"].as_str() {
        None => Value::Null,
        Some(_) if lanes => Value::from("lanes"),
        Some(_) => Value::from("device"),
    };
    assert_eq!(json["counts"]["chart"]["ranked_by"], by, "{json} {}", ran.stderr);
    let (found, taps) = (&json["counts"], charted["taps"].as_u64().unwrap());
    for (word, n) in charted["status"].as_object().unwrap() {
        let found = found["status"][word].as_u64().unwrap_or(0);
        assert!(found.abs_diff(n.as_u64().unwrap()) <= 2 + taps / 20_000, "{word}: {json} {charted}");
    }
    assert_eq!(got.len(), rows_of_cpu.len());
    for (a, b) in got[1..].iter().zip(&rows_of_cpu[1..]) {
        let [x, y] = [a, b].map(|row| row[rank].parse::<f64>().unwrap());
        assert!((x / y - 1.0).abs() < 5e-4, "{a:?} {b:?}");
    }
}

const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
const OWN: &str = "theta = { min = 0.5, max = 10, samples = SAMPLES }";
const SHARED: &str = "theta = { from = 0.5, to = 10, steps = 40 }";
const MOVED: &str = "drive = \"displacement\"\ndelta = { min = 0.2, max = 4, samples = SAMPLES }";

#[test]
fn practical_designs_with_drives_of_their_own_rank_as_solved() {
    agrees(&spec("", "", OWN, PRACTICAL, "top = 50"), "K_sd");
}

#[test]
fn practical_designs_over_shared_drives_rank_as_solved_by_their_error() {
    agrees(&spec("", "", SHARED, PRACTICAL, "top = 50\nby = \"total_rms_mm\""), "total_rms");
}

#[test]
fn a_hub_and_a_pole_are_part_of_the_charts() {
    let model =
        "[model]\nsurface = true\nshear = true\npole_radius = 2\nmaterial = { yeoh = [0.5, -0.08, 0.02] }";
    agrees(&spec("hub = 8", "", OWN, model, "top = 50\nby = \"total_rms_mm\""), "total_rms");
}

#[test]
fn timoshenkos_theory_keeps_a_small_spread() {
    let model = "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"";
    agrees(&spec("", "", SHARED, model, "top = 50"), "K_sd");
}

#[test]
fn a_displaced_object_and_a_gauge_on_the_far_side_rank_as_solved() {
    let model = "[model]\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    agrees(&spec("", "side = \"far\"", MOVED, model, "top = 50\nby = \"total_rms_mm\""), "total_rms");
}

#[test]
fn friction_that_holds_and_lets_go_ranks_as_solved() {
    let model = format!("{PRACTICAL}\ncontact = {{ coulomb = 0.3 }}");
    agrees(&spec("", "", OWN, &model, "top = 50"), "K_sd");
    agrees(&spec("", "", SHARED, &model, "top = 50\nby = \"total_rms_mm\""), "total_rms");
}

/// Next to the apex series over the drive would want more orders than there are.
#[test]
fn sharp_tips_are_read_or_solved() {
    let text = spec("", "", OWN, PRACTICAL, "top = 50");
    agrees(
        &text
            .replace("min = 2.5, max = 7", "min = 1.25, max = 1.3")
            .replace("min = 8, max = 12", "min = 10, max = 12"),
        "K_sd",
    );
}

#[test]
fn a_table_of_every_design_is_read_to_the_tolerance() {
    let text = spec("", "", OWN, PRACTICAL, "");
    let desk = Desk::new(&text);
    for precision in ["f32", "f64"] {
        let arguments =
            ["sweep", "spec.toml", "--backend", "cpu", "--precision", precision, "--out", precision];
        desk.run(&arguments).exits(0);
    }
    let (got, want) = (rows(&desk, "f32"), rows(&desk, "f64"));
    assert_eq!((got.len(), want.len()), (1 + SAMPLES, 1 + SAMPLES));
    let at = |name: &str| got[0].iter().position(|n| n == name).unwrap();
    for (name, most) in [("K_mean", 1e-5), ("K_sd", 1e-3), ("strain_max", 1e-5), ("force_max_N", 1e-4)] {
        let k = at(name);
        for (a, b) in got[1..].iter().zip(&want[1..]) {
            match (a[k].parse::<f64>(), b[k].parse::<f64>()) {
                (Ok(x), Ok(y)) => assert!((x / y - 1.0).abs() < most, "{name}: {a:?} {b:?}"),
                (x, y) => assert_eq!(x.is_ok(), y.is_ok(), "{name}"),
            }
        }
    }
}

/// Strain errors of a chart at random taps of its box, the model's own choice of sticking included.
fn worst(setup: &Setup, a: f64) -> f64 {
    let drive = match setup.drive {
        Drive::Angle => [0.5f64.to_radians(), 10f64.to_radians()],
        Drive::Displacement => [0.2 / a, 4.0 / a],
    };
    let ranges = [drive, [0.0; 2], [8.0 / a, 12.0 / a], [0.0025 * a, 0.013 * a], [3.0 / a, 17.0 / a]];
    let chart = DistanceChart::new(setup, a, (ranges, 4.0 / a), 1e-5).unwrap().expect("a smooth model");
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let points: Vec<[f64; AXES]> = (0..400)
        .map(|_| chart.axes().map(|axis| axis.range[0] + random() * (axis.range[1] - axis.range[0])))
        .collect();
    let found = Taps::new(setup, a, None, 1e-9).solve(&points).unwrap();
    let error = |(q, o): (&[f64; AXES], &vibrissa::evaluate::Outcome)| {
        (chart.at(q)[0] / room(q) + o.deviation / (1.0 + o.deviation)).abs()
    };
    points.iter().zip(&found).map(error).fold(0.0, f64::max)
}

#[test]
fn charts_hold_their_strain_on_taps_of_their_own() {
    let practical = Setup::default().material(Material::NeoHookean(3.2)).surface().shear().extension();
    let timoshenko = Setup {
        estimate: Estimate { theory: Theory::Timoshenko, ..Estimate::default() },
        ..Setup::default().shear()
    };
    let moved = Setup { drive: Drive::Displacement, ..practical.clone() };
    let friction = |mu| practical.clone().contact(Contact::Coulomb(mu));
    for (name, setup) in [
        ("ideal", Setup::default()),
        ("timoshenko", timoshenko),
        ("practical", practical.clone()),
        ("hub and pole", practical.clone().hub(8.0).pole_radius(3.0)),
        ("displaced", moved),
        ("coulomb 0.1", friction(0.1)),
        ("coulomb 0.3", friction(0.3)),
    ] {
        for a in [24.0, 42.0] {
            let worst = worst(&setup, a);
            assert!(worst < 6e-6, "{name} at {a} mm: {worst:.1e}");
        }
    }
}

#[test]
fn charts_are_written_with_their_domain_and_error() {
    let text = spec("", "", OWN, PRACTICAL, "");
    let desk = Desk::new(&text);
    desk.run(&["chart", "spec.toml", "--out", "charts"]).exits(0);
    let chart: Value = serde_json::from_str(&desk.read("charts/chart.json")).unwrap();
    let charts = chart["charts"].as_array().unwrap();
    assert_eq!(charts.len(), 10);
    for chart in charts {
        assert!(chart["strain_error"].as_f64().unwrap() <= 1e-6);
        assert_eq!(chart["axes"].as_array().unwrap().len(), AXES);
    }
    // Of poles that are not upright, and two gauges: each chart says its direction, and holds three functions more.
    let tilted = text
        .replace("[tap]\n", "[tap]\ntilt = [0, 20]\nlean = 5\n")
        .replace("[gauge]\n", "[gauge]\nsecond = true\n");
    let desk = Desk::new(&tilted.replace("steps = 10", "steps = 4"));
    desk.run(&["chart", "spec.toml", "--out", "charts"]).exits(0);
    let chart: Value = serde_json::from_str(&desk.read("charts/chart.json")).unwrap();
    let charts = chart["charts"].as_array().unwrap();
    let directions: Vec<[f64; 2]> =
        charts.iter().map(|c| ["tilt_deg", "lean_deg"].map(|key| c[key].as_f64().unwrap())).collect();
    assert_eq!((charts.len(), &directions[..2]), (8, &[[0.0, 5.0], [20.0, 5.0]][..]));
    assert_eq!(chart["beside"][0], "strain_2_over_theory_times_1_less_x_over_a");
    for chart in charts {
        assert!(chart["strain_error"].as_f64().unwrap() <= 1e-6);
        assert_eq!(chart["beside"]["series"].as_array().unwrap().len(), 3);
        assert_eq!(chart["beside"]["axes"].as_array().unwrap().len(), AXES);
    }
    let many = tilted.replace("tilt = [0, 20]", "tilt = { from = 0, to = 20, steps = 21 }");
    let refused = Desk::new(&many).run(&["chart", "spec.toml", "--out", "charts"]).exits(2);
    assert!(
        refused.stderr.contains("tap.tilt") && refused.stderr.contains("64 at most"),
        "{}",
        refused.stderr
    );
    let linear = text.replace("surface = true", "geometry = \"linear\"").replace("shear = true\n", "");
    let linear = linear.replace("extension = true\nmaterial = { neo-hookean = 3.2 }", "");
    let desk = Desk::new(&linear);
    let refused = desk.run(&["chart", "spec.toml", "--out", "charts"]).exits(2);
    assert!(refused.stderr.contains("no distance has a chart"), "{}", refused.stderr);
}
