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

use super::number::Number;

/// Dimensionless numbers of a tap, or of several in lanes; lengths in units of the contact distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Groups<T = f64> {
    /// τa, the taper over the contact distance.
    pub taper: T,
    /// 1 − τa.
    pub rest: T,
    /// Tap angle θ, rad.
    pub angle: T,
    /// r₀; 0 for a displaced object.
    pub hub: T,
    /// ϑ: turn of the base, rad; 0 for a displaced object.
    pub turn: T,
    /// ζ: half the growth of the squared distance to the pole; 0 for a tap angle.
    pub pull: T,
    /// Base radius.
    pub radius: T,
    /// tan α, for contact on the surface.
    pub slope: Option<T>,
    /// Radius of the pole.
    pub pole: T,
    /// EI₀/(k G A₀), with shear.
    pub shear: Option<T>,
    /// EI₀/(E A₀), if the centreline stretches: also the gauge strain of a unit axial force, which the section law has not otherwise.
    pub stretch: Option<T>,
    /// 1 − x1, 1 − x2, and x2 − x1.
    pub gauge: [T; 3],
    /// +1 for a gauge on the contact side, −1 on the far side.
    pub side: f64,
}

/// The limit of the contact force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// T = μP, sign included; 0 is frictionless.
    Slide(f64),
    /// The contact does not slip: it stays at its arc length on an edge, and rolls on a pole.
    Stick,
}

/// The contact before the tap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch<T = f64> {
    /// Radius of the whisker there, for contact on the surface, else 0.
    pub radius: T,
    /// tan α, likewise.
    pub slope: T,
    /// cos α and sin α, likewise; else 1 and 0.
    pub direction: (T, T),
    /// Pole centre from the motor's axis, (X₀, Y₀).
    pub pole: (T, T),
}

/// The first-order solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset<T = f64> {
    /// W, the force across.
    pub across: T,
    /// H, the force along.
    pub along: T,
    /// x = c − 1.
    pub arc: T,
    /// H/W of a sliding contact; ρ cos α of one that sticks, by which it rolls.
    pub ratio: T,
    /// Unsigned gauge strain.
    pub strain: T,
}

/// cos α and sin α of a slope.
#[inline(always)]
pub fn direction<T: Number>(slope: T) -> (T, T) {
    let c = T::of(1.0) / slope.hypot(T::of(1.0));
    (c, slope * c)
}

impl<T: Number> Groups<T> {
    /// The contact before the tap.
    #[inline(always)]
    pub fn touch(&self) -> Touch<T> {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let (radius, slope, (cos, sin)) = match self.slope {
            Some(slope) => (self.radius * self.rest, slope, direction(slope)),
            None => (zero, zero, (one, zero)),
        };
        let pole = (one + self.pole * sin + self.hub, radius + self.pole * cos);
        Touch { radius, slope, direction: (cos, sin), pole }
    }

    /// The first-order solution for the contact `grip` at `touch`.
    #[inline(always)]
    pub fn onset(&self, touch: &Touch<T>, grip: Grip) -> Onset<T> {
        let [zero, one, two, three, six] = [0.0, 1.0, 2.0, 3.0, 6.0].map(T::of);
        let (v, contact_radius, (x0, y0)) = (self.rest, touch.radius, touch.pole);
        let (psi1, bare) = ((one + two * v) / (six * v * v), one / (six * v * v));
        let eta1 = self.shear.map_or(bare, |shear| bare - shear / v);
        let (psi0, eta0) = match self.slope {
            Some(_) => {
                let cube = v * v * v;
                (
                    contact_radius * (one + v + v * v) / (three * cube),
                    contact_radius * (two + v) / (six * cube),
                )
            }
            None => (zero, zero),
        };
        let f = self.stretch.map_or(zero, |stretch| stretch / v);
        let square = x0 * x0 + y0 * y0;
        let turn = square - self.hub * x0;
        let (a1, a0) = (turn * psi1 - x0 * eta1, turn * psi0 - x0 * eta0);
        let (b1, b0) = (eta1 + self.hub * psi1, eta0 + self.hub * psi0);
        let (right, zeta) = (self.angle * square, self.pull);
        let (across, along, arc, ratio) = match grip {
            Grip::Slide(friction) => {
                let ((cos, sin), friction) = (touch.direction, T::of(friction));
                let leaning = || (friction * cos - sin) / (cos + friction * sin);
                let ratio = if self.slope.is_none() { friction } else { leaning() };
                let (m11, m12) = (a1 + ratio * (a0 + y0 * f), y0 + x0 * touch.slope);
                let (m21, m22) = (ratio * x0 * f + y0 * (b1 + ratio * b0), x0 - y0 * touch.slope);
                let det = m11 * m22 - m12 * m21;
                let across = (right * m22 - m12 * zeta) / det;
                (across, ratio * across, (m11 * zeta - m21 * right) / det, ratio)
            }
            Grip::Stick => {
                let roll = self.pole * touch.direction.0;
                let (lift, reach) = (roll * (y0 + x0 * touch.slope), roll * (x0 - y0 * touch.slope));
                let (m11, m12) = (a1 - lift * psi1, a0 + y0 * f - lift * psi0);
                let (m21, m22) = (y0 * b1 - reach * psi1, x0 * f + y0 * b0 - reach * psi0);
                let (right, zeta) = (right - lift * self.turn, zeta - reach * self.turn);
                let det = m11 * m22 - m12 * m21;
                let (across, along) = ((right * m22 - m12 * zeta) / det, (m11 * zeta - m21 * right) / det);
                (across, along, roll * (self.turn - across * psi1 - along * psi0), roll)
            }
        };
        let [lever, section, area] = self.gauge_means();
        let bending = self.radius * (across * lever + along * contact_radius * section);
        let axial = |stretch: T| T::of(self.side) * stretch * along * area;
        let strain = self.stretch.map_or(bending, |stretch| bending + axial(stretch));
        Onset { across, along, arc, ratio, strain }
    }

    /// Means over the gauge of (1 − s)₊/(1 − τs)³, 1/(1 − τs)³ and 1/(1 − τs)², the last two over the bent part.
    #[inline(always)]
    fn gauge_means(&self) -> [T; 3] {
        let [zero, half, one] = [0.0, 0.5, 1.0].map(T::of);
        let [near, far, width] = self.gauge;
        let [b1, b2] = [near, far].map(|end| one / (self.taper * end + self.rest));
        let clear = [half * b1 * b2 * (near * b1 + far * b2), half * b1 * b2 * (b1 + b2), b1 * b2];
        if zero.all_at_most(far) {
            return clear;
        }
        let beyond = zero.if_less(near, near, zero);
        let (bent, end) = (beyond / width, one / self.rest);
        let ends =
            [half * bent * beyond * b1 * b1 * end, half * bent * b1 * end * (b1 + end), bent * b1 * end];
        std::array::from_fn(|k| far.if_less(zero, ends[k], clear[k]))
    }
}
