//! Fixed-point iteration: solve a trial tap, correct its contact, repeat to tolerance.

use rayon::prelude::*;

use super::solve::{Plane, Solutions, Solved, frame};
use super::{Evaluator, Task};
use crate::design::{Design, Shared};
use crate::kernel::Solution;
use crate::kernel::tap::{Ask, Frame};
use crate::physics::linear::StrainCurve;
use crate::physics::onset::Grip;
use crate::scene::{Drive, Model, Setup, Side};

#[expect(clippy::large_enum_variant, reason = "most are the large one, and none is kept")]
pub(super) enum Turn {
    /// Converged: its frame, its solution and its plane of bending.
    Found(Frame, Solution, Plane),
    Next,
    Lost,
}

pub(super) trait Trial: Send + Sync {
    /// The next tap to solve; None if its strain means nothing.
    fn frame(&self) -> Option<Frame>;

    /// Processes `solution` of the tap `here`, known to the tolerance.
    fn turn(&mut self, here: &Frame, solution: &Solution, tolerance: f64) -> Turn;
}

/// The frictionless tap at `a`, mm, of the rod of `shared`, turned by `angle`, rad, about a place `hub` mm behind where it begins.
pub(super) fn framed(
    (model, side): (&Model, Side),
    (shared, rod): (&Shared, &StrainCurve),
    hub: f64,
    amount: f64,
    [a, angle]: [f64; 2],
) -> Option<Frame> {
    Frame::new(&Ask {
        model,
        side,
        curve: &StrainCurve::new(rod.taper, rod.gauge, hub, Drive::Angle, rod.shear),
        // Errors stay relative to the peak at the drive `amount`, not at the angle.
        peak: shared.peak * amount / angle,
        a,
        amount: angle,
        grip: Grip::Slide(0.0),
        start: shared.start,
    })
}

impl<'a> Evaluator<'a> {
    /// Solves frictionless `tasks`, iterated from `begin` in at most `rounds`; `spatial`: with the values of the plane of bending.
    pub(super) fn sought<'t, T: Trial>(
        &mut self,
        (designs, tasks): (&'t [Design], &[Task]),
        (rounds, spatial): (usize, bool),
        begin: impl Fn(&'t Setup, &'t Shared, &Task) -> Option<T> + Sync,
    ) -> Solutions
    where
        'a: 't,
    {
        let (setup, tolerance) = (self.setup, self.tolerance());
        let begun = |task: &Task| {
            let design = &designs[task.design as usize];
            let upright =
                frame(setup, design, task, Grip::Slide(0.0)).filter(|_| task.direction.is_valid())?;
            Some((Solved::lost(upright), begin(design.setup(setup), design.shared.as_ref()?, task)))
        };
        let begun: Vec<Option<(Solved, Option<T>)>> = tasks.par_iter().with_min_len(64).map(begun).collect();
        let mut all: Vec<Option<Solved>> = begun.iter().map(|b| b.as_ref().map(|b| b.0)).collect();
        let mut open: Vec<(usize, T)> =
            begun.into_iter().enumerate().filter_map(|(i, b)| b?.1.map(|trial| (i, trial))).collect();
        for _ in 0..rounds {
            if open.is_empty() {
                break;
            }
            let framed = |(_, trial): &(usize, T)| trial.frame();
            let frames: Vec<Option<Frame>> = open.par_iter().with_min_len(256).map(framed).collect();
            let solved = self.solve_framed(&frames, &|_| Grip::Slide(0.0), spatial)?;
            let turned = |((i, mut trial), s): ((usize, T), Option<Solved>)| {
                let s = s?;
                let within = s.solution.within(tolerance);
                let turn = within.then(|| trial.turn(&s.frame, &s.solution, tolerance));
                Some((i, trial, s, turn))
            };
            let turned: Vec<_> =
                open.into_par_iter().zip(solved).with_min_len(64).filter_map(turned).collect();
            open = Vec::new();
            for (i, trial, s, turn) in turned {
                let Some(one) = &mut all[i] else { continue };
                let sweeps = one.sweeps + s.sweeps;
                one.sweeps = sweeps;
                match turn {
                    // The upright rod's answer: the material ends, or a kernel cannot decide.
                    None => *one = Solved { sweeps, plane: None, ..s },
                    Some(Turn::Found(frame, solution, plane)) => {
                        *one = Solved { frame, solution, plane: Some(plane), sweeps, ..s };
                    }
                    Some(Turn::Next) => open.push((i, trial)),
                    Some(Turn::Lost) => {}
                }
            }
        }
        all.iter().flatten().for_each(|s| self.sweeps.push(s.sweeps));
        Ok(all)
    }
}
