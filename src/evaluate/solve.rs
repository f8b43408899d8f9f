//! Frames and solutions of taps on a fast kernel.

use rayon::prelude::*;

use super::{Evaluator, Method, Task};
use crate::design::{Design, amount};
use crate::error::SolveError;
use crate::kernel::{
    self, Effects, Solution,
    rule::limits::ASTRAY,
    tap::{Ask, Frame, Response},
};
use crate::physics::onset::Grip;
use crate::scene::{Contact, Setup};

/// Errors of the forces of a sticking contact, per error of the strain, at most.
const ROUGH: f64 = 100.0;

/// Taps that a thread frames at least: fewer cost less than to hand them over.
const FRAMES: usize = 1024;

/// A framed tap, its solution and what holds its contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solved {
    pub frame: Frame,
    pub solution: Solution<f64>,
    pub grip: Grip,
    /// Sweeps spent on it, also for another grip.
    pub sweeps: f64,
    /// Read from solutions at other drives.
    pub interpolated: bool,
}

impl Evaluator<'_> {
    /// Frames and solutions of `tasks`, whatever holds their contacts; `None` outside the domain or at the apex.
    pub(super) fn solutions(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
    ) -> Result<Vec<Option<Solved>>, SolveError> {
        let solved = match self.setup.model.contact {
            Contact::Frictionless | Contact::Coulomb(0.0) => {
                self.solve(designs, tasks, &|_| Grip::Slide(0.0))
            }
            Contact::Stick => self.solve(designs, tasks, &|_| Grip::Stick),
            Contact::Coulomb(mu) => self.coulomb(designs, tasks, mu),
        }?;
        solved.iter().flatten().for_each(|s| self.sweeps.push(s.sweeps));
        Ok(solved)
    }

    /// Frames and solutions of `tasks`; `None` outside the domain or at the apex.
    pub(super) fn solve(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: &(dyn Fn(usize) -> Grip + Sync),
    ) -> Result<Vec<Option<Solved>>, SolveError> {
        let setup = self.setup;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok(vec![None; tasks.len()]);
        };
        let at = |i: usize| frame(setup, &designs[tasks[i].design as usize], &tasks[i], grip(i));
        let framed = |i: usize| {
            at(i).map(|frame| Solved {
                frame,
                solution: Solution::FAILED,
                grip: grip(i),
                sweeps: 0.0,
                interpolated: false,
            })
        };
        let places = (0..tasks.len()).into_par_iter().with_min_len(FRAMES);
        let mut solved: Vec<Option<Solved>> = places.map(framed).collect();
        if tasks.is_empty() {
            return Ok(solved);
        }
        self.taps.clear();
        self.taps.extend(solved.iter().flatten().map(|s| *s.frame.tap()));
        let effects = Effects::new(&setup.model, setup.gauge.side, grip(0) == Grip::Stick);
        kernel::solve(solver.as_mut(), effects, rungs, *tolerance, &self.taps, &mut self.solutions)?;
        for (place, s) in solved.iter_mut().flatten().zip(&self.solutions) {
            (place.solution, place.sweeps) = (*s, s.sweeps);
        }
        Ok(solved)
    }

    /// Coulomb friction: the sticking solution where |T| ≤ μP, else sliding with the sign of the sticking T. Where the kernel finds no
    /// sticking solution, or one too rough to tell, the tap stays a sticking one without a solution.
    fn coulomb(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        mu: f64,
    ) -> Result<Vec<Option<Solved>>, SolveError> {
        let mut solved = self.solve(designs, tasks, &|_| Grip::Stick)?;
        let decide = |s: &Solved| {
            let Response { tangential, normal, .. } = s.frame.response(&s.solution);
            let spare = mu * normal - tangential.abs();
            let rough = ROUGH * s.solution.error * tangential.abs().max(normal.abs());
            match spare {
                _ if !s.solution.within(ASTRAY) || spare.abs() <= rough => None,
                _ if spare > 0.0 => Some(Grip::Stick),
                _ => Some(Grip::Slide(mu.copysign(tangential))),
            }
        };
        let mut sliding = Vec::new();
        for (i, place) in solved.iter_mut().enumerate() {
            let Some(s) = place else { continue };
            match decide(s) {
                Some(Grip::Stick) => {}
                Some(grip) => sliding.push((i, grip)),
                None => s.solution = Solution { load: s.solution.load, ..Solution::FAILED },
            }
        }
        let again: Vec<Task> = sliding.iter().map(|&(i, _)| tasks[i]).collect();
        let slid = self.solve(designs, &again, &|k| sliding[k].1)?;
        for (&(i, _), s) in sliding.iter().zip(slid) {
            let before = solved[i].map_or(0.0, |s| s.sweeps);
            solved[i] = s.map(|s| Solved { sweeps: before + s.sweeps, ..s });
        }
        Ok(solved)
    }
}

/// `task` in its own units; `None` outside the domain or at the apex.
pub(super) fn frame(setup: &Setup, design: &Design, task: &Task, grip: Grip) -> Option<Frame> {
    let shared = design.shared.as_ref().filter(|_| design.admits(setup.drive, task.a, task.drive))?;
    let ask = Ask {
        model: &setup.model,
        side: setup.gauge.side,
        curve: &shared.model,
        peak: shared.peak,
        a: task.a,
        amount: amount(setup.drive, task.drive),
        grip,
    };
    Frame::new(&ask)
}
