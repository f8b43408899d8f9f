//! Whole positions that contradict each other: beyond the strongest signal of a drive, signals fall with the distance.

use vibrissa_learned::labels::{CERTAIN, LEAST};

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
        let cells: Vec<_> = cells.iter().filter(|c| c.j == j).collect();
        let strongest = (0..cells.len()).max_by(|&i, &k| cells[i].signal.total_cmp(&cells[k].signal));
        for pair in cells[strongest.unwrap_or(0)..].windows(2) {
            let rise = pair[1].signal - pair[0].signal;
            let deviation = noise * (pair[0].share + pair[1].share).sqrt();
            if rise <= LEAST * pair[0].signal || rise <= CERTAIN * deviation {
                continue;
            }
            let a = [pair[0].i, pair[1].i].map(|i| distances.centres[i]);
            let deviations = rise / deviation;
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
