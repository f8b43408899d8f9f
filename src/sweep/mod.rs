//! The sweep: plan → evaluate → reduce → write. It is divided into chunks of whole designs by index alone, and the rows of a chunk depend only on the
//! spec and its index. So a stopped sweep continues with the missing chunks, and a part of a sweep is some of the designs. Memory holds one chunk or
//! design, the rows kept with `top`, and listed tuples (with all outcomes if the rows of their designs alternate).
//! With effects left off the kept rows check the reduced model; if it fails, the sweep is repeated with a fuller one.

mod charted;
mod group;
mod keep;
mod output;
mod probe;
mod running;
mod taps;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::backend::{Backend, Choice};
use crate::census::{needed::Needed, sample::Row};
use crate::error::{Error, InputError};
use crate::plan::{CHUNK, Plan};
use crate::progress::Progress;
use crate::recommend::Standing;
use crate::scene::{Setup, Spec, Study, Tuple};
use crate::sink::run_json::{self, Counts, Seconds};
use crate::sink::{Folder, Shard, Written, folder::unpack};
use keep::{Keeper, Reached, State};
use output::{About, Writers};
use running::Run;
use taps::Taps;

pub use keep::{EVERY, Kept};
pub use output::{PLACES, Place, Tables, ordered};
pub use probe::seconds;

/// The result of a finished sweep.
#[derive(Debug)]
#[non_exhaustive]
pub struct Report {
    /// Written files.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<PathBuf>,
    /// Numbers of taps and rows.
    pub counts: Counts,
    /// Times in seconds.
    pub seconds: Seconds,
    /// Backend used.
    pub backend: Backend,
    /// The recommended row, then others by the same rule; one per design if [`Self::by_design`].
    pub highlights: Vec<Kept>,
    /// True if [`Self::highlights`] has one row per design.
    pub by_design: bool,
    /// Position of the recommended row relative to the strain limit; `None` without a complete row.
    pub standing: Option<Standing>,
    /// Number of complete rows from which the best were chosen; with `top` and `per = "design"` one per design.
    pub ranked: u64,
    /// `model_error` of `run.json`, if effects could be left off.
    pub model_error: Option<Value>,
    /// `handed_over` of `run.json`, if the device did not answer all.
    pub handed_over: Option<Value>,
}

#[derive(Debug)]
pub struct Target<'a> {
    /// Result folder; `None` for tables in memory: nothing is written, and a stopped sweep cannot continue.
    pub out: Option<&'a Path>,
    pub force: bool,
    pub stop: &'a AtomicBool,
    /// A part of the whole; `out` is then the folder of the part.
    pub shard: Option<Shard>,
    pub every: Duration,
}

impl<'a> Target<'a> {
    pub fn new(out: &'a Path, stop: &'a AtomicBool) -> Self {
        Self { out: Some(out), force: false, stop, shard: None, every: EVERY }
    }
}

/// Writes the tables and `run.json`; continues a stopped run of the same sweep.
/// Errors: the folder holds something else; no memory for tables; a backend or disk fails; a stop. What is complete is kept.
pub fn run(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    target: &Target<'_>,
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let spent = (choice.seconds + plan.seconds, plan.chart);
    let done = attempt(spec, plan, choice, (target, progress), (spent, None))?;
    Ok(done.expect("without a model to check every sweep is done").0)
}

