//! A sweep whose tables stay in memory.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::needed::{Checked, checked, fuller, until_it_holds};
use super::writers::{Tables, Writers};
use super::{Before, Clock, Report, Run, routes};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::error::Error;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::scene::Spec;

/// Does what `plan`, of `spec` on `choice`, says, and gives the tables that it asks for; nothing is written, and a stopped one cannot go on. With
/// `needed` by the model that it says, which is in `spec`, or by the fuller one that the rows kept turn out to need.
///
/// # Errors
/// Tables for which there is no memory; a backend that fails; `stop`, set from outside.
pub fn collect(
    spec: &mut Spec,
    plan: Plan,
    choice: &Choice,
    (stop, progress): (&AtomicBool, &mut dyn Progress),
    needed: Option<&mut Needed>,
) -> Result<(Report, Tables), Error> {
    let Some(needed) = needed else {
        let clock = Clock::new(&plan, choice.seconds);
        let done = attempt(spec, &plan, choice, (stop, progress), (clock, None))?;
        return Ok(done.expect("without a model to check every sweep is done"));
    };
    until_it_holds(spec, plan, choice, needed, &mut |spec, plan, timed| {
        attempt(spec, plan, choice, (stop, progress), timed)
    })
}

/// One sweep; `None` where its kept rows show that its model does not do.
fn attempt(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    (stop, progress): (&AtomicBool, &mut dyn Progress),
    (clock, needed): (Clock, Option<&mut Needed>),
) -> Result<Option<(Report, Tables)>, Error> {
    let begun = Instant::now();
    let (study, full) = (&spec.study, fuller(needed.as_deref()));
    let method = choice.open(&study.setup.model)?;
    let open = begun.elapsed().as_secs_f64() + choice.seconds;
    let before = Before::nothing(Writers::in_memory(study, plan)?);
    let mut run = Run::new((study, plan), method, before, (stop, progress));
    let guard = needed.as_ref().zip(full.as_ref()).map(|(needed, full)| needed.guard(full)).transpose()?;
    run.evaluator = run.evaluator.guarded(guard);
    run.handed = run.handed.on(choice.backend.device.clone());
    routes(&mut run)?;
    let Checked::Holds(model_error) = checked(&run, needed)? else { return Ok(None) };
    let (report, writers, _) = Report::of(run, choice, clock, open);
    let report = Report { model_error, ..report };
    Ok(Some((report, writers.into_tables())))
}
