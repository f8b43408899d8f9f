//! Strains of whiskers as built on a GPU, in f32, over drives from 1e-4° and 1e-4 mm on: those of the reference to the tolerance.

use std::path::Path;

use crate::common::sweeping::{GPU, REFERENCE, number, sweep};
use vibrissa::census::{Taps, sample};
use vibrissa::spec;

/// Keys of `[tap]`: drives fall, so that the first taps of a batch are large ones.
fn tap(turned: bool) -> String {
    let large = |from: f64, step: f64| (0..16).map(move |k| from - step * f64::from(k));
    let drives =
        |from, step| large(from, step).chain([1.0, 0.3, 0.1, 0.01, 1e-3, 1e-4]).collect::<Vec<f64>>();
    match turned {
        true => format!("a = [33, 15, 45]\ntheta = {:?}", drives(10.0, 0.5)),
        false => format!("a = [33, 15, 45]\ndrive = \"displacement\"\ndelta = {:?}", drives(5.0, 0.2)),
    }
}

const TURNED: bool = true;
const LIFTED: bool = false;

const POLE: &str = "pole_radius = 20\nextension = true\nsurface = true\nshear = true";

/// What is in `[whisker]`, beside D 10, d 6 and L_a 50 where it is no profile; whether the base turns; and what is in `[model]`.
const WHISKERS: [(&str, bool, &str); 12] = [
    ("bore = 4", TURNED, POLE),
    ("bore = 4", LIFTED, POLE),
    ("core = { diameter = 0.5, modulus = 60_000 }", TURNED, "surface = true"),
    ("exponent = 0.5", TURNED, POLE),
    ("exponent = 3", LIFTED, "surface = true"),
    ("root = { k_theta = 1000, k_y = 20, k_x = 20 }", TURNED, POLE),
    ("curvature = 0.008\ncurvature_slope = -0.0003", TURNED, POLE),
    ("curvature = -0.008", TURNED, "material = { yeoh = [0.5, -0.08, 0.02] }\nsurface = true\nnu = 0.45"),
    ("curvature = 0.004", LIFTED, "shear = true\nmaterial = { neo-hookean = 3.2 }"),
    ("exponent = 2\ncurvature = 0.005", LIFTED, POLE),
    ("exponent = 1.5", TURNED, "extension = true\nsurface = true\ncontact = { coulomb = 0.1 }"),
    ("profile = [[0, 10], [12, 7], [50, 5]]", TURNED, POLE),
];

#[test]
fn on_a_gpu_strains_of_built_whiskers_keep_the_tolerance_at_small_drives() {
    for (whisker, turned, model) in WHISKERS {
        let cone = if whisker.starts_with("profile") { "" } else { "D = 10\nd = 6\nL_a = 50\n" };
        let tap = tap(turned);
        let text =
            format!("[whisker]\n{cone}{whisker}\n[gauge]\nx_ss = 5\nl = 2\n[tap]\n{tap}\n[model]\n{model}\n");
        let study = spec::parse("spec.toml", &text, Path::new("")).unwrap().study;
        let taps = Taps::of(&study.setup, &sample::random(&study.space, 1000, 0));
        let [found, wanted] = [GPU, REFERENCE].map(|place| sweep(&text, place).tuples);
        let mut worst = 0.0f64;
        for (i, (found, wanted)) in found.rows.iter().zip(&wanted.rows).enumerate() {
            assert_eq!(found["status"], wanted["status"], "{text}{found:?}");
            let [Some(strain), Some(right)] = [found, wanted].map(|row| number(row, "strain")) else {
                continue;
            };
            let error = (strain - right).abs() / right.abs().max(taps.least(i));
            assert!(error <= 1e-5, "off by {error:.1e} of itself: {text}{found:?}\n{wanted:?}");
            worst = worst.max(error);
        }
        assert!(worst > 0.0, "nothing was solved in f32: {text}");
    }
}
