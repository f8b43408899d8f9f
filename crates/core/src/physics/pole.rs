//! A pole of any direction, and the plane in which the whisker bends against it (model §6), where the tap is planar with another distance and angle.
//! Base frame, after the turn: t₀ along the whisker at its clamp, y₁ towards the object in the plane of rotation, z the motor's axis; its origin is
//! that axis, or the clamp where the object moves. The rod bends in the plane of t₀ and m = cos φ y₁ + sin φ z.

use super::real::{Real, Vector};
use super::taper::Taper;
use crate::scene::model::{Drive, Model};

/// A vector of space: along t₀, y₁ and z.
pub type Space<T> = [T; 3];

fn dot<T: Real>([a, b, c]: Space<T>, [x, y, z]: Space<T>) -> T {
    a * x + b * y + c * z
}

/// A pole after the base has turned, or after it has moved itself, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Pole<T = f64> {
    /// A, a point of its axis, mm.
    pub point: Space<T>,
    /// u, the direction of its axis.
    pub along: Space<T>,
    /// |A|² − |A|² at first touch, mm².
    farther: T,
    distance: T,
    touched: Vector<T>,
    slope: T,
}

/// The planar tap in a plane of bending.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar<T = f64> {
    /// Distance a′ at which the undeflected whisker would touch, mm.
    pub distance: T,
    /// Tap angle, rad.
    pub angle: T,
    /// λ: place of the contact on the pole's axis, from that of first touch, mm.
    pub slide: T,
}

impl<T: Copy> Pole<T> {
    /// `f` of each number of both.
    pub fn with<O: Copy, U>(&self, o: &Pole<O>, f: impl Fn(T, O) -> U) -> Pole<U> {
        let each = |x: Space<T>, y: Space<O>| std::array::from_fn(|k| f(x[k], y[k]));
        Pole {
            point: each(self.point, o.point),
            along: each(self.along, o.along),
            farther: f(self.farther, o.farther),
            distance: f(self.distance, o.distance),
            touched: Vector { x: f(self.touched.x, o.touched.x), y: f(self.touched.y, o.touched.y) },
            slope: f(self.slope, o.slope),
        }
    }
}

impl<T: Real> Pole<T> {
    /// The pole of `tilt` β and `lean` γ, rad, at the distance `a` of a `taper`, mm, for an `amount` of the `drive`: θ, rad, or δ, mm. `hub` is r₀, mm,
    /// without meaning for a displacement; `model` gives the contact on the surface, and ρ.
    pub fn new(
        taper: &Taper<T>,
        model: &Model<T>,
        (drive, hub): (Drive, T),
        [tilt, lean]: [T; 2],
        (a, amount): (T, T),
    ) -> Self {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let [height, sin, cos] = taper.touched(a, model.surface);
        let slope = if model.surface { taper.tan_alpha } else { zero };
        let (hub, turn, moved) = match drive {
            Drive::Angle => (hub, amount, zero),
            Drive::Displacement => (zero, zero, amount),
        };
        let touched = Vector::new(a + hub + model.pole_radius * sin, height + model.pole_radius * cos);
        let (tilt, lean) = (Vector::from_angle(tilt), Vector::from_angle(lean));
        // Towards the object (cos β y + sin β z), and across it.
        let (out, across) = ([zero, tilt.x, tilt.y], [zero, -tilt.y, tilt.x]);
        let along = |k: usize, x: T| lean.x * across[k] + lean.y * (cos * x - sin * out[k]);
        let start = |k: usize, x: T| touched.x * x + touched.y * out[k];
        let (sin_t, cos_t) = turn.sin_cos();
        let turned = |[x, y, z]: Space<T>| [cos_t * x + sin_t * y, cos_t * y - sin_t * x, z];
        let begun = [start(0, one), start(1, zero), start(2, zero)];
        let [x, y, z] = turned(begun);
        Self {
            point: [x, y - moved, z],
            along: turned([along(0, one), along(1, zero), along(2, zero)]),
            farther: moved * (moved - begun[1] * 2.0),
            distance: a,
            touched,
            slope,
        }
    }

    /// λ, mm, of a contact in the plane of azimuth `phi`, rad.
    pub fn slide(&self, phi: T) -> T {
        let (sin, cos) = phi.sin_cos();
        let normal = [T::of(0.0), -sin, cos];
        -dot(self.point, normal) / dot(self.along, normal)
    }

    /// The planar tap in the plane of azimuth `phi`, rad; `None` if the pole lies along that plane, or is too near to be touched.
    pub fn planar(&self, phi: T) -> Option<Planar<T>> {
        let (sin, cos) = phi.sin_cos();
        let (m, slide) = ([T::of(0.0), cos, sin], self.slide(phi));
        let seen = std::array::from_fn(|k| self.point[k] + slide * self.along[k]);
        let (x, y) = (seen[0], dot(seen, m));
        // |q(a + step)|² = |C|²: the whisker's radius falls with the slope.
        let grown = self.farther + slide * (dot(self.point, self.along) * 2.0 + slide);
        let (square, half) = (self.slope * self.slope + 1.0, self.touched.x - self.slope * self.touched.y);
        let step = grown / (half + (half * half + square * grown).sqrt());
        let touched = self.touched + Vector::new(T::of(1.0), -self.slope) * step;
        let at = Vector::new(x, y);
        let angle = at.perp_dot(touched).atan2(at.dot(touched));
        let planar = Planar { distance: self.distance + step, angle, slide };
        let sound = planar.distance.value() > 0.0 && planar.angle.value() > 0.0;
        (sound && slide.value().is_finite()).then_some(planar)
    }

    /// The azimuth where a contact with its normal at `psi`, rad, from y₁ pushes square to the pole, (sin ψ t₀ + cos ψ m)·u = 0, if any.
    pub fn azimuth(&self, psi: T) -> Option<T> {
        let [x, y, z] = self.along;
        let sine = -psi.tan() * x / y.hypot(z);
        (sine.value().abs() <= 1.0).then(|| sine.asin() - y.atan2(z))
    }
}
