//! The dimensionless tap that kernels solve, its solution, and the conversion in f64. Unit of length is the contact distance. A displaced object
//! (passive drive) is the same problem seen from the clamp, without a hub: the pole turns by an angle and its distance grows.

use bytemuck::{Pod, Zeroable};

use super::cpu::Pack;
use super::onset::Pose;
use super::rule::limits::{EDGE, HOPELESS};
use vibrissa_core::design::Shared;
use vibrissa_core::physics::{driven::Driven, linear::StrainCurve, taper::Taper};
use vibrissa_core::scene::{Grip, Setup};

/// A tap in units of the contact distance; the layout is the WGSL struct `Tap`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Tap<T = f64> {
    /// Taper τa.
    pub taper: T,
    /// 1 − τa > 0, from f64: next to the apex the difference would lose digits in f32.
    pub rest: T,
    /// θ, rad.
    pub angle: T,
    /// r₀/a.
    pub hub: T,
    /// 1 − x1/a: distance of the contact beyond the gauge's near end.
    pub near: T,
    /// 1 − x2/a; negative where the contact is on the gauge.
    pub far: T,
    /// (x2 − x1)/a.
    pub width: T,
    /// EI₀/(k G A₀) (S/3).
    pub shear: T,
    /// |ε|/max(|ε|, 1e-3 θ f_max) of the linear strain: weight of relative strain errors.
    pub weight: T,
    /// Base radius.
    pub radius: T,
    /// Radius at the contact for contact on the surface, else 0.
    pub contact_radius: T,
    /// tan α for contact on the surface, else 0.
    pub slope: T,
    /// X₀: pole centre from the motor's axis, along the whisker.
    pub pole_x: T,
    /// Y₀: pole centre from the motor's axis, across the whisker.
    pub pole_y: T,
    /// H/W of a sliding contact; ρ cos α of a sticking one, by which it rolls.
    pub ratio: T,
    /// W₀ of the first-order solution.
    pub force: T,
    /// H₀ of the first-order solution.
    pub along: T,
    /// x₀ = c − 1 to first order.
    pub arc: T,
    /// First-order strain.
    pub strain: T,
}

/// A kernel's answer; the layout is the WGSL struct `Solution`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Solution<T = f64> {
    /// w: W/W₀ − 1.
    pub force: T,
    /// k: (H − H₀)/W₀.
    pub along: T,
    /// z: c − 1 − x₀.
    pub arc: T,
    /// Strain over that of the first-order solution, less 1.
    pub strain: T,
    /// Estimated error of the strain relative to max(|ε|, 1e-3 θ f_max).
    pub error: T,
    /// Largest load of a fibre; above 1 the material law ends. 0 without an equilibrium, or outside the chart.
    pub load: T,
    /// Sweeps spent.
    pub sweeps: T,
}

macro_rules! pod {
    ($($t:ty),*) => {$(
        // SAFETY: repr(C), all fields of one plain float type, so no padding and every bit pattern is valid.
        unsafe impl Zeroable for Tap<$t> {}
        unsafe impl Pod for Tap<$t> {}
        unsafe impl Zeroable for Solution<$t> {}
        unsafe impl Pod for Solution<$t> {}
    )*};
}
pod!(f32, f64);

macro_rules! fields {
    ($name:ident: $($f:ident)*) => {
        impl<T: Copy> $name<T> {
            /// Names of the fields, in order.
            pub const FIELDS: &[&str] = &[$(stringify!($f)),*];

            /// Every field through `f`.
            #[inline(always)]
            pub fn map<U>(&self, f: impl Fn(T) -> U) -> $name<U> {
                $name { $($f: f(self.$f)),* }
            }

            /// Every field gathered from the same field of something.
            #[inline(always)]
            pub fn gather(mut f: impl FnMut(usize) -> T) -> Self {
                let mut at = 0;
                $(let $f = f(at); at += 1;)*
                let _ = at;
                $name { $($f),* }
            }

            /// Values in order.
            #[inline(always)]
            pub fn values(&self) -> [T; [$(stringify!($f)),*].len()] {
                [$(self.$f),*]
            }
        }
    };
}
fields!(Tap: taper rest angle hub near far width shear weight radius contact_radius slope pole_x pole_y ratio force along arc strain);
fields!(Solution: force along arc strain error load sweeps);

