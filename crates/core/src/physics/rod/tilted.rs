//! The exact rod against a pole of any direction (model §6): planar taps, and one equation for the azimuth of their plane.

use super::shoot::Shooter;
use super::statics::Bent;
use super::{RodProblem, RodTap};
use crate::physics::driven::Driven;
use crate::physics::pole::{Pole, azimuth};
use crate::scene::{Contact, Grip, Side};
use crate::status::Status;

const SOLVED: f64 = 1e-12;

/// Accepted where rounding of the planar taps stops the steps.
const NEARLY: f64 = 1e-9;

const MOST_PLANES: u32 = 40;

/// A tap with a gauge in the plane of rotation, and one 90° further round the whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltedTap {
    /// The tap with the first gauge.
    pub tap: RodTap,
    /// Mean strain over the second gauge, tension positive.
    pub strain_2: f64,
    /// Mean strain of the centreline over the gauge.
    pub axial: f64,
    /// Azimuth φ of the plane of bending from the plane of rotation, rad.
    pub azimuth: f64,
    /// λ: distance that the contact has moved along the pole, mm.
    pub slide: f64,
}

impl RodProblem<'_> {
    /// The tap against a pole of `tilt` β and `lean` γ, rad, below 90°; with friction other than sticking to an edge for upright poles only.
    /// Errors: those of [`Self::solve`], and [`Status::NOT_CONVERGED`] if no plane is found.
    pub fn solve_tilted(&self, direction: [f64; 2]) -> Result<TiltedTap, Status> {
        let (held, start) = self.held();
        let one = held.tilted(direction)?;
        Ok(TiltedTap { tap: RodTap { contact_arc: one.tap.contact_arc + start, ..one.tap }, ..one })
    }

    fn tilted(&self, direction: [f64; 2]) -> Result<TiltedTap, Status> {
        let upright = direction == [0.0; 2];
        let sticks = self.model.contact == Contact::Stick && self.model.pole_radius == 0.0;
        if upright || sticks || self.driven.size() == 0.0 {
            let tap = self.tap()?;
            return Ok(self.beside(tap, 0.0, 0.0));
        }
        if !matches!(self.model.contact, Contact::Frictionless | Contact::Coulomb(0.0)) {
            return Err(Status::NOT_CONVERGED);
        }
        let pole = Pole::new(&self.taper, self.model, direction, (self.distance, self.hub, self.driven));
        let hub = self.driven.if_turned(self.hub);
        let alpha = if self.model.surface { self.taper.tan_alpha.atan() } else { 0.0 };
        let at = |phi: f64| {
            let planar = pole.planar(phi).ok_or(Status::NOT_CONVERGED)?;
            let driven = Driven::Radians(planar.angle);
            let problem = Self { distance: planar.distance, hub, driven, ..*self };
            let tap = problem.tap()?;
            let next = azimuth(pole.along, tap.base_angle + alpha).ok_or(Status::NOT_CONVERGED)?;
            Ok::<_, Status>((next - phi, planar, problem, tap))
        };
        let (mut phi, mut before) = (direction[0], None);
        let mut last = f64::INFINITY;
        for _ in 0..MOST_PLANES {
            let (lack, planar, problem, tap) = at(phi)?;
            if lack.abs() <= SOLVED || lack.abs() <= NEARLY && lack.abs() >= 0.5 * last {
                return Ok(problem.beside(tap, phi, planar.slide));
            }
            let step = match before {
                Some((then, lack_then)) if lack != lack_then => lack * (then - phi) / (lack - lack_then),
                _ => lack,
            };
            (before, last) = (Some((phi, lack)), lack.abs());
            phi += step.clamp(-2.0 * lack.abs(), 2.0 * lack.abs());
        }
        Err(Status::NOT_CONVERGED)
    }

    fn beside(&self, tap: RodTap, phi: f64, slide: f64) -> TiltedTap {
        let axial = self.axial(&tap);
        let (sin, cos) = phi.sin_cos();
        // The gauge in the plane of bending reads axial + bending; on the far side both gauges are turned by 180°.
        let bending = tap.strain - axial;
        let strain = if phi == 0.0 { tap.strain } else { axial + bending * cos };
        // In the plane of rotation the second gauge is on the neutral fibre.
        let strain_2 = axial + bending * sin;
        TiltedTap { tap: RodTap { strain, ..tap }, strain_2, axial, azimuth: phi, slide }
    }

    fn axial(&self, tap: &RodTap) -> f64 {
        let side = if self.side == Side::Contact { Side::Far } else { Side::Contact };
        let mirrored = Self { side, ..*self };
        let shooter = Shooter::with(&mirrored, Grip::Stick);
        let load = shooter.load(tap.contact_arc, [tap.normal_force, tap.tangential_force]);
        let [x1, x2] = self.gauge;
        let strain = |bent: Bent| 0.5 * (tap.strain + bent.elongation / (x2 - x1));
        load.bend(&shooter.whisker, self.gauge).map_or(f64::NAN, strain)
    }
}
