//! The estimator that answers by default.

use super::side::SideResult;
use crate::estimator::{ALL, Estimator, LEARNED};

/// Distances of a side from which on it shows whether an estimator tells any.
const MANY: usize = 5;
/// Error of a guess of the middle, in ranges of the distances.
const GUESS: f64 = 0.29;
/// Another estimator answers in place of one that guesses where its errors are less than this share of those.
const BETTER: f64 = 1.0 / 3.0;

/// Between the ends of the calibrated distances, mm.
pub fn range(side: &SideResult) -> f64 {
    side.record.distances_mm[1] - side.record.distances_mm[0]
}

/// Learned, unless on a side of many distances it is as wrong as a guess of the middle, and another estimator that all sides have is far from that.
pub fn of(sides: &[SideResult]) -> &'static dyn Estimator {
    let rms = |s: &SideResult, e: &'static dyn Estimator| {
        s.held_out(e).and_then(|h| h.rms(|_| true).0).unwrap_or(f64::INFINITY)
    };
    let lost = |s: &&SideResult| s.distances.len() >= MANY && rms(s, LEARNED) > GUESS * range(s);
    let Some(side) = sides.iter().find(lost) else { return LEARNED };
    let fit = |e: &&'static dyn Estimator| {
        let on = |s: &SideResult| s.has(*e) && rms(s, *e) < GUESS * range(s);
        sides.iter().all(on) && rms(side, *e) < BETTER * rms(side, LEARNED)
    };
    let total = |e: &'static dyn Estimator| sides.iter().map(|s| rms(s, e) / range(s)).sum::<f64>();
    ALL.into_iter().filter(fit).min_by(|d, e| total(*d).total_cmp(&total(*e))).unwrap_or(LEARNED)
}
