//! A pole of any direction, and the plane in which the whisker bends against it (model §6), where the tap is planar with another distance and angle.
//! Base frame, after the turn: t₀ along the whisker at its clamp, y₁ towards the object in the plane of rotation, z the motor's axis; its origin is
//! that axis, or the clamp where the object moves. The rod bends in the plane of t₀ and m = cos φ y₁ + sin φ z.

use glam::DVec2;

use super::driven::Driven;
use super::taper::Taper;
use crate::scene::model::Model;

/// A vector of space: along t₀, y₁ and z.
pub type Space<T = f64> = [T; 3];

fn dot([a, b, c]: Space, [x, y, z]: Space) -> f64 {
    a * x + b * y + c * z
}

/// A pole after the base has turned, or after it has moved itself, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Pole {
    /// A, a point of its axis, mm.
    pub point: Space,
    /// u, the direction of its axis.
    pub along: Space,
    /// |A|² − |A|² at first touch, mm².
    farther: f64,
    distance: f64,
    touched: DVec2,
    slope: f64,
}

/// The planar tap in a plane of bending.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar {
    /// Distance a′ at which the undeflected whisker would touch, mm.
    pub distance: f64,
    /// Tap angle, rad.
    pub angle: f64,
    /// λ: place of the contact on the pole's axis, from that of first touch, mm.
    pub slide: f64,
}

impl Pole {
    /// The pole of `tilt` β and `lean` γ, rad, at the distance `a` of a `taper`, mm, when it is `driven`. `hub` is r₀, mm, without meaning for a
    /// displacement; `model` gives the contact on the surface, and ρ.
    pub fn new(
        taper: &Taper,
        model: &Model,
        [tilt, lean]: [f64; 2],
        (a, hub, driven): (f64, f64, Driven),
    ) -> Self {
        let [height, sin, cos] = taper.touched(a, model.surface);
        let slope = if model.surface { taper.tan_alpha } else { 0.0 };
        let (hub, [turn, moved]) = (driven.if_turned(hub), driven.turn_and_lift());
        let touched = DVec2::new(a + hub + model.pole_radius * sin, height + model.pole_radius * cos);
        let (tilt, lean) = (DVec2::from_angle(tilt), DVec2::from_angle(lean));
        // Towards the object (cos β y + sin β z), and across it.
        let (out, across) = ([0.0, tilt.x, tilt.y], [0.0, -tilt.y, tilt.x]);
        let along = |k: usize, x: f64| lean.x * across[k] + lean.y * (cos * x - sin * out[k]);
        let start = |k: usize, x: f64| touched.x * x + touched.y * out[k];
        let (sin_t, cos_t) = turn.sin_cos();
        let turned = |[x, y, z]: Space| [cos_t * x + sin_t * y, cos_t * y - sin_t * x, z];
        let begun = [start(0, 1.0), start(1, 0.0), start(2, 0.0)];
        let [x, y, z] = turned(begun);
        Self {
            point: [x, y - moved, z],
            along: turned([along(0, 1.0), along(1, 0.0), along(2, 0.0)]),
            farther: moved * (moved - begun[1] * 2.0),
            distance: a,
            touched,
            slope,
        }
    }

    /// The planar tap in the plane of azimuth `phi`, rad; `None` if the pole lies along that plane, or is too near to be touched.
    pub fn planar(&self, phi: f64) -> Option<Planar> {
        let (sin, cos) = phi.sin_cos();
        let (m, slide) = ([0.0, cos, sin], slide(self.point, self.along, phi));
        let seen = std::array::from_fn(|k| self.point[k] + slide * self.along[k]);
        let (x, y) = (seen[0], dot(seen, m));
        // |q(a + step)|² = |C|²: the whisker's radius falls with the slope.
        let grown = self.farther + slide * (dot(self.point, self.along) * 2.0 + slide);
        let (square, half) = (self.slope * self.slope + 1.0, self.touched.x - self.slope * self.touched.y);
        let step = grown / (half + (half * half + square * grown).sqrt());
        let touched = self.touched + DVec2::new(1.0, -self.slope) * step;
        let at = DVec2::new(x, y);
        let angle = at.perp_dot(touched).atan2(at.dot(touched));
        let planar = Planar { distance: self.distance + step, angle, slide };
        let sound = planar.distance > 0.0 && planar.angle > 0.0;
        (sound && slide.is_finite()).then_some(planar)
    }
}

/// λ, mm, of a contact in the plane of azimuth `phi`, rad, with a pole `along` u through `point` A.
pub fn slide(point: Space, along: Space, phi: f64) -> f64 {
    let (sin, cos) = phi.sin_cos();
    let normal = [0.0, -sin, cos];
    -dot(point, normal) / dot(along, normal)
}

/// The azimuth where a contact with its normal at `psi`, rad, from y₁ pushes square to a pole along u, (sin ψ t₀ + cos ψ m)·u = 0, if any.
pub fn azimuth([x, y, z]: Space, psi: f64) -> Option<f64> {
    let sine = -psi.tan() * x / y.hypot(z);
    (sine.abs() <= 1.0).then(|| sine.asin() - y.atan2(z))
}
