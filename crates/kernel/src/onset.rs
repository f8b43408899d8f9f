//! The linear limit of the exact model: force, arc and strain to first order in the drive, in closed form.
//!
//! Lengths in contact distances, forces in EI₀/a². With surface contact, friction or shear K does not tend to 1; kernels carry the deviation.
//!
//! W and H are the contact force across and along the whisker, (X₀, Y₀) the pole centre from the motor's axis, a₁, a₀ (b₁, b₀) the effects
//! of a unit W and H on the closure across (along) that line, f the stretch by a unit H. To first order in θ, W, H and x = c − 1:
//! - W a₁ + H a₀ + x (Y₀ + X₀ tan α) + Y₀ H f = θ (X₀² + Y₀²)
//! - (X₀ − Y₀ tan α) x + X₀ H f + Y₀ (W b₁ + H b₀) = ζ
//!
//! A contact that sticks rolls on the pole: x = ρ cos α (ϑ − W ψ₁ − H ψ₀), ϑ the turn of the base, W ψ₁ + H ψ₀ that of the contact against it.

use crate::Tap;
use crate::cpu::{Pack, Packed, Plain};
use vibrissa_core::physics::{driven::Driven, linear::shear_length2, solid::Held, taper::Taper};
use vibrissa_core::scene::{Grip, Model, Side};

/// One number, or one of each of several taps. Lanes round as scalars do, and no operation is fused: each gives the same bits as a single number.
pub type Lanes<const L: usize> = Pack<f64, L, Plain>;

/// Taps in mm and rad.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a, const L: usize> {
    /// Model of the rod.
    pub model: &'a Model,
    /// Side of the gauge.
    pub side: Side,
    /// The drive.
    pub driven: Driven<Lanes<L>>,
    /// r₀; 0 for a displaced object.
    pub hub: f64,
    /// The whisker.
    pub taper: Taper<Lanes<L>>,
    /// Gauge span [x1, x2].
    pub gauge: [Lanes<L>; 2],
    /// Contact distance.
    pub a: Lanes<L>,
    /// Contact condition.
    pub grip: Grip,
}

