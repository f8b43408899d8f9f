//! Single taps, as often as they are asked for: each of a whisker of its own.
//!
//! On a CPU they are solved in blocks, each from whisker to outcome on one core, so that what lies between stays in its cache: it is
//! ten times as large as what is asked and told.

use std::sync::{Mutex, OnceLock, PoisonError};

use rayon::prelude::*;

use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::kernel::Rung;
use crate::plan::CHUNK;
use crate::scene::{RunOptions, Setup, Tuple};

/// Taps of a block on a CPU: a work item of the kernel.
const BLOCK: usize = 1024;

/// What solves taps of one setup, from any thread.
pub struct Taps {
    setup: Setup,
    choice: Choice,
    /// Opened, and not in use just now.
    workers: Mutex<Vec<Worker>>,
    /// With the charts of the first, for all.
    rungs: OnceLock<Vec<Rung>>,
}

/// What one thread solves with, and room for it.
struct Worker {
    method: Method,
    designs: Vec<Design>,
    tasks: Vec<Task>,
}

impl Taps {
    /// Of `setup`, where `options` say.
    ///
    /// # Errors
    /// A backend that the machine does not have; a tolerance that it cannot keep.
    pub fn new(setup: Setup, options: &RunOptions) -> Result<Self, Error> {
        let choice = Choice::new(options)?;
        Ok(Self { setup, choice, workers: Mutex::default(), rungs: OnceLock::new() })
    }

    /// What all taps share.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Where they are solved.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// Opens what solves them, once more.
    ///
    /// # Errors
    /// A device that does not open.
    pub fn method(&self) -> Result<Method, Error> {
        let mut method = self.choice.open(&self.setup.model)?;
        if let Method::Fast { rungs, .. } = &mut method {
            let charted = || {
                rungs.first().map(Rung::chart);
                rungs.clone()
            };
            *rungs = self.rungs.get_or_init(charted).clone();
        }
        Ok(method)
    }

    /// Solves as many taps as `out` has places, `tap(i)` (mm, degrees or mm) being tap i, and writes what `read` reads of their outcomes. A
    /// tap without a solution says so in its status.
    ///
    /// # Errors
    /// Threads or kernels that fail.
    pub fn solve<T: Send>(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        read: impl Fn(&Outcome) -> T + Sync,
        out: &mut [T],
    ) -> Result<(), Error> {
        let on_cpu = self.choice.backend.adapter.is_none();
        let size = if on_cpu { BLOCK } else { CHUNK as usize };
        let one = |(at, out): (usize, &mut [T])| self.block(|i| tap(at * size + i), &read, out);
        match on_cpu && out.len() > size {
            true => out.par_chunks_mut(size).enumerate().try_for_each(one),
            false => out.chunks_mut(size).enumerate().try_for_each(one),
        }
    }

    fn block<T: Send>(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        read: &(impl Fn(&Outcome) -> T + Sync),
        out: &mut [T],
    ) -> Result<(), Error> {
        let idle = || self.workers.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = idle().pop();
        let Worker { method, mut designs, mut tasks } = match waiting {
            Some(worker) => worker,
            None => Worker { method: self.method()?, designs: Vec::new(), tasks: Vec::new() },
        };
        let places = || (0..out.len()).into_par_iter().with_min_len(BLOCK);
        places().map(|i| Design::new(&self.setup, tap(i))).collect_into_vec(&mut designs);
        let task = |i: usize| Task::of(i as u32, &designs[i].tuple);
        places().map(task).collect_into_vec(&mut tasks);
        let mut evaluator = Evaluator::new(&self.setup, method);
        let outcomes = evaluator.run(&designs, &tasks)?;
        out.par_iter_mut().with_min_len(BLOCK).zip(&outcomes).for_each(|(place, o)| *place = read(o));
        idle().push(Worker { method: evaluator.into_method(), designs, tasks });
        Ok(())
    }
}
