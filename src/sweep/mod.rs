//! The sweep: plan → evaluate → reduce → write, in bounded memory.
//!
//! A sweep is cut into chunks of whole designs by their index alone. A chunk's rows are a function of the spec and its index, whatever ran before
//! or beside it. So a stopped sweep continues with the chunks that are not there, and a part of a sweep is some of the designs.
//! Memory is that of one chunk or one design and, with `top`, of the rows kept; of listed tuples that of the list, and of all outcomes where
//! the rows of its designs alternate.

mod about;
mod best;
mod charted;
mod group;
mod handed;
mod keep;
mod needed;
mod probe;
mod route;
mod running;
mod taps;
mod writers;

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::backend::{Backend, Choice};
use crate::census::needed::Needed;
use crate::error::Error;
use crate::plan::{CHUNK, Plan};
use crate::progress::Progress;
use crate::recommend::Standing;
use crate::scene::{Spec, Tuple};
use crate::sink::{
    folder::{Folder, Question, Written, unpack},
    run_json::{self, Counts, Seconds},
    shard::Shard,
};

use about::About;
pub use about::Place;
pub use best::Kept;
use charted::Rankers;
pub use keep::EVERY;
use keep::{Keeper, Reached};
use needed::{Checked, checked, fuller, until_it_holds};
pub use needed::{run_needed, whole};
pub use probe::seconds;
use running::Run;
use taps::Taps;
use writers::{Marks, Writers};
pub use writers::{PLACES, Tables};

/// What a finished sweep tells.
#[derive(Debug)]
#[non_exhaustive]
pub struct Report {
    /// Files written.
    pub files: Vec<std::path::PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<std::path::PathBuf>,
    /// Counts.
    pub counts: Counts,
    /// Times.
    pub seconds: Seconds,
    /// Backend used.
    pub backend: Backend,
    /// The row that is recommended, then others by the same rule; one of each design where [`Self::by_design`].
    pub highlights: Vec<Kept>,
    /// Whether they are the best rows of different designs.
    pub by_design: bool,
    /// How the recommended row stands to the strain limit; without a complete row there is none.
    pub standing: Option<Standing>,
    /// Complete rows among which they are the best; with `top` and `per = "design"` one of each design.
    pub ranked: u64,
    /// `model_error` of `run.json`, where effects could be left off.
    pub model_error: Option<Value>,
    /// Its `handed_over`, where another than the device answered.
    pub handed_over: Option<Value>,
}

/// Where and how a sweep writes.
#[derive(Debug)]
pub struct Target<'a> {
    /// Result folder.
    pub out: &'a std::path::Path,
    /// Replace another spec's result.
    pub force: bool,
    /// Set from outside to stop early.
    pub stop: &'a AtomicBool,
    /// One part of the whole; `out` is then the folder of the part.
    pub shard: Option<Shard>,
    /// What is complete is kept so often.
    pub every: Duration,
}

impl<'a> Target<'a> {
    /// The whole, into `out`.
    pub fn new(out: &'a std::path::Path, stop: &'a AtomicBool) -> Self {
        Self { out, force: false, stop, shard: None, every: EVERY }
    }
}

/// Does what `plan`, of `spec` on `choice`, says, and writes the tables and `run.json`; goes on where a run of the same stopped.
///
/// # Errors
/// A folder that holds something else, a backend or a disk that fails, a request to stop; what is complete is kept.
pub fn run(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    target: &Target<'_>,
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let clock = Clock::new(plan, choice.seconds);
    let done = attempt(spec, plan, choice, ((Some(target), target.stop), progress), (clock, None))?;
    Ok(done.expect("without a model to check every sweep is done").0)
}

/// When a sweep began, and what was done for it before, s.
#[derive(Clone, Copy)]
struct Clock {
    start: Instant,
    before: f64,
    /// Making charts, in this and in earlier attempts.
    chart: Option<f64>,
}

impl Clock {
    fn new(plan: &Plan, before: f64) -> Self {
        Self { start: Instant::now(), before: before + plan.seconds, chart: plan.chart }
    }

    fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64() + self.before
    }
}

impl Report {
    /// What `run` on `choice`, whose device took `open` seconds, comes to, where its tables go, and what keeps it.
    fn of(run: Run<'_>, choice: &Choice, clock: Clock, open: f64) -> (Self, Writers, Option<Keeper>) {
        let Run { writers, reached: Reached { counts, shown, solve, handed, .. }, keeper, study, .. } = run;
        let (standing, offered) = (shown.standing(), shown.offered);
        let (highlights, by_design) = shown.into_rows(study.output.top.is_some() || study.output.by_said);
        let report = Self {
            files: Vec::new(),
            removed: Vec::new(),
            seconds: Seconds { total: clock.total(), open, chart: clock.chart, solve },
            backend: choice.backend.clone(),
            ranked: counts.complete.unwrap_or(offered),
            counts,
            highlights,
            by_design,
            standing,
            model_error: None,
            handed_over: handed.described(),
        };
        (report, writers, keeper)
    }
}

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
    until_it_holds(spec, plan, choice, ((None, stop), progress), needed)
}

