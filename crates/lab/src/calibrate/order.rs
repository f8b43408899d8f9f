//! Whole positions that contradict each other: beyond the strongest signal of a drive, signals fall with the distance.

use serde::Serialize;
use vibrissa_learned::labels::rises;

use super::side::SideResult;
use crate::estimator::Estimator;
use crate::estimator::cells::{Cell, Levels};

/// Two neighbouring positions of which one is not what its label says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contradiction {
    /// The two distances, mm.
    #[serde(rename = "a_mm")]
    pub a: [f64; 2],
    /// Number of drives at which their signals are in the wrong order.
    pub drives: usize,
    /// By how many standard deviations at most.
    pub deviations: f64,
}

/// Contradictions among the positions of `cells`, whose single readings scatter by `noise`. Which of two is wrong the data do not say.
pub fn contradictions(cells: &[Cell], [distances, drives]: [&Levels; 2], noise: f64) -> Vec<Contradiction> {
    let mut found: Vec<Contradiction> = Vec::new();
    for j in 0..drives.len() {
        let cells: Vec<&Cell> = cells.iter().filter(|c| c.j == j).collect();
        let deviation = |c: &&Cell, d: &&Cell| noise * (c.share + d.share).sqrt();
        for (k, deviations) in rises(&cells, |c| c.signal, deviation) {
            let a = [k, k + 1].map(|k| distances.centres[cells[k].i]);
            match found.iter_mut().find(|c| c.a == a) {
                Some(c) => {
                    *c =
                        Contradiction { drives: c.drives + 1, deviations: c.deviations.max(deviations), ..*c }
                }
                None => found.push(Contradiction { a, drives: 1, deviations }),
            }
        }
    }
    found
}

/// Least rise of a signal that counts as growing, in standard deviations.
const SURE: f64 = 6.0;
/// Fewest distances of a drive that are compared.
const FEWEST: usize = 3;

/// At how many drives the farthest of `cells` gives the strongest signal and the nearest the weakest, where the theory expects (or, of a whisker that is
/// not `known`, would expect away from its gauge) the opposite; and at how many there are distances enough to say so.
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

/// Fewest distances of a side on which an estimator is judged.
const MANY: usize = 5;
/// Error of guessing the middle, as a share of the range of distances.
const GUESS: f64 = 0.29;
/// `learned` loses with an error above this share of the range, if another estimator has less than [`FAR`] of that error.
const WRONG: f64 = 0.1;
/// See above.
const FAR: f64 = 0.1;
/// The error of the winner must be below this share of that of `learned`.
const BETTER: f64 = 1.0 / 3.0;

/// Between the ends of the calibrated distances, mm.
pub fn range(side: &SideResult) -> f64 {
    side.record.distances_mm[1] - side.record.distances_mm[0]
}

/// Learned, unless on a side of many distances it is as wrong as a guess of the middle, or ten times as wrong as another, and another estimator that all
/// sides have is far from that. Who answers less than half of the taps left out knows nothing.
pub fn of(sides: &[SideResult]) -> Estimator {
    let rms = |s: &SideResult, e: Estimator| {
        let (rms, answered) = s.held_out(e).map_or((None, 0), |h| h.rms(|_| true));
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
    Estimator::ALL
        .into_iter()
        .filter(fit)
        .min_by(|d, e| total(*d).total_cmp(&total(*e)))
        .unwrap_or(Estimator::Learned)
}
