//! Taps of a solid (model §8) as taps of a rod. A contact that yields by δ along its normal is a rigid one against a pole of radius ρ − δ; a rod
//! stiffened by a foil is one without foil whose base is moved. δ and the base follow from the forces, so that each tap is solved two or three times.
//! The skin strain next to the clamp follows from the force and its line of action.

use super::outcome::problem;
use super::solve::Solutions;
use super::trial::{self, Turn};
use super::{Evaluator, Task};
use crate::design::{Design, Shared, amount};
use crate::kernel::tap::Frame;
use crate::kernel::{Chart, Solution};
use crate::physics::inverse::bracketed;
use crate::physics::linear::StrainCurve;
use crate::physics::real::Vector;
use crate::physics::rod::{Borne, Changed};
use crate::physics::section::SectionStrain;
use crate::physics::solid::{Soft, is_solid};
use crate::scene::{Drive, Model, Setup};

/// Share of the tolerance for the strain error due to the residual angle.
const SHARE: f64 = 0.03;

/// Strains less than this share of the peak's count as that, as in all tolerances.
const LEAST: f64 = 1e-3;

/// Most rounds; the reference solves taps that need more.
const ROUNDS: usize = 8;

struct Trial<'a> {
    setup: &'a Setup,
    shared: &'a Shared,
    /// The rod from where its clamp holds it.
    rod: StrainCurve,
    soft: Option<Soft>,
    /// The object's centre before the tap, mm, from the rod's beginning, x along the clamped whisker; and its motion, kept apart for precision.
    pole: [[f64; 2]; 2],
    tilt: [f64; 2],
    /// Drive of the tap, rad or mm.
    amount: f64,
    /// The contact before the tap, mm from where the rod begins.
    from: f64,
    /// The tap of the rod: a, mm, θ, rad, and the contact's yield δ, mm.
    at: [f64; 3],
    last: Option<Last>,
    /// True if there is a strain: the contact begins beyond the gauge's near end.
    strained: bool,
}

/// Motion of a point by a turn of `angle`, rad.
fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, less) = (angle.sin(), -2.0 * (0.5 * angle).sin().powi(2));
    [less * x - sin * y, sin * x + less * y]
}

struct Last {
    /// θ, rad.
    angle: f64,
    /// P, N.
    force: f64,
    solution: Solution,
}

impl<'a> Trial<'a> {
    /// Starts from the force of linear theory; `None` if the rod has no such tap.
    fn new(setup: &'a Setup, shared: &'a Shared, task: &Task) -> Option<Self> {
        let (model, rod) = (&setup.model, shared.rod());
        let amount = amount(setup.drive, task.drive);
        let soft = Soft::new(model, &shared.taper, task.a);
        let from = task.a - shared.start;
        let [height, sin, cos] = rod.taper.touched(from, model.surface);
        let from_base = [from + model.pole_radius * sin, height + model.pole_radius * cos];
        let moved = match setup.drive {
            Drive::Angle => turned([from_base[0] + rod.hub, from_base[1]], -amount),
            Drive::Displacement => [0.0, -amount],
        };
        let pole = [from_base, moved];
        let strained = task.a > shared.gauge[0];
        let mut one = Self {
            setup,
            shared,
            rod,
            soft,
            pole,
            tilt: [sin, cos],
            amount,
            from,
            at: [0.0; 3],
            last: None,
            strained,
        };
        one.at = one.planar(0.0, &Changed::NOTHING, 1.0)?;
        let force = trial::Trial::frame(&one)?.response(&Solution::UNLOADED).normal;
        one.at = one.next(force, &Changed::NOTHING, 1.0)?.0;
        Some(one)
    }

    /// The tap of the rod whose contact yields by `depth`, with its base at `base`, its motion times `share`.
    fn planar(&self, depth: f64, base: &Changed, share: f64) -> Option<[f64; 3]> {
        let [[x, y], moved] = self.pole;
        let seen = turned([x + moved[0], y + moved[1]], share * base.turn);
        let [dx, dy] =
            [moved[0] + share * base.place[0] + seen[0], moved[1] + share * base.place[1] + seen[1]];
        let [sin, cos] = self.tilt;
        let slope = if self.setup.model.surface { self.rod.taper.tan_alpha } else { 0.0 };
        // The rod's tap leads the centre to (x, y) + b (1, −tan α) − δ n, n the contact's normal, as far from the base as the wanted tap does.
        let (square, half) = (1.0 + slope * slope, x - slope * y);
        let rest = depth * (depth - 2.0 * (x * sin + y * cos)) - dx * (2.0 * x + dx) - dy * (2.0 * y + dy);
        let b = -rest / (half + (half * half - square * rest).sqrt());
        let [ux, uy] = [b - depth * sin, -slope * b - depth * cos];
        let cross = x * (uy - dy) - y * (ux - dx) + dx * uy - dy * ux;
        let angle = cross.atan2((x + dx) * (x + ux) + (y + dy) * (y + uy));
        let a = self.from + b;
        (a > 0.0 && angle > 0.0).then_some([a, angle, depth])
    }

    /// The tap consistent with its force: the angle tried last gave `force`, N, which scales as the angle to `power`. Also the ratio of the angles.
    fn next(&self, force: f64, base: &Changed, power: f64) -> Option<([f64; 3], f64)> {
        let depth = |share: f64| self.soft.map_or(0.0, |soft| soft.depth(force * share));
        let angle = self.at[1];
        let lack = |g: f64| {
            let share = g.powf(power);
            self.planar(depth(share), base, share).map_or(-1.0, |at| at[1] / angle - g)
        };
        let mut most = 1.0;
        for _ in 0..8 {
            if lack(most) <= 0.0 {
                break;
            }
            most *= 2.0;
        }
        let g = bracketed(lack, 0.0, most);
        let share = g.powf(power);
        Some((self.planar(depth(share), base, share)?, g))
    }

