//! Frames and solutions of taps on a fast kernel.

use rayon::prelude::*;

use super::{Evaluator, Method, Task};
use crate::design::{Design, amount};
use crate::error::SolveError;
use crate::kernel::{
    self, Effects, Rule, Rung, Solution, Tap,
    cpu::Cpu,
    rule::{every_rule, limits::ASTRAY},
    tap::{Ask, Frame, Response},
};
use crate::physics::onset::Grip;
use crate::scene::{Contact, Material, Precision, Setup};

/// Largest error of the forces of a sticking contact, per error of the strain.
pub(super) const ROUGH: f64 = 100.0;

/// Tolerance of the guess of the grip.
const COARSE: f64 = 1e-2;

/// Motion of a contact, in a and per error of the strain, that makes its direction certain: an error of the arc shows at least as large.
const SURELY: f64 = 10.0;

const FRAMES: usize = 1024;

#[derive(Debug, Clone, Copy)]
pub(super) struct Solved {
    pub frame: Frame,
    pub solution: Solution,
    pub grip: Grip,
    /// Sweeps spent on it, also for another grip.
    pub sweeps: f64,
}

type Grips<'g> = &'g (dyn Fn(usize) -> Grip + Sync);

pub(super) type Solutions = Result<Vec<Option<Solved>>, SolveError>;

impl Evaluator<'_> {
    /// Solutions of `tasks` with any contact; `None` outside the domain or at the apex.
    pub(super) fn solutions(&mut self, designs: &[Design], tasks: &[Task]) -> Solutions {
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

    pub(super) fn solve(&mut self, designs: &[Design], tasks: &[Task], grip: Grips<'_>) -> Solutions {
        self.solve_framed(&frames(self.setup, designs, tasks, grip), grip)
    }

    pub(super) fn solve_framed(&mut self, frames: &[Option<Frame>], grip: Grips<'_>) -> Solutions {
        let setup = self.setup;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok(vec![None; frames.len()]);
        };
        if frames.is_empty() {
            return Ok(Vec::new());
        }
        self.taps.clear();
        let tap = |frame: &Option<Frame>| frame.as_ref().map(|frame| *frame.tap());
        self.taps.par_extend(frames.par_iter().with_min_len(FRAMES).filter_map(tap));
        let effects = Effects::new(&setup.model, setup.gauge.side, grip(0) == Grip::Stick);
        kernel::solve(solver.as_mut(), effects, rungs, *tolerance, &self.taps, &mut self.solutions)?;
        let solved = |i: usize, frame: Frame, solution: Solution| {
            let (grip, sweeps) = (grip(i), solution.sweeps);
            Solved { frame, solution, grip, sweeps }
        };
        if self.solutions.len() == frames.len() {
            let one = |(i, (frame, s)): (usize, (&Option<Frame>, &Solution))| Some(solved(i, (*frame)?, *s));
            let all = frames.par_iter().zip(&self.solutions).enumerate();
            return Ok(all.with_min_len(FRAMES).map(one).collect());
        }
        let mut solutions = self.solutions.iter();
        let one = |(i, frame): (usize, &Option<Frame>)| Some(solved(i, (*frame)?, *solutions.next()?));
        Ok(frames.iter().enumerate().map(one).collect())
    }

    /// Coulomb friction: sliding at μ where the contact then moves against that friction, else sticking where |T| ≤ μP; both criteria agree (model
    /// §3). A tap without a certain solution is left open: it may slide before.
    fn coulomb(&mut self, designs: &[Design], tasks: &[Task], mu: f64) -> Solutions {
        let setup = self.setup;
        let framed = frames(setup, designs, tasks, &|_| Grip::Stick);
        let held = foreseen(setup, framed.iter().flatten(), mu)?;
        let whole = (0..tasks.len()).filter(|&i| framed[i].is_some());
        // A rolling contact moves without slipping: only the sticking solution decides.
        let likely = |grip: &Grip| *grip != Grip::Stick && setup.model.pole_radius == 0.0;
        let likely: Vec<(usize, Grip)> = whole.zip(held).filter(|(_, grip)| likely(grip)).collect();
        let mut solved: Vec<Option<Solved>> = vec![None; tasks.len()];
        let slide = |one: &mut Self, sliding: &[(usize, Grip)]| {
            let those: Vec<Task> = sliding.iter().map(|&(i, _)| tasks[i]).collect();
            one.solve(designs, &those, &|k| sliding[k].1)
        };
        let slid = slide(self, &likely)?;
        for (&(i, grip), s) in likely.iter().zip(slid) {
            let told = s.as_ref().is_some_and(|s| moves_with(s, grip));
            solved[i] = s.filter(|_| told);
        }

        let open: Vec<usize> = (0..tasks.len()).filter(|&i| solved[i].is_none()).collect();
        let rest: Vec<Option<Frame>> = open.iter().map(|&i| framed[i]).collect();
        let stuck = self.solve_framed(&rest, &|_| Grip::Stick)?;
        let mut sliding = Vec::new();
        for (&i, s) in open.iter().zip(stuck) {
            solved[i] = s;
            let Some(s) = &mut solved[i] else { continue };
            match decide(s, mu) {
                Some(Grip::Stick) => {}
                Some(grip) => sliding.push((i, grip)),
                None => s.solution = Solution::FAILED,
            }
        }
        let slid = slide(self, &sliding)?;
        for (&(i, _), s) in sliding.iter().zip(slid) {
            let before = solved[i].map_or(0.0, |s| s.sweeps);
            solved[i] = s.map(|s| Solved { sweeps: before + s.sweeps, ..s });
        }
        Ok(solved)
    }
}

