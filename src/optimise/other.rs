//! What the best design would be worth to another estimator: at its own drive, and at the drive that suits that estimator best.

use super::evaluate::Scorer;
use super::report::{Design, unit};
use super::score::{Goal, Score};
use crate::error::Error;
use crate::evaluate::Method;
use crate::plan::Layout;
use crate::scene::search::{Quantity, Search};
use crate::scene::{Column, Setup, Theory, Tuple};

/// Drives looked at first, with the nominal whisker alone, and how far on either side of the best of them the best of all samples is sought.
const FIRST: (usize, usize) = (65, 4);
/// Drives looked at then, and again between the neighbours of the best, so many times.
const NEXT: (usize, u32) = (9, 5);

/// The best design where distances are told in another way.
#[derive(Debug)]
pub struct Other {
    /// By what.
    pub theory: Theory,
    /// At the drive that was found.
    pub here: Design,
    /// At the best of the drives that were searched or listed; `None` where there is but one, or none that keeps the limits.
    pub best: Option<Design>,
}

/// Judges the whisker of `point` by the other estimator.
pub(super) fn judge(
    (setup, layout): (&Setup, &Layout),
    search: &Search,
    method: Method,
    (point, goal): (&Tuple, Goal),
) -> Result<Other, Error> {
    let theory = setup.estimate.theory.compared();
    let mut setup = setup.clone();
    setup.estimate.theory = theory;
    let mut scorer = Scorer::new(&setup, layout, search, method).leaving();
    let mut best: Option<Tuple> = None;
    if let Some(v) = search.variables.iter().find(|v| v.quantity == Quantity::Column(Column::Drive)) {
        let between = |ends: [f64; 2], n: usize| -> Vec<f64> {
            let share = |i: usize| i as f64 / (n - 1) as f64;
            (0..n).map(|i| ends[0] * (ends[1] / ends[0]).powf(share(i))).collect()
        };
        let around = |drives: &[f64], at: usize, by: usize| {
            [drives[at.saturating_sub(by)], drives[(at + by).min(drives.len() - 1)]]
        };
        let drives = between([v.min, v.max], FIRST.0);
        let scores = scorer.nominal(&taps(point, &drives))?;
        let mut ends = least(&scores, goal).map(|at| around(&drives, at, FIRST.1));
        for _ in 0..NEXT.1 {
            let Some(these) = ends else { break };
            let drives = between(these, NEXT.0);
            let scores = scorer.scores(&taps(point, &drives))?;
            let at = least(&scores, goal);
            best = at.map(|at| Tuple { drive: drives[at], ..*point }).or(best);
            ends = at.map(|at| around(&drives, at, 1));
        }
    } else if layout.n_drives > 1 {
        let drives: Vec<f64> = (0..layout.n_drives).map(|j| layout.drive(point, j)).collect();
        let scores = scorer.scores(&taps(point, &drives))?;
        best = least(&scores, goal).map(|at| Tuple { drive: drives[at], ..*point });
    }
    let mut design = |point: Tuple| -> Result<Design, Error> {
        let score = scorer.scores(&[point])?[0];
        Ok(Design { point, row: scorer.row(&point)?, score, unit: unit(&setup, &point) })
    };
    Ok(Other { theory, here: design(*point)?, best: best.map(design).transpose()? })
}

/// The whisker of `point` at each of `drives`.
fn taps(point: &Tuple, drives: &[f64]) -> Vec<Tuple> {
    drives.iter().map(|&drive| Tuple { drive, ..*point }).collect()
}

/// Place of the best of `scores`; `None` where none keeps the limits.
fn least(scores: &[Score], goal: Goal) -> Option<usize> {
    let allowed = (0..scores.len()).filter(|&i| goal.feasible(&scores[i]));
    allowed.min_by(|&i, &j| goal.value(&scores[i]).total_cmp(&goal.value(&scores[j])))
}
