//! Which estimator to believe: the one with the smallest error on distances left out, where the data can tell them apart.

use std::collections::BTreeMap;

use super::side::SideResult;
use crate::estimator::held_out::HeldOut;
use crate::estimator::{ALL, Estimator, PAPER};

/// Squared errors are told apart where their mean difference is larger than so many of its standard errors.
const TOLD_APART: f64 = 2.0;

/// The winner. Candidates are compared on the held-out taps that all of them answer; one that answers less than half of what
/// another does is none. Of those that the data cannot tell apart the preferred one is taken.
pub fn winner(sides: &[SideResult]) -> &'static dyn Estimator {
    let answered = |e: &dyn Estimator| -> usize {
        let on = |s: &SideResult| s.held_out(e).map_or(0, HeldOut::answered);
        sides.iter().map(on).sum()
    };
    let everywhere = |e: &&dyn Estimator| sides.iter().all(|s| s.has(*e));
    let mut known: Vec<&'static dyn Estimator> = ALL.into_iter().filter(everywhere).collect();
    known.sort_by_key(|e| e.preference());
    let most = known.iter().map(|e| answered(*e)).max().unwrap_or(0);
    let candidates: Vec<&dyn Estimator> =
        known.iter().copied().filter(|e| answered(*e) > 0 && 2 * answered(*e) >= most).collect();
    let squares: Vec<BTreeMap<(usize, usize), (f64, f64)>> =
        candidates.iter().map(|e| per_distance(sides, *e, &candidates)).collect();
    let mean = |k: usize| {
        let (sum, n) = squares[k].values().fold((0.0, 0.0), |(s, n), (q, m)| (s + q, n + m));
        sum / n
    };
    let Some(best) = (0..candidates.len()).min_by(|a, b| mean(*a).total_cmp(&mean(*b))) else {
        return known.first().copied().unwrap_or(PAPER);
    };
    let as_good = |k: &usize| *k == best || !worse(&squares[*k], &squares[best]);
    (0..candidates.len()).find(as_good).map_or(candidates[best], |k| candidates[k])
}

/// Sum of squared errors and number of taps at each (side, distance).
fn per_distance(
    sides: &[SideResult],
    estimator: &dyn Estimator,
    candidates: &[&dyn Estimator],
) -> BTreeMap<(usize, usize), (f64, f64)> {
    let mut sums = BTreeMap::new();
    for (k, side) in sides.iter().enumerate() {
        let shared = side.answered_by_all(candidates);
        let Some(held) = side.held_out(estimator) else { continue };
        for cell in &side.cells {
            for tap in cell.taps.iter().filter(|t| shared[**t]) {
                let sum: &mut (f64, f64) = sums.entry((k, cell.i)).or_default();
                *sum = (sum.0 + held.taps[*tap].powi(2), sum.1 + 1.0);
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
