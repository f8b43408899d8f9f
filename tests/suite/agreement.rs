//! Every backend against the same known answers: the cases of another code, of every configuration of model §5, hubs and passive drives
//! included, and random taps of the reference solver. A backend that the machine lacks fails.

use std::sync::LazyLock;

use crate::common::cases::{Kind, Known, evaluate, known, random};
use crate::common::configuration;
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place, REFERENCE};
use vibrissa::evaluate::Outcome;
use vibrissa::kernel::gpu;
use vibrissa::scene::{Precision, Tuple};
use vibrissa::status::Status;

/// Random taps of each kind.
const RANDOM: u32 = 800;

/// Share of the random taps that may remain `not_converged` where the reference has an answer.
const UNSOLVED: f64 = 0.01;

/// What is promised of the strain, relative, without any option (interface: defaults of `--tolerance`).
fn promised(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 1e-8 }
}

/// Errors and where they were met.
#[derive(Debug, Default)]
struct Census(Vec<(f64, String)>);

impl Census {
    fn push(&mut self, error: f64, at: impl FnOnce() -> String) {
        self.0.push((error, at()));
    }

    /// Prints worst, median and place; what exceeds `bound` goes to `faults`.
    fn close(mut self, name: &str, bound: f64, faults: &mut Vec<String>) {
        self.0.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (count, over) =
            (self.0.len(), self.0.iter().filter(|(error, _)| error.is_nan() || *error > bound).count());
        let (Some(median), Some((worst, at))) = (self.0.get(count / 2), self.0.last()) else {
            return faults.push(format!("{name}: nothing was compared"));
        };
        println!("{name:24} {count:4} compared, worst {worst:.1e}, median {:.1e}; worst: {at}", median.0);
        if over > 0 {
            faults.push(format!("{name}: {over} of {count} exceed {bound:.0e}, worst {worst:.2e} at {at}"));
        }
    }
}

/// Fails with all `faults`.
#[track_caller]
fn none(faults: &[String]) {
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn relative(value: f64, expected: f64) -> f64 {
    if value == expected { 0.0 } else { ((value - expected) / expected).abs() }
}

/// The cases of another code: strain; of Hooke's rod, to which the reference is held here, also force and arc.
fn agrees_with_another_code(place: Place) {
    let mut faults = Vec::new();
    let known = |kind: Kind| known(kind).into_iter().map(move |(name, rows)| (kind, name, rows));
    for (kind, name, mut known) in Kind::ALL.into_iter().flat_map(known) {
        let hooke = name == "hooke";
        if place.backend == REFERENCE.backend && !hooke {
            continue;
        }
        if place.precision == Precision::F64 && place.backend == GPU_F64.backend && !hooke {
            // Double precision is slow in software.
            let mut at = 0..;
            known.retain(|_| at.next().is_some_and(|k| k % 2 == 0));
        }
        let mut setup = kind.setup();
        (setup.model, setup.gauge.side) = configuration(&name);
        let tuples: Vec<Tuple> = known.iter().map(|k| k.tuple).collect();
        let solved = evaluate(&setup, place.open(&setup), &tuples);
        let mut census = [Census::default(), Census::default(), Census::default()];
        for (Known { line, strain, force, arc, .. }, (found, _)) in known.iter().zip(&solved) {
            assert!(!hooke || found.status.counts(), "{kind:?} line {line}: {}", found.status);
            let pairs = [(found.strain, *strain), (found.normal_force, *force), (found.arc, *arc)];
            for (census, (value, expected)) in census.iter_mut().zip(pairs) {
                census.push(relative(value, expected), || format!("line {line}"));
            }
        }
        let bound = promised(place) * if hooke || place.precision == Precision::F32 { 1.0 } else { 2.0 };
        for (census, quantity) in
            census.into_iter().zip(["strain", "force", "arc"]).take(if hooke { 3 } else { 1 })
        {
            census.close(&format!("{kind:?} {name}, {quantity}"), bound, &mut faults);
        }
    }
    none(&faults);
}

/// Random tuples of one kind and what the reference makes of them.
struct Sample {
    kind: Kind,
    tuples: Vec<Tuple>,
    answers: Vec<(Outcome, f64)>,
}

static SAMPLES: LazyLock<[Sample; 3]> = LazyLock::new(|| {
    Kind::ALL.map(|kind| {
        let tuples = random(kind, RANDOM);
        let answers = evaluate(&kind.setup(), REFERENCE.open(&kind.setup()), &tuples);
        Sample { kind, tuples, answers }
    })
});

/// Random taps: strain as the tolerance is defined, force and arc relative; none is solved that has no answer.
fn agrees_with_the_reference(place: Place) {
    let mut faults = Vec::new();
    for Sample { kind, tuples, answers } in &*SAMPLES {
        let solved = evaluate(&kind.setup(), place.open(&kind.setup()), tuples);
        let mut census = [Census::default(), Census::default(), Census::default()];
        let (mut unsolved, mut beyond) = (0, 0);
        for (i, ((found, _), (expected, least))) in solved.iter().zip(answers).enumerate() {
            let at = || format!("{kind:?} tap {i}: {:?}", tuples[i]);
            if expected.status.has(Status::NOT_CONVERGED) {
                beyond += 1;
                if !found.status.has(Status::NOT_CONVERGED) {
                    faults.push(format!("no equilibrium, yet {}: {}", found.status, at()));
                }
                continue;
            }
            if found.status.has(Status::NOT_CONVERGED) {
                unsolved += 1;
                println!("not_converged: {}", at());
                continue;
            }
            let edge = Status::SLIPPED_OFF | Status::STRAIN_LIMIT;
            if !(found.status | expected.status).has(edge) && found.status != expected.status {
                faults.push(format!("{} instead of {}: {}", found.status, expected.status, at()));
            }
            let strain = (found.strain - expected.strain).abs() / expected.strain.abs().max(*least);
            census[0].push(strain, at);
            census[1].push(relative(found.normal_force, expected.normal_force), at);
            census[2].push(relative(found.arc, expected.arc), at);
        }
        println!("{kind:?}: {unsolved} of {} not converged, {beyond} without equilibrium", tuples.len());
        if f64::from(unsolved) > UNSOLVED * tuples.len() as f64 {
            faults.push(format!("{unsolved} {kind:?} taps are not solved"));
        }
        for (census, quantity) in census.into_iter().zip(["strain", "force", "arc"]) {
            census.close(&format!("random {kind:?}, {quantity}"), promised(place), &mut faults);
        }
    }
    none(&faults);
}

macro_rules! backends {
    ($($name:ident: $place:expr;)*) => {$(
        mod $name {
            use super::*;

            #[test]
            fn agrees_with_another_code() {
                super::agrees_with_another_code($place);
            }

            #[test]
            fn agrees_with_the_reference() {
                super::agrees_with_the_reference($place);
            }
        }
    )*};
}

backends! {
    reference: REFERENCE;
    cpu_f32: CPU;
    cpu_f64: CPU_F64;
    gpu_f32: GPU;
}

/// On the first adapter that has f64 in its shaders; lavapipe is one, so a machine that tests has one.
#[test]
fn gpu_f64_agrees() {
    let adapters = gpu::adapters();
    let names: Vec<&str> = adapters.iter().map(|a| a.name.as_str()).collect();
    let first = adapters.first().is_some_and(|a| a.f64);
    assert!(
        first,
        "the adapter that is taken has no f64 in its shaders: {names:?} (Debian: apt install mesa-vulkan-drivers)"
    );
    agrees_with_another_code(GPU_F64);
    agrees_with_the_reference(GPU_F64);
}
