//! Shooting: the closure of a tap and Newton's method for the force and the place of the contact (model §3).

mod closure;

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat2, DVec2};

use super::statics::{Bent, EndLoad, Whisker};
use super::{RANGE_PARTS, RodProblem};
use crate::physics::body::Touched;
use crate::physics::flexure::Flexure;
use crate::physics::section::SectionStrain;
use crate::physics::solid::Soft;
use crate::scene::{Grip, Signal};
use crate::status::Status;

const HIT: f64 = 1e-12;

/// Accepted where rounding stops the steps: next to the clamp of a thick whisker, whose radius is many distances.
const NEARLY: f64 = 1e-9;

const PROBE: f64 = 1e-6;

/// Longest step of the continuation, rad or δ/a; up to it linear theory is the first guess.
const STRIDE: f64 = 0.3;

const SMALLEST_STRIDE: f64 = 1e-3;

/// Number of strides after which a failing one ends the path; near a fold they creep.
const MOST_STRIDES: u32 = 120;

/// Largest relative error of a foreseen force; past it a stride may land on another branch, as a tip of 0.5 mm against a pole of 5 mm did.
const FORESEEN: f64 = 0.5;

/// Determinant of the Jacobian, over that at zero load, below which it is computed again to get its sign.
const UPRIGHT: f64 = 0.5;

/// Distance over D up to which folds are not checked.
const NEXT_TO_CLAMP: f64 = 1e-2;

/// Drive, rad or δ/a, that counts as zero load.
const BEGUN: f64 = 1e-4;

/// Contact arc over L_a beyond which a built whisker has slipped off.
const BEYOND: f64 = 1.0 + 1e-12;

/// Newton steps of a stride, and halvings of a step: 40 and 9 took six times as long on the hardest taps, with the same results.
const MOST_STEPS: u32 = 15;
const MOST_HALVINGS: i32 = 2;

#[derive(Debug, Clone, Copy)]
pub(super) struct Shot {
    pub normal: f64,
    pub tangential: f64,
    pub load: EndLoad,
    pub bent: Bent,
    pub miss: DVec2,
}

pub(super) struct Stopped {
    pub why: Status,
    pub farthest: Option<Shot>,
}

/// A tap by a drive of any size; its unknowns are P/`force` and (c − a)/a or T/`force`.
pub(super) struct Shooter<'a> {
    problem: &'a RodProblem<'a>,
    /// The second unknown is the arc length c of a contact that slides, else the friction T.
    pub unknowns: Grip,
    pub whisker: Whisker<'a>,
    touched: Touched,
    hub: f64,
    /// Unit of the drive's size: a radian, or a.
    unit: f64,
    /// Unit of forces, N.
    force: f64,
    soft: Option<Soft>,
    /// From the motor's axis, or the clamp for a displacement, to the object, mm.
    lever: f64,
}

impl<'a> Shooter<'a> {
    /// The unit of forces is that of linear theory at a drive of one unit.
    pub fn new(problem: &'a RodProblem<'a>, unknowns: Grip) -> Self {
        let RodProblem { taper, model, distance: a, body, .. } = *problem;
        let shooter = Self::with(problem, unknowns);
        let (e0, compliance) = (model.material.e0(), shooter.whisker.shear_compliance);
        let bending = 64.0 * a.powi(3) / (3.0 * PI * e0 * taper.D.powi(4) * (1.0 - taper.tau * a));
        let shear = 1.0 + 3.0 * e0 * taper.D * taper.D * compliance / (16.0 * a * a);
        let linear = body.map(|body| {
            let drive = (shooter.hub, problem.driven.kind());
            Flexure::new(Arc::new(body.clone()), Signal::Force, problem.gauge, drive, model.shear)
        });
        let cone = shooter.lever / (bending * shear);
        Self { force: linear.map_or(cone, |linear| linear.force(a) * shooter.unit), ..shooter }
    }

