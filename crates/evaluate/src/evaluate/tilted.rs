//! Taps out of plane (model §6). For a trial azimuth φ of the plane the pole looks like that of a planar tap, whose base angle ψ(0) gives the next φ
//! in closed form; that map contracts by about θ². It is iterated first with the first-order solution; solved taps then correct φ: one suffices at
//! 1e-5, two at 1e-8.

use rayon::prelude::*;

use super::solve::{Plane, Solutions, Solved, frame};
use super::{Evaluator, Task};
use crate::design::{Design, Shared, amount, radians};
use crate::kernel::Solution;
use crate::kernel::tap::{Ask, Frame};
use crate::physics::linear::StrainCurve;
use crate::physics::onset::Grip;
use crate::physics::pole::{Planar, Pole, Rig};
use crate::scene::{Contact, Drive, Setup};

/// Share of the tolerance for the strain error due to the residual of φ.
const SHARE: f64 = 0.1;

/// The same for the error of φ due to the base angle, which no further plane reduces.
const NOISE: f64 = 0.5;

/// Most planes per tap; the reference solves taps that need more.
const MOST_PLANES: usize = 8;

/// Most rounds of the closed form; and the last change of φ, rad: the error of the first-order solution.
const ROUNDS: usize = 12;
const STILL: f64 = 3e-5;

/// Largest contraction that is believed.
const STEEPEST: f64 = 0.9;

/// Error of a solution's base angle, relative and in units of the tolerance: some roundings in f32 at 1e-5.
const ROUGH: f64 = 0.03;

/// Change of the contact's direction, rad, over which the slope of φ is taken.
const PROBE: f64 = 1e-4;

#[expect(clippy::large_enum_variant, reason = "most are the large one, and none is kept")]
enum Turn {
    /// Converged: its frame, its solution and its plane of bending.
    Found(Frame, Solution, Plane),
    Next,
    Lost,
}

struct Trial<'a> {
    setup: &'a Setup,
    shared: &'a Shared,
    pole: Pole,
    /// Angle of the contact's normal against the whisker's, rad.
    alpha: f64,
    /// θ, rad, or δ, mm.
    amount: f64,
    /// φ, rad.
    phi: f64,
    /// Change of the next φ per change of φ.
    contraction: f64,
    /// True if there is a strain: the contact begins beyond the gauge's near end.
    strained: bool,
}

impl<'a> Trial<'a> {
    /// Starts from the plane of the first-order solutions; `None` without one.
    fn new(setup: &'a Setup, shared: &'a Shared, task: &Task) -> Option<Self> {
        let (rod, model) = (shared.rod(), &setup.model);
        let (taper, hub) = (rod.taper, setup.hub + shared.start);
        let amount = amount(setup.drive, task.drive);
        let direction = radians(task.direction);
        let pole = Pole::new(
            &Rig { taper, hub, drive: setup.drive, model },
            direction,
            task.a - shared.start,
            amount,
        );
        let alpha = if model.surface { taper.tan_alpha.atan() } else { 0.0 };
        let strained = task.a > shared.gauge[0];
        let mut one =
            Self { setup, shared, pole, alpha, amount, phi: direction[0], contraction: 0.0, strained };
        let mut last = 0.0f64;
        for _ in 0..ROUNDS {
            let base = one.framed(&pole.planar(one.phi)?)?.base_angle();
            let step = pole.azimuth(base + alpha)? - one.phi;
            one.phi += step;
            if last != 0.0 {
                one.contraction = (step / last).clamp(-STEEPEST, STEEPEST);
            }
            if step.abs() <= STILL {
                break;
            }
            last = step;
        }
        Some(one)
    }

    fn framed(&self, planar: &Planar) -> Option<Frame> {
        let Self { setup, shared, .. } = self;
        let rod = shared.rod();
        let hub = if setup.drive == Drive::Angle { rod.hub } else { 0.0 };
        Frame::new(&Ask {
            model: &setup.model,
            side: setup.gauge.side,
            curve: &StrainCurve::new(rod.taper, rod.gauge, hub, Drive::Angle, rod.shear),
            // Errors stay relative to the peak at the whole drive, not at the angle.
            peak: shared.peak * self.amount / planar.angle,
            a: planar.distance,
            amount: planar.angle,
            grip: Grip::Slide(0.0),
            start: shared.start,
        })
    }

    /// The frame in the plane of azimuth `phi`, and λ there; None if its strain means nothing: the contact begins at or inside the gauge's near end.
    fn at(&self, phi: f64) -> Option<(Frame, f64)> {
        let told =
            |planar: &Planar| planar.distance > self.shared.gauge[0] - self.shared.start || !self.strained;
        let planar = self.pole.planar(phi).filter(told)?;
        Some((self.framed(&planar)?, planar.slide))
    }

