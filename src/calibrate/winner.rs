//! Which estimator to believe: the one with the smallest error on distances left out, where the data can tell them apart.

use std::collections::BTreeMap;

use super::side::SideResult;
use crate::estimator::{ALL, Estimator};

/// Squared errors are told apart where their mean difference is larger than so many of its standard errors.
const TOLD_APART: f64 = 2.0;

/// A candidate whose error is so many times the smallest, on all taps, has no say in which are compared; such a one cannot win.
pub(super) const FAR_WORSE: f64 = 3.0;
/// So many common taps, or half of all, are enough to compare on.
const ENOUGH: usize = 20;

/// The winner. Candidates are compared on the held-out taps that all of them answer, those far worse than the best left out; where these
/// are too few, on all, a tap without an answer counting as an error of half the range. Of those that the data cannot tell apart the
/// preferred one is taken: the fewest numbers first, but what guesses at a whisker that is not `known` last. `None` where no estimator
/// knows anything of distances left out: it answers none, or its error is larger than the range of the distances.
pub fn winner(sides: &[SideResult], known: bool) -> Option<&'static dyn Estimator> {
    let order = |e: &&'static dyn Estimator| (!known && e.needs_whisker(true), e.preference());
    let knows = |s: &SideResult, e: &dyn Estimator| {
        let rms = s.held_out(e).and_then(|h| h.rms(|_| true).0);
        s.has(e) && rms.is_some_and(|rms| rms < 2.0 * unanswered(s))
    };
    let everywhere = |e: &&dyn Estimator| sides.iter().all(|s| knows(s, *e));
    let mut candidates: Vec<&'static dyn Estimator> = ALL.into_iter().filter(everywhere).collect();
    candidates.sort_by_key(order);
    let overall: Vec<f64> = candidates.iter().map(|e| rms(sides, *e)).collect();
    let least = overall.iter().copied().fold(f64::INFINITY, f64::min);
    let near = candidates.iter().zip(&overall).filter(|(_, rms)| **rms <= FAR_WORSE * least);
    let candidates: Vec<&'static dyn Estimator> = near.map(|(e, _)| *e).collect();
    let used: usize = sides.iter().map(|s| s.used).sum();
    let common: usize =
        sides.iter().map(|s| s.answered_by_all(&candidates).iter().filter(|x| **x).count()).sum();
    let shared = common >= ENOUGH || 2 * common >= used;
    let squares: Vec<BTreeMap<(usize, usize), (f64, f64)>> =
        candidates.iter().map(|e| per_distance(sides, *e, &candidates, shared)).collect();
    let mean = |k: usize| {
        let (sum, n) = squares[k].values().fold((0.0, 0.0), |(s, n), (q, m)| (s + q, n + m));
        sum / n
    };
    let best = (0..candidates.len()).min_by(|a, b| mean(*a).total_cmp(&mean(*b)))?;
    let as_good = |k: &usize| {
        *k == best || (mean(*k) <= FAR_WORSE.powi(2) * mean(best) && !worse(&squares[*k], &squares[best]))
    };
    Some((0..candidates.len()).find(as_good).map_or(candidates[best], |k| candidates[k]))
}

/// Half the range of the distances of a side: the error of a tap without an answer, mm.
fn unanswered(side: &SideResult) -> f64 {
    0.5 * (side.record.distances_mm[1] - side.record.distances_mm[0])
}

/// Root mean square error over all used taps.
fn rms(sides: &[SideResult], estimator: &dyn Estimator) -> f64 {
    let all = per_distance(sides, estimator, &[], false);
    let (sum, n) = all.values().fold((0.0, 0.0), |(s, n), (q, m)| (s + q, n + m));
    (sum / n).sqrt()
}

/// Sum of squared errors and number of taps at each (side, distance): of those that all `candidates` answer if `shared`, else of all.
fn per_distance(
    sides: &[SideResult],
    estimator: &dyn Estimator,
    candidates: &[&dyn Estimator],
    shared: bool,
) -> BTreeMap<(usize, usize), (f64, f64)> {
    let mut sums = BTreeMap::new();
    for (k, side) in sides.iter().enumerate() {
        let answered = side.answered_by_all(candidates);
        let Some(held) = side.held_out(estimator) else { continue };
        for cell in &side.cells {
            for tap in cell.taps.iter().filter(|t| !shared || answered[**t]) {
                let error = held.taps[*tap];
                let error = if error.is_finite() { error } else { unanswered(side) };
                let sum: &mut (f64, f64) = sums.entry((k, cell.i)).or_default();
                *sum = (sum.0 + error.powi(2), sum.1 + 1.0);
            }
        }
    }
    sums
}

/// Whether `a` is worse than `b` beyond chance: differences at distances are taken as independent.
fn worse(a: &BTreeMap<(usize, usize), (f64, f64)>, b: &BTreeMap<(usize, usize), (f64, f64)>) -> bool {
    let mut spread = crate::reduce::Spread::default();
    for (key, (sum, n)) in a {
        if let Some((other, _)) = b.get(key) {
            spread.push((sum - other) / n);
        }
    }
    match (spread.mean(), spread.sd()) {
        (Some(mean), Some(sd)) => mean > TOLD_APART * sd / (spread.n as f64).sqrt(),
        (Some(mean), None) => mean > 0.0,
        (None, _) => false,
    }
}
