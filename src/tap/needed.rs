//! The best tap angle by what is needed of the model (`--model-error`).

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{Report, TapAsked, find_by};
use crate::census::needed::Needed;
use crate::census::sample::{Row, choosing_in};
use crate::chart::ranges::Wanted;
use crate::error::{Error, SolveError};
use crate::optimise::run::no_axes;
use crate::progress::Progress;
use crate::scene::{Study, Tuple};

/// The best drive by what is needed of the model for a strain within `bound`.
pub(super) fn find_needed(
    study: &Study,
    asked: TapAsked<'_>,
    bound: f64,
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let (mut needed, mut study) = (needed(study, asked.ends, bound)?, study.clone());
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
        let go_on = || match asked.stop.load(Ordering::Relaxed) {
            true => Err(SolveError::Stopped.into()),
            false => Ok(()),
        };
        if needed.keeps(&rows, true, &go_on)? {
            let model_error = Some((needed.summary(), needed.sentence()));
            return Ok(Report { model_error, ..report });
        }
    }
}

/// What the one whisker of `study` needs of its model for a strain within `bound`, over its distances and the drives `ends`.
///
/// # Errors
/// A tuple file; a kernel that fails.
pub fn needed(study: &Study, ends: [f64; 2], bound: f64) -> Result<Needed, Error> {
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let wanted = Wanted { drive: ends, ..Wanted::of(&layout) };
    Needed::new(&study.setup, &choosing_in(&wanted, &layout), bound)
}

impl Report {
    /// The drives of the optima, of the ends of the curve, and those between which its status changes.
    fn turns(&self) -> Vec<f64> {
        let ends = self.curve.first().into_iter().chain(self.curve.last());
        let other = self.other.as_ref().and_then(|other| other.optimum.as_ref().ok());
        let steps = self.curve.windows(2).filter(|s| s[0].row.status != s[1].row.status).flatten();
        let optima = [&self.optimum, &self.unconstrained];
        optima.into_iter().chain(other).chain(ends).chain(steps).map(|s| s.drive).collect()
    }
}
