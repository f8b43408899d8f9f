//! Solutions of taps: of cones by their kernel; of the others, and of what the kernel leaves open, by the solver of every whisker.

use rayon::prelude::*;

use super::outcome::Asked;
use super::rod::{Rods, takes_all};
use super::{Evaluator, Method, Outcome, Task};
use crate::design::Design;
use crate::error::SolveError;
use crate::kernel::{self, Effects, Solution, rule::limits::ASTRAY, tap::Frame};
use crate::scene::{Contact, Grip, Setup};

/// Largest error of the forces of a sticking contact, per error of the strain.
const ROUGH: f64 = 100.0;

/// Motion of a contact, in a and per error of the strain, that makes its direction certain: an error of the arc shows at least as large.
const SURELY: f64 = 10.0;

/// Least frames per thread.
const FRAMES: usize = 256;

/// A tap whose contact is held by `grip`.
#[derive(Clone, Copy)]
pub(super) struct Solved {
    /// Values without words; strains as on the contact side.
    pub found: Outcome,
    pub grip: Grip,
    /// c/a − 1, from where the rod begins.
    pub moved: f64,
    /// Estimated error of the strain, relative; infinite without a solution.
    pub error: f64,
    /// Largest load of a fibre; above 1 the material law ends.
    pub load: f64,
    /// True if the iteration came near no equilibrium.
    pub astray: bool,
    /// True if the kernel of cones found an equilibrium beyond a fold or its range, or close to the end of the law.
    pub unsure: bool,
    /// Sweeps spent on it, also for another grip.
    pub sweeps: f64,
}

impl Solved {
    /// No solution.
    pub const LOST: Self = Self {
        found: Outcome::NOTHING,
        grip: Grip::Slide(0.0),
        moved: f64::NAN,
        error: f64::INFINITY,
        load: 0.0,
        astray: true,
        unsure: false,
        sweeps: 0.0,
    };

    /// True if the contact surely moved along the whisker against its friction.
    fn moves(&self) -> bool {
        let Grip::Slide(friction) = self.grip else { return false };
        self.error <= ASTRAY && self.moved * friction.signum() > SURELY * self.error
    }

    /// The contact condition at `mu` from a sticking solution; `None` if that is too inaccurate.
    fn decided(&self, mu: f64) -> Option<Grip> {
        let Outcome { normal_force: normal, tangential_force: tangential, .. } = self.found;
        let spare = mu * normal - tangential.abs();
        let rough = ROUGH * self.error * tangential.abs().max(normal.abs());
        match spare {
            _ if !(self.error <= ASTRAY && spare.abs() > rough) => None,
            _ if spare > 0.0 => Some(Grip::Stick),
            _ => Some(Grip::Slide(mu.copysign(tangential))),
        }
    }
}

/// Taps to solve, with their contacts.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub setup: &'a Setup,
    pub designs: &'a [Design],
    pub tasks: &'a [Task],
    /// All stick, or none.
    pub grips: &'a [Grip],
    /// True for samples of charts, which hold the ratio to linear theory: errors are relative to its strain, where that of the tap is smaller.
    pub charted: bool,
    /// True for samples of a smooth function: that of a cone ends where its kernel has no answer.
    pub samples: bool,
    /// True if the taps need not lie in the domain: those next to a tap of it.
    pub beyond: bool,
}

impl<'a> Question<'a> {
    /// True if the contacts stick.
    pub fn stick(&self) -> bool {
        self.grips.first() == Some(&Grip::Stick)
    }

    /// The tap of task `i`; `None` outside the domain.
    pub fn asked(&self, i: usize) -> Option<Asked<'a>> {
        let ask = if self.beyond { Asked::known } else { Asked::of };
        ask(self.setup, self.design(i), &self.tasks[i], f64::NAN)
    }

    fn design(&self, i: usize) -> &'a Design {
        &self.designs[self.tasks[i].design as usize]
    }

    /// Factor by which the error of a tap, relative to its strain, may exceed the tolerance; θ f is `linear`.
    pub fn share(&self, linear: f64, strain: f64) -> f64 {
        let share = (linear / strain).abs();
        if self.charted && share.is_finite() { share.max(1.0) } else { 1.0 }
    }
}

