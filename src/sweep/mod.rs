//! The sweep: plan → evaluate → reduce → write, in bounded memory.
//!
//! Whole designs go through together, up to [`CHUNK`] taps and about a second at a time; of a larger design what is solved is held until all of it
//! is. Memory is that of one chunk or one design and, with `top`, of the rows kept; of listed tuples that of the list, and of all outcomes where
//! the rows of its designs alternate.

mod about;
mod best;
mod charted;
mod collect;
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
use crate::evaluate::Outcome;
use crate::plan::{CHUNK, Plan};
use crate::progress::Progress;
use crate::recommend::Standing;
use crate::scene::{Spec, Study, Tuple};
use crate::sink::{
    folder::{Folder, Left, Mark, Question, Written},
    pack::{Packed, Unpacker},
    run_json::{self, Counts, Seconds},
    shard::Shard,
};

use about::About;
pub use about::Place;
use best::Highlights;
pub use best::Kept;
use charted::Rankers;
pub use collect::collect;
use handed::Handed;
pub use keep::EVERY;
use keep::Keeper;
use needed::{Checked, checked, fuller};
pub use needed::{run_needed, whole};
pub use probe::seconds;
use running::Run;
use taps::Taps;
use writers::Writers;
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
    let report = attempt(spec, plan, choice, target, progress, (clock, None))?;
    Ok(report.expect("without a model to check every sweep is done"))
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
        let Run { writers, counts, best, solve, keeper, handed, study, .. } = run;
        let (standing, offered) = (best.standing(), best.offered);
        let (highlights, by_design) = best.into_rows(study.output.top.is_some() || study.output.by_said);
        let report = Self {
            files: Vec::new(),
            removed: Vec::new(),
            seconds: Seconds { total: clock.total(), open, chart: clock.chart, solve: solve.as_secs_f64() },
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

/// One sweep; `None`, and nothing is written, where its kept rows show that its model does not do.
fn attempt(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    target: &Target<'_>,
    progress: &mut dyn Progress,
    (clock, needed): (Clock, Option<&mut Needed>),
) -> Result<Option<Report>, Error> {
    let begun = Instant::now();
    let full = fuller(needed.as_deref());
    let bound = needed.as_ref().filter(|_| full.is_some()).map(|n| n.bound());
    let (study, about) = (&spec.study, About::new(spec, plan, choice, (target.shard, bound)));
    let asked = target.shard.map_or(Value::Null, |shard| json!({ "shard": shard.to_string() }));
    let question = Question::of_scene("sweep", spec, asked);
    let question = Question { identity: Some(about.identity.clone()), ..question };
    let names = writers::names(study, plan, &about);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut folder = Folder::open(target.out, question, &names, target.force)?;
    let method = running::method(study, choice, target.stop)?;
    let open = begun.elapsed().as_secs_f64() + choice.seconds;
    let left = folder.left.take();
    let before = left.as_ref().map(|left| Before::read(study, plan, &about, &mut folder, left));
    let (before, resumed) = match before.transpose()?.flatten() {
        Some(before) => (before, left),
        None => (Before::nothing(Writers::new(study, plan, &about, &mut folder)?), None),
    };
    let seconds = resumed.as_ref().map_or(0.0, |left| left.seconds);
    resumed.iter().for_each(|left| progress.note(&format!("going on: {} are complete", left.done)));
    // Rows kept may ask for a fuller model.
    let every = if full.is_some() && study.output.top.is_some() { Duration::MAX } else { target.every };
    let keeper = Keeper::new(folder, &about.identity, every, (begun, seconds));
    let mut run = Run::new((study, plan), method, before, (target.stop, progress));
    (run.designs, run.keeper, run.part) = (about.designs.clone(), Some(keeper), about.places);
    run.handed = run.handed.on(choice.backend.device.clone());
    run.taps = plan.taps_of(target.shard);
    let guard = needed.as_ref().zip(full.as_ref()).map(|(needed, full)| needed.guard(full)).transpose()?;
    run.evaluator = run.evaluator.guarded(guard);
    let done = routes(&mut run).and_then(|()| checked(&run, needed));
    let (mut report, writers, keeper) = Report::of(run, choice, clock, open);
    let Some(keeper) = keeper else { return Err(Error::Run("a sweep without a folder".into())) };
    report.model_error = match done.and_then(|told| writers.close().map(|()| told)) {
        Ok(Checked::Holds(told)) => told,
        Ok(Checked::Astray) => return Ok(None),
        Err(e) => return Err(keeper.explain(e)),
    };
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
    if let Some(shard) = target.shard {
        document["shard"] = about::description(shard, study, plan, &about);
    }
    let mut folder = keeper.folder;
    folder.run_json(&document)?;
    Written { files: report.files, removed: report.removed, .. } = folder.finish()?;
    Ok(Some(report))
}

/// Goes through the space.
fn routes(run: &mut Run<'_>) -> Result<(), Error> {
    run.counts.chart = Rankers::of(run.plan).map(|rankers| json!(rankers.summary()));
    route::run(run, &Taps::new(&run.study.space))
}

/// What every route keeps: the fields of [`Before`] beside the tables.
type Shared = (Counts, Highlights, (f64, u64, Handed), Vec<Outcome>);

/// How far a stopped run had come; nothing of a new one.
struct Before {
    writers: Writers,
    counts: Counts,
    best: Highlights,
    solve: Duration,
    /// Taps that the full model solved in place of one with effects left off.
    mended: u64,
    handed: Handed,
    /// Outcomes of the first taps of a design under way.
    under_way: Vec<Outcome>,
    /// What its route packed.
    state: Option<Vec<u8>>,
}

impl Before {
    fn nothing(writers: Writers) -> Self {
        let (counts, best) = (Counts::default(), Highlights::default());
        let (solve, handed, under_way) = (Duration::ZERO, Handed::default(), Vec::new());
        Self { writers, counts, best, solve, mended: 0, handed, under_way, state: None }
    }

    /// From what it `left`; `None` where that is not whole, and is given up.
    fn read(
        study: &Study,
        plan: &Plan,
        about: &About,
        folder: &mut Folder,
        left: &Left,
    ) -> Result<Option<Self>, Error> {
        let mut state = Unpacker(&left.state);
        let head: Option<Shared> = state.take();
        let writers = match head {
            Some(_) => Writers::resume(study, plan, about, folder, &mut state)?,
            None => Err("its state".to_owned()),
        };
        match (head, writers) {
            (Some((counts, best, (solve, mended, handed), under_way)), Ok(writers)) => {
                let solve = Duration::try_from_secs_f64(solve).unwrap_or_default();
                let state = Some(state.0.to_vec());
                Ok(Some(Self { writers, counts, best, solve, mended, handed, under_way, state }))
            }
            (_, writers) => folder.damaged(&writers.err().unwrap_or_default()).map(|()| None),
        }
    }
}

/// What of `state` can be read as a part of the state of a stopped sweep; for tests of the reading.
#[doc(hidden)]
pub fn readable(state: &[u8]) -> [bool; 5] {
    fn reads<T: Packed>(mut state: Unpacker<'_>) -> bool {
        state.take::<T>().is_some()
    }
    let state = Unpacker(state);
    [
        reads::<Shared>(state),
        reads::<best::Reached>(state),
        reads::<Vec<Outcome>>(state),
        reads::<Mark>(state),
        reads::<Vec<(Tuple, Option<String>)>>(state),
    ]
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> ([u64; 5], u64) {
    ([t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits()), t.rig)
}
