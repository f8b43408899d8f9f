//! The sweep: plan → evaluate → reduce → write, in bounded memory.
//!
//! Whole designs go through together, up to [`CHUNK`] taps at a time; a design larger than that goes through in parts,
//! twice where it is larger than [`KEEP`] (once for K̄, once for the rows that need it). Memory is that of one
//! chunk, the statistics of one design and, with `top`, the rows kept. A tuple file is held in memory as a
//! whole up to some size; of a larger one its rows are numbered, and read again.

mod charted;
mod design;
mod file;
mod grid;
mod list;
mod needed;
mod probe;
mod rows;
mod select;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::needed::Needed;
use crate::plan::{CHUNK, KEEP, Layout, Plan};
use crate::profile::{self, Ask, Profile, Reach};
use crate::progress::Progress;
use crate::scene::{Space, Spec, Study, Theory, Tuple};
use crate::sink::{
    csv::Text,
    folder::{Folder, Output, Question, Written},
    run_json::{self, Counts, Seconds},
    table::Table,
};

pub use probe::seconds;
use select::Best;
pub use select::Kept;

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
    /// `model_error` of `run.json`, where effects could be left off.
    pub model_error: Option<Value>,
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
}

/// Does what `plan`, of `spec` on `choice`, says, and writes the tables and `run.json`.
pub fn run(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    target: &Target<'_>,
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let clock = Clock { start: Instant::now(), before: choice.seconds + plan.seconds, chart: plan.chart };
    let report = attempt(spec, plan, choice, target, progress, (clock, None))?;
    Ok(report.expect("without a model to check every sweep is done"))
}

/// Does what `plan` says by the model that `needed` says, which is in `spec`; where the rows kept do not bear it out, again by the fuller one
/// that then is needed.
///
/// # Errors
/// As [`run`].
pub fn run_needed(
    spec: &mut Spec,
    plan: Plan,
    choice: &Choice,
    target: &Target<'_>,
    progress: &mut dyn Progress,
    needed: &mut Needed,
) -> Result<Report, Error> {
    let before = choice.seconds + plan.seconds + needed.seconds[0];
    let mut clock = Clock { start: Instant::now(), before, chart: plan.chart };
    let mut plan = plan;
    loop {
        if let Some(report) = attempt(spec, &plan, choice, target, progress, (clock, Some(&mut *needed)))? {
            return Ok(report);
        }
        spec.study.setup = needed.setup().clone();
        plan = Plan::new(&spec.study, choice)?;
        clock.chart = clock.chart.into_iter().chain(plan.chart).reduce(|a, b| a + b);
    }
}

/// When a sweep began, and what was done for it before, s.
#[derive(Clone, Copy)]
struct Clock {
    start: Instant,
    before: f64,
    /// Making charts, in this and in earlier attempts.
    chart: Option<f64>,
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
    let question = Question::of_scene("sweep", spec, Value::Null);
    let mut folder = Folder::open(target.out, question, &names(&spec.study, plan), target.force)?;
    let method = choice.open(&spec.study.setup.model)?;
    let open = begun.elapsed().as_secs_f64() + choice.seconds;
    let writers = Writers::new(&spec.study, plan, &mut folder)?;
    let full = needed.as_ref().filter(|n| !n.left().is_empty()).map(|n| n.full().clone());
    let mut run = Run::new((&spec.study, plan), method, writers, (target.stop, progress));
    let guard = needed.as_ref().zip(full.as_ref()).map(|(needed, full)| needed.guard(full)).transpose()?;
    run.evaluator = run.evaluator.guarded(guard);
    if let Some(reader) = &plan.reader {
        run.counts.solved += reader.sweeps().taps;
        run.counts.sweeps.merge(&reader.sweeps());
        run.counts.chart = Some(serde_json::json!(reader.summary()));
    }
    match &spec.study.space {
        Space::Grid(factors) => {
            grid::run(&mut run, &Layout::new(factors))?;
        }
        Space::List(tuples) => list::run(&mut run, tuples)?,
        Space::File(listed) => file::run(&mut run, listed)?,
    }
    let solve = run.solve.as_secs_f64();
    let model_error = match needed {
        None => None,
        Some(needed) => {
            if !needed.keeps(&needed::rows(&spec.study.space, &run.kept)?, &|| run.check_stop())? {
                return Ok(None);
            }
            let mut told = needed.summary(solve + plan.chart.unwrap_or(0.0));
            told["taps_by_full_model"] = run.evaluator.mended().into();
            Some(told)
        }
    };
    let counts = run.counts;
    let ranked = counts.complete.unwrap_or(run.best.offered);
    let highlights = run.best.into_rows();
    run.writers.close()?;
    let total = clock.start.elapsed().as_secs_f64() + clock.before;
    let seconds = Seconds { total, open, chart: clock.chart, solve };
    folder.run_json(&run_json::of_sweep(spec, &choice.backend, &counts, seconds, model_error.as_ref()))?;
    let Written { files, removed, .. } = folder.finish()?;
    let backend = choice.backend.clone();
    Ok(Some(Report { files, removed, counts, seconds, backend, highlights, ranked, model_error }))
}

