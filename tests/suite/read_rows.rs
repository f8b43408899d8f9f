//! Rows read from charts against rows reduced from taps solved in f64, column by column.

use crate::common::specs;
use crate::common::sweeping::{CPU, CPU_F64, Row, number, sweep};
use vibrissa::chart::{ranges::Wanted, ranker::Ranker};
use vibrissa::design::Design;
use vibrissa::scene::Tuple;
use vibrissa::statistics::Figures;

const SAMPLES: usize = 4_000;

/// Designs of a lab, each with its own drive unless `drive` lists drives.
fn spec(whisker: &str, gauge: &str, tap: &str, rest: &str) -> String {
    let text = format!(
        "[whisker]\nD = {{ min = 8, max = 12, samples = N }}\n{whisker}\n[gauge]\nx_ss = {{ min = 3, max = 15, samples = N }}\nl = {{ min = 1, max = 4, samples = N }}\nnoise_strain = 2e-5\n{gauge}\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{tap}\n{rest}\n[output]\ntuples = false\ndistances = false\n"
    );
    text.replace('N', &SAMPLES.to_string())
}

/// Status words agree, except in two rows at a threshold; every column is within its tolerance; the share of rows read from charts is in `read`.
#[track_caller]
fn agrees(text: &str, read: std::ops::Range<f64>) {
    let study = specs::parse(text).unwrap().study;
    let (setup, layout) = (&study.setup, study.space.layout().unwrap());
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let row = |r: u64| layout.stroke(&layout.design(r / layout.n_drives), r % layout.n_drives);
    let tuples: Vec<Tuple> = (0..layout.n_designs * layout.n_drives).map(row).collect();
    let reader = Ranker::of_rows(setup, &distances, &Wanted::of(&layout), 1e-5).unwrap().expect("charts");
    let got = reader.figures(&tuples);
    let want = sweep(text, CPU_F64).designs.rows;
    assert_eq!(got.len(), want.len());
    let share = got.iter().flatten().count() as f64 / got.len() as f64;
    assert!(read.contains(&share), "{share} of the rows are read");
    let pairs = || {
        let rows = got.iter().zip(&want).zip(&tuples);
        // A search counts contacts that slip off, a table does not.
        let on = |want: &Row| !want["status"].contains("slipped_off");
        rows.filter_map(move |((got, want), t)| {
            Some((got.as_ref().filter(|_| on(want))?.row.figures(), want, t))
        })
    };
    let other = pairs().filter(|(got, want, _)| got.status.to_string() != want["status"]).count();
    assert!(other <= 2, "{other} rows with other words");
    type Read = fn(&Figures, f64) -> Option<f64>;
    let columns: [(&str, &str, f64, f64, Read); 10] = [
        ("K_mean", "K_mean", 1e-5, 1e-5, |row, unit| row.mean.map(|m| (1.0 + m) * unit)),
        ("K_sd", "K_sd", 1e-3, 3e-4, |row, unit| row.sd.map(|s| s * unit)),
        ("error_rms_mm", "error_rms_mm", 2e-3, 3e-4, |row, _| row.error_rms),
        ("error_max_mm", "error_max_mm", 2e-3, 3e-4, |row, _| row.error_max),
        ("error_mean_mm", "error_rms_mm", 2e-3, 3e-4, |row, _| row.error_mean),
        ("noise_rms_mm", "noise_rms_mm", f64::INFINITY, 1e-3, |row, _| row.noise_rms),
        ("total_rms_mm", "total_rms_mm", f64::INFINITY, 1e-3, |row, _| row.total_rms()),
        ("strain_max", "strain_max", 1e-5, 1e-5, |row, _| row.strain_max),
        ("force_max_N", "force_max_N", 1e-4, 1e-4, |row, _| row.force_max),
        ("n", "n", 1e-9, 1e-9, |row, _| Some(row.n as f64)),
    ];
    for (name, scale, most, usual, value) in columns {
        let mut beyond = 0;
        for (i, (got, want, t)) in pairs().enumerate() {
            if got.status.to_string() != want["status"] {
                continue;
            }
            let unit = Design::new(setup, *t).elongation(setup).unwrap_or(1.0);
            let known = |name: &str| {
                number(
                    want,
                    if want.contains_key(name) { name.into() } else { format!("{name}_mm") }.as_str(),
                )
            };
            match (value(&got, unit), known(name)) {
                (Some(x), Some(y)) => {
                    let error = (x - y).abs() / known(scale).unwrap().abs().max(1e-12);
                    assert!(error < most, "{name}, row {i}: {x} {y}");
                    beyond += usize::from(error > usual);
                }
                (x, y) => assert_eq!(x.is_some(), y.is_some(), "{name}, row {i}"),
            }
        }
        assert!(beyond <= got.len() / 100, "{name}: {beyond} rows");
    }
}

const TIPS: &str = "d = { min = 2.5, max = 7, samples = N }\nL_a = 50";
const OWN: &str = "theta = { min = 0.5, max = 10, samples = N }";
const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

#[test]
fn rows_of_whiskers_on_their_own_angles() {
    let mixed = "d = { min = 2.5, max = 7, samples = N }\nL_a = { min = 46, max = 52, samples = N }";
    let rig = format!("{TIPS}\nhub = 8");
    let pole = "[model]\nsurface = true\nshear = true\npole_radius = 2\nmaterial = { yeoh = [0.5, -0.08, 0.02] }\n[estimate]\nK = 1";
    let timoshenko =
        "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"\nconvention = \"elongation\"";
    let friction = format!("{PRACTICAL}\ncontact = {{ coulomb = 0.3 }}");
    for (whisker, gauge, model, read) in [
        (TIPS, "", "", 0.9..1.0001),
        (TIPS, "", PRACTICAL, 0.9..1.0001),
        (mixed, "", "", 0.5..0.8),
        (&rig, "side = \"far\"", pole, 0.9..1.0001),
        (TIPS, "", timoshenko, 0.9..1.0001),
        (TIPS, "", &friction, 0.9..1.0001),
    ] {
        agrees(&spec(whisker, gauge, OWN, model), read);
    }
}

#[test]
fn rows_of_drives_that_are_shared_and_of_displaced_objects() {
    let text = spec(TIPS, "", "theta = [10, 0.5, 3]", PRACTICAL);
    agrees(&text.replace(&SAMPLES.to_string(), "1500"), 0.9..1.0001);
    let widening = "d = { min = 8, max = 14, samples = N }\nL_a = 50";
    let moved = "drive = \"displacement\"\ndelta = { min = 0.2, max = 4, samples = N }";
    agrees(&spec(widening, "", moved, "[model]\nextension = true"), 0.0..1.0001);
}

#[test]
fn a_table_of_every_design_is_read_to_the_tolerance() {
    let text = spec(TIPS, "", OWN, PRACTICAL);
    let [got, want] = [CPU, CPU_F64].map(|place| sweep(&text, place));
    for (name, most) in [("K_mean", 1e-5), ("K_sd", 1e-3), ("strain_max", 1e-5), ("force_max_N", 1e-4)] {
        for (got, want) in got.designs.rows.iter().zip(&want.designs.rows) {
            match (number(got, name), number(want, name)) {
                (Some(x), Some(y)) => assert!((x / y - 1.0).abs() < most, "{name}: {got:?} {want:?}"),
                (x, y) => assert_eq!(x, y, "{name}: {got:?} {want:?}"),
            }
        }
    }
}