pub(super) type Solutions = Result<Vec<Solved>, SolveError>;

impl Evaluator<'_> {
    /// Solutions of `tasks` with all contacts of `grip`, for charts, or as the model says; `samples` as in [`Question`].
    pub(super) fn solutions(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: Option<Grip>,
        samples: bool,
    ) -> Solutions {
        let held = match (grip, self.setup.model.contact) {
            (Some(grip), _) => grip,
            (None, Contact::Frictionless | Contact::Coulomb(0.0)) => Grip::Slide(0.0),
            (None, Contact::Stick) => Grip::Stick,
            (None, Contact::Coulomb(mu)) => return self.coulomb(designs, tasks, (mu, samples)),
        };
        let (setup, grips) = (self.setup, vec![held; tasks.len()]);
        let charted = grip.is_some();
        self.solve(&Question { setup, designs, tasks, grips: &grips, charted, samples, beyond: false })
    }

    /// Coulomb friction: sliding at μ where the contact then moves against that friction, else sticking where |T| ≤ μP; both criteria agree (model
    /// §3). A tap without a certain solution is left open: it may slide before.
    fn coulomb(&mut self, designs: &[Design], tasks: &[Task], (mu, samples): (f64, bool)) -> Solutions {
        let setup = self.setup;
        let mut solved = vec![Solved::LOST; tasks.len()];
        let mut solve = |places: &[usize], grips: &[Grip], solved: &mut [Solved]| {
            let those: Vec<Task> = places.iter().map(|&i| tasks[i]).collect();
            let found = self.solve(&Question {
                setup,
                designs,
                tasks: &those,
                grips,
                charted: false,
                samples,
                beyond: false,
            })?;
            for (&i, new) in places.iter().zip(found) {
                solved[i] = Solved { sweeps: solved[i].sweeps + new.sweeps, ..new };
            }
            Ok::<(), SolveError>(())
        };
        // A rolling contact moves without slipping: only the sticking solution decides.
        let foreseen = |i: usize| {
            let task = &tasks[i];
            let edge = setup.model.pole_radius == 0.0 && !takes_all(setup);
            let frame = || frame(setup, &designs[task.design as usize], task, Grip::Stick);
            edge.then(frame).flatten().map(|frame| frame.foreseen(mu)).filter(|grip| *grip != Grip::Stick)
        };
        let all = (0..tasks.len()).into_par_iter().with_min_len(FRAMES);
        let (likely, grips): (Vec<usize>, Vec<Grip>) = all.filter_map(|i| Some((i, foreseen(i)?))).unzip();
        solve(&likely, &grips, &mut solved)?;
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| !solved[i].moves()).collect();
        solve(&open, &vec![Grip::Stick; open.len()], &mut solved)?;
        let (mut sliding, mut grips) = (Vec::new(), Vec::new());
        for i in open {
            match solved[i].decided(mu) {
                Some(Grip::Stick) => {}
                Some(grip) => {
                    sliding.push(i);
                    grips.push(grip);
                }
                None => solved[i] = Solved { grip: Grip::Stick, sweeps: solved[i].sweeps, ..Solved::LOST },
            }
        }
        solve(&sliding, &grips, &mut solved)?;
        Ok(solved)
    }

    fn solve(&mut self, question: &Question<'_>) -> Solutions {
        let mut solved = self.cones(question)?;
        let Method::Fast { ladder, tolerance, .. } = &self.method else { return Ok(solved) };
        let cone = |i: usize| !takes_all(question.setup) && question.tasks[i].direction.is_upright();
        let open = |i: &usize| solved[*i].error > *tolerance && !(question.samples && cone(*i));
        let open: Vec<usize> = (0..solved.len()).filter(open).collect();
        if open.is_empty() {
            return Ok(solved);
        }
        let found = Rods::new(question, &open).solve(*tolerance, &ladder.section);
        for (&i, new) in open.iter().zip(found) {
            let Solved { sweeps, unsure, .. } = solved[i];
            solved[i] = Solved { sweeps: sweeps + new.sweeps, unsure, ..new };
        }
        Ok(solved)
    }

    /// Solutions of upright cones, where they surely meet the tolerance, by their kernel.
    fn cones(&mut self, question: &Question<'_>) -> Solutions {
        let (setup, count) = (question.setup, question.tasks.len());
        let nothing = |i: usize| Solved { grip: question.grips[i], ..Solved::LOST };
        let (Method::Fast { solver, ladder, tolerance }, false) = (&mut self.method, takes_all(setup)) else {
            return Ok((0..count).map(nothing).collect());
        };
        let frame = |i: usize| frame(setup, question.design(i), &question.tasks[i], question.grips[i]);
        let frames: Vec<Option<Frame>> = (0..count).into_par_iter().with_min_len(FRAMES).map(frame).collect();
        self.taps.clear();
        let tap = |frame: &Option<Frame>| frame.as_ref().map(|frame| *frame.tap());
        self.taps.par_extend(frames.par_iter().with_min_len(FRAMES).filter_map(tap));
        let effects = Effects::new(&setup.model, setup.gauge.side, question.stick());
        let rungs = &ladder.rungs;
        let enough =
            kernel::solve(solver.as_mut(), effects, rungs, *tolerance, &self.taps, &mut self.solutions)?;
        let mut next = 0..;
        let places: Vec<Option<usize>> =
            frames.iter().map(|frame| frame.as_ref().and_then(|_| next.next())).collect();
        let solutions = &self.solutions;
        let one = |i: usize| {
            let (Some(frame), Some(place), Some(asked)) = (&frames[i], places[i], question.asked(i)) else {
                return nothing(i);
            };
            let s = &solutions[place];
            let found = of_cone(&asked, frame, s, question.grips[i]);
            let error = s.error / question.share(asked.linear, found.found.strain);
            match (Solution { error, ..*s }).is_told(enough) {
                true => Solved { error, ..found },
                false => Solved { sweeps: s.sweeps, unsure: s.unsure(), ..nothing(i) },
            }
        };
        Ok((0..count).into_par_iter().with_min_len(FRAMES).map(one).collect())
    }
}

