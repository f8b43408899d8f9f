//! The estimator that answers by default.

use super::side::SideResult;
use crate::estimator::{ALL, Estimator, LEARNED};

/// Distances of a side from which on it shows whether an estimator tells any.
const MANY: usize = 5;
/// Error of a guess of the middle, in ranges of the distances.
const GUESS: f64 = 0.29;
/// Share of the range by which learned is off where another estimator that is off by less than [`FAR`] of that is taken.
const WRONG: f64 = 0.1;
/// See above.
const FAR: f64 = 0.1;
/// Another estimator answers in place of one that guesses where its errors are less than this share of those.
const BETTER: f64 = 1.0 / 3.0;

/// Between the ends of the calibrated distances, mm.
pub fn range(side: &SideResult) -> f64 {
    side.record.distances_mm[1] - side.record.distances_mm[0]
}

/// Learned, unless on a side of many distances it is as wrong as a guess of the middle, or ten times as wrong as another, and another estimator that all
/// sides have is far from that. Who answers less than half of the taps left out knows nothing.
pub fn of(sides: &[SideResult]) -> &'static dyn Estimator {
    let rms = |s: &SideResult, e: &'static dyn Estimator| {
        let (rms, answered) = s.held_out(e).map_or((None, 0), |h| h.rms(|_| true));
        rms.filter(|_| 2 * answered >= s.used).unwrap_or(f64::INFINITY)
    };
    let lost = |s: &&SideResult| {
        let own = rms(s, LEARNED);
        let beaten = || own > WRONG * range(s) && ALL.iter().any(|e| rms(s, *e) < FAR * own);
        s.distances.len() >= MANY && (own > GUESS * range(s) || beaten())
    };
    let Some(side) = sides.iter().find(lost) else { return LEARNED };
    let fit = |e: &&'static dyn Estimator| {
        let on = |s: &SideResult| s.has(*e) && rms(s, *e) < GUESS * range(s);
        sides.iter().all(on) && rms(side, *e) < BETTER * rms(side, LEARNED)
    };
    let total = |e: &'static dyn Estimator| sides.iter().map(|s| rms(s, e) / range(s)).sum::<f64>();
    ALL.into_iter().filter(fit).min_by(|d, e| total(*d).total_cmp(&total(*e))).unwrap_or(LEARNED)
}
