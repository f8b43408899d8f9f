//! The best tap angle, also by a reduced model (`--model-error`).

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{Report, TapAsked, find_by};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::census::sample::{Row, choosing_in};
use crate::chart::ranges::Wanted;
use crate::error::Error;
use crate::optimise::run::no_axes;
use crate::progress::{Progress, go_on};
use crate::scene::search::Objective;
use crate::scene::{Study, Tuple};

/// With `bound`, effects are left off whose joint change of strain stays within it: over the interval, at the optima, and where the status changes.
/// Errors: several whiskers, or a tuple file; no complete row; no drive within the strain limit; a failing backend; `stop`.
pub fn find(
    study: &Study,
    ends: [f64; 2],
    objective: Objective,
    choice: &Choice,
    (bound, stop, progress): (Option<f64>, &AtomicBool, &mut dyn Progress),
) -> Result<Report, Error> {
    let asked = TapAsked { ends, objective, choice, needed: None, stop };
    let Some(bound) = bound else { return find_by(study, asked, progress) };
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let (mut needed, mut study) = (needed(study, ends, bound)?, study.clone());
    let (whisker, n) = (layout.stroke(&layout.design(0), 0), layout.n_distances);
    let distances: Arc<[f64]> = (0..n).map(|i| layout.distance(i)).collect();
    loop {
        study.setup = needed.setup.clone();
        let report = match find_by(&study, TapAsked { needed: Some(&needed), ..asked }, &mut *progress) {
            Err(Error::Input(_)) if !needed.left().is_empty() => {
                needed.give_up();
                continue;
            }
            found => found?,
        };
        let row = |drive| Row::new(Tuple { drive, ..whisker }, distances.clone());
        let rows: Vec<Row> = report.turns().into_iter().map(row).collect();
        if needed.keeps(&rows, true, &|| Ok(go_on(stop)?))? {
            let model_error = Some((needed.summary(), needed.sentence()));
            return Ok(Report { model_error, ..report });
        }
    }
}

pub fn needed(study: &Study, ends: [f64; 2], bound: f64) -> Result<Needed, Error> {
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let wanted = Wanted { drive: ends, ..Wanted::of(&layout) };
    Needed::new(&study.setup, &choosing_in(&wanted, &layout), bound)
}

impl Report {
    /// The drives of the optima, of the ends of the curve, and on both sides of each change of status.
    fn turns(&self) -> Vec<f64> {
        let ends = self.curve.first().into_iter().chain(self.curve.last());
        let other = self.other.as_ref().and_then(|other| other.optimum.as_ref().ok());
        let steps = self.curve.windows(2).filter(|s| s[0].row.status != s[1].row.status).flatten();
        let optima = [&self.optimum, &self.unconstrained];
        optima.into_iter().chain(other).chain(ends).chain(steps).map(|s| s.drive).collect()
    }
}
