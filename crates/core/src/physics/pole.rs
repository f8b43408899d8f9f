//! A pole of any direction, and the plane in which the whisker bends against it (model §6).
//!
//! The base frame is that of the turned base: t₀ along the whisker at its clamp, y₁ towards the object in the plane of rotation, z the
//! motor's axis. Its origin is what the base turns about: the motor's axis, or the clamp where the object moves. The bent rod lies in
//! the plane of t₀ and m = cos φ y₁ + sin φ z. There it is a planar tap, with another distance and another tap angle.

use glam::{DVec2, DVec3};

use super::taper::Taper;
use crate::scene::model::{Drive, Model};

/// What a pole of any direction is seen from.
#[derive(Debug, Clone, Copy)]
pub struct Rig<'a> {
    /// The whisker.
    pub taper: Taper,
    /// r₀, mm; [`Drive::Displacement`] ignores it.
    pub hub: f64,
    /// What moves.
    pub drive: Drive,
    /// Whether the contact is on the surface, and ρ.
    pub model: &'a Model,
}

/// A pole after the base has turned, or after it has moved itself, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Pole {
    /// A, a point of its axis, mm.
    point: DVec3,
    /// u, the direction of its axis.
    along: DVec3,
    /// |A|² less what it was at first touch, mm².
    farther: f64,
    /// a, mm.
    distance: f64,
    /// Its axis from the origin at first touch, along the whisker and towards the object, mm.
    touched: DVec2,
    /// tan α of the contact.
    slope: f64,
}

/// The planar tap in a plane of bending.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar {
    /// Distance a′ at which the undeflected whisker would touch, mm.
    pub distance: f64,
    /// Tap angle, rad.
    pub angle: f64,
    /// λ: how far the plane's point of the pole is along its axis from that of first touch, mm.
    pub slide: f64,
}

impl Pole {
    /// The pole of `tilt` β and `lean` γ, rad, at the distance `a`, mm, for an `amount` of the drive: θ, rad, or δ, mm.
    pub fn new(rig: &Rig<'_>, [tilt, lean]: [f64; 2], a: f64, amount: f64) -> Self {
        let Rig { taper, hub, drive, model } = *rig;
        let (height, sin, cos, slope) = match model.surface {
            true => (taper.radius(a), taper.sin_alpha(), taper.cos_alpha(), taper.tan_alpha),
            false => (0.0, 0.0, 1.0, 0.0),
        };
        let (hub, turn, moved) = match drive {
            Drive::Angle => (hub, amount, 0.0),
            Drive::Displacement => (0.0, 0.0, amount),
        };
        let touched = DVec2::new(a + hub + model.pole_radius * sin, height + model.pole_radius * cos);
        let (tilt, lean) = (DVec2::from_angle(tilt), DVec2::from_angle(lean));
        // Towards the object (cos β y + sin β z), and across it.
        let (out, across) = (DVec3::new(0.0, tilt.x, tilt.y), DVec3::new(0.0, -tilt.y, tilt.x));
        let along = lean.x * across + lean.y * (cos * DVec3::X - sin * out);
        let start = touched.x * DVec3::X + touched.y * out;
        let turned = |v: DVec3| {
            let (sin, cos) = turn.sin_cos();
            DVec3::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x, v.z)
        };
        Self {
            point: turned(start) - moved * DVec3::Y,
            along: turned(along),
            farther: moved * (moved - 2.0 * start.y),
            distance: a,
            touched,
            slope,
        }
    }

    /// The planar tap in the plane of azimuth `phi`, rad; `None` where the pole lies along that plane, or too near to be touched.
    pub fn planar(&self, phi: f64) -> Option<Planar> {
        let (sin, cos) = phi.sin_cos();
        let (m, normal) = (DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos));
        let slide = -self.point.dot(normal) / self.along.dot(normal);
        let seen = self.point + slide * self.along;
        let (x, y) = (seen.x, seen.dot(m));
        // |q(a + step)|² = |C|²: the whisker's radius falls with the slope.
        let grown = self.farther + slide * (2.0 * self.point.dot(self.along) + slide);
        let (square, half) = (1.0 + self.slope * self.slope, self.touched.x - self.slope * self.touched.y);
        let step = grown / (half + (half * half + square * grown).sqrt());
        let touched = self.touched + step * DVec2::new(1.0, -self.slope);
        let angle = DVec2::new(x, y).perp_dot(touched).atan2(DVec2::new(x, y).dot(touched));
        let planar = Planar { distance: self.distance + step, angle, slide };
        (planar.distance > 0.0 && planar.angle > 0.0 && slide.is_finite()).then_some(planar)
    }

    /// The azimuth at which a contact whose normal stands at `psi`, rad, from y₁ pushes square to the pole:
    /// (n_x t₀ + n_y m)·u = 0 with n = (sin ψ, cos ψ). `None` where there is none.
    pub fn azimuth(&self, psi: f64) -> Option<f64> {
        let DVec3 { x, y, z } = self.along;
        let sine = -psi.tan() * x / y.hypot(z);
        (sine.abs() <= 1.0).then(|| sine.asin() - y.atan2(z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pole(tilt: f64, lean: f64, drive: Drive, amount: f64) -> Pole {
        let model = Model { surface: true, pole_radius: 3.0, ..Model::PLAIN };
        let rig = Rig { taper: Taper::new(10.0, 4.0, 50.0), hub: 4.0, drive, model: &model };
        Pole::new(&rig, [tilt, lean], 33.0, amount)
    }

    #[test]
    fn an_upright_pole_is_the_planar_tap() {
        let one = pole(0.0, 0.0, Drive::Angle, 0.1);
        let Planar { distance, angle, slide } = one.planar(0.0).unwrap();
        assert_eq!((distance, slide), (33.0, 0.0));
        assert!((angle - 0.1).abs() < 1e-15);
        assert_eq!(one.azimuth(0.3), Some(0.0));
    }

    #[test]
    fn the_plane_meets_the_pole_where_it_says() {
        for drive in [Drive::Angle, Drive::Displacement] {
            let amount = if drive == Drive::Angle { 0.1 } else { 3.3 };
            let one = pole(0.4, 0.2, drive, amount);
            let Planar { distance, angle, .. } = one.planar(0.42).unwrap();
            // Turned back, the planar pole is where the whisker touches it at that distance.
            let taper = Taper::new(10.0, 4.0, 50.0);
            let hub = if drive == Drive::Angle { 4.0 } else { 0.0 };
            let (sin, cos) = (taper.sin_alpha(), taper.cos_alpha());
            let touched = DVec2::new(distance + hub + 3.0 * sin, taper.radius(distance) + 3.0 * cos);
            let (s, c) = 0.42f64.sin_cos();
            let slide = one.planar(0.42).unwrap().slide;
            let seen = one.point + slide * one.along;
            assert!(seen.dot(DVec3::new(0.0, -s, c)).abs() < 1e-13);
            let turned = DVec2::from_angle(-angle).rotate(touched);
            assert!((turned - DVec2::new(seen.x, seen.dot(DVec3::new(0.0, c, s)))).length() < 1e-12);
        }
    }

    #[test]
    fn a_push_at_the_azimuth_is_square_to_the_pole() {
        let one = pole(-0.7, 0.3, Drive::Angle, 0.15);
        let (sin, cos) = one.azimuth(0.25).unwrap().sin_cos();
        let push = DVec3::new(0.25f64.sin(), 0.25f64.cos() * cos, 0.25f64.cos() * sin);
        assert!(push.dot(one.along).abs() < 1e-15);
    }
}
