//! Coverage of σ: errors at positions and in runs left out, relative to the σ of the answer.

use std::collections::BTreeSet;

use rayon::prelude::*;
use serde::Serialize;

use super::Calibrated;
use crate::estimator::{Answers, Estimator, Known, learned::Learnt};

/// Share of the errors at one position within 1 σ and beyond 3 σ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Side: contact or far.
    pub side: &'static str,
    /// Position, mm.
    pub a_mm: f64,
    /// Number of taps with an answer.
    pub n: usize,
    /// Root mean square error, mm.
    pub rms_mm: f64,
    /// Share within 1 σ.
    pub within_1: f64,
    /// 95 % binomial interval of that share (Wilson 1927).
    pub interval: [f64; 2],
    /// Share beyond 3 σ.
    pub beyond_3: f64,
}

impl Coverage {
    pub(super) fn new(side: &'static str, a_mm: f64, errors: &[[f64; 2]]) -> Self {
        let n = errors.len() as f64;
        let share =
            |f: &dyn Fn(f64) -> bool| errors.iter().filter(|[e, s]| f((e / s).abs())).count() as f64 / n;
        let rms_mm = (errors.iter().map(|e| e[0] * e[0]).sum::<f64>() / n).sqrt();
        let (p, z2) = (share(&|r| r <= 1.0), 1.96f64 * 1.96);
        let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = (p * (1.0 - p) * z2 / n + z2 * z2 / (4.0 * n * n)).sqrt() / (1.0 + z2 / n);
        let interval = [(middle - half).max(0.0), (middle + half).min(1.0)];
        Self { side, a_mm, n: errors.len(), rms_mm, within_1: p, interval, beyond_3: share(&|r| r > 3.0) }
    }
}

/// Coverage of `learned`.
#[derive(Debug, Clone, PartialEq)]
pub struct Covered {
    /// At each position, left out whole.
    pub positions: Vec<Coverage>,
    /// Over all positions; `None` without answers.
    pub all: Option<Coverage>,
    /// Over all runs, each left out whole; `None` for a single run.
    pub runs: Option<Coverage>,
}

/// Coverage on positions and runs left out.
pub fn coverage(found: &Calibrated) -> Covered {
    let (mut positions, mut all, mut of_runs) = (Vec::new(), Vec::new(), Vec::new());
    for side in &found.sides {
        if let Some(held) = side.held_out(Estimator::Learned) {
            for (i, a) in side.table.distances.centres.iter().enumerate() {
                let taps = side.table.cells.iter().filter(|c| c.i == i).flat_map(|c| &c.taps);
                let errors = taps.map(|k| held.taps[*k]).filter(|e| e[1].is_finite()).collect::<Vec<_>>();
                if !errors.is_empty() {
                    positions.push(Coverage::new(side.name(), *a, &errors));
                    all.extend(errors);
                }
            }
        }
        of_runs.extend(runs(found, &side.learnt));
    }
    let over = |errors: &[[f64; 2]]| (!errors.is_empty()).then(|| Coverage::new("", f64::NAN, errors));
    Covered { positions, all: over(&all), runs: over(&of_runs) }
}

fn runs(found: &Calibrated, learnt: &Learnt) -> Vec<[f64; 2]> {
    let numbers: BTreeSet<usize> = learnt.task.rows.iter().map(|r| r.run).collect();
    if numbers.len() < 2 {
        return Vec::new();
    }
    let without = |run: &usize| {
        let (gone, left): (Vec<usize>, Vec<usize>) =
            learnt.places.iter().partition(|k| learnt.task.rows[**k].run == *run);
        let drives: Vec<f64> = gone.iter().filter_map(|k| Some(found.taps[learnt.taps[*k]?].drive)).collect();
        let Some(answers) = learnt.without(&left, &drives) else { return Vec::new() };
        let of = |k: usize| {
            let tap = &found.taps[learnt.taps[k]?];
            let known = Known { share: tap.zero_share(), same_run: false };
            let at = answers.find(tap.drive, learnt.sign * tap.signal, known).ok()?;
            Some([at.a - tap.a, at.sigma])
        };
        gone.into_iter().filter_map(of).collect::<Vec<_>>()
    };
    numbers.par_iter().flat_map(without).collect()
}