/// One sweep, into the folder of `target` or into memory; `None`, and nothing is written, where its kept rows show that its model does not do.
fn attempt(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    ((target, stop), progress): ((Option<&Target<'_>>, &AtomicBool), &mut dyn Progress),
    (clock, needed): (Clock, Option<&mut Needed>),
) -> Result<Option<(Report, Tables)>, Error> {
    let begun = Instant::now();
    let full = fuller(needed.as_deref());
    let bound = needed.as_ref().filter(|_| full.is_some()).map(|n| n.bound());
    let (study, shard) = (&spec.study, target.and_then(|target| target.shard));
    let about = About::new(spec, plan, choice, (shard, bound));
    let folder = target.map(|target| opened(spec, plan, &about, target)).transpose()?;
    let method = running::method(study, choice, stop)?;
    let open = begun.elapsed().as_secs_f64() + choice.seconds;
    let mut run = Run::new((study, plan), method, (stop, progress));
    let mut resumed = None;
    match folder {
        None => run.writers = Writers::in_memory(study, plan)?,
        Some(mut folder) => {
            resumed = run.go_on(&about, &mut folder)?;
            let seconds = resumed.as_ref().map_or(0.0, |left| left.seconds);
            // Rows kept may ask for a fuller model.
            let anew = full.is_some() && study.output.top.is_some();
            let every = target.filter(|_| !anew).map_or(Duration::MAX, |target| target.every);
            run.keeper = Some(Keeper::new(folder, &about.identity, every, (begun, seconds)));
            (run.designs, run.part, run.taps) = (about.designs.clone(), about.places, plan.taps_of(shard));
        }
    }
    run.reached.handed = std::mem::take(&mut run.reached.handed).on(choice.backend.device.clone());
    let guard = needed.as_ref().zip(full.as_ref()).map(|(needed, full)| needed.guard(full)).transpose()?;
    run.evaluator = run.evaluator.guarded(guard);
    let done = routes(&mut run).and_then(|()| checked(&run, needed));
    let (mut report, writers, keeper) = Report::of(run, choice, clock, open);
    let (told, tables) = match done.and_then(|told| Ok((told, writers.close()?))) {
        Ok(done) => done,
        Err(e) => {
            return Err(match keeper {
                Some(keeper) => keeper.explain(e),
                None => e,
            });
        }
    };
    let Checked::Holds(told) = told else { return Ok(None) };
    report.model_error = told;
    let Some(keeper) = keeper else { return Ok(Some((report, tables))) };
    report.seconds.total = clock.total() + keeper.before;
    let told = [report.model_error.as_ref(), report.handed_over.as_ref()];
    let mut document = run_json::of_sweep(
        spec,
        (&choice.backend, &choice.backend.warnings(&spec.warnings)),
        &report.counts,
        report.seconds,
        told,
    );
    if let Some(left) = &resumed {
        document["resumed"] = json!({ "from": left.done, "seconds_before": left.seconds });
    }
    if let Some(shard) = shard {
        document["shard"] = about::description(shard, study, plan, &about);
    }
    let mut folder = keeper.folder;
    folder.run_json(&document)?;
    Written { files: report.files, removed: report.removed } = folder.finish()?;
    Ok(Some((report, tables)))
}

/// The folder of a sweep.
fn opened(spec: &Spec, plan: &Plan, about: &About, target: &Target<'_>) -> Result<Folder, Error> {
    let asked = target.shard.map_or(Value::Null, |shard| json!({ "shard": shard.to_string() }));
    let identity = Some(about.identity.clone());
    let question = Question { identity, ..Question::of_scene("sweep", spec, asked) };
    let names = writers::names(&spec.study, plan, about);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Folder::open(target.out, question, &names, target.force)
}

/// Goes through the space.
fn routes(run: &mut Run<'_>) -> Result<(), Error> {
    run.reached.counts.chart = Rankers::of(run.plan).map(|rankers| json!(rankers.summary()));
    route::run(run, &Taps::new(&run.study.space))
}

/// Whether `state` can be read as that of a stopped sweep; for tests of the reading.
#[doc(hidden)]
pub fn readable(state: &[u8]) -> bool {
    unpack::<(Reached, Marks)>(state).is_some()
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> ([u64; 5], u64) {
    ([t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits()), t.rig)
}