impl<const L: usize> Pose<'_, L> {
    /// The taps without units, with their first-order solution and `weight` 1; cos α and sin α of contacts on the surface, else 1 and 0.
    #[inline(always)]
    pub fn onset(&self) -> (Tap<Lanes<L>>, [Lanes<L>; 2]) {
        let [zero, half, one, two, three, six] = [0.0, 0.5, 1.0, 2.0, 3.0, 6.0].map(Lanes::of);
        let (a, [x1, x2], model) = (self.a, self.gauge, self.model);
        let taper = self.taper.tau * a;
        let [near, far, width] = [(a - x1) / a, (a - x2) / a, (x2 - x1) / a];
        let (v, radius) = (one - taper, half * self.taper.D / a);
        let shear = model.shear.then(|| {
            shear_length2(&self.taper, Lanes::of(model.nu))
                / (Lanes::of(3.0 * Held::new(model).shear) * a * a)
        });
        // A unit axial force gives this strain at the gauge, too; the section law does not hold it.
        let stretch = model.extension.then(|| Lanes::of(0.25) * radius * radius);
        // A length of the rig, mostly 0.
        let over_a = |length: f64| if length == 0.0 { zero } else { Lanes::of(length) / a };
        let (hub, rho) = (over_a(self.hub), over_a(model.pole_radius));
        let (contact_radius, slope, (cos, sin)) = match model.surface {
            true => {
                let slope = self.taper.tan_alpha;
                let cos = one / slope.map2(one, f64::hypot);
                (radius * v, slope, (cos, slope * cos))
            }
            false => (zero, zero, (one, zero)),
        };
        let (x0, y0) = (one + rho * sin + hub, contact_radius + rho * cos);
        // ϑ, the turn of the base, and ζ, half the growth of the squared distance to the pole.
        let (angle, turn, zeta) = match self.driven {
            Driven::Radians(theta) => (theta, theta, zero),
            Driven::Millimetres(delta) => {
                // The object's path seen from the clamp: an angle and a growing distance.
                let delta = delta / a;
                let (across, along) = (x0 * delta, x0 * x0 + y0 * (y0 - delta));
                (across.map2(along, f64::atan2), zero, half * delta * delta - y0 * delta)
            }
        };
        let (psi1, bare) = ((one + two * v) / (six * v * v), one / (six * v * v));
        let eta1 = shear.map_or(bare, |shear| bare - shear / v);
        let (psi0, eta0) = match model.surface {
            true => {
                let cube = v * v * v;
                (
                    contact_radius * (one + v + v * v) / (three * cube),
                    contact_radius * (two + v) / (six * cube),
                )
            }
            false => (zero, zero),
        };
        let f = stretch.map_or(zero, |stretch| stretch / v);
        let square = x0 * x0 + y0 * y0;
        let arm = square - hub * x0;
        let (a1, a0) = (arm * psi1 - x0 * eta1, arm * psi0 - x0 * eta0);
        let (b1, b0) = (eta1 + hub * psi1, eta0 + hub * psi0);
        let right = angle * square;
        let (across, along, arc, ratio) = match self.grip {
            Grip::Slide(friction) => {
                let friction = Lanes::of(friction);
                let leaning = || (friction * cos - sin) / (cos + friction * sin);
                let ratio = if model.surface { leaning() } else { friction };
                let (m11, m12) = (a1 + ratio * (a0 + y0 * f), y0 + x0 * slope);
                let (m21, m22) = (ratio * x0 * f + y0 * (b1 + ratio * b0), x0 - y0 * slope);
                let det = m11 * m22 - m12 * m21;
                let across = (right * m22 - m12 * zeta) / det;
                (across, ratio * across, (m11 * zeta - m21 * right) / det, ratio)
            }
            Grip::Stick => {
                let roll = rho * cos;
                let (lift, reach) = (roll * (y0 + x0 * slope), roll * (x0 - y0 * slope));
                let (m11, m12) = (a1 - lift * psi1, a0 + y0 * f - lift * psi0);
                let (m21, m22) = (y0 * b1 - reach * psi1, x0 * f + y0 * b0 - reach * psi0);
                let (right, zeta) = (right - lift * turn, zeta - reach * turn);
                let det = m11 * m22 - m12 * m21;
                let (across, along) = ((right * m22 - m12 * zeta) / det, (m11 * zeta - m21 * right) / det);
                (across, along, roll * (turn - across * psi1 - along * psi0), roll)
            }
        };
        let [lever, section, area] = gauge_means([near, far, width], taper, v);
        let bending = radius * (across * lever + along * contact_radius * section);
        let side = Lanes::of(if self.side == Side::Far { -1.0 } else { 1.0 });
        let strain = stretch.map_or(bending, |stretch| bending + side * stretch * along * area);
        let tap = Tap {
            taper,
            rest: v,
            angle,
            hub,
            near,
            far,
            width,
            shear: shear.unwrap_or(zero),
            weight: one,
            radius,
            contact_radius,
            slope,
            pole_x: x0,
            pole_y: y0,
            ratio,
            force: across,
            along,
            arc,
            // A contact before the gauge has force and arc only.
            strain: zero.if_less(near, strain, one),
        };
        (tap, [cos, sin])
    }
}

/// Means over the gauge of (1 − s)₊/(1 − τs)³, 1/(1 − τs)³ and 1/(1 − τs)², the last two over the bent part.
#[inline(always)]
fn gauge_means<const L: usize>(
    [near, far, width]: [Lanes<L>; 3],
    taper: Lanes<L>,
    rest: Lanes<L>,
) -> [Lanes<L>; 3] {
    let [zero, half, one] = [0.0, 0.5, 1.0].map(Lanes::of);
    let [b1, b2] = [near, far].map(|end| one / (taper * end + rest));
    let clear = [half * b1 * b2 * (near * b1 + far * b2), half * b1 * b2 * (b1 + b2), b1 * b2];
    if zero.all_at_most(far) {
        return clear;
    }
    let beyond = zero.if_less(near, near, zero);
    let (bent, end) = (beyond / width, one / rest);
    let ends = [half * bent * beyond * b1 * b1 * end, half * bent * b1 * end * (b1 + end), bent * b1 * end];
    std::array::from_fn(|k| far.if_less(zero, ends[k], clear[k]))
}
