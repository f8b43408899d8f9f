//! Bounds the time of the search. The reference takes up to a second per tap; if kernels leave many taps to it, the search is repeated with a
//! larger tolerance, then with fewer drives, and refused if it would still take minutes.

use super::{FEW, Report, Sample, TapAsked, best, few, write};
use crate::backend::Choice;
use crate::design::Design;
use crate::error::{Error, InputError, SolveError};
use crate::optimise::run::no_axes;
use crate::optimise::score::Limit;
use crate::progress::Progress;
use crate::scene::{Layout, RunOptions, Setup, Signal, Study};

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
