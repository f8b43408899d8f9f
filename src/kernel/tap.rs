//! The dimensionless tap that kernels solve, its solution, and the way there and back in f64.
//!
//! Unit of length is the contact distance. A displaced object (passive drive) is the same problem seen from the clamp:
//! the contact is at distance √(a² + δ²) and angle atan(δ/a), without a hub.

use bytemuck::{Pod, Zeroable};

use super::Kernel;
use crate::physics::{linear::StrainCurve, taper::Taper};
use crate::scene::model::Drive;

/// A tap in units of the contact distance; the layout is the WGSL struct `Tap`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Tap<T> {
    /// τa.
    pub taper: T,
    /// 1 − τa > 0, from f64: next to the apex the difference would lose digits in f32.
    pub rest: T,
    /// θ, rad.
    pub angle: T,
    /// r₀/a.
    pub hub: T,
    /// 1 − x1/a: how far the contact is beyond the gauge's near end.
    pub near: T,
    /// 1 − x2/a; negative where the contact is on the gauge.
    pub far: T,
    /// (x2 − x1)/a.
    pub width: T,
    /// S/a² of the shear theory (linear kernel only).
    pub shear: T,
    /// |ε|/max(|ε|, 1e-3 θ f_max) of the linear strain: weight of relative strain errors.
    pub weight: T,
}

/// What a kernel returns; the layout is the WGSL struct `Solution`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Solution<T> {
    /// P/P_linear − 1.
    pub force: T,
    /// c/a − 1.
    pub arc: T,
    /// Exact kernel: ε/ε_linear − 1. Linear kernel: ε a/(D θ).
    pub strain: T,
    /// Estimated error of the strain relative to max(|ε|, 1e-3 θ f_max).
    pub error: T,
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

/// Fields of [`Tap`], in order.
pub const TAP_FIELDS: [&str; 9] =
    ["taper", "rest", "angle", "hub", "near", "far", "width", "shear", "weight"];
/// Fields of [`Solution`], in order.
pub const SOLUTION_FIELDS: [&str; 5] = ["force", "arc", "strain", "error", "sweeps"];

impl Tap<f64> {
    /// Rounded to single precision.
    pub fn to_f32(self) -> Tap<f32> {
        let c = |x: f64| x as f32;
        Tap {
            taper: c(self.taper),
            rest: c(self.rest),
            angle: c(self.angle),
            hub: c(self.hub),
            near: c(self.near),
            far: c(self.far),
            width: c(self.width),
            shear: c(self.shear),
            weight: c(self.weight),
        }
    }
}

impl Solution<f32> {
    /// Widened; nothing is added.
    pub fn to_f64(self) -> Solution<f64> {
        let c = f64::from;
        Solution {
            force: c(self.force),
            arc: c(self.arc),
            strain: c(self.strain),
            error: c(self.error),
            sweeps: c(self.sweeps),
        }
    }
}

impl Solution<f64> {
    /// Whether the tap met the tolerance; false for anything that is not a number.
    pub fn within(&self, tolerance: f64) -> bool {
        self.error <= tolerance && self.force.is_finite() && self.arc.is_finite() && self.strain.is_finite()
    }

    /// A tap that has no solution.
    pub const FAILED: Self =
        Self { force: f64::NAN, arc: f64::NAN, strain: f64::NAN, error: f64::INFINITY, sweeps: 0.0 };
}

/// A tap in its own units: what is asked of the rod, and how a solution is read.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    taper: Taper,
    /// Strain curve of the linear theory of the model (Euler–Bernoulli for the exact rod), as an angle drive about
    /// the hub, or about the clamp for a displaced object.
    curve: StrainCurve,
    /// Contact distance in the rotated frame, mm.
    reach: f64,
    /// Tap angle in the rotated frame, rad.
    angle: f64,
    /// Largest value of `curve`, per rad.
    peak: f64,
}

/// Strain, force and arc of one tap, in strain, N, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Unsigned strain of a gauge on the contact side.
    pub strain: f64,
    /// ε / (θ f) − 1 at full relative precision, f the linear theory of the model about the same drive.
    pub strain_deviation: f64,
    /// Contact force, N.
    pub force: f64,
    /// Contact arc, mm.
    pub arc: f64,
}

impl Frame {
    /// `amount` is θ in rad or δ in mm; `curve` the strain curve of the model for the drive asked; `peak` the largest
    /// value of that curve.
    pub fn new(curve: &StrainCurve, a: f64, amount: f64, peak: f64) -> Self {
        let (reach, angle) = match curve.drive {
            Drive::Angle => (a, amount),
            Drive::Displacement => (a.hypot(amount), amount.atan2(a)),
        };
        let angle_curve = StrainCurve::new(curve.taper, curve.gauge, curve.hub, Drive::Angle, curve.shear);
        // θ f_max of the drive asked, per rad of the rotated frame.
        Self { taper: curve.taper, curve: angle_curve, reach, angle, peak: peak * amount / angle }
    }

    /// The linear theory itself: no rotated frame, θ is the drive (δ/a for a displaced object).
    pub fn linear(curve: &StrainCurve, a: f64, amount: f64) -> Self {
        let angle = if curve.drive == Drive::Angle { amount } else { amount / a };
        let angle_curve = StrainCurve::new(curve.taper, curve.gauge, curve.hub, Drive::Angle, curve.shear);
        Self { taper: curve.taper, curve: angle_curve, reach: a, angle, peak: 0.0 }
    }

    /// The dimensionless tap; `None` where the contact would be at or beyond the virtual apex.
    pub fn tap(&self) -> Option<Tap<f64>> {
        let rest = 1.0 - self.taper.tau * self.reach;
        let [x1, x2] = self.curve.gauge;
        let f = self.curve.value(self.reach);
        (rest > 0.0).then(|| Tap {
            taper: self.taper.tau * self.reach,
            rest,
            angle: self.angle,
            hub: self.curve.hub / self.reach,
            near: (self.reach - x1) / self.reach,
            far: (self.reach - x2) / self.reach,
            width: (x2 - x1) / self.reach,
            shear: self.curve.shear / (self.reach * self.reach),
            weight: if f > 0.0 { f / f.max(1e-3 * self.peak) } else { 0.0 },
        })
    }

    /// Reads a solution of `kernel`; `e` is Young's modulus, MPa.
    pub fn response(&self, kernel: Kernel, e: f64, s: &Solution<f64>) -> Response {
        let linear_strain = self.angle * self.curve.value(self.reach);
        let force = self.angle * self.curve.force(e, self.reach);
        match kernel {
            Kernel::Linear => Response {
                strain: s.strain * self.angle * self.taper.D / self.reach,
                strain_deviation: 0.0,
                force,
                arc: self.reach,
            },
            Kernel::Exact => Response {
                strain: linear_strain + linear_strain * s.strain,
                strain_deviation: s.strain,
                force: force + force * s.force,
                arc: self.reach + self.reach * s.arc,
            },
        }
    }

    /// θ f of the rotated frame: the strain to which `strain_deviation` refers.
    pub fn linear_strain(&self) -> f64 {
        self.angle * self.curve.value(self.reach)
    }
}
