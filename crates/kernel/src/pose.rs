//! From mm to units of the contact distance, of one tap or of several in lanes.

use super::tap::Tap;
use vibrissa_core::physics::linear::shear_length2;
use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::onset::{Grip, Groups, Touch};
use vibrissa_core::physics::solid::Held;
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::{Drive, Model, Side};

/// A tap in mm and rad.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a, T = f64> {
    /// Model of the rod.
    pub model: &'a Model,
    /// Side of the gauge.
    pub side: Side,
    /// Drive: the base turns, or the object moves.
    pub drive: Drive,
    /// r₀; 0 for a displaced object.
    pub hub: f64,
    /// The whisker.
    pub taper: Taper<T>,
    /// Gauge span [x1, x2].
    pub gauge: [T; 2],
    /// Contact distance.
    pub a: T,
    /// θ or δ.
    pub amount: T,
    /// Contact condition.
    pub grip: Grip,
}

impl<T: Number> Pose<'_, T> {
    /// The tap for kernels, with `weight` 1, and the touch before it.
    #[inline(always)]
    pub fn tap(&self) -> (Tap<T>, Touch<T>) {
        let [zero, half, one] = [0.0, 0.5, 1.0].map(T::of);
        let (a, [x1, x2], model) = (self.a, self.gauge, self.model);
        let taper = self.taper.tau * a;
        let [near, far, width] = [(a - x1) / a, (a - x2) / a, (x2 - x1) / a];
        let radius = half * self.taper.D / a;
        let shear = model.shear.then(|| {
            shear_length2(&self.taper, T::of(model.nu)) / (T::of(3.0 * Held::new(model).shear) * a * a)
        });
        // A length of the rig, mostly 0.
        let over_a = |length: f64| if length == 0.0 { zero } else { T::of(length) / a };
        let mut groups = Groups {
            taper,
            rest: one - taper,
            angle: self.amount,
            hub: over_a(self.hub),
            turn: self.amount,
            pull: zero,
            radius,
            slope: model.surface.then_some(self.taper.tan_alpha),
            pole: over_a(model.pole_radius),
            shear,
            stretch: model.extension.then(|| T::of(0.25) * radius * radius),
            gauge: [near, far, width],
            side: if self.side == Side::Far { -1.0 } else { 1.0 },
        };
        let touch = groups.touch();
        let (pole_x, pole_y) = touch.pole;
        if self.drive == Drive::Displacement {
            // The object's path seen from the clamp: an angle and a growing distance.
            let delta = self.amount / a;
            let (across, along) = (pole_x * delta, pole_x * pole_x + pole_y * (pole_y - delta));
            groups.angle = across.atan2(along);
            groups.turn = zero;
            groups.pull = half * delta * delta - pole_y * delta;
        }
        let onset = groups.onset(&touch, self.grip);
        let tap = Tap {
            taper,
            rest: groups.rest,
            angle: groups.angle,
            hub: groups.hub,
            near,
            far,
            width,
            shear: shear.unwrap_or(zero),
            weight: one,
            radius,
            contact_radius: touch.radius,
            slope: touch.slope,
            pole_x,
            pole_y,
            ratio: onset.ratio,
            force: onset.across,
            along: onset.along,
            arc: onset.arc,
            // A contact before the gauge has force and arc only.
            strain: zero.if_less(near, onset.strain, one),
        };
        (tap, touch)
    }
}
