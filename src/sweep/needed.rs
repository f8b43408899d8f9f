//! Sweeps with effects left off: the kept rows check the reduced model; if it fails, the sweep is repeated with a fuller one.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::{Report, Run, Tables, Target, attempt, key};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::census::sample::Row;
use crate::error::{Error, InputError};
use crate::plan::Plan;
use crate::progress::Progress;
use crate::scene::{Layout, Setup, Space, Spec, Study, Tuple};
use crate::sink::shard::Shard;

/// Like [`run`](super::run); also returns tables in memory. The reduced model `needed` is that of `spec`; a fuller one follows if the kept rows
/// refute it. A stopped sweep with kept rows starts anew, because the next attempt may not need its rows. [`whole`] checks which parts are allowed.
pub fn run_needed(
    spec: &mut Spec,
    mut plan: Plan,
    choice: &Choice,
    (target, progress): (&Target<'_>, &mut dyn Progress),
    mut needed: Option<&mut Needed>,
) -> Result<(Report, Tables), Error> {
    let before = needed.as_ref().map_or(0.0, |needed| needed.seconds[0]);
    let (start, before, mut chart) = (Instant::now(), before + choice.seconds + plan.seconds, plan.chart);
    loop {
        let timed = ((before + start.elapsed().as_secs_f64(), chart), needed.as_deref_mut());
        if let Some(done) = attempt(spec, &plan, choice, (target, &mut *progress), timed)? {
            return Ok(done);
        }
        spec.study.setup = needed.as_ref().map_or_else(Setup::default, |needed| needed.setup.clone());
        plan = Plan::new(&spec.study, choice)?;
        chart = chart.into_iter().chain(plan.chart).reduce(|a, b| a + b);
    }
}

/// Refuses a part of a ranked sweep with a model error: the reduced model is checked on the rows that the whole keeps.
pub fn whole(shard: Option<Shard>, study: &Study) -> Result<(), InputError> {
    let Some(shard) = shard.filter(|_| study.output.top.is_some()) else { return Ok(()) };
    let why = "with a model error and top, the model is checked on the rows that the whole keeps, which no part knows";
    let allowed =
        "the whole without --shard, parts without top, or parts without --model-error and [run] model_error";
    Err(InputError::new(why).key("--shard").value(shard).allowed(allowed))
}

/// The full model, if any effects are left off.
pub(super) fn fuller(needed: Option<&Needed>) -> Option<Setup> {
    needed.filter(|n| !n.left().is_empty()).map(|n| n.full.clone())
}

/// `model_error` of `run.json`, if requested; the outer `None` if the kept rows show that a fuller model is needed.
pub(super) fn checked(run: &Run<'_>, needed: Option<&mut Needed>) -> Result<Option<Option<Value>>, Error> {
    let Some(needed) = needed else { return Ok(Some(None)) };
    if !needed.keeps(&rows(&run.study.space, &run.kept), true, &|| run.check_stop())? {
        return Ok(None);
    }
    let mut told = needed.summary();
    told["taps_by_full_model"] = run.mended().into();
    Ok(Some(Some(told)))
}

fn rows(space: &Space, kept: &[Tuple]) -> Vec<Row> {
    let listed = match space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            let all: Arc<[f64]> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
            return kept.iter().map(|t| Row::new(*t, all.clone())).collect();
        }
        Space::List(_) if kept.is_empty() => return Vec::new(),
        Space::List(listed) => listed,
    };
    let identity = |t: &Tuple| (key(t), [t.tilt, t.lean, t.drive].map(|x| (x + 0.0).to_bits()));
    let mut distances: HashMap<_, Vec<f64>> = kept.iter().map(|t| (identity(t), Vec::new())).collect();
    for t in listed.iter() {
        distances.entry(identity(&t)).and_modify(|row| row.push(t.a));
    }
    kept.iter().map(|t| Row::new(*t, distances[&identity(t)].as_slice().into())).collect()
}
