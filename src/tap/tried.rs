//! Bounds the search of the best drive. The reference takes up to a second for a tap that the kernels leave to it. If there are many, the search is tried
//! again to a larger tolerance, then with fewer drives; if that would still take minutes, it is refused.

use std::sync::atomic::AtomicBool;

use super::refused::beyond_gauge;
use super::{FEW, Report, best};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::error::{Error, InputError, SolveError};
use crate::optimise::run::no_axes;
use crate::progress::Progress;
use crate::scene::search::Objective;
use crate::scene::{BackendChoice, Precision, RunOptions, Study};

/// Steps of the grid of drives, one attempt after the other.
const STEPS: [f64; 3] = [1000.0, 200.0, 50.0];

/// An attempt: by what, and in how many steps.
pub(super) type Attempt<'c> = (&'c Choice, f64);

/// As [`super::find`], by one estimator.
pub(super) fn tried(
    study: &Study,
    ends: [f64; 2],
    objective: Objective,
    choice: &Choice,
    (needed, stop, progress): (Option<&Needed>, &AtomicBool, &mut dyn Progress),
) -> Result<Report, Error> {
    let (setup, layout) = (&study.setup, study.space.layout().ok_or_else(no_axes)?);
    beyond_gauge(setup, &layout)?;
    let looser = looser(choice)?;
    let first = looser.is_some().then_some((choice, STEPS[0]));
    let then = STEPS.map(|steps| (looser.as_ref().unwrap_or(choice), steps));
    for attempt in first.into_iter().chain(then) {
        match best(study, ends, objective, attempt, (needed, stop, &mut *progress)) {
            Err(Error::Solve(SolveError::TooHard)) => {
                progress.note("many taps of this whisker are hard to solve: again, less finely");
            }
            done => return done,
        }
    }
    let error = InputError::new(
        "so many taps of this whisker are hard to solve that its best tap would take minutes",
    );
    Err(error
        .key("tap.a")
        .allowed("distances beyond the end of the gauge, a whisker that tapers less; or --backend reference, which takes its time")
        .into())
}

/// What is chosen in place of the `choice` for few taps where that is too fine: f64 to its usual tolerance.
fn looser(choice: &Choice) -> Result<Option<Choice>, Error> {
    if choice.backend.reason != FEW {
        return Ok(None);
    }
    let options = RunOptions {
        backend: Some(BackendChoice::Cpu),
        precision: Some(Precision::F64),
        ..RunOptions::default()
    };
    let mut looser = Choice::new(&options)?;
    looser.backend.reason = FEW.into();
    Ok(Some(looser))
}
