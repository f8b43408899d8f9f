//! Hard cases, invariances and single precision of the fast kernels on every backend. A backend that the machine lacks fails the test.

use crate::common;

mod agreeing;
mod invariance;
mod limits;
mod single_precision;
mod told;

use crate::common::CONFIGURATIONS;
use crate::common::cases::{Kind, evaluate};
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place, REFERENCE};
use vibrissa::evaluate::Outcome;
use vibrissa::scene::model::{Contact, Material, Model, Side};
use vibrissa::scene::{Precision, Setup, Tuple};

const FAST: [Place; 4] = [CPU, CPU_F64, GPU, GPU_F64];

const ALL: [Place; 5] = [CPU, CPU_F64, GPU, GPU_F64, REFERENCE];

/// Allowed strain error at the default tolerance, relative to max(|ε|, 1e-3 θ f_max).
fn bound(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 2e-8 }
}

fn setup(model: Model, side: Side) -> Setup {
    let mut setup = Kind::Tap.setup();
    (setup.model, setup.gauge.side) = (model, side);
    setup
}

fn tuple(d: f64, a: f64, degrees: f64) -> Tuple {
    Tuple { D: 10.0, d, L_a: 50.0, x_ss: 5.0, l: 2.0, a, drive: degrees, ..Tuple::default() }
}

fn grid(tips: &[f64], distances: &[f64], angles: &[f64]) -> Vec<Tuple> {
    let mut all = Vec::new();
    for &d in tips {
        for &a in distances {
            all.extend(angles.iter().map(|&degrees| tuple(d, a, degrees)));
        }
    }
    all
}

fn outcomes(setup: &Setup, place: Place, tuples: &[Tuple]) -> Vec<Outcome> {
    evaluate(setup, place.open(setup), tuples).into_iter().map(|(outcome, _)| outcome).collect()
}

/// Compares every backend with the reference: same status; strain within its bound, P and arc within five times that, or all without a value.
/// Returns the outcomes of the reference.
#[track_caller]
fn agree(name: &str, setup: &Setup, tuples: &[Tuple]) -> Vec<Outcome> {
    agree_on(&FAST, name, setup, tuples)
}

#[track_caller]
fn agree_on(places: &[Place], name: &str, setup: &Setup, tuples: &[Tuple]) -> Vec<Outcome> {
    assert!(!tuples.is_empty());
    let exact = evaluate(setup, REFERENCE.open(setup), tuples);
    let mut faults = Vec::new();
    for &place in places {
        let found = evaluate(setup, place.open(setup), tuples);
        let (mut worst, mut compared) = (0.0_f64, 0);
        for (i, ((fast, _), (exact, least))) in found.iter().zip(&exact).enumerate() {
            let mut fault = |what: String| faults.push(format!("{place:?} {:?}: {what}", tuples[i]));
            if fast.status != exact.status {
                fault(format!("{} instead of {}", fast.status, exact.status));
                continue;
            }
            if !exact.strain.is_finite() {
                if fast.strain.is_finite() || fast.deviation.is_finite() || fast.normal_force.is_finite() {
                    fault(format!("a value with {}", fast.status));
                }
                continue;
            }
            compared += 1;
            let scale = exact.strain.abs().max(*least);
            let error = if scale > 0.0 { (fast.strain - exact.strain).abs() / scale } else { 0.0 };
            if error.is_nan() || error > bound(place) {
                fault(format!("strain {} instead of {}: {error:.1e}", fast.strain, exact.strain));
            }
            worst = worst.max(error);
            let forces = exact.normal_force.abs().max(exact.tangential_force.abs());
            let pairs =
                [(fast.normal_force, exact.normal_force), (fast.tangential_force, exact.tangential_force)];
            let pairs = pairs.map(|(value, expected)| (value, expected, forces));
            for (value, expected, scale) in pairs.into_iter().chain([(fast.arc, exact.arc, exact.arc)]) {
                let error = (value - expected).abs();
                if error.is_nan() || error > 5.0 * bound(place) * scale {
                    fault(format!("force or arc {value} instead of {expected}"));
                }
            }
            if fast.sticking != exact.sticking {
                fault(format!("sticks {} instead of {}", fast.sticking, exact.sticking));
            }
        }
        println!("{name}, {place:?}: {compared} of {} compared, worst {worst:.1e}", tuples.len());
    }
    let some = faults[..faults.len().min(20)].join("\n");
    assert!(faults.is_empty(), "{name}: {} faults\n{some}", faults.len());
    exact.into_iter().map(|(outcome, _)| outcome).collect()
}

fn rubber(contact: Contact) -> Model {
    Model { contact, ..common::all_effects(Material::NeoHookean(3.2)) }
}