/// Names of the tables that are written.
fn names(study: &Study, plan: &Plan) -> Vec<&'static str> {
    let wanted = [plan.tuples, study.output.designs, study.output.distances];
    [Table::Tuples, Table::Designs, Table::Distances]
        .into_iter()
        .zip(wanted)
        .filter(|(_, w)| *w)
        .map(|(t, _)| t.file())
        .collect()
}

/// A sweep under way.
struct Run<'a> {
    study: &'a Study,
    evaluator: Evaluator<'a>,
    writers: Writers,
    counts: Counts,
    best: Best,
    /// Design and drive of the rows that `top` keeps.
    kept: Vec<Tuple>,
    solve: Duration,
    plan: &'a Plan,
    stop: &'a AtomicBool,
    progress: &'a mut dyn Progress,
}

impl<'a> Run<'a> {
    fn new(
        (study, plan): (&'a Study, &'a Plan),
        method: Method,
        writers: Writers,
        (stop, progress): (&'a AtomicBool, &'a mut dyn Progress),
    ) -> Self {
        let evaluator = Evaluator::new(&study.setup, method).reading(plan.reader.clone());
        let (counts, best, solve) = (Counts::default(), Best::new(HIGHLIGHTS), Duration::ZERO);
        Self { study, plan, evaluator, writers, counts, best, kept: Vec::new(), solve, stop, progress }
    }

    /// Outcomes of `tasks`; `Err` when asked to stop.
    fn evaluate(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        self.check_stop()?;
        let start = Instant::now();
        let outcomes = self.evaluator.run(designs, tasks)?;
        self.counts.solved += outcomes.len() as u64;
        Ok(self.noted(outcomes, start))
    }

    /// As [`Self::evaluate`], read from charts where the plan has any.
    fn read(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        self.check_stop()?;
        let start = Instant::now();
        let outcomes = self.evaluator.read(designs, tasks)?;
        let interpolated = outcomes.iter().filter(|o| o.interpolated).count() as u64;
        self.counts.interpolated += interpolated;
        self.counts.solved += outcomes.len() as u64 - interpolated;
        Ok(self.noted(outcomes, start))
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
        self.counts.solved += solved;
        self.counts.interpolated += outcomes.iter().filter(|o| o.interpolated).count() as u64;
        Ok(self.noted(outcomes, start))
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

    /// Counts the sweeps and strains of `outcomes`, which were solved since `start`.
    fn noted(&mut self, outcomes: Vec<Outcome>, start: Instant) -> Vec<Outcome> {
        self.solve += start.elapsed();
        self.counts.sweeps.merge(&self.evaluator.take_sweeps());
        for o in outcomes.iter().filter(|o| o.status.counts()) {
            self.counts.strain.push(o.strain.abs());
        }
        outcomes
    }

    /// `Err` when asked to stop.
    fn check_stop(&self) -> Result<(), Error> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(Error::Run("interrupted; nothing was written, an older result is as it was".into())),
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

    /// Appends rows to a table that is written.
    fn write(&mut self, table: Table, text: &[u8], rows: u64) -> Result<(), Error> {
        let (slot, count) = self.writers.slot(table);
        if let Some(file) = slot {
            file.write(text)?;
            self.counts.rows[count] += rows;
        }
        Ok(())
    }
}

/// The open table files; `None` for a table that is not written.
struct Writers {
    files: [Option<Output>; 3],
}

impl Writers {
    /// Writes nothing.
    fn none() -> Self {
        Self { files: [None, None, None] }
    }

    fn new(study: &Study, plan: &Plan, folder: &mut Folder) -> Result<Self, Error> {
        let mut open = |table: Table, wanted: bool| -> Result<Option<Output>, Error> {
            if !wanted {
                return Ok(None);
            }
            let mut file = folder.file(table.file())?;
            let mut text = Text::default();
            text.header(&table.columns(&study.setup)).map_err(|e| Error::Run(e.to_string()))?;
            file.write(&text.into_bytes())?;
            Ok(Some(file))
        };
        Ok(Self {
            files: [
                open(Table::Tuples, plan.tuples)?,
                open(Table::Designs, study.output.designs)?,
                open(Table::Distances, study.output.distances)?,
            ],
        })
    }

    fn slot(&mut self, table: Table) -> (&mut Option<Output>, usize) {
        let at = table as usize;
        (&mut self.files[at], at)
    }

    fn wants(&self, table: Table) -> bool {
        self.files[table as usize].is_some()
    }

    fn close(self) -> Result<(), Error> {
        self.files.into_iter().flatten().try_for_each(Output::close)
    }
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> [u64; 5] {
    [t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits())
}
