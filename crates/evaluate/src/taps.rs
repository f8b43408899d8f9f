//! Single taps, each of another whisker. On a CPU they are solved in blocks, each from whisker to outcome on one core, so that the intermediate data,
//! ten times as large as input and output, stay in its cache.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use rayon::prelude::*;

use crate::CHUNK;
use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::error::{Error, InputError};
use crate::evaluate::{
    Evaluator, Gradient, Input, Method, Outcome, Task, closed, closed_gradient, is_closed, section,
};
use crate::kernel::frames::{Framed, Framing};
use crate::kernel::{Ladder, Section};
use crate::scene::{RunOptions, Setup, Tuple};

/// Taps of a block on a CPU: a work item of the kernel.
const BLOCK: usize = 1024;

/// Solves taps of one setup, from any thread.
pub struct Taps {
    setup: Setup,
    choice: Choice,
    framing: Option<Framing>,
    /// Opened and idle.
    workers: Mutex<Vec<Worker>>,
    /// Shared, as are its charts.
    ladder: OnceLock<Ladder>,
    /// The section law for derivatives.
    section: Section,
}

/// Refuses tilted and leaning poles where `setup` has no taps at them, with the reason as the error.
pub fn refuse(setup: &Setup, leaning: [bool; 2]) -> Result<(), InputError> {
    let Some(why) = setup.forbids(leaning) else { return Ok(()) };
    let key = if leaning[0] { "tilt" } else { "lean" };
    Err(InputError::new(why).key(key).allowed("0, or contact=\"frictionless\""))
}

/// A solver and the memory of its last block.
type Worker = (Method, Vec<Design>, Vec<Task>, Framed);

impl Taps {
    /// For `setup`, on the backend of `options`.
    /// Errors: a backend that the machine does not have; a tolerance that it cannot keep.
    pub fn new(setup: Setup, options: &RunOptions) -> Result<Self, Error> {
        let choice = Choice::new(options)?;
        let framing = Framing::new(&setup).filter(|_| choice.backend.adapter.is_none());
        let section = section(&setup);
        Ok(Self { setup, choice, framing, workers: Mutex::default(), ladder: OnceLock::new(), section })
    }

    /// The setup of all taps.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The backend.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// Opens another solver of these taps.
    /// Errors: a device that does not open.
    pub fn method(&self) -> Result<Method, Error> {
        let mut method = self.choice.open(&self.setup.model)?;
        if let Method::Fast { ladder, .. } = &mut method {
            *ladder = self.ladder.get_or_init(|| ladder.clone()).clone();
        }
        Ok(method)
    }

    /// Solves as many taps as `out` has places, `tap(i)` (mm, degrees or mm) being tap i, and writes `read` of their outcomes. The status shows
    /// unsolved taps.
    /// Errors: threads or kernels that fail.
    pub fn solve<T: Send>(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        read: impl Fn(&Outcome) -> T + Sync,
        out: &mut [T],
    ) -> Result<(), Error> {
        self.in_blocks(out, |at, out| {
            self.block(
                |i| tap(at + i),
                out.len(),
                |_, _, outcomes| {
                    let places = out.par_iter_mut().with_min_len(BLOCK).zip(outcomes);
                    places.for_each(|(place, outcome)| *place = read(outcome));
                },
            )
        })
    }

    /// The same with derivatives by `inputs` ([`Gradient`]) of `numbers` of each outcome, into `slopes`: ordered by tap, then number, then input.
    /// Errors: as [`Self::solve`].
    pub fn gradients<T: Send>(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        (inputs, numbers): (&[Input], &[usize]),
        read: impl Fn(&Outcome) -> T + Sync,
        out: &mut [T],
        slopes: &mut [f64],
    ) -> Result<(), Error> {
        let width = inputs.len() * numbers.len();
        if width == 0 {
            return self.solve(tap, read, out);
        }
        let mut places: Vec<_> = out.iter_mut().zip(slopes.chunks_mut(width)).collect();
        let gradient = Gradient::new(&self.setup, inputs, &self.section);
        self.in_blocks(&mut places, |at, places| {
            self.block(
                |i| tap(at + i),
                places.len(),
                |designs, tasks, outcomes| {
                    let mut found = vec![f64::NAN; places.len() * width];
                    gradient.write((designs, tasks, outcomes), numbers, &mut found);
                    for (((out, slopes), outcome), found) in
                        places.iter_mut().zip(outcomes).zip(found.chunks(width))
                    {
                        **out = read(outcome);
                        slopes.copy_from_slice(found);
                    }
                },
            )
        })
    }

