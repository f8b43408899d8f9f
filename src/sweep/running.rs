//! State of a running sweep.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::best::Best;
use super::keep::{Keeper, Reached};
use super::output::Writers;
use crate::backend::Choice;
use crate::census::{Taps, sample};
use crate::curve::{
    self, Ask, Curve,
    both::{self, Both},
};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::plan::Plan;
use crate::progress::{Progress, go_on};
use crate::scene::{Study, Theory, Tuple};
use crate::sink::frame::Frame;
use crate::sink::run_json::Counts;
use crate::sink::table::Table;

pub(super) struct Run<'a> {
    pub study: &'a Study,
    pub evaluator: Evaluator<'a>,
    pub writers: Writers,
    pub reached: Reached,
    pub kept: Vec<Tuple>,
    pub plan: &'a Plan,
    pub stop: &'a AtomicBool,
    pub progress: &'a mut dyn Progress,
    pub designs: Range<u64>,
    pub taps: u64,
    /// `None` if nothing is written.
    pub keeper: Option<Keeper>,
}

impl<'a> Run<'a> {
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

    /// Runs `f` unless stopped; records its time and sweeps.
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

    pub fn evaluate(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        let outcomes = self.timed(|evaluator| evaluator.run(designs, tasks))?;
        self.reached.counts.solved += outcomes.len() as u64;
        self.reached.counts.referred += outcomes.iter().filter(|o| o.referred).count() as u64;
        for o in outcomes.iter().filter(|o| o.status.counts()) {
            self.reached.counts.strain.push(o.magnitude());
        }
        Ok(outcomes)
    }

    /// The exact model's curve of each of `asks`; empty unless distances come from the exact model.
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

    /// Estimates from the two strains of each of `tasks`; `reach` gives the smallest and largest distance of a design. Empty if not used.
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

    pub fn check_stop(&self) -> Result<(), Error> {
        Ok(go_on(self.stop)?)
    }

    /// Taps that the full model solved instead of the reduced one.
    pub fn mended(&self) -> u64 {
        self.reached.mended + self.evaluator.mended()
    }

    pub fn absorb(&mut self, status: &Counts) {
        self.reached.counts.taps += status.taps;
        self.reached.counts.combinations.add(&status.combinations);
        self.progress.at(self.reached.counts.taps, self.taps);
    }

    pub fn show(&mut self, more: u64) {
        self.progress.at(self.reached.counts.taps + more, self.taps);
    }

    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        if self.writers.wants(table) {
            self.reached.counts.rows[table as usize] +=
                pieces.iter().map(|piece| piece.len() as u64).sum::<u64>();
        }
        self.writers.write(table, pieces)
    }
}

/// Taps on which a device is compared with the CPU before the first row. They are taken from the whole space, so that all parts agree.
const TAPS: u32 = 32;

/// The method of `choice`, after its device was compared with the CPU on taps of `study`. Kernels of cones are checked on fixed taps instead.
pub(super) fn method(study: &Study, choice: &Choice, stop: &AtomicBool) -> Result<Method, Error> {
    let (setup, method) = (&study.setup, choice.open(&study.setup.model)?);
    if choice.backend.adapter.is_none() || setup.built.is_none() {
        return Ok(method);
    }
    let taps = Taps::of(setup, &sample::random(&study.space, TAPS, 0));
    // Taps left to the reference are not compared.
    let mut evaluator = Evaluator::new(setup, method).stopping(stop).sparing(usize::MAX);
    evaluator.run(&taps.designs, &taps.tasks)?;
    Ok(evaluator.into_method())
}
