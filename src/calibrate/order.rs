//! Whole positions that contradict each other: beyond the strongest signal of a drive, signals fall with the distance.

use vibrissa_learned::labels::rises;

use crate::estimator::cells::{Cell, Levels};

/// Two neighbouring positions of which one is not what its label says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// The two distances, mm.
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