    /// Strains, and their derivatives by `inputs` into `slopes`: ordered by tap, then input.
    /// Errors: as [`Self::solve`].
    pub fn strain_gradients(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        inputs: &[Input],
        out: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Error> {
        if is_closed(&self.setup) && !inputs.is_empty() {
            let open = AtomicBool::new(false);
            let mut places: Vec<_> = out.iter_mut().zip(slopes.chunks_mut(inputs.len())).collect();
            self.in_blocks(&mut places, |at, places| {
                for (i, (strain, slopes)) in places.iter_mut().enumerate() {
                    match closed_gradient(&self.setup, &tap(at + i), inputs, slopes) {
                        Some(found) => **strain = found,
                        None => open.store(true, Ordering::Relaxed),
                    }
                }
                Ok(())
            })?;
            if !open.into_inner() {
                return Ok(());
            }
        }
        self.gradients(tap, (inputs, &[0]), |outcome| outcome.strain, out, slopes)
    }

    /// Solves as many taps as `out` has places, as [`Self::solve`], and writes their strains.
    /// Errors: threads or kernels that fail.
    pub fn strains(&self, tap: impl Fn(usize) -> Tuple + Sync, out: &mut [f64]) -> Result<(), Error> {
        if is_closed(&self.setup) {
            return self.in_blocks(out, |at, out| {
                let mut others = Vec::new();
                for (i, place) in out.iter_mut().enumerate() {
                    match closed(&self.setup, &tap(at + i)) {
                        Some(strain) => *place = strain,
                        None => others.push(i),
                    }
                }
                self.open(|i| tap(at + i), &others, out)
            });
        }
        match &self.framing {
            Some(framing) => self.in_blocks(out, |at, out| self.lanes(framing, |i| tap(at + i), out)),
            None => self.solve(tap, |outcome| outcome.strain, out),
        }
    }

    /// Solves the taps `open` of a block and writes their strains.
    fn open(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        open: &[usize],
        out: &mut [f64],
    ) -> Result<(), Error> {
        if open.is_empty() {
            return Ok(());
        }
        let told = |_: &_, _: &_, outcomes: &[Outcome]| {
            open.iter().zip(outcomes).for_each(|(&i, outcome)| out[i] = outcome.strain);
        };
        self.block(|k| tap(open[k]), open.len(), told)
    }

    /// Calls `one` for each block of `out`, with the index where it begins.
    fn in_blocks<T: Send>(
        &self,
        out: &mut [T],
        one: impl Fn(usize, &mut [T]) -> Result<(), Error> + Sync,
    ) -> Result<(), Error> {
        let on_cpu = self.choice.backend.adapter.is_none();
        let size = if on_cpu { BLOCK } else { CHUNK as usize };
        let one = |(k, out): (usize, &mut [T])| one(k * size, out);
        match on_cpu && out.len() > size {
            true => out.par_chunks_mut(size).enumerate().try_for_each(one),
            false => out.chunks_mut(size).enumerate().try_for_each(one),
        }
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Worker>> {
        self.workers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn worker(&self) -> Result<Worker, Error> {
        let waiting = self.idle().pop();
        waiting.map_or_else(|| Ok((self.method()?, Vec::new(), Vec::new(), Framed::default())), Ok)
    }

    fn lanes(
        &self,
        framing: &Framing,
        tap: impl Fn(usize) -> Tuple + Sync,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let (method, designs, tasks, mut framed) = self.worker()?;
        let dimensions = |i: usize| {
            let t = tap(i);
            let upright = if t.direction().is_upright() { t.a } else { f64::NAN };
            [t.D, t.d, t.L_a, t.x_ss, t.l, upright, t.drive]
        };
        framing.frame(out.len(), dimensions, &mut framed);
        let mut evaluator = Evaluator::new(&self.setup, method);
        let open = evaluator.strains(&framed, out)?;
        self.idle().push((evaluator.into_method(), designs, tasks, framed));
        self.open(tap, &open, out)
    }

    /// Solves `count` taps and calls `told` with them.
    fn block(
        &self,
        tap: impl Fn(usize) -> Tuple + Sync,
        count: usize,
        told: impl FnOnce(&[Design], &[Task], &[Outcome]),
    ) -> Result<(), Error> {
        let (method, mut designs, mut tasks, framed) = self.worker()?;
        let places = || (0..count).into_par_iter().with_min_len(BLOCK);
        places().map(|i| Design::new(&self.setup, tap(i))).collect_into_vec(&mut designs);
        let task = |i: usize| Task::of(i as u32, &designs[i].tuple);
        places().map(task).collect_into_vec(&mut tasks);
        let mut evaluator = Evaluator::new(&self.setup, method);
        let outcomes = evaluator.run(&designs, &tasks)?;
        told(&designs, &tasks, &outcomes);
        self.idle().push((evaluator.into_method(), designs, tasks, framed));
        Ok(())
    }
}
