//! From designs and taps to outcomes, on any backend: the only place where statuses of the physics are decided.

mod gradient;
mod guard;
mod input;
mod outcome;
mod rigs;
mod rod;
mod solve;
mod strains;
mod task;

use std::fmt::Debug;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::design::Design;
use crate::error::SolveError;
use crate::kernel::gpu::ranking::DeviceRanker;
use crate::kernel::ranking::{OnCpu, Sheet};
use crate::kernel::{Ladder, Section, Solution, Solver, Tap};
use crate::progress::{NEVER, go_on};
use crate::reduce::Sweeps;
use crate::scene::{Geometry, Grip, Layout, Material, Precision, Setup};
use crate::status::Status;
pub use gradient::{Gradient, OUTPUTS, section};
pub use guard::{Guard, doubts};
pub use input::Input;
use outcome::{Asked, reference};
pub use outcome::{beside_linear, outcome_of_chart, problem};
pub use rod::takes_all;
use solve::Solved;
pub use strains::{closed, closed_gradient, is_closed};
pub use task::{Outcome, Outcomes, Task};

/// A backend, ready to evaluate taps of one setup.
pub struct Evaluator<'a> {
    setup: &'a Setup,
    method: Method,
    taps: Vec<Tap>,
    solutions: Vec<Solution>,
    sweeps: Sweeps,
    /// Taps referred to the reference so far.
    pub referred: usize,
    reader: Option<Arc<dyn Source>>,
    /// Ladders for materials of rigs that differ.
    laws: Vec<(Material, Ladder)>,
    guard: Option<Box<Guard<'a>>>,
    /// Set from outside to stop early: work then fails with [`SolveError::Stopped`].
    pub stop: &'a AtomicBool,
}

/// The taps without a solution that a call refers to the reference. The others get no values.
#[derive(Debug, Clone, Copy)]
pub struct Referral {
    /// Most taps that the evaluator refers, in all its calls: each can take a second. Beyond, [`SolveError::TooHard`] is returned at once.
    pub most: usize,
    /// True if taps are samples of a smooth function: a frictionless one without a solution lies beyond its end, and is not referred.
    pub samples: bool,
    /// True if taps far from the base are referred that are near no equilibrium: the reference takes seconds to confirm each. Those of built whiskers
    /// always are.
    pub far: bool,
}

impl Referral {
    /// All taps without a solution.
    pub const ALL: Self = Self { most: usize::MAX, samples: false, far: true };
    /// For samples of a smooth function.
    pub const SAMPLES: Self = Self { samples: true, ..Self::ALL };
}

/// A source of outcomes: charts.
pub trait Source: Debug + Send + Sync {
    /// Outcomes of `tasks`; `None` of those that must be solved.
    fn read(&self, setup: &Setup, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>>;
}

/// Method of solving taps.
pub enum Method {
    /// A fast kernel.
    Fast {
        /// The backend.
        solver: Box<dyn Solver>,
        /// Rungs of the kernel, and the section law.
        ladder: Ladder,
        /// Bound on the strain error.
        tolerance: f64,
    },
    /// f64 shooting.
    Reference,
}

impl Method {
    /// Taps of `material` by `solver`, in `precision`, with strains to `tolerance`.
    pub fn fast(solver: Box<dyn Solver>, precision: Precision, material: &Material, tolerance: f64) -> Self {
        Self::Fast { solver, ladder: Ladder::new(precision, material, tolerance), tolerance }
    }
}

impl<'a> Evaluator<'a> {
    /// Evaluates taps of `setup` by `method`.
    pub fn new(setup: &'a Setup, method: Method) -> Self {
        Self {
            setup,
            method,
            taps: Vec::new(),
            solutions: Vec::new(),
            sweeps: Sweeps::default(),
            referred: 0,
            reader: None,
            laws: Vec::new(),
            guard: None,
            stop: &NEVER,
        }
    }

    /// Fails with [`SolveError::Stopped`] once `stop` is set.
    pub fn stopping(self, stop: &'a AtomicBool) -> Self {
        Self { stop, ..self }
    }

    /// With `guard` for the taps near a threshold, if there is one.
    pub fn guarded(self, guard: Option<Guard<'a>>) -> Self {
        Self { guard: guard.map(Box::new), ..self }
    }

    /// Taps that the guard has solved.
    pub fn mended(&self) -> u64 {
        self.guard.as_ref().map_or(0, |guard| guard.mended)
    }

    /// Runs `f` without the guard, so that functions smooth in the reduced model stay so.
    pub fn unguarded<R>(&mut self, f: impl FnOnce(&mut Self) -> R) -> R {
        let guard = self.guard.take();
        let done = f(self);
        self.guard = guard;
        done
    }

    /// With a `reader` for [`Self::read`], if there is one.
    pub fn reading(self, reader: Option<Arc<impl Source + 'static>>) -> Self {
        Self { reader: reader.map(|reader| reader as Arc<dyn Source>), ..self }
    }

    /// Outcomes of `tasks`, in their order: read where possible, else as [`Self::run_referring`].
    pub fn read(&mut self, designs: &[Design], tasks: &[Task], referral: Referral) -> Outcomes {
        let Some(reader) = &self.reader else { return self.run_referring(designs, tasks, referral) };
        let found = reader.read(self.setup, designs, tasks);
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| found[i].is_none()).collect();
        let again: Vec<Task> = open.iter().map(|&i| tasks[i]).collect();
        let solved = self.unguarded(|one| one.run_referring(designs, &again, referral))?;
        let mut all: Vec<Outcome> = found.into_iter().map(|o| o.unwrap_or(Outcome::NOTHING)).collect();
        open.iter().zip(solved).for_each(|(&i, outcome)| all[i] = outcome);
        self.mend(designs, tasks, all)
    }

