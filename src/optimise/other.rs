//! What the best design would be worth to another estimator: at its own drive, and at the drive that suits that estimator best.

use super::evaluate::Scorer;
use super::run::{Design, unit};
use super::score::Goal;
use crate::error::Error;
use crate::evaluate::Method;
use crate::plan::Layout;
use crate::scene::search::Search;
use crate::scene::{Column, Setup, Theory, Tuple};

/// Drives looked at first, and then between the neighbours of the best, so many times.
const LOOKS: ([usize; 2], u32) = ([65, 17], 4);

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
    let mut scorer = Scorer::new(&setup, layout, search, method);
    let mut best: Option<Tuple> = None;
    if let Some(v) = search.variables.iter().find(|v| v.column == Column::Drive) {
        let ([first, next], rounds) = LOOKS;
        let (mut ends, mut n) = ([v.min, v.max], first);
        for _ in 0..=rounds {
            let share = |i: usize| i as f64 / (n - 1) as f64;
            let drives: Vec<f64> = (0..n).map(|i| ends[0] * (ends[1] / ends[0]).powf(share(i))).collect();
            let Some(at) = least(&mut scorer, point, &drives, goal)? else { break };
            best = Some(Tuple { drive: drives[at], ..*point });
            (ends, n) = ([drives[at.saturating_sub(1)], drives[(at + 1).min(n - 1)]], next);
        }
    } else if layout.n_drives > 1 {
        let drives: Vec<f64> = (0..layout.n_drives).map(|j| layout.drive(point, j)).collect();
        best = least(&mut scorer, point, &drives, goal)?.map(|at| Tuple { drive: drives[at], ..*point });
    }
    let mut design = |point: Tuple| -> Result<Design, Error> {
        let score = scorer.scores(&[point])?[0];
        Ok(Design { point, row: scorer.row(&point)?, score, unit: unit(&setup, &point) })
    };
    Ok(Other { theory, here: design(*point)?, best: best.map(design).transpose()? })
}

/// Place of the best of `drives`; `None` where none keeps the limits.
fn least(scorer: &mut Scorer<'_>, point: &Tuple, drives: &[f64], goal: Goal) -> Result<Option<usize>, Error> {
    let points: Vec<Tuple> = drives.iter().map(|&drive| Tuple { drive, ..*point }).collect();
    let scores = scorer.scores(&points)?;
    let allowed = (0..points.len()).filter(|&i| goal.feasible(&scores[i]));
    Ok(allowed.min_by(|&i, &j| goal.value(&scores[i]).total_cmp(&goal.value(&scores[j]))))
}
