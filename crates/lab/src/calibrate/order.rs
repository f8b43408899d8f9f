//! Positions in the wrong order (beyond the peak of a drive, signals fall with the distance), and the choice of the estimator.

use serde::Serialize;
use vibrissa_learned::labels::rises;

use super::side::SideResult;
use crate::estimator::Estimator;
use crate::estimator::taps::Cell;
use crate::measure::group::Groups;

/// Two neighbouring positions, one of which is mislabelled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contradiction {
    #[serde(rename = "a_mm")]
    pub a: [f64; 2],
    /// Number of drives at which their signals are in the wrong order.
    pub drives: usize,
    /// Largest deviation over these drives, in standard deviations.
    pub deviations: f64,
}

/// Contradictions among the positions of `cells`; `noise` is that of a single reading. The data do not show which of two positions is wrong.
pub fn contradictions(cells: &[Cell], [distances, drives]: [&Groups; 2], noise: f64) -> Vec<Contradiction> {
    let mut found: Vec<Contradiction> = Vec::new();
    for j in 0..drives.len() {
        let cells: Vec<&Cell> = cells.iter().filter(|c| c.j == j).collect();
        let deviation = |c: &&Cell, d: &&Cell| noise * (c.share + d.share).sqrt();
        for (k, deviations) in rises(&cells, |c| c.signal, deviation) {
            let a = [k, k + 1].map(|k| distances.centres[cells[k].i]);
            match found.iter_mut().find(|c| c.a == a) {
                Some(c) => (c.drives, c.deviations) = (c.drives + 1, c.deviations.max(deviations)),
                None => found.push(Contradiction { a, drives: 1, deviations }),
            }
        }
    }
    found
}

/// Least rise of a signal that counts as growing, in standard deviations.
const SURE: f64 = 6.0;
const FEWEST: usize = 3;

/// Number of drives with a signal that grows with the distance against the theory (unknown whisker: away from its gauge), and of drives compared.
pub fn growing(cells: &[Cell], drives: usize, noise: f64, known: bool) -> [usize; 2] {
    let mut found = [0; 2];
    for j in 0..drives {
        let mut cells: Vec<&Cell> = cells.iter().filter(|c| c.j == j).collect();
        cells.sort_by(|c, d| c.a.total_cmp(&d.a));
        let (Some(near), Some(far)) = (cells.first(), cells.last()) else { continue };
        if cells.len() < FEWEST {
            continue;
        }
        let sd = noise * (near.share + far.share).sqrt();
        let grows = far.signal - near.signal > SURE * sd && (!known || far.linear < near.linear);
        let between = cells.iter().all(|c| c.signal >= near.signal && c.signal <= far.signal);
        found = [found[0] + usize::from(grows && between), found[1] + 1];
    }
    found
}

const MANY: usize = 5;
/// Error of always answering the middle, as a share of the range.
const GUESS: f64 = 0.29;
/// `learned` loses with an error above this share of the range if another estimator has less than [`FAR`] of that error.
const WRONG: f64 = 0.1;
const FAR: f64 = 0.1;
/// The winner's error must be below this share of that of `learned`.
const BETTER: f64 = 1.0 / 3.0;

pub fn range(side: &SideResult) -> f64 {
    side.record.distances_mm[1] - side.record.distances_mm[0]
}

/// `learned`, unless on a side it fails and an estimator of all sides is much better. Estimators that answer less than half of the taps do not count.
pub fn of(sides: &[SideResult]) -> Estimator {
    let rms = |s: &SideResult, e: Estimator| {
        let (rms, answered) = s.rms(e);
        rms.filter(|_| 2 * answered >= s.used).unwrap_or(f64::INFINITY)
    };
    let lost = |s: &&SideResult| {
        let own = rms(s, Estimator::Learned);
        let beaten = || own > WRONG * range(s) && Estimator::ALL.iter().any(|e| rms(s, *e) < FAR * own);
        s.table.distances.len() >= MANY && (own > GUESS * range(s) || beaten())
    };
    let Some(side) = sides.iter().find(lost) else { return Estimator::Learned };
    let fit = |e: &Estimator| {
        let on = |s: &SideResult| s.has(*e) && rms(s, *e) < GUESS * range(s);
        sides.iter().all(on) && rms(side, *e) < BETTER * rms(side, Estimator::Learned)
    };
    let total = |e: Estimator| sides.iter().map(|s| rms(s, e) / range(s)).sum::<f64>();
    let best = Estimator::ALL.into_iter().filter(fit).min_by(|d, e| total(*d).total_cmp(&total(*e)));
    best.unwrap_or(Estimator::Learned)
}
