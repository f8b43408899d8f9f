//! Rows that were once wrong: tests/data/told.txt has their answers.

use super::*;
use crate::common::{ROOT, pool, specs};
use vibrissa::scene::RunOptions;

/// CPU precisions and tolerances to test in addition to the defaults.
const LOOSE: [(Precision, f64); 3] = [(Precision::F32, 3e-6), (Precision::F32, 1e-6), (Precision::F64, 1e-5)];

/// Each backend within its tolerance; the reference within 1e-9.
#[test]
fn rows_that_once_lied_are_told() {
    let table = std::fs::read_to_string(format!("{ROOT}/tests/data/told.txt")).expect("the table");
    let mut faults = Vec::new();
    for row in table.lines().filter(|row| !row.starts_with('#')) {
        let fields: Vec<&str> = row.split(" | ").collect();
        let [whisker, gauge, tap, model, told, more] = fields[..] else { panic!("six fields: {row}") };
        let text = format!("[whisker]\n{whisker}\n[gauge]\n{gauge}\n[tap]\n{tap}\n[model]\n{model}\n");
        let study = specs::parse(&text.replace(" / ", "\n")).unwrap_or_else(|e| panic!("{e}: {row}")).study;
        let (setup, tuple) = (&study.setup, study.space.layout().expect("axes").tuple(0));
        let exact = outcomes(setup, REFERENCE, &[tuple])[0];
        let strain = if told == "reference" { exact.strain } else { told.parse().unwrap_or(f64::NAN) };
        let mut check = |name: String, outcome: Outcome, bound: f64| {
            let error = (outcome.strain - strain).abs() / strain.abs();
            let told = match strain.is_nan() {
                true => outcome.status.to_string() == told,
                false => error <= bound && outcome.status.counts() && outcome.deviation.is_finite(),
            };
            if !told {
                faults.push(format!("{name}: {} {}, {error:.1e}: {row}", outcome.strain, outcome.status));
            }
        };
        for place in ALL {
            let found = outcomes(setup, place, &[tuple])[0];
            check(format!("{place:?}"), found, if place == REFERENCE { 1e-9 } else { bound(place) });
        }
        for &(precision, tolerance) in LOOSE.iter().filter(|_| more == "loose") {
            let options = RunOptions {
                backend: Some(CPU.backend),
                precision: Some(precision),
                tolerance: Some(tolerance),
                ..RunOptions::default()
            };
            let choice = pool::choice(&options).expect("the CPU");
            let method = choice.open(&setup.model).expect("kernels");
            check(
                format!("{precision:?} at {tolerance:e}"),
                evaluate(setup, method, &[tuple])[0].0,
                tolerance,
            );
        }
    }
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults.join("\n"));
}