    pub fn continuation(&self) -> Result<Shot, Stopped> {
        let (whole, longest) = (self.problem.driven.size(), STRIDE * self.unit);
        let (mut at, mut before) = ((0.0, DVec2::ZERO), (0.0, DVec2::ZERO));
        let mut stride = longest;
        let (mut tried, mut growth, mut farthest, mut unseen) = (0, 2.0, None, None);
        // End of a first stride that linear theory did not foresee; accepted if a shorter one ends in proportion.
        let mut doubtful: Option<(f64, DVec2)> = None;
        let mut first: Option<f64> = None;
        loop {
            tried += 1;
            let next = whole.min(at.0 + stride);
            let begins = at.0 == 0.0;
            let guess = if begins {
                DVec2::new(self.first(next / self.unit), 0.0)
            } else {
                at.1 + (at.1 - before.1) * ((next - at.0) / (at.0 - before.0))
            };
            let hit = self.newton(next, guess).and_then(|(z, shot, jacobian)| {
                let linear = self.first(next / self.unit);
                let near = |x: f64| (z.x - x).abs() <= FORESEEN * z.x.abs().max(x.abs()).max(linear);
                // With a contact that gives way ends are not in proportion.
                let last = doubtful.replace((next, z)).filter(|_| begins && self.soft.is_none());
                let foreseen = near(guess.x) || last.is_some_and(|(size, z)| near(z.x * (next / size)));
                if !foreseen {
                    return Err(Status::NOT_CONVERGED);
                }
                // Behind a fold the Jacobian has the other sign; next to the clamp of a thick whisker lengths cancel, and nothing folds.
                if self.problem.distance < NEXT_TO_CLAMP * self.problem.taper.D {
                    return Ok((z, shot));
                }
                let determinant = jacobian.determinant();
                let begun = match first {
                    Some(begun) => begun,
                    None => *first.insert(self.begun()?),
                };
                let close = determinant * begun.signum() < UPRIGHT * begun.abs();
                if close && self.jacobian(next, z, &shot)?.determinant() * begun < 0.0 {
                    return Err(Status::NOT_CONVERGED);
                }
                Ok((z, shot))
            });
            match hit {
                Ok((_, shot))
                    if self.problem.body.is_some_and(|body| shot.load.arc > body.length * BEYOND) =>
                {
                    return Err(Stopped { why: Status::SLIPPED_OFF, farthest: Some(shot) });
                }
                Ok((_, shot)) if next == whole => return Ok(shot),
                Ok((z, shot)) => {
                    (before, at) = (at, (next, z));
                    (farthest, unseen) = (Some(shot), Some(shot));
                    stride = longest.min(growth * stride);
                    growth = 2.0;
                }
                Err(missed) => {
                    stride = 0.5 * (next - at.0);
                    growth = 1.0;
                    // The path ends where a fibre has left the range of the law.
                    let left = unseen.take().is_some_and(|shot| self.is_in_range(&shot) == Ok(false));
                    if left || stride < SMALLEST_STRIDE * whole || tried > MOST_STRIDES {
                        let why = if left { Status::MATERIAL_LIMIT } else { missed };
                        return Err(Stopped { why, farthest });
                    }
                }
            }
        }
    }

    fn begun(&self) -> Result<f64, Status> {
        let size = BEGUN * self.unit;
        let z = DVec2::new(self.first(BEGUN), 0.0);
        Ok(self.jacobian(size, z, &self.shoot(size, z)?)?.determinant())
    }

    /// P of linear theory over [`Self::force`] at a size in units.
    fn first(&self, size: f64) -> f64 {
        let stiffness = self.force / self.lever;
        self.soft.map_or(size, |soft| soft.force(stiffness, size * self.lever) / self.force)
    }

    /// Newton's method with Broyden's updates and the natural monotonicity test (Deuflhard 1974). The Jacobian may be an updated one.
    fn newton(&self, size: f64, guess: DVec2) -> Result<(DVec2, Shot, DMat2), Status> {
        let mut z = guess;
        let mut shot = self.shoot(size, z)?;
        let mut jacobian = self.jacobian(size, z, &shot)?;
        let mut step = -(jacobian.inverse() * shot.miss);
        for _ in 0..MOST_STEPS {
            if self.size(z, step) <= HIT {
                return Ok((z, shot, jacobian));
            }
            let mut missed = Status::NOT_CONVERGED;
            let Some((fraction, trial, next)) =
                (0..=MOST_HALVINGS).map(|halvings| 0.5_f64.powi(halvings)).find_map(|fraction| {
                    let trial = self.shoot(size, z + fraction * step);
                    missed = trial.as_ref().err().copied().unwrap_or(Status::NOT_CONVERGED);
                    let trial = trial.ok()?;
                    let next = -(jacobian.inverse() * trial.miss);
                    (self.size(z, next) < self.size(z, step)).then_some((fraction, trial, next))
                })
            else {
                // Steps that no longer shrink are rounding of lengths that cancel.
                return if self.size(z, step) <= NEARLY { Ok((z, shot, jacobian)) } else { Err(missed) };
            };
            let contracts = fraction == 1.0 && self.size(z, next) < 0.1 * self.size(z, step);
            z += fraction * step;
            jacobian = if contracts {
                let lack = (trial.miss - shot.miss) - jacobian * step;
                jacobian + DMat2::from_cols(lack * step.x, lack * step.y) * step.length_squared().recip()
            } else {
                self.jacobian(size, z, &trial)?
            };
            shot = trial;
            step = -(jacobian.inverse() * shot.miss);
        }
        if self.size(z, step) <= NEARLY { Ok((z, shot, jacobian)) } else { Err(Status::NOT_CONVERGED) }
    }

    fn scale(&self, z: DVec2) -> DVec2 {
        match self.unknowns {
            Grip::Slide(_) => DVec2::new(z.x, 1.0),
            Grip::Stick => DVec2::new(z.x, z.x.abs() + z.y.abs()),
        }
    }

    fn size(&self, z: DVec2, step: DVec2) -> f64 {
        (step / self.scale(z)).abs().max_element()
    }

    fn jacobian(&self, size: f64, z: DVec2, shot: &Shot) -> Result<DMat2, Status> {
        let change = PROBE * self.scale(z);
        let column = |axis: DVec2| {
            let moved = self.shoot(size, z + change * axis)?;
            Ok::<_, Status>((moved.miss - shot.miss) / change.dot(axis))
        };
        Ok(DMat2::from_cols(column(DVec2::X)?, column(DVec2::Y)?))
    }

    pub fn is_in_range(&self, shot: &Shot) -> Result<bool, Status> {
        if self.whisker.law.is_linear() {
            return Ok(true);
        }
        let inside = |_, _: &_, strain: SectionStrain| strain.is_in_range();
        Ok(shot.load.walk(&self.whisker, shot.load.arc, RANGE_PARTS, inside)?.0)
    }
}