    /// Processes `solution` of the tap `here`, known to the tolerance.
    fn turn(&mut self, here: &Frame, solution: &Solution, tolerance: f64) -> Turn {
        let psi = solution.base + self.alpha;
        let (Some(next), Some(beside)) = (self.pole.azimuth(psi), self.pole.azimuth(psi + PROBE)) else {
            return Turn::Lost;
        };
        let step = (next - self.phi) / (1.0 - self.contraction);
        let phi = self.phi + step;
        let Some((frame, slide)) = self.at(phi) else { return Turn::Lost };
        // In the plane of φ the deviation δ from the first-order solution is kept. Its relative change is that of this solution; the residual of φ,
        // and the error of φ due to the base angle, affect both.
        let (from, to) = (here.tap(), frame.tap());
        let (ratio, deviation) = match self.strained {
            true => (to.strain / from.strain - 1.0, solution.strain.abs()),
            false => (0.0, 0.0),
        };
        let strain = ratio.abs() * to.weight.max(from.weight);
        let changed = (to.force / from.force - 1.0).abs().max(strain);
        let turned = step.abs() * (1.0 + phi.tan().abs());
        let rough = self.contraction.abs() + to.angle * to.angle;
        let off = (beside - next).abs() / PROBE * ROUGH * tolerance * solution.base.abs();
        let noise = if step == 0.0 { 0.0 } else { (changed + turned) * off / step.abs() };
        let left = rough * turned + (rough + deviation) * changed;
        self.phi = phi;
        match () {
            () if noise > NOISE * tolerance => Turn::Lost,
            () if left <= SHARE * tolerance => Turn::Found(frame, *solution, Plane { azimuth: phi, slide }),
            () => Turn::Next,
        }
    }
}

impl<'a> Evaluator<'a> {
    pub(super) fn spatial_solutions(&mut self, designs: &[Design], tasks: &[Task]) -> Solutions {
        let setup = self.setup;
        // A contact that sticks on the centreline stays in the plane of rotation, for any direction of the pole.
        let kind = |task: &Task| match (task.direction.is_upright(), setup.model.contact) {
            (true, _) => usize::from(setup.gauge.second),
            // A contact that would roll along the pole too is not modelled.
            (false, Contact::Stick) if setup.model.pole_radius > 0.0 => 3,
            (false, Contact::Stick) => 1,
            (false, Contact::Frictionless | Contact::Coulomb(0.0)) => 2,
            // Sliding with friction depends on its path; not modelled, and no spec allows it.
            (false, Contact::Coulomb(_)) => 3,
        };
        let mut all: Vec<Option<Solved>> = vec![None; tasks.len()];
        for which in 0..3 {
            let places: Vec<usize> = (0..tasks.len()).filter(|&i| kind(&tasks[i]) == which).collect();
            if places.is_empty() {
                continue;
            }
            let these: Vec<Task> = places.iter().map(|&i| tasks[i]).collect();
            let solved = match which {
                2 => self.tilted(designs, &these),
                _ => self.solutions(designs, &these, which > 0),
            };
            places.iter().zip(solved?).for_each(|(&i, s)| all[i] = s);
        }
        Ok(all)
    }

    /// Solves frictionless tilted `tasks`: the tap in a trial plane, then the next plane.
    fn tilted<'t>(&mut self, designs: &'t [Design], tasks: &[Task]) -> Solutions
    where
        'a: 't,
    {
        let (setup, tolerance) = (self.setup, self.tolerance());
        let begun = |task: &Task| {
            let design = &designs[task.design as usize];
            let upright =
                frame(setup, design, task, Grip::Slide(0.0)).filter(|_| task.direction.is_valid())?;
            Some((Solved::lost(upright), Trial::new(design.setup(setup), design.shared.as_ref()?, task)))
        };
        let begun: Vec<Option<(Solved, Option<Trial<'t>>)>> =
            tasks.par_iter().with_min_len(64).map(begun).collect();
        let mut all: Vec<Option<Solved>> = begun.iter().map(|b| b.as_ref().map(|b| b.0)).collect();
        let mut open: Vec<(usize, Trial<'t>)> =
            begun.into_iter().enumerate().filter_map(|(i, b)| b?.1.map(|trial| (i, trial))).collect();
        for _ in 0..MOST_PLANES {
            if open.is_empty() {
                break;
            }
            let framed = |(_, trial): &(usize, Trial<'t>)| Some(trial.at(trial.phi)?.0);
            let frames: Vec<Option<Frame>> = open.par_iter().with_min_len(256).map(framed).collect();
            let solved = self.solve_framed(&frames, &|_| Grip::Slide(0.0), true)?;
            let turned = |((i, mut trial), s): ((usize, Trial<'t>), Option<Solved>)| {
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
