//! Frames and solutions of taps on a fast kernel.

use rayon::prelude::*;

use super::{Evaluator, Method, Task};
use crate::design::{Design, amount};
use crate::kernel::{
    self, Effects, Kernel, Solution,
    tap::{Ask, Frame},
};
use crate::physics::onset::Grip;
use crate::scene::{Contact, Geometry, Scene};

/// A framed tap, its solution and what holds its contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solved {
    pub frame: Frame,
    pub solution: Solution<f64>,
    pub grip: Grip,
    /// Read from solutions at other drives.
    pub interpolated: bool,
}

impl Evaluator<'_> {
    /// Frames and solutions of `tasks`, whatever holds their contacts; `None` outside the domain or at the apex.
    pub(super) fn solutions(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
    ) -> Result<Vec<Option<Solved>>, String> {
        match self.scene.model.contact {
            _ if self.scene.model.geometry == Geometry::Linear => {
                self.solve(designs, tasks, &|_| Grip::Slide(0.0))
            }
            Contact::Frictionless | Contact::Coulomb(0.0) => {
                self.solve(designs, tasks, &|_| Grip::Slide(0.0))
            }
            Contact::Stick => self.solve(designs, tasks, &|_| Grip::Stick),
            Contact::Coulomb(mu) => self.coulomb(designs, tasks, mu),
        }
    }

    /// Frames and solutions of `tasks`; `None` outside the domain or at the apex.
    fn solve(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: &(dyn Fn(usize) -> Grip + Sync),
    ) -> Result<Vec<Option<Solved>>, String> {
        let scene = self.scene;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok(vec![None; tasks.len()]);
        };
        let at = |i: usize| frame(scene, &designs[tasks[i].design as usize], &tasks[i], grip(i));
        let framed = |i: usize| {
            at(i).map(|frame| Solved {
                frame,
                solution: Solution::FAILED,
                grip: grip(i),
                interpolated: false,
            })
        };
        let mut solved: Vec<Option<Solved>> = (0..tasks.len()).into_par_iter().map(framed).collect();
        if tasks.is_empty() {
            return Ok(solved);
        }
        self.taps.clear();
        self.taps.extend(solved.iter().flatten().map(|s| *s.frame.tap()));
        let kernel = match (scene.model.geometry, grip(0)) {
            (Geometry::Linear, _) => Kernel::Linear,
            (_, g) => Kernel::Exact(Effects::new(&scene.model, scene.gauge.side, g == Grip::Stick)),
        };
        kernel::solve(solver.as_mut(), kernel, rungs, *tolerance, &self.taps, &mut self.solutions)?;
        for (place, s) in solved.iter_mut().flatten().zip(&self.solutions) {
            place.solution = *s;
        }
        Ok(solved)
    }

    /// Coulomb friction: the sticking solution where |T| ≤ μP, else sliding with the sign of the sticking T.
    ///
    /// Where the contact cannot stick, the sign is that of the largest drive among the halves of halves at which it can, provided
    /// that T/P, continued in a straight line from the half of that drive, keeps its sign; else the tap is left unsolved.
    fn coulomb(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        mu: f64,
    ) -> Result<Vec<Option<Solved>>, String> {
        let tolerance = self.tolerance();
        let stuck = Kernel::Exact(Effects::new(&self.scene.model, self.scene.gauge.side, true));
        let friction = |s: &Option<Solved>| {
            let s = s.as_ref().filter(|s| s.solution.within(tolerance))?;
            let response = s.frame.response(stuck, &s.solution);
            Some((response.tangential, response.normal))
        };
        let mut solved = self.solve(designs, tasks, &|_| Grip::Stick)?;
        let mut forces: Vec<Option<(f64, f64)>> = solved.iter().map(friction).collect();
        let sticking: Vec<bool> = forces.iter().map(|f| f.is_some_and(|(t, p)| t.abs() <= mu * p)).collect();
        // Share of the drive and T/P there, of the largest drive at which the contact sticks.
        let mut last: Vec<Option<(f64, f64)>> = vec![None; tasks.len()];
        let mut open: Vec<usize> =
            (0..tasks.len()).filter(|&i| solved[i].is_some() && forces[i].is_none()).collect();
        for k in 1..9 {
            let share = 0.5f64.powi(k);
            let earlier: Vec<Task> =
                open.iter().map(|&i| Task { drive: tasks[i].drive * share, ..tasks[i] }).collect();
            let found = self.solve(designs, &earlier, &|_| Grip::Stick)?;
            let known: Vec<_> = found.iter().map(friction).collect();
            for (&i, f) in open.iter().zip(&known) {
                match (last[i], f) {
                    (None, Some((t, p))) => last[i] = Some((share, t / p.abs())),
                    (Some((at, ratio)), Some((t, p))) => {
                        let ahead = ratio + (ratio - t / p.abs()) * (1.0 - at) / share;
                        forces[i] = (ahead * ratio > 0.0).then_some((ratio, 1.0));
                    }
                    _ => {}
                }
            }
            open = open
                .into_iter()
                .zip(known)
                .filter(|(i, f)| last[*i].is_none_or(|(at, _)| at == share) || f.is_none())
                .map(|(i, _)| i)
                .collect();
        }
        let sliding: Vec<usize> = (0..tasks.len()).filter(|&i| !sticking[i] && forces[i].is_some()).collect();
        let again: Vec<Task> = sliding.iter().map(|&i| tasks[i]).collect();
        let sign = |k: usize| Grip::Slide(forces[sliding[k]].map_or(0.0, |(t, _)| mu.copysign(t)));
        let slid = self.solve(designs, &again, &sign)?;
        for (&i, s) in sliding.iter().zip(slid) {
            solved[i] = s;
        }
        // A contact that neither sticks nor has a sign to slide with has no answer.
        for (i, s) in solved.iter_mut().enumerate() {
            if let Some(s) = s.as_mut().filter(|_| !sticking[i] && forces[i].is_none()) {
                s.solution = Solution { load: s.solution.load, ..Solution::FAILED };
                s.grip = Grip::Slide(mu);
            }
        }
        Ok(solved)
    }
}

/// `task` in its own units; `None` outside the domain or at the apex.
pub(super) fn frame(scene: &Scene, design: &Design, task: &Task, grip: Grip) -> Option<Frame> {
    let shared = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))?;
    let ask = Ask {
        model: &scene.model,
        side: scene.gauge.side,
        curve: &shared.model,
        peak: shared.peak,
        a: task.a,
        amount: amount(scene.drive, task.drive),
        grip,
    };
    match scene.model.geometry {
        Geometry::Linear => Frame::linear(&ask),
        Geometry::Exact => Frame::exact(&ask),
    }
}
