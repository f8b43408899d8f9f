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
mod probe;
mod select;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::plan::{CHUNK, KEEP, Layout, Plan};
use crate::profile::{self, Ask, Profile, Reach};
use crate::progress::Progress;
use crate::scene::{Space, Spec, Study, Theory, Tuple};
use crate::sink::{
    columns::{Block, Columns, Form},
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
    let start = Instant::now();
    let question = Question::of_scene("sweep", spec, Value::Null);
    let mut folder = Folder::open(target.out, question, &names(&spec.study, plan), target.force)?;
    let method = choice.open(&spec.study.setup.model)?;
    let open = start.elapsed();
    let writers = Writers::new(&spec.study, plan, &mut folder)?;
    let swept = sweep(&spec.study, plan, method, writers, (target.stop, progress))?;
    swept.writers.close()?;
    let Swept { counts, solve, highlights, ranked, .. } = swept;
    let seconds = Seconds::new(start.elapsed(), open, solve);
    folder.run_json(&run_json::of_sweep(spec, &choice.backend, &counts, seconds))?;
    let Written { files, removed, .. } = folder.finish()?;
    Ok(Report { files, removed, counts, seconds, backend: choice.backend.clone(), highlights, ranked })
}

/// Does what `plan`, of `study` on `choice`, says, and gives the tables that it asks for (tuples, designs, distances), by columns; nothing
/// is written.
///
/// # Errors
/// A backend that fails; `stop`, set from outside.
pub fn collect(
    study: &Study,
    plan: &Plan,
    choice: &Choice,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<(Report, [Option<Columns>; 3]), Error> {
    let start = Instant::now();
    let method = choice.open(&study.setup.model)?;
    let open = start.elapsed();
    let swept = sweep(study, plan, method, Writers::in_memory(study, plan)?, (stop, progress))?;
    let Swept { writers, counts, solve, highlights, ranked } = swept;
    let (files, removed, backend) = (Vec::new(), Vec::new(), choice.backend.clone());
    let seconds = Seconds::new(start.elapsed(), open, solve);
    Ok((Report { files, removed, counts, seconds, backend, highlights, ranked }, writers.into_columns()))
}

/// What a sweep leaves behind.
struct Swept {
    writers: Writers,
    counts: Counts,
    solve: Duration,
    highlights: Vec<Kept>,
    ranked: u64,
}

fn sweep<'a>(
    study: &'a Study,
    plan: &'a Plan,
    method: Method,
    writers: Writers,
    steered: (&'a AtomicBool, &'a mut dyn Progress),
) -> Result<Swept, Error> {
    let mut run = Run::new((study, plan), method, writers, steered);
    if let Some(reader) = &plan.reader {
        run.counts.solved += reader.sweeps().taps;
        run.counts.sweeps.merge(&reader.sweeps());
        run.counts.chart = Some(serde_json::json!(reader.summary()));
    }
    match &study.space {
        Space::Grid(factors) => {
            grid::run(&mut run, &Layout::new(factors))?;
        }
        Space::List(tuples) => list::run(&mut run, tuples)?,
        Space::File(listed) => file::run(&mut run, listed)?,
    }
    let (counts, solve, writers) = (run.counts, run.solve, run.writers);
    let ranked = counts.complete.unwrap_or(run.best.offered);
    Ok(Swept { writers, counts, solve, highlights: run.best.into_rows(), ranked })
}

/// Which tables are asked for.
fn wanted(study: &Study, plan: &Plan) -> [bool; 3] {
    [plan.tuples, study.output.designs, study.output.distances]
}

/// Names of the tables that are written.
fn names(study: &Study, plan: &Plan) -> Vec<&'static str> {
    Table::ALL.into_iter().zip(wanted(study, plan)).filter(|(_, w)| *w).map(|(t, _)| t.file()).collect()
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
        Self { study, plan, evaluator, writers, counts, best, solve, stop, progress }
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
    fn write(&mut self, table: Table, block: Block, rows: u64) -> Result<(), Error> {
        match (&mut self.writers.places[table as usize], block) {
            (Some(Place::File(file)), Block::Text(text)) => file.write(&text)?,
            (Some(Place::Memory(all)), Block::Columns(more)) => all.append(more)?,
            _ => {}
        }
        self.count(table, rows);
        Ok(())
    }

    /// Counts rows of a table that is asked for.
    fn count(&mut self, table: Table, rows: u64) {
        if self.writers.wants(table) {
            self.counts.rows[table as usize] += rows;
        }
    }
}

/// Where a table goes.
enum Place {
    File(Box<Output>),
    Memory(Columns),
}

/// Where the tables go, and in what form their rows come; `None` for a table that nobody asked for.
struct Writers {
    form: Form,
    places: [Option<Place>; 3],
}

impl Writers {
    /// Writes nothing.
    fn none() -> Self {
        Self { form: Form::Text, places: [const { None }; 3] }
    }

    fn in_memory(study: &Study, plan: &Plan) -> Result<Self, Error> {
        let place = |table: Table| -> Result<Option<Place>, Error> {
            if !wanted(study, plan)[table as usize] {
                return Ok(None);
            }
            let columns = Columns::like(&table.blank(), plan.rows[table as usize])?;
            Ok(Some(Place::Memory(columns)))
        };
        let [tuples, designs, distances] = Table::ALL.map(place);
        Ok(Self { form: Form::Columns, places: [tuples?, designs?, distances?] })
    }

    fn new(study: &Study, plan: &Plan, folder: &mut Folder) -> Result<Self, Error> {
        let wanted = wanted(study, plan);
        let open = |table: Table| -> Result<Option<Place>, Error> {
            if !wanted[table as usize] {
                return Ok(None);
            }
            let mut file = folder.file(table.file())?;
            let mut text = Text::default();
            text.header(&table.columns(&study.setup)).map_err(|e| Error::Run(e.to_string()))?;
            file.write(&text.into_bytes())?;
            Ok(Some(Place::File(Box::new(file))))
        };
        let [tuples, designs, distances] = Table::ALL.map(open);
        Ok(Self { form: Form::Text, places: [tuples?, designs?, distances?] })
    }

    fn wants(&self, table: Table) -> bool {
        self.places[table as usize].is_some()
    }

    fn close(self) -> Result<(), Error> {
        self.places.into_iter().flatten().try_for_each(|place| match place {
            Place::File(file) => file.close(),
            Place::Memory(_) => Ok(()),
        })
    }

    fn into_columns(self) -> [Option<Columns>; 3] {
        self.places.map(|place| match place {
            Some(Place::Memory(columns)) => Some(columns),
            _ => None,
        })
    }
}

/// Everything that makes two designs of a tuple file the same.
fn key(t: &Tuple) -> [u64; 5] {
    [t.D, t.d, t.L_a, t.x_ss, t.l].map(|x| (x + 0.0).to_bits())
}
