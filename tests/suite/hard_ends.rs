//! Every tap that a chart may answer, at the hard ends of the domain, against f64, which uses no chart: d/D = 0.25 to 1.2, θ to 20°, gauges from the
//! clamp to next to the contact, every kind of model. (Finer tips have charts at small distances only; their other taps are solved.)

use crate::common::specs;
use crate::common::sweeping::CPU_F64;
use vibrissa::chart::{ranges::Wanted, reader::Reader};
use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Source, Task};
use vibrissa::scene::{Direction, Tuple};

const SAMPLES: usize = 4_000;

fn spec([tips, places]: [[f64; 2]; 2], rig: &str, side: &str, drive: &str, model: &str) -> String {
    let axis = |[lo, hi]: [f64; 2]| format!("{{ min = {lo}, max = {hi}, samples = {SAMPLES} }}");
    let drive = drive.replace("SAMPLES", &SAMPLES.to_string());
    format!(
        "[whisker]\nD = 10\nd = {}\nL_a = 50\n{rig}\n[gauge]\nx_ss = {}\nl = {}\n{side}\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{drive}\n{model}\n[output]\ndesigns = false\ndistances = false\n",
        axis(tips),
        axis(places),
        axis([1.0, 4.0]),
    )
}

/// Strains from charts agree with f64 within 1e-5 of max(|ε|, 1e-3 of the largest); status words agree except next to a limit. Most taps are read.
#[track_caller]
fn holds(text: &str) {
    let study = specs::parse(text).unwrap().study;
    let (setup, layout) = (&study.setup, study.space.layout().unwrap());
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let tuples: Vec<Tuple> = (0..layout.len()).map(|i| layout.tuple(i)).collect();
    let designs: Vec<Design> = tuples.iter().map(|t| Design::new(setup, *t)).collect();
    let tasks: Vec<Task> = (0..).zip(&tuples).map(|(i, t)| Task::of(i, t)).collect();
    let mut directions: Vec<Direction> = Vec::new();
    for Tuple { tilt, lean, .. } in &tuples {
        let direction = Direction { tilt: *tilt, lean: *lean };
        if !directions.contains(&direction) {
            directions.push(direction);
        }
    }
    let reader =
        Reader::new(setup, (&distances, &directions), &Wanted::of(&layout), 1e-5).unwrap().expect("charts");
    let got = reader.read(setup, &designs, &tasks);
    let want = Evaluator::new(setup, CPU_F64.open(setup)).run(&designs, &tasks).unwrap();
    let taps = tasks.len() as f64;
    let largest = want.iter().map(|y| y.strain.abs()).filter(|y| y.is_finite()).fold(0.0, f64::max);
    let (mut words, mut read, mut solved) = (0, 0, 0);
    for (i, (x, y)) in got.iter().zip(&want).enumerate() {
        let Some(x) = x else { continue };
        read += 1;
        words += usize::from(x.status != y.status);
        if x.strain.is_finite() && y.strain.is_finite() {
            solved += 1;
            let off = (x.strain - y.strain).abs() / y.strain.abs().max(1e-3 * largest);
            assert!(off < 1e-5, "tap {i}: {} for {}, off by {off:.1e}", x.strain, y.strain);
            let whole = y.strain.hypot(y.strain_2).max(1e-3 * largest);
            for (x, y, most) in [
                (x.strain_2, y.strain_2, 1e-5 * whole),
                (x.azimuth, y.azimuth, 1e-5),
                (x.slide, y.slide, 1e-5 * y.arc),
                (x.arc, y.arc, 1e-5 * y.arc),
                (x.normal_force, y.normal_force, 1e-4 * y.normal_force),
            ] {
                assert!((x - y).abs() <= most || x.is_nan() || y.is_nan(), "tap {i}: {x} for {y}");
            }
        }
    }
    assert!(f64::from(read) > 0.8 * taps, "{read} of {taps} taps are read");
    assert!(f64::from(solved) > 0.5 * taps, "{solved} taps compared");
    // A chart has one direction: it must not answer another.
    if !directions.contains(&Direction::UPRIGHT) {
        let upright: Vec<Task> = tasks.iter().map(|t| Task { direction: Direction::UPRIGHT, ..*t }).collect();
        assert!(reader.read(setup, &designs, &upright).iter().all(Option::is_none));
    }
    // Next to a limit, single precision may give the other word.
    assert!(words as f64 <= 2.0 + taps / 20_000.0, "{words} words differ");
}

const FAR: &str = "theta = { min = 0.5, max = 20, samples = SAMPLES }";
const NEAR: &str = "theta = { min = 0.5, max = 10, samples = SAMPLES }";
const MOVED: &str = "drive = \"displacement\"\ndelta = { min = 0.2, max = 8, samples = SAMPLES }";
const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

#[test]
fn whiskers_at_the_ends_of_the_domain() {
    let pole = "[model]\nsurface = true\npole_radius = 2\nmaterial = { mooney-rivlin = [0.35, 0.15] }";
    let yeoh = "[model]\nextension = true\nmaterial = { yeoh = [0.5, -0.08, 0.02] }";
    let timoshenko = "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"";
    let rubs = |mu: f64| format!("{PRACTICAL}\ncontact = {{ coulomb = {mu} }}");
    for (tips, places, rig, side, drive, model) in [
        ([2.5, 8.0], [0.0, 18.0], "", "", FAR, PRACTICAL),
        ([8.0, 12.0], [0.0, 18.0], "", "", NEAR, PRACTICAL),
        ([2.5, 8.0], [3.0, 18.0], "hub = 8", "", FAR, pole),
        ([2.5, 8.0], [0.0, 15.0], "", "side = \"far\"", MOVED, yeoh),
        ([2.5, 8.0], [0.5, 18.0], "", "", NEAR, timoshenko),
        ([4.0, 8.0], [0.0, 15.0], "", "", NEAR, &rubs(0.2)),
    ] {
        holds(&spec([tips, places], rig, side, drive, model));
    }
}

#[test]
fn tilted_poles() {
    let pole = "[model]\nsurface = true\npole_radius = 3";
    for (rig, side, drive, model) in [
        ("hub = 3", "second = true", NEAR, ""),
        ("hub = 3", "", NEAR, ""),
        ("hub = 3", "second = true", NEAR, pole),
        ("hub = 3", "second = true", NEAR, PRACTICAL),
        ("hub = 3", "second = true\nside = \"far\"", NEAR, PRACTICAL),
        ("hub = 3", "second = true", MOVED, PRACTICAL),
    ] {
        let text = spec([[3.0, 5.0], [4.0, 6.0]], rig, side, drive, model)
            .replace("to = 48, steps = 10", "to = 45, steps = 3");
        let text = text.replace("[tap]\n", "[tap]\ntilt = [20, -35]\nlean = 10\n");
        holds(&text.replace(&SAMPLES.to_string(), "300"));
    }
}
