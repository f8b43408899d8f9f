//! The sweep: plan → evaluate → reduce → write, in bounded memory.
//!
//! Whole designs go through together, up to [`CHUNK`] taps at a time; a design larger than that goes through in parts,
//! twice where it is larger than [`KEEP`] (once for K̄, once for the rows that need it). Memory is that of one
//! chunk, the statistics of one design and, with `top`, the rows kept. A tuple file is held in memory as a
//! whole up to some size; of a larger one its rows are numbered, and read again.

mod about;
mod charted;
mod design;
mod file;
mod grid;
mod keep;
mod list;
mod parted;
mod probe;
mod select;
mod writers;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::plan::{CHUNK, KEEP, Layout, Plan};
use crate::profile::{self, Ask, Profile, Reach};
use crate::progress::Progress;
use crate::scene::{Space, Spec, Study, Theory, Tuple};
use crate::sink::{
    folder::{Folder, Left, Question, Written},
    pack::Unpacker,
    rows::Rows,
    run_json::{self, Counts, Seconds},
    shard::Shard,
    table::Table,
};

use about::About;
pub use keep::EVERY;
use keep::Keeper;
pub use parted::Place;
pub use probe::seconds;
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

/// A sweep under way.
struct Run<'a> {
    study: &'a Study,
    evaluator: Evaluator<'a>,
    writers: Writers,
    counts: Counts,
    best: Best,
    solve: Duration,
    plan: &'a Plan,
    stop: &'a AtomicBool,
    progress: &'a mut dyn Progress,
    /// Designs that are its own.
    designs: Range<u64>,
    /// Whether it is a part whose rows' places in the whole are written.
    part: bool,
    /// Keeps what is complete; nothing where nothing is written.
    keeper: Option<Keeper>,
    /// Where a stopped run stopped.
    state: Option<Vec<u8>>,
}

impl<'a> Run<'a> {
    fn new(
        (study, plan): (&'a Study, &'a Plan),
        method: Method,
        before: Before,
        (stop, progress): (&'a AtomicBool, &'a mut dyn Progress),
    ) -> Self {
        let evaluator = Evaluator::new(&study.setup, method).reading(plan.reader.clone());
        let Before { writers, counts, best, solve, state } = before;
        let (designs, part, keeper) = (0..plan.designs, false, None);
        Self {
            study,
            evaluator,
            writers,
            counts,
            best,
            solve,
            plan,
            stop,
            progress,
            designs,
            part,
            keeper,
            state,
        }
    }

    /// Outcomes of `tasks`; `Err` when asked to stop.
    fn evaluate(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        self.check_stop()?;
        let start = Instant::now();
        let outcomes = self.evaluator.run(designs, tasks)?;
        self.solve += start.elapsed();
        self.counts.solved += outcomes.len() as u64;
        self.note(&outcomes);
        Ok(outcomes)
    }

    /// As [`Self::evaluate`], read from charts where the plan has any.
    fn read(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        self.check_stop()?;
        let start = Instant::now();
        let outcomes = self.evaluator.read(designs, tasks)?;
        self.solve += start.elapsed();
        let interpolated = outcomes.iter().filter(|o| o.interpolated).count() as u64;
        self.counts.interpolated += interpolated;
        self.counts.solved += outcomes.len() as u64 - interpolated;
        self.note(&outcomes);
        Ok(outcomes)
    }

    /// Outcomes of `tasks`, which come in runs over all of `drives`; `Err` when asked to stop.
    fn evaluate_over(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        drives: &[f64],
    ) -> Result<Vec<Outcome>, Error> {
        self.check_stop()?;
        let start = Instant::now();
        let (outcomes, solved) = self.evaluator.run_over_drives(designs, tasks, drives)?;
        self.solve += start.elapsed();
        self.counts.solved += solved;
        self.counts.interpolated += outcomes.iter().filter(|o| o.interpolated).count() as u64;
        self.note(&outcomes);
        Ok(outcomes)
    }

    /// The model's own curve of each of `rows`: place of the design, drive, smallest and largest distance asked of it. None unless distances
    /// are told by the model. With `drives` the rows of a design are all of them; `Err` when asked to stop.
    fn profiles(
        &mut self,
        designs: &[Design],
        rows: impl Iterator<Item = (u32, f64, [f64; 2])>,
        drives: Option<&[f64]>,
    ) -> Result<Vec<Option<Profile>>, Error> {
        if self.study.setup.estimate.theory != Theory::Exact {
            return Ok(Vec::new());
        }
        self.check_stop()?;
        let start = Instant::now();
        let ask = |(design, drive, ends)| Ask { design, drive, reach: Reach::Asked(ends) };
        let asks: Vec<Ask> = rows.map(ask).collect();
        let (profiles, solved) =
            profile::solve(&self.study.setup, &mut self.evaluator, designs, &asks, drives)?;
        self.solve += start.elapsed();
        self.counts.solved += solved;
        self.counts.sweeps.merge(&self.evaluator.take_sweeps());
        Ok(profiles)
    }

    /// Counts sweeps and strains.
    fn note(&mut self, outcomes: &[Outcome]) {
        self.counts.sweeps.merge(&self.evaluator.take_sweeps());
        for o in outcomes.iter().filter(|o| o.status.counts()) {
            self.counts.strain.push(o.strain.abs());
        }
    }

    /// `Err` when asked to stop.
    fn check_stop(&self) -> Result<(), Error> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(keep::interrupted()),
            false => Ok(()),
        }
    }

    /// Takes over the counts of finished taps.
    fn absorb(&mut self, status: &Counts) {
        self.counts.taps += status.taps;
        for (word, n) in &status.status {
            *self.counts.status.entry(word).or_default() += n;
        }
        self.progress.at(self.counts.taps, self.plan.taps);
    }

    /// Shows that `more` taps than the finished ones are done.
    fn show(&mut self, more: u64) {
        self.progress.at(self.counts.taps + more, self.plan.taps);
    }

    /// Appends `n` rows to a table, if it is written.
    fn write(&mut self, table: Table, rows: Rows, n: u64) -> Result<(), Error> {
        self.count(table, n);
        self.writers.write(table, rows)
    }

    /// Counts `n` rows of a table, if it is written.
    fn count(&mut self, table: Table, n: u64) {
        if self.writers.wants(table) {
            self.counts.rows[table as usize] += n;
        }
    }

    /// Notes where rows stand in the whole, if this is a part.
    fn place(&mut self, places: impl Iterator<Item = Place>) -> Result<(), Error> {
        let bytes: Vec<u8> =
            places.take(if self.part { usize::MAX } else { 0 }).flat_map(Place::bytes).collect();
        self.writers.place(&bytes)
    }

    /// Rows for the tables.
    fn rows(&self) -> Rows {
        Rows::new(self.writers.format)
    }
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> [u64; 5] {
    [t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits())
}