/// The kernel's solution `s` of a tap.
fn of_cone(asked: &Asked<'_>, frame: &Frame, s: &Solution, grip: Grip) -> Solved {
    let (tap, [normal_force, tangential_force]) = (frame.tap(), frame.forces(s));
    // K = θ f/ε and ε = ε₀ (1 + δ): the ratio of two closed forms in f64, then the kernel's δ.
    let ratio = asked.linear / tap.strain - 1.0;
    let found = Outcome {
        strain: tap.strain(s),
        strain_linear: asked.linear,
        deviation: (ratio - s.strain) / (1.0 + s.strain),
        normal_force,
        tangential_force,
        arc: frame.arc(s),
        sticking: grip == Grip::Stick,
        ..Outcome::NOTHING
    };
    Solved {
        found,
        grip,
        moved: tap.moved(s),
        error: s.error,
        load: s.load,
        sweeps: s.sweeps,
        ..Solved::LOST
    }
}

/// An upright tap as the kernel takes it; `None` outside the domain, and at the apex.
fn frame(setup: &Setup, design: &Design, task: &Task, grip: Grip) -> Option<Frame> {
    let setup = design.setup(setup);
    let inside = task.direction.is_upright() && design.admits(setup, task.a, task.drive);
    let shared = design.shared.as_ref().filter(|_| inside)?;
    Frame::new(setup, shared, (task.a, task.driven(setup)), grip)
}