/// Guesses the grips of the contacts of `frames`, framed as sticking: by one sweep, of Hooke's rod in f32.
pub fn foreseen<'f>(
    setup: &Setup,
    frames: impl Iterator<Item = &'f Frame> + Clone,
    mu: f64,
) -> Result<Vec<Grip>, SolveError> {
    let look = Rule { sweeps: 1, ..every_rule(Precision::F32)[0] };
    let rung = Rung::new(look, Precision::F32, &Material::Hooke(1.0), COARSE);
    let effects = Effects { law: false, ..Effects::new(&setup.model, setup.gauge.side, true) };
    let taps: Vec<Tap> = frames.clone().map(|frame| *frame.tap()).collect();
    let mut out = Vec::new();
    kernel::solve(&mut Cpu::new(Precision::F32), effects, &[rung], COARSE, &taps, &mut out)?;
    let grip = |(frame, s): (&Frame, &Solution)| {
        let Response { tangential, normal, .. } = frame.response(s);
        if tangential.abs() > mu * normal { Grip::Slide(mu.copysign(tangential)) } else { Grip::Stick }
    };
    Ok(frames.zip(&out).map(grip).collect())
}

/// True if the contact of `s` surely moved along the whisker against the friction of `grip`.
fn moves_with(s: &Solved, grip: Grip) -> bool {
    let Grip::Slide(friction) = grip else { return false };
    let moved = s.frame.moved(&s.solution) * friction.signum();
    s.solution.within(ASTRAY) && moved > SURELY * s.solution.error
}

/// The contact condition from the sticking solution `s`; `None` if it is too inaccurate.
fn decide(s: &Solved, mu: f64) -> Option<Grip> {
    let Response { tangential, normal, .. } = s.frame.response(&s.solution);
    let spare = mu * normal - tangential.abs();
    let rough = ROUGH * s.solution.error * tangential.abs().max(normal.abs());
    match spare {
        _ if !s.solution.within(ASTRAY) || spare.abs() <= rough => None,
        _ if spare > 0.0 => Some(Grip::Stick),
        _ => Some(Grip::Slide(mu.copysign(tangential))),
    }
}

fn frames(setup: &Setup, designs: &[Design], tasks: &[Task], grip: Grips<'_>) -> Vec<Option<Frame>> {
    let one = |i: usize| frame(setup, &designs[tasks[i].design as usize], &tasks[i], grip(i));
    (0..tasks.len()).into_par_iter().with_min_len(FRAMES).map(one).collect()
}

pub(super) fn frame(setup: &Setup, design: &Design, task: &Task, grip: Grip) -> Option<Frame> {
    let setup = design.setup(setup);
    let shared = design.shared.as_ref().filter(|_| design.admits(setup, task.a, task.drive))?;
    let ask = Ask {
        model: &setup.model,
        side: setup.gauge.side,
        curve: &shared.rod(),
        peak: shared.peak,
        a: task.a - shared.start,
        amount: amount(setup.drive, task.drive),
        grip,
        start: shared.start,
    };
    Frame::new(&ask)
}
