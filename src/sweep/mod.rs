//! The sweep: plan → evaluate → reduce → write, in bounded memory.
//!
//! Whole designs go through together, up to [`CHUNK`] taps at a time; a design larger than that goes through in parts,
//! twice where it is larger than [`KEEP`] (once for K̄, once for the rows that need it). Memory is that of one
//! chunk, the statistics of one design and, with `top`, the rows kept. A tuple file is held in memory as a
//! whole up to some size; of a larger one its rows are numbered, and read again.

mod about;
mod at;
mod charted;
mod design;
mod file;
mod grid;
mod keep;
mod list;
mod parted;
mod probe;
mod running;
mod select;
mod writers;

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::backend::{Backend, Choice};
use crate::error::Error;
use crate::plan::{CHUNK, KEEP, Layout, Plan};
use crate::progress::Progress;
use crate::scene::{Space, Spec, Study, Tuple};
use crate::sink::{
    folder::{Folder, Left, Question, Written},
    pack::Unpacker,
    run_json::{self, Counts, Seconds},
    shard::Shard,
};

use about::About;
pub use keep::EVERY;
use keep::Keeper;
pub use parted::Place;
pub use probe::seconds;
use running::Run;
use select::Best;
pub use select::Kept;
pub use writers::PLACES;
use writers::Writers;

/// Rows that the summary shows.
const HIGHLIGHTS: usize = 8;

/// What a finished sweep tells.
#[derive(Debug)]
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
    /// The best rows by the column that ranks, best first.
    pub highlights: Vec<Kept>,
    /// Complete rows among which they are the best; with `top` and `per = "design"` one of each design.
    pub ranked: u64,
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
    let start = Instant::now();
    let (study, about) = (&spec.study, About::new(spec, plan, choice, target.shard));
    let asked = target.shard.map_or(Value::Null, |shard| json!({ "shard": shard.to_string() }));
    let question = Question::of_scene("sweep", spec, asked);
    let names = writers::names(study, plan, &about);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (mut folder, left) = Folder::open_again(target.out, question, &names, &about.identity, target.force)?;
    let method = choice.open(&study.setup.model)?;
    let open = start.elapsed();
    let head = left.as_ref().map(|left| left.head.clone());
    let before = match left {
        Some(left) => Before::read(study, plan, &about, &mut folder, left, target.force)?,
        None => None,
    };
    let (before, resumed) = match before {
        Some(before) => (before, head),
        None => (Before::nothing(Writers::new(study, plan, &about, &mut folder)?), None),
    };
    let seconds = resumed.as_ref().map_or(0.0, |head| head.seconds);
    resumed.iter().for_each(|head| progress.note(&format!("going on: {} are complete", head.done)));
    let keeper = Keeper::new(folder, &about.identity, target.every, (start, seconds));
    let mut run = Run::new((study, plan), method, before, (target.stop, progress));
    (run.designs, run.keeper, run.part) = (about.designs.clone(), Some(keeper), about.places);
    run.taps = plan.taps_of(target.shard);
    let done = routes(&mut run, spec);
    let Run { writers, counts, best, solve, keeper, .. } = run;
    let Some(keeper) = keeper else { return Err(keep::damaged()) };
    let ranked = counts.complete.unwrap_or(best.offered);
    let highlights = best.into_rows();
    let closed = done.and_then(|()| writers.close());
    if let Err(e) = closed {
        return Err(keeper.explain(e));
    }
    let total = start.elapsed() + Duration::from_secs_f64(keeper.before);
    let seconds = Seconds::new(total, open, solve);
    let mut document = run_json::of_sweep(spec, &choice.backend, &counts, seconds);
    if let Some(head) = &resumed {
        document["resumed"] = json!({ "from": head.done, "seconds_before": head.seconds });
    }
    if let Some(shard) = target.shard {
        document["shard"] = parted::description(shard, study, plan, &about);
    }
    let Keeper { mut folder, .. } = keeper;
    folder.run_json(&document)?;
    let Written { files, removed, .. } = folder.finish()?;
    Ok(Report { files, removed, counts, seconds, backend: choice.backend.clone(), highlights, ranked })
}

/// The way of the space.
fn routes(run: &mut Run<'_>, spec: &Spec) -> Result<(), Error> {
    run.counts.chart = run.plan.ranker.as_ref().map(|ranker| ranker.summary());
    if let Some(reader) = &run.plan.reader {
        run.counts.chart = Some(json!(reader.summary()));
        if run.state.is_none() {
            run.counts.solved += reader.sweeps().taps;
            run.counts.sweeps.merge(&reader.sweeps());
        }
    }
    match &spec.study.space {
        Space::Grid(factors) => grid::run(run, &Layout::new(factors)),
        Space::List(tuples) => list::run(run, tuples),
        Space::File(listed) => file::run(run, listed),
    }
}

/// How far a stopped run had come; nothing of a new one.
struct Before {
    writers: Writers,
    counts: Counts,
    best: Best,
    solve: Duration,
    /// What its route packed.
    state: Option<Vec<u8>>,
}

impl Before {
    fn nothing(writers: Writers) -> Self {
        let (counts, best) = (Counts::default(), Best::new(HIGHLIGHTS));
        Self { writers, counts, best, solve: Duration::ZERO, state: None }
    }

    /// From what it `left`; `None` where that is not whole and is given up by `force`.
    fn read(
        study: &Study,
        plan: &Plan,
        about: &About,
        folder: &mut Folder,
        left: Left,
        force: bool,
    ) -> Result<Option<Self>, Error> {
        let mut state = Unpacker(&left.state);
        let head: Option<(Counts, Best, f64)> = state.take();
        let writers = match head {
            Some(_) => Writers::resume(study, plan, about, folder, &mut state)?,
            None => None,
        };
        match head.zip(writers) {
            Some(((counts, best, solve), writers)) => {
                let solve = Duration::try_from_secs_f64(solve).unwrap_or_default();
                Ok(Some(Self { writers, counts, best, solve, state: Some(state.0.to_vec()) }))
            }
            None if force => folder.begin_anew().map(|()| None),
            None => Err(keep::damaged()),
        }
    }
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> [u64; 5] {
    [t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits())
}
