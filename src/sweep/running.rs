//! A sweep under way: what its routes share.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::best::Best;
use super::keep::{Keeper, Reached};
use super::writers::Writers;
use crate::backend::Choice;
use crate::census::{Taps, sample};
use crate::curve::{
    self, Ask, Curve,
    both::{self, Both},
};
use crate::design::Design;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::plan::Plan;
use crate::progress::Progress;
use crate::scene::{Study, Theory, Tuple};
use crate::sink::frame::Frame;
use crate::sink::run_json::Counts;
use crate::sink::table::Table;

pub(super) struct Run<'a> {
    pub study: &'a Study,
    pub evaluator: Evaluator<'a>,
    pub writers: Writers,
    /// What is known of the complete chunks, and counted in the one under way.
    pub reached: Reached,
    /// Design and drive of the rows that `top` keeps.
    pub kept: Vec<Tuple>,
    pub plan: &'a Plan,
    pub stop: &'a AtomicBool,
    pub progress: &'a mut dyn Progress,
    /// Designs that are its own.
    pub designs: Range<u64>,
    /// Taps of these, about.
    pub taps: u64,
    /// Keeps what is complete; nothing where nothing is written.
    pub keeper: Option<Keeper>,
}

impl<'a> Run<'a> {
    /// Of nothing yet, into no tables.
    pub fn new(
        (study, plan): (&'a Study, &'a Plan),
        method: Method,
        (stop, progress): (&'a AtomicBool, &'a mut dyn Progress),
    ) -> Self {
        let evaluator = Evaluator::new(&study.setup, method).stopping(stop);
        let reached = Reached { best: Best::new(study.output.top.unwrap_or(0)), ..Reached::default() };
        Self {
            study,
            evaluator,
            writers: Writers::none(),
            reached,
            kept: Vec::new(),
            plan,
            stop,
            progress,
            designs: 0..plan.designs,
            taps: plan.taps,
            keeper: None,
        }
    }

    /// Does `f` unless asked to stop, and notes the time and the sweeps that it took.
    fn timed<R, E>(&mut self, f: impl FnOnce(&mut Evaluator<'a>) -> Result<R, E>) -> Result<R, Error>
    where
        Error: From<E>,
    {
        self.check_stop()?;
        let start = Instant::now();
        let done = f(&mut self.evaluator)?;
        self.reached.solve += start.elapsed().as_secs_f64();
        self.reached.counts.sweeps.merge(&self.evaluator.take_sweeps());
        Ok(done)
    }

    /// Outcomes of `tasks`; `Err` when asked to stop.
    pub fn evaluate(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        let outcomes = self.timed(|evaluator| evaluator.run(designs, tasks))?;
        self.reached.counts.solved += outcomes.len() as u64;
        self.reached.counts.referred += outcomes.iter().filter(|o| o.referred).count() as u64;
        for o in outcomes.iter().filter(|o| o.status.counts()) {
            self.reached.counts.strain.push(o.magnitude());
        }
        Ok(outcomes)
    }

    /// The model's own curve of each of `asks`. None unless distances are told by the model; `Err` when asked to stop.
    pub fn curves(
        &mut self,
        designs: &[Design],
        asks: impl Iterator<Item = Ask>,
    ) -> Result<Vec<Option<Curve>>, Error> {
        if self.study.setup.estimate.theory != Theory::Exact || self.study.setup.gauge.second {
            return Ok(Vec::new());
        }
        let asks: Vec<Ask> = asks.collect();
        let setup = &self.study.setup;
        let (curves, solved) = self.timed(|evaluator| curve::solve(setup, evaluator, designs, &asks))?;
        self.reached.counts.solved += solved;
        Ok(curves)
    }

    /// What the model takes the two strains of each of `tasks` for; `reach` says the smallest and the largest distance asked of a design.
    /// Nothing unless distances are told so; `Err` when asked to stop.
    pub fn both(
        &mut self,
        designs: &[Design],
        tasks: impl FnOnce() -> Vec<Task>,
        outcomes: &[Outcome],
        reach: impl Fn(usize) -> [f64; 2],
    ) -> Result<Vec<Option<Both>>, Error> {
        let setup = &self.study.setup;
        if !both::asked(setup) {
            return Ok(Vec::new());
        }
        let ask =
            |(task, tap): (Task, &Outcome)| both::Ask::own(setup, task, tap, reach(task.design as usize));
        let asks: Vec<both::Ask> = tasks().into_iter().zip(outcomes).map(ask).collect();
        let (found, solved) = self.timed(|evaluator| both::both(setup, evaluator, designs, &asks))?;
        self.reached.counts.solved += solved;
        Ok(found)
    }

    /// `Err` when asked to stop.
    pub fn check_stop(&self) -> Result<(), Error> {
        if self.stop.load(Ordering::Relaxed) { Err(SolveError::Stopped.into()) } else { Ok(()) }
    }

    /// Taps that the full model solved in place of one with effects left off.
    pub fn mended(&self) -> u64 {
        self.reached.mended + self.evaluator.mended()
    }

    /// Takes over the counts of finished taps.
    pub fn absorb(&mut self, status: &Counts) {
        self.reached.counts.taps += status.taps;
        self.reached.counts.combinations.add(&status.combinations);
        self.progress.at(self.reached.counts.taps, self.taps);
    }

    /// Shows that `more` taps than the finished ones are done.
    pub fn show(&mut self, more: u64) {
        self.progress.at(self.reached.counts.taps + more, self.taps);
    }

    /// Appends the rows of `pieces` to a table, if it is written, and counts them.
    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        if self.writers.wants(table) {
            self.reached.counts.rows[table as usize] +=
                pieces.iter().map(|piece| piece.len() as u64).sum::<u64>();
        }
        self.writers.write(table, pieces)
    }
}

/// Taps of the whole space that a device is compared on before the first row: what it gets wrong there, each part of a sweep finds alike.
const TAPS: u32 = 32;

/// The method of `choice`, whose device has been compared with the CPU on taps of `study`. Kernels of cones have known taps instead.
pub(super) fn method(study: &Study, choice: &Choice, stop: &AtomicBool) -> Result<Method, Error> {
    let (setup, method) = (&study.setup, choice.open(&study.setup.model)?);
    if choice.backend.adapter.is_none() || setup.built.is_none() {
        return Ok(method);
    }
    let taps = Taps::of(setup, &sample::random(&study.space, TAPS, 0));
    // Taps that are the reference's are compared with nothing.
    let mut evaluator = Evaluator::new(setup, method).stopping(stop).sparing(usize::MAX);
    evaluator.run(&taps.designs, &taps.tasks)?;
    Ok(evaluator.into_method())
}