impl Tap {
    /// The strain of solution `s`, positive as on the contact side.
    pub fn strain(&self, s: &Solution) -> f64 {
        self.strain + self.strain * s.strain
    }

    /// Shift of the contact along the whisker: c/a − 1.
    pub fn moved(&self, s: &Solution) -> f64 {
        self.arc + s.arc
    }
}

impl Solution {
    /// True if the tap met the tolerance; false for NaN or infinite values.
    pub fn within(&self, tolerance: f64) -> bool {
        self.error <= tolerance
            && [self.force, self.along, self.arc, self.strain].iter().all(|x| x.is_finite())
    }

    /// True if the kernel has an answer: a strain within `tolerance` from a material that has surely not ended.
    pub fn is_told(&self, tolerance: f64) -> bool {
        self.within(tolerance) && self.load < 1.0 - EDGE
    }

    /// True at an equilibrium outside the series or chart, beyond a fold of the path, or close to the end of the law.
    pub fn unsure(&self) -> bool {
        self.error == HOPELESS && self.load <= 1.0 + EDGE || (self.load - 1.0).abs() <= EDGE
    }

    /// A tap that has no solution.
    pub const FAILED: Self = Self {
        force: f64::NAN,
        along: f64::NAN,
        arc: f64::NAN,
        strain: f64::NAN,
        error: f64::INFINITY,
        load: 0.0,
        sweeps: 0.0,
    };
}

/// A tap with its units: converts the question and the answer.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    tap: Tap,
    /// Contact distance, mm.
    a: f64,
    /// EI₀/a², N.
    unit: f64,
    /// cos α, sin α at the contact.
    direction: [f64; 2],
    /// T/P of a sliding contact.
    friction: Option<f64>,
    /// Beginning of the rod, mm from the face of its clamp.
    start: f64,
}

impl Frame {
    /// The tap at `a` mm, `driven`, held by `grip`; `None` where the contact would be at or beyond the virtual apex.
    pub fn new(setup: &Setup, shared: &Shared, (a, driven): (f64, Driven), grip: Grip) -> Option<Self> {
        let (model, curve, start) = (&setup.model, &shared.rod(), shared.start);
        let (a, size) = (a - start, driven.size());
        let StrainCurve { taper, gauge, hub, .. } = *curve;
        let lane = |x: f64| Pack::new([x]);
        let pose = Pose {
            model,
            side: setup.gauge.side,
            driven: driven.map(lane),
            hub,
            taper: Taper { D: lane(taper.D), tau: lane(taper.tau), tan_alpha: lane(taper.tan_alpha) },
            gauge: gauge.map(lane),
            a: lane(a),
            grip,
        };
        let (tap, direction) = pose.onset();
        if tap.rest.0[0] <= 0.0 {
            return None;
        }
        let linear = size * curve.value(a);
        let least = 1e-3 * size * shared.peak;
        let weight = if linear > 0.0 { linear / linear.max(least) } else { 0.0 };
        let stiffness = model.material.e0() * std::f64::consts::PI * taper.D.powi(4) / 64.0;
        let friction = match grip {
            Grip::Slide(friction) => Some(friction),
            Grip::Stick => None,
        };
        let tap = Tap { weight, ..tap.map(|x| x.0[0]) };
        let direction = direction.map(|x| x.0[0]);
        Some(Self { tap, a, unit: stiffness / (a * a), direction, friction, start })
    }

    /// The dimensionless tap.
    pub fn tap(&self) -> &Tap {
        &self.tap
    }

    /// P and T, N, of a solution.
    pub fn forces(&self, s: &Solution) -> [f64; 2] {
        let t = &self.tap;
        let (w, h) = (t.force + t.force * s.force, t.along + t.force * s.along);
        let [cos, sin] = self.direction;
        let normal = (w * cos - h * sin) * self.unit;
        [normal, self.friction.map_or((w * sin + h * cos) * self.unit, |friction| friction * normal)]
    }

    /// c of a solution, mm.
    pub fn arc(&self, s: &Solution) -> f64 {
        self.start + self.a * (1.0 + self.tap.moved(s))
    }

    /// The contact at friction `mu` of a tap that is framed as sticking, to first order in the drive: it sticks or slides.
    pub fn foreseen(&self, mu: f64) -> Grip {
        let [normal, tangential] = self.forces(&Solution::default());
        if tangential.abs() > mu * normal { Grip::Slide(mu.copysign(tangential)) } else { Grip::Stick }
    }
}