    fn mend(&mut self, designs: &[Design], tasks: &[Task], mut outcomes: Vec<Outcome>) -> Outcomes {
        if let Some(guard) = &mut self.guard {
            guard.mend(designs, tasks, &mut outcomes)?;
        }
        Ok(outcomes)
    }

    /// The method, for another setup.
    pub fn into_method(self) -> Method {
        self.method
    }

    /// Kernel sweeps spent since the last call, on any taps.
    pub fn take_sweeps(&mut self) -> Sweeps {
        std::mem::take(&mut self.sweeps)
    }

    /// Ranks the designs of `layout` by charts as a `sheet` on the solver's device, if it has one and ranks them as `on_cpu` does.
    pub fn ranking(
        &mut self,
        sheet: impl FnOnce() -> Option<Sheet>,
        layout: &Layout,
        on_cpu: &OnCpu<'_>,
    ) -> Result<Option<DeviceRanker>, SolveError> {
        match &mut self.method {
            // Shaders have f of a cone only.
            Method::Fast { solver, .. } if self.setup.built.is_none() => {
                solver.device().map_or(Ok(None), |device| device.ranking(sheet, layout, on_cpu))
            }
            _ => Ok(None),
        }
    }

    /// Leaves the solver's device, which failed as `why` says while it ranked.
    pub fn give_up(&mut self, why: &str) {
        if let Method::Fast { solver, .. } = &mut self.method
            && let Some(device) = solver.device()
        {
            device.give_up(why, 0);
        }
    }

    /// Bound on the strain error; 0 of the reference.
    pub fn tolerance(&self) -> f64 {
        match &self.method {
            Method::Fast { tolerance, .. } => *tolerance,
            Method::Reference => 0.0,
        }
    }

    /// [`Self::run_referring`] for designs with rigs of one kind, without the guard; `expected`: the answers of the reference, if known, so that it need
    /// not be used again.
    pub fn run_alike(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        referral: Referral,
        expected: Option<&[Outcome]>,
    ) -> Outcomes {
        go_on(self.stop)?;
        let (setup, stop) = (self.setup, self.stop);
        // Linear geometry has closed forms.
        let outcomes = if matches!(self.method, Method::Reference) || setup.model.geometry == Geometry::Linear
        {
            let answer = |t: &Task| match stop.load(Ordering::Relaxed) {
                true => Outcome::NOTHING,
                false => reference(setup, &designs[t.design as usize], t),
            };
            tasks.par_iter().map(answer).collect()
        } else {
            self.outcomes(designs, tasks, (None, referral), expected)?
        };
        go_on(self.stop)?;
        Ok(outcomes)
    }

    /// Outcomes of `tasks` with all contacts of `grip`, none by the reference: accurate to the tolerance relative to their strain or, where that crosses
    /// zero next to the contact, to the strain of linear theory, as charts hold their ratio. `samples`: see [`Referral`].
    pub fn run_gripped(&mut self, designs: &[Design], tasks: &[Task], grip: Grip, samples: bool) -> Outcomes {
        go_on(self.stop)?;
        self.outcomes(designs, tasks, (Some(grip), Referral { samples, ..Referral::ALL }), None)
    }

    fn outcomes(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        (grip, referral): (Option<Grip>, Referral),
        expected: Option<&[Outcome]>,
    ) -> Outcomes {
        let solved = self.solutions(designs, tasks, grip, referral.samples)?;
        solved.iter().filter(|s| s.sweeps > 0.0).for_each(|s| self.sweeps.push(s.sweeps));
        let (setup, tolerance, stop) = (self.setup, self.tolerance(), self.stop);
        let section = match &self.method {
            Method::Fast { ladder, .. } if referral.samples => Some(&ladder.section),
            _ => None,
        };
        // Samples of a smooth function without a solution lie beyond its end, unless the section law ends before.
        let beyond = |s: &Solved| {
            let whole = |section: &Section| section.chart().is_none_or(|chart| chart.whole);
            s.grip == Grip::Slide(0.0) && !s.unsure && section.is_some_and(whole)
        };
        // Taps that stay without an answer if they are left open.
        let unsolved = |task: &Task, design: &Design, s: &Solved| {
            let far = || !referral.far && setup.built.is_none() && s.astray && task.is_far(design);
            grip.is_some() || beyond(s) || far()
        };
        // `None` where the reference must decide.
        let tell = |(task, s): (&Task, &Solved)| {
            let design = &designs[task.design as usize];
            let asked = Asked::of(setup, design, task, s.found.strain_linear);
            let Some(asked) = asked else { return Some(Outcome::OUTSIDE) };
            let nothing = || unsolved(task, design, s).then(|| asked.unsolved(Status::NOT_CONVERGED));
            asked.told(s, tolerance).or_else(nothing)
        };
        let told: Vec<Option<Outcome>> = tasks.par_iter().zip(&solved).map(tell).collect();
        self.referred += told.iter().filter(|told| told.is_none()).count();
        if self.referred > referral.most {
            return Err(SolveError::TooHard);
        }
        let finish = |(i, told): (usize, Option<Outcome>)| {
            let refer = || match stop.load(Ordering::Relaxed) {
                true => Outcome::NOTHING,
                false => {
                    let (task, design) = (&tasks[i], &designs[tasks[i].design as usize]);
                    let answer = expected.map_or_else(|| reference(setup, design, task), |known| known[i]);
                    // No other solver has tilted poles of built whiskers.
                    Outcome { referred: setup.built.is_none() || task.direction.is_upright(), ..answer }
                }
            };
            told.unwrap_or_else(refer)
        };
        let outcomes = told.into_par_iter().enumerate().map(finish).collect();
        go_on(stop)?;
        Ok(outcomes)
    }
}