    /// Changes by the skin and the foil, and the strain that the gauge shows, or `None` if that is the rod's.
    fn changed(
        &self,
        frame: &Frame,
        solution: &Solution,
        (chart, tolerance): (Option<&Chart>, f64),
    ) -> Option<(Changed, Option<f64>)> {
        let Self { setup, shared, .. } = self;
        let (response, foil) = (frame.response(solution), shared.foil);
        let arc = response.arc - shared.start;
        if arc <= 0.0 || arc.is_nan() {
            return None; // The rod's contact lies behind its base.
        }
        if foil.is_none() && !setup.model.distorting {
            return Some((Changed::NOTHING, None));
        }
        let unit = std::f64::consts::PI * setup.model.material.e0();
        let law = |n: f64, m: f64| {
            let [axial, bending] = chart?.at(n / unit, 4.0 * m.abs() / unit)?;
            Some(SectionStrain { axial, bending: bending.copysign(m) })
        };
        // The plain rod's line of action goes through the centre of its pole.
        let [a, angle, depth] = self.at;
        let radius = setup.model.pole_radius - depth;
        let [height, sin, cos] = self.rod.taper.touched(a, setup.model.surface);
        let centre = Vector::new(a + radius * sin, height + radius * cos);
        let borne = Borne {
            force: Vector::from_angle(-solution.base).rotate(Vector::new(sin, cos) * -response.normal),
            through: Vector::from_angle(-angle).rotate(centre),
            arc,
        };
        let problem = problem(setup, shared, self.from + shared.start, self.amount);
        let changed = problem.changed(&borne, &law, tolerance)?;
        let share = foil.map_or(1.0, |foil| foil.transfer);
        Some((changed, Some(share * (response.strain + changed.strain))))
    }
}

impl trial::Trial for Trial<'_> {
    /// None where its strain means nothing: the contact begins at or inside the gauge's near end.
    fn frame(&self) -> Option<Frame> {
        let Self { setup, shared, rod, .. } = self;
        let [a, angle, depth] = self.at;
        if self.strained && a <= rod.gauge[0] {
            return None;
        }
        let model = Model { pole_radius: setup.model.pole_radius - depth, ..setup.model };
        trial::framed((&model, setup.gauge.side), (shared, rod), 0.0, self.amount, [a, angle])
    }

    fn turn(&mut self, here: &Frame, solution: &Solution, told: (Option<&Chart>, f64)) -> Turn {
        let force = here.response(solution).normal;
        let [a, angle, _] = self.at;
        // Without a foil the base stays; the skin comes last.
        let foil = self.shared.foil.is_some();
        let early = if foil { self.changed(here, solution, told) } else { Some((Changed::NOTHING, None)) };
        let Some((base, _)) = early else { return Turn::Lost };
        // Forces deviate from linear ones as the square of the angle.
        let power = match &self.last {
            Some(last) => (force / last.force).ln() / (angle / last.angle).ln(),
            None => 1.0 + 2.0 * solution.force,
        };
        let power = if power.is_finite() { power.clamp(0.5, 2.0) } else { 1.0 };
        let Some((at, g)) = self.next(force, &base, power) else { return Turn::Lost };
        self.at = at;
        let (mut found, mut known) = (*solution, 1.0);
        if let Some(last) = self.last.replace(Last { angle, force, solution: *solution }) {
            let apart = (angle - last.angle) / last.angle;
            let share = (at[1] - angle) / (angle - last.angle);
            if apart != 0.0 && share.abs() < 1.0 {
                found = solution.beyond(&last.solution, share);
                known = if foil { 1.0 } else { (10.0 * apart.abs()).min(1.0) };
            }
        }
        // Along a thick pole the contact moves by ρ for each rad.
        let moved = self.setup.model.pole_radius * angle / at[0];
        let rough = at[1] * at[1] + moved + solution.strain.abs() + base.turn.abs() / angle;
        let mut left = (g - 1.0).abs() * rough;
        if self.strained {
            // The strain's deviation from linear theory changes with the distance from the gauge; where it leaves little strain, both count for more.
            let beside = here.response(solution).deviation;
            left += (at[0] - a).abs() / (at[0] - self.rod.gauge[0]).abs() * beside.abs();
            let least = LEAST * self.shared.peak * self.amount / here.tap().strain.abs();
            left /= (1.0 + beside).abs().max(least).min(1.0);
        }
        if left * known > SHARE * told.1 {
            return Turn::Next;
        }
        let Some(frame) = self.frame() else { return Turn::Lost };
        match self.changed(&frame, &found, told) {
            Some((_, mean)) => Turn::Found(frame, found, None, mean),
            None => Turn::Lost,
        }
    }
}

pub(super) fn asked(setup: &Setup) -> bool {
    is_solid(&setup.model) || setup.gauge.foil.is_some()
}

impl Evaluator<'_> {
    pub(super) fn solid(&mut self, designs: &[Design], tasks: &[Task]) -> Solutions {
        let skinned = self.setup.model.distorting || self.setup.gauge.foil.is_some();
        self.sought((designs, tasks), (ROUNDS, skinned), Trial::new)
    }
}
