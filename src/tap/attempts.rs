//! The best tap angle, also by a reduced model (`--model-error`), in bounded time: the reference takes up to a second per tap; if kernels leave many
//! taps to it, the search is repeated with a larger tolerance, then with fewer drives, and refused if it would still take minutes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{FEW, Report, Sample, TapAsked, best, few, find_by, write};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::census::sample::{Row, choosing_in};
use crate::chart::ranges::Wanted;
use crate::design::Design;
use crate::error::{Error, InputError, SolveError};
use crate::optimise::run::no_axes;
use crate::optimise::score::Limit;
use crate::progress::{Progress, go_on};
use crate::scene::search::Objective;
use crate::scene::{Layout, RunOptions, Setup, Signal, Study, Tuple};

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

/// Largest numbers of grid steps, one per attempt. The optimum is polished for any grid.
pub const STEPS: &[f64] = &[1000.0, 200.0, 50.0];
pub const COARSE: &[f64] = &[100.0, 50.0];

pub(super) fn tried(
    study: &Study,
    asked: TapAsked<'_>,
    steps: &[f64],
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let (setup, layout) = (&study.setup, study.space.layout().ok_or_else(no_axes)?);
    beyond_gauge(setup, &layout)?;
    let looser = looser(asked.choice)?;
    let first = looser.is_some().then_some((asked.choice, steps[0]));
    let then = steps.iter().map(|steps| (looser.as_ref().unwrap_or(asked.choice), *steps));
    for (choice, steps) in first.into_iter().chain(then) {
        match best(study, TapAsked { choice, ..asked }, steps, &mut *progress) {
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

/// Replaces the `choice` for few taps if it is too fine: f64 with its usual tolerance.
fn looser(choice: &Choice) -> Result<Option<Choice>, Error> {
    (choice.backend.reason == FEW).then(|| few(&RunOptions::default())).transpose()
}

/// Refuses a contact at or before the gauge's near end: no drive gives it a signal.
pub(super) fn beyond_gauge(setup: &Setup, layout: &Layout) -> Result<(), InputError> {
    let design = Design::new(setup, layout.design(0));
    let ([nearest, _], Some(shared)) = (layout.reach(), design.shared) else { return Ok(()) };
    let begins = shared.gauge[0];
    if setup.signal != Signal::Strain || setup.channels.is_some() || nearest > begins {
        return Ok(());
    }
    let name = write::unit(setup).0;
    Err(InputError::new(format!(
        "no {name} gives a complete row: a tap at {nearest} mm does not bend the gauge, which begins at {begins} mm (no_strain)"
    ))
    .key("tap.a")
    .value(nearest)
    .allowed(format!("> {begins} mm, or a gauge nearer to the clamp")))
}

pub(super) fn incomplete(setup: &Setup, samples: &[Sample]) -> InputError {
    let status = samples.iter().fold(samples[0].row.status, |all, s| all | s.row.status);
    let name = write::unit(setup).0;
    InputError::new(format!("no {name} of the interval gives a complete row; the taps are {status}"))
        .key("tap.a")
        .allowed("distances beyond the gauge and before the tip")
}

pub(super) fn overstrained(setup: &Setup, samples: &[Sample]) -> InputError {
    let name = write::unit(setup).0;
    let over = samples.iter().map(|s| s.score.limit(Limit::Strain)).fold(f64::INFINITY, f64::min);
    // Strain of the skin; a foil reads less.
    let least = setup.gauge.strain_limit * (1.0 + over);
    InputError::new(format!(
        "every {name} of the interval strains the gauge beyond its limit: at least {least:.4}, {:.3} times the limit",
        1.0 + over
    ))
    .key("gauge.strain_limit")
    .value(setup.gauge.strain_limit)
    .allowed(format!("≥ {least:.4}, or a smaller {name}"))
}
