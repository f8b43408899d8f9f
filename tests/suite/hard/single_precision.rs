//! K − 1 and its spread in single precision, next to those of f64, whose own answers are compared with the reference.

use super::*;
use crate::common::configuration;
use vibrissa::scene::RunOptions;

/// Degrees.
const ANGLES: [f64; 9] = [0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0];

/// Number of contact distances, 21, 24 … 48 mm.
const DISTANCES: usize = 10;

/// D and d, mm.
const WHISKERS: [(f64, f64); 9] = [
    (10.0, 2.0),
    (10.0, 3.0),
    (10.0, 4.0),
    (10.0, 7.0),
    (10.0, 10.0),
    (10.0, 12.0),
    (8.0, 5.0),
    (12.0, 2.5),
    (9.0, 9.0),
];

fn tuples() -> Vec<Tuple> {
    let mut all = Vec::new();
    for (wide, d) in WHISKERS {
        for degrees in ANGLES {
            all.extend((0..DISTANCES).map(|i| Tuple { D: wide, ..tuple(d, 21.0 + 3.0 * i as f64, degrees) }));
        }
    }
    all
}

fn at(place: Place, tolerance: f64, setup: &Setup, tuples: &[Tuple]) -> Vec<(Outcome, f64)> {
    let (backend, precision) = (Some(place.backend), Some(place.precision));
    let options = RunOptions { backend, precision, tolerance: Some(tolerance), ..RunOptions::default() };
    let choice = common::pool::choice(&options).unwrap_or_else(|e| panic!("{place:?}: {e}"));
    let method = common::pool::open(place, &choice, &setup.model);
    evaluate(setup, method, tuples)
}

/// Sample standard deviation.
fn spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

fn theta(t: &Tuple) -> f64 {
    t.drive.to_radians()
}

#[test]
fn frictionless_hooke_keeps_its_deviations_and_their_spread() {
    let (tuples, setup) = (tuples(), setup(common::model(Material::Hooke(3.2)), Side::Contact));
    let yardstick = at(CPU_F64, 1e-10, &setup, &tuples);
    // The yardstick against the reference: K − 1 of the reference has lost digits at small angles.
    for (i, (exact, _)) in evaluate(&setup, REFERENCE.open(&setup), &tuples).iter().enumerate().step_by(7) {
        let yardstick = yardstick[i].0;
        assert!((yardstick.strain / exact.strain - 1.0).abs() < 1e-10, "{:?}", tuples[i]);
        assert!((yardstick.deviation - exact.deviation).abs() < 1e-10, "{:?}", tuples[i]);
    }
    for place in [CPU, GPU] {
        let found = at(place, 1e-6, &setup, &tuples);
        let (mut strain, mut deviation, mut sd) = ((0.0_f64, 0), (0.0_f64, 0), (0.0_f64, 0));
        let worse = |worst: &mut (f64, usize), error: f64, i: usize| {
            assert!(error.is_finite(), "{place:?} {:?}: {error}", tuples[i]);
            if error > worst.0 {
                *worst = (error, i);
            }
        };
        for (i, ((fast, _), (exact, least))) in found.iter().zip(&yardstick).enumerate() {
            worse(&mut strain, (fast.strain - exact.strain).abs() / exact.strain.abs().max(*least), i);
            let scale = exact.deviation.abs().max(0.02 * theta(&tuples[i]).powi(2));
            worse(&mut deviation, (fast.deviation - exact.deviation).abs() / scale, i);
        }
        for row in 0..tuples.len() / DISTANCES {
            let of = |all: &[(Outcome, f64)]| {
                let part = &all[row * DISTANCES..(row + 1) * DISTANCES];
                spread(&part.iter().map(|(o, _)| o.deviation).collect::<Vec<_>>())
            };
            worse(&mut sd, (of(&found) / of(&yardstick) - 1.0).abs(), row * DISTANCES);
        }
        for (name, (worst, i), bound) in
            [("strain", strain, 1e-6), ("K − 1", deviation, 1e-4), ("SD(K)", sd, 1e-4)]
        {
            println!("{place:?}, {name}: worst {worst:.1e} at {:?}", tuples[i]);
            assert!(worst <= bound, "{place:?}, {name}: {worst:.1e} at {:?}", tuples[i]);
        }
    }
}

/// Bound on K − 1 relative to |K − K₀| + 0.02 θ². On the most tapered whisker K − K₀ of order θ and of order θ² cancel (yeoh, 45 mm,
/// 0.3°) down to the rounding of the numbers that enter: 1.1e-3 is what f32 leaves there.
fn effects_bound(t: &Tuple) -> f64 {
    if t.D == 12.0 && t.drive == 0.3 { 1.5e-3 } else { 1e-3 }
}

#[test]
fn other_effects_keep_their_deviations() {
    let tuples = tuples();
    let mut faults = Vec::new();
    for name in CONFIGURATIONS {
        let (model, side) = configuration(name);
        let setup = setup(model, side);
        let vanishing: Vec<Tuple> = tuples.iter().map(|t| Tuple { drive: 1e-5, ..*t }).collect();
        let limit = at(CPU_F64, 1e-10, &setup, &vanishing);
        let yardstick = at(CPU_F64, 1e-10, &setup, &tuples);
        let exact = evaluate(&setup, REFERENCE.open(&setup), &tuples);
        for (i, (exact, _)) in exact.iter().enumerate().step_by(11) {
            assert!((yardstick[i].0.strain / exact.strain - 1.0).abs() < 1e-9, "{name} {:?}", tuples[i]);
        }
        for place in [CPU, GPU] {
            let found = at(place, 1e-6, &setup, &tuples);
            let (mut worst, mut compared) = ((0.0_f64, 0), 0);
            for (i, ((fast, _), (exact, _))) in found.iter().zip(&yardstick).enumerate() {
                assert!(exact.strain.is_finite(), "{name} {:?}: {}", tuples[i], exact.status);
                let scale = (exact.deviation - limit[i].0.deviation).abs() + 0.02 * theta(&tuples[i]).powi(2);
                let error = (fast.deviation - exact.deviation).abs() / scale;
                compared += 1;
                if error.is_nan() || error > effects_bound(&tuples[i]) {
                    faults.push(format!("{name} {place:?} {:?}: {error:.1e} {}", tuples[i], fast.status));
                }
                if error > worst.0 {
                    worst = (error, i);
                }
            }
            println!(
                "{name}, {place:?}: {compared} compared, worst {:.1e} at {:?}",
                worst.0, tuples[worst.1]
            );
        }
    }
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults[..faults.len().min(20)].join("\n"));
}
