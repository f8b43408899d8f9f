//! Every configuration of model §5 on every fast backend: the cases of another code, hubs and passive drives included. A
//! backend that the machine lacks fails.

use crate::common::cases::{Kind, evaluate, known};
use crate::common::configuration;
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place};
use vibrissa::scene::{Precision, Tuple};

/// Bound on the strain at the default tolerance.
fn bound(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 2e-8 }
}

fn agrees(place: Place) {
    let mut faults = Vec::new();
    for kind in Kind::ALL {
        for (name, mut rows) in known(kind) {
            if place.precision == Precision::F64 && place.backend == GPU_F64.backend {
                // Double precision is slow in software.
                let mut at = 0..;
                rows.retain(|_| at.next().is_some_and(|k| k % 2 == 0));
            }
            let (model, side) = configuration(&name);
            let mut setup = kind.setup();
            (setup.model, setup.gauge.side) = (model, side);
            let tuples: Vec<Tuple> = rows.iter().map(|case| case.tuple).collect();
            let solved = evaluate(&setup, place.open(&setup), &tuples);
            let sweeps = solved.iter().map(|(o, _)| f64::from(o.sweeps)).sum::<f64>() / rows.len() as f64;
            let worst = rows
                .iter()
                .zip(&solved)
                .map(|(case, (o, _))| ((o.strain / case.strain - 1.0).abs(), case.line))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .expect("a case");
            println!(
                "{place:?} {kind:?} {name}: worst {:.1e} on line {}, sweeps {sweeps:.1}",
                worst.0, worst.1
            );
            if worst.0.is_nan() || worst.0 > bound(place) {
                faults.push(format!("{kind:?} {name}: {worst:?}"));
            }
        }
    }
    assert!(faults.is_empty(), "{place:?}:\n{}", faults.join("\n"));
}

#[test]
fn cpu_f32_agrees() {
    agrees(CPU);
}

#[test]
fn cpu_f64_agrees() {
    agrees(CPU_F64);
}

#[test]
fn gpu_f32_agrees() {
    agrees(GPU);
}

#[test]
fn gpu_f64_agrees() {
    agrees(GPU_F64);
}
