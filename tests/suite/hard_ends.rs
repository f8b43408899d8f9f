//! Every tap that a chart may answer, at the hard ends of the domain, against the same tap solved in f64, which reads no chart: whiskers from
//! d/D = 0.25 to 1.2, θ to 20°, gauges from the clamp to next to the contact, of every kind of model. (Finer tips have charts at small distances
//! only; the rest of them is solved.)

use std::collections::HashMap;

use crate::common::program::Desk;

/// Ten distances each: 2¹⁷ taps and a few.
const SAMPLES: usize = 13_200;

/// Whiskers of 10 mm with these tips and gauges that begin at these places, mm.
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

/// Columns of tuples.csv by name.
fn columns(desk: &Desk, folder: &str) -> HashMap<String, Vec<String>> {
    let text = desk.read(&format!("{folder}/tuples.csv"));
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        line.split(',').zip(&mut columns).for_each(|(field, column)| column.push(field.to_owned()));
    }
    names.into_iter().map(str::to_owned).zip(columns).collect()
}

/// Strains within the tolerance of those in f64, relative to themselves and to 1e-3 of the largest, and the same words but next to a limit.
/// Most of the taps are read from charts.
#[track_caller]
fn holds(text: &str) {
    let desk = Desk::new(text);
    let run = |precision: &str| {
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
        (desk.run(&arguments).exits(0).json()["counts"].clone(), columns(&desk, precision))
    };
    let ((charted, got), (_, want)) = (run("f32"), run("f64"));
    let taps = charted["taps"].as_f64().unwrap();
    let read = charted["interpolated"].as_f64().unwrap() / taps;
    assert!(read > 0.8, "{read} of the taps are read: {charted}");
    let numbers = |of: &HashMap<String, Vec<String>>| -> Vec<f64> {
        of["strain"].iter().map(|x| x.parse().unwrap_or(f64::NAN)).collect()
    };
    let (x, y) = (numbers(&got), numbers(&want));
    assert_eq!((x.len(), y.len()), (taps as usize, taps as usize));
    let floor = 1e-3 * y.iter().filter(|y| y.is_finite()).fold(0.0, |most: f64, y| most.max(y.abs()));
    let (mut words, mut solved) = (0, 0);
    for i in 0..x.len() {
        let same = got["status"][i] == want["status"][i];
        words += usize::from(!same);
        if x[i].is_finite() && y[i].is_finite() {
            solved += 1;
            let off = (x[i] - y[i]).abs() / y[i].abs().max(floor);
            assert!(off < 1e-5, "row {i}: {} for {}, off by {off:.1e}", x[i], y[i]);
        }
    }
    assert!(solved as f64 > 0.5 * taps, "{solved} rows compared");
    // Next to a limit single precision may say it or not.
    assert!(words as f64 <= 2.0 + taps / 20_000.0, "{words} words differ");
}

const FAR: &str = "theta = { min = 0.5, max = 20, samples = SAMPLES }";
const NEAR: &str = "theta = { min = 0.5, max = 10, samples = SAMPLES }";
const MOVED: &str = "drive = \"displacement\"\ndelta = { min = 0.2, max = 8, samples = SAMPLES }";
const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

#[test]
fn practical_whiskers_with_gauges_from_the_clamp_to_the_contact() {
    holds(&spec([[2.5, 8.0], [0.0, 18.0]], "", "", FAR, PRACTICAL));
}

#[test]
fn whiskers_that_grow_towards_the_tip() {
    holds(&spec([[8.0, 12.0], [0.0, 18.0]], "", "", NEAR, PRACTICAL));
}

#[test]
fn whiskers_on_a_hub_against_a_pole() {
    let model = "[model]\nsurface = true\npole_radius = 2\nmaterial = { mooney-rivlin = [0.35, 0.15] }";
    holds(&spec([[2.5, 8.0], [3.0, 18.0]], "hub = 8", "", FAR, model));
}

#[test]
fn displaced_objects_and_gauges_on_the_far_side() {
    let model = "[model]\nextension = true\nmaterial = { yeoh = [0.5, -0.08, 0.02] }";
    holds(&spec([[2.5, 8.0], [0.0, 15.0]], "", "side = \"far\"", MOVED, model));
}

#[test]
fn whiskers_that_shear_beside_timoshenkos_theory() {
    let model = "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"";
    holds(&spec([[2.5, 8.0], [0.5, 18.0]], "", "", NEAR, model));
}

#[test]
fn contacts_with_friction() {
    let model = format!("{PRACTICAL}\ncontact = {{ coulomb = 0.2 }}");
    holds(&spec([[4.0, 8.0], [0.0, 15.0]], "", "", NEAR, &model));
}