/// One sweep, after so many seconds of earlier work, with those of charts. Returns `None` and writes nothing if the kept rows show that the reduced model is not accurate enough.
fn attempt(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    (target, progress): (&Target<'_>, &mut dyn Progress),
    ((before, chart), needed): ((f64, Option<f64>), Option<&mut Needed>),
) -> Result<Option<(Report, Tables)>, Error> {
    let begun = Instant::now();
    let full = needed.as_deref().filter(|n| !n.left().is_empty()).map(|n| n.full.clone());
    let bound = needed.as_ref().filter(|_| full.is_some()).map(|n| n.bound);
    let (study, shard) = (&spec.study, target.shard);
    let about = About::new(spec, plan, choice, shard, bound);
    let names = output::names(study, plan, &about);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let open = |out| Folder::open(out, about.question.clone(), &names, target.force);
    let folder = target.out.map(open).transpose()?;
    let method = choice.open(&study.setup.model)?;
    let open = begun.elapsed().as_secs_f64() + choice.seconds;
    let mut run = Run::new((study, plan), method, (target.stop, progress));
    let mut resumed = None;
    match folder {
        None => run.writers = Writers::new((study, plan), &about, None, Vec::new())?,
        Some(mut folder) => {
            resumed = run.go_on(&about, &mut folder)?;
            let before = resumed.as_ref().map_or(0.0, |left| left.seconds);
            // The kept rows may require a fuller model, which starts anew; then states are not worth saving.
            let anew = full.is_some() && study.output.top.is_some();
            let every = if anew { Duration::MAX } else { target.every };
            let last = Instant::now();
            run.keeper = Some(Keeper { folder, every, start: begun, before, last, pause: every });
            (run.designs, run.taps) = (about.designs.clone(), plan.taps_of(shard));
        }
    }
    run.reached.handed = std::mem::take(&mut run.reached.handed).on(choice.backend.device.clone());
    let guard = needed.as_ref().zip(full.as_ref()).map(|(needed, full)| needed.guard(full)).transpose()?;
    run.evaluator = run.evaluator.guarded(guard);
    run.reached.counts.chart = plan.rankers.as_ref().map(|rankers| json!(rankers.summary()));
    let taps = Taps::new(&study.space);
    let done = running::run(&mut run, &taps).and_then(|()| fits(&run, &taps, needed));
    let Run { writers, reached: Reached { counts, shown, solve, handed, .. }, keeper, .. } = run;
    let done = done.and_then(|told| Ok((told, writers.close()?)));
    let (told, tables) = done.map_err(|e| match &keeper {
        Some(keeper) => keeper.folder.explain(e),
        None => e,
    })?;
    let Some(model_error) = told else { return Ok(None) };
    let (standing, offered) = (shown.standing(), shown.offered);
    let (highlights, by_design) = shown.into_rows(study.output.top.is_some() || study.output.by_said);
    let total = before + begun.elapsed().as_secs_f64() + keeper.as_ref().map_or(0.0, |keeper| keeper.before);
    let mut report = Report {
        files: Vec::new(),
        removed: Vec::new(),
        seconds: Seconds { total, open, chart, solve },
        backend: choice.backend.clone(),
        ranked: counts.complete.unwrap_or(offered),
        counts,
        highlights,
        by_design,
        standing,
        model_error,
        handed_over: handed.described(),
    };
    let Some(Keeper { mut folder, .. }) = keeper else { return Ok(Some((report, tables))) };
    let mut document = report.document(spec);
    if let Some(left) = &resumed {
        document["resumed"] = json!({ "from": left.done, "seconds_before": left.seconds });
    }
    if let Some(shard) = shard {
        document["shard"] = output::description(shard, study, plan, &about);
    }
    folder.run_json(&document)?;
    Written { files: report.files, removed: report.removed } = folder.finish()?;
    Ok(Some((report, tables)))
}

impl Report {
    pub fn document(&self, spec: &Spec) -> Value {
        let (c, total) = (&self.counts, self.seconds.total);
        let mut body = json!({
            "in_force": run_json::in_force(spec),
            "ranking": { "by": spec.study.listed_by().word(), "varying": run_json::varying(&spec.study) },
            "material_fit": run_json::material_fit(spec, Some(c)),
            "warnings": self.backend.warnings(&spec.warnings),
            "backend": self.backend,
            "counts": run_json::counts(c),
            "seconds": self.seconds,
            "taps_per_second": if total > 0.0 { c.taps as f64 / total } else { 0.0 },
        });
        for (key, told) in [("model_error", &self.model_error), ("handed_over", &self.handed_over)] {
            told.iter().for_each(|told| body[key] = told.clone());
        }
        run_json::document("sweep", run_json::spec(spec), body)
    }
}

/// For tests: true if `state` can be read as the state of a stopped sweep.
#[doc(hidden)]
pub fn readable(state: &[u8]) -> bool {
    unpack::<State>(state).is_some()
}

fn key(t: &Tuple) -> ([u64; 5], u64) {
    ([t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits()), t.rig)
}

/// Like [`run`]; also returns tables in memory. The reduced model `needed` is that of `spec`; a fuller one follows if the kept rows
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

/// `model_error` of `run.json`, if requested; the outer `None` if the kept rows show that a fuller model is needed.
fn fits(run: &Run<'_>, taps: &Taps<'_>, needed: Option<&mut Needed>) -> Result<Option<Option<Value>>, Error> {
    let Some(needed) = needed else { return Ok(Some(None)) };
    let row = |&(k, stroke): &(u64, u32)| {
        let (design, places) = (taps.design(k), taps.places(k));
        let own = (0..).zip(&places.of).filter(|(_, (_, j))| *j == stroke);
        let own: Vec<Tuple> = own.map(|(t, _)| taps.tap((k, &design), t)).collect();
        Row::new(own[0], own.iter().map(|t| t.a).collect())
    };
    let rows: Vec<Row> = run.reached.kept.iter().flatten().map(row).collect();
    if !needed.keeps(&rows, true, &|| run.check_stop())? {
        return Ok(None);
    }
    let mut told = needed.summary();
    told["taps_by_full_model"] = run.mended().into();
    Ok(Some(Some(told)))
}
