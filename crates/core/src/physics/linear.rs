//! Linear theory (model §2): closed forms of the tapered cantilever pressed at distance a.
//! In u = 1/a and b_i = 1/(1 − τ x_i), so that nothing divides by τ or cancels as d → D:
//!
//! - tap angle (Eq. 4), strain per radian f (Eq. 8, unit corrected), per mm g = f/a;
//! - f_T = f/(1 + S/a²), S = 3 E D²/(16 k G): shear multiplies θ for the same force by 1 + S/a² for *any* taper.

use std::f64::consts::PI;
use std::sync::Arc;

use super::body::Body;
use super::flexure::Flexure;
use super::number::Number;
use super::real::Real;
use super::taper::Taper;
use crate::scene::channels::Signal;
use crate::scene::model::Drive;

/// Shear length² S = 3 E D²/(16 k G), mm², with k = 6(1+ν)/(7+6ν), G = E/(2(1+ν)); E cancels.
#[inline(always)]
pub fn shear_length2<T: Number>(taper: &Taper<T>, nu: T) -> T {
    let k = shear_coefficient(nu);
    T::of(3.0) * taper.D * taper.D * T::of(2.0) * (T::of(1.0) + nu) / (T::of(16.0) * k)
}

/// k of a round section, 6 (1 + ν)/(7 + 6 ν).
#[inline(always)]
pub fn shear_coefficient<T: Number>(nu: T) -> T {
    T::of(6.0) * (T::of(1.0) + nu) / (T::of(7.0) + T::of(6.0) * nu)
}

/// Strain of a gauge per unit of drive over the contact distance a: f (1/rad), or g = f/a (1/mm) for a displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct StrainCurve<T = f64> {
    /// The whisker.
    pub taper: Taper<T>,
    /// Gauge span x1 < x2, mm.
    pub gauge: [T; 2],
    /// r₀, mm; 0 for a displacement.
    pub hub: T,
    /// Angle or displacement.
    pub drive: Drive,
    /// S, mm²; 0 for Euler–Bernoulli.
    pub shear: T,
    /// b1 = 1/(1 − τ x1), b2 = 1/(1 − τ x2).
    pub b: [T; 2],
    built: Option<Flexure>,
}

impl<T: Real> StrainCurve<T> {
    /// `shear` is S of [`shear_length2`], or 0 for Euler–Bernoulli theory; lengths in mm.
    #[inline(always)]
    pub fn new(taper: Taper<T>, gauge: [T; 2], hub: T, drive: Drive, shear: T) -> Self {
        let hub = if drive == Drive::Displacement { T::of(0.0) } else { hub };
        let b = gauge.map(|x| T::of(1.0) / (T::of(1.0) - taper.tau * x));
        Self { taper, gauge, hub, drive, shear, b, built: None }
    }

    /// f and df/du at u = 1/a, for 0 ≤ u < 1/x1, of a cone clamped at its base; 0 beyond.
    #[inline(always)]
    pub fn of_cone(&self, u: T) -> (T, T) {
        let one = T::of(1.0);
        let ([x1, x2], [b1, b2]) = (self.gauge, self.b);
        if (x1 * u).value() >= 1.0 {
            return (T::of(0.0), T::of(0.0));
        }
        let quarter = T::of(0.75) * self.taper.D;
        let (p, dp) = if (x2 * u).value() <= 1.0 {
            let c = quarter * b1 * b2;
            let t = x1 * b1 + x2 * b2;
            let (m, n) = (u - self.taper.tau, b1 * (one - x1 * u) + b2 * (one - x2 * u));
            (c * m * n, c * (n - t * m))
        } else {
            // The contact is on the gauge: no moment beyond it. C₁ (1 − x1 u)²
            let c = quarter * b1 * b1 / (x2 - x1);
            let m = one - x1 * u;
            (c * m * m, c * T::of(-2.0) * x1 * m)
        };
        // Factor of the drive and its derivative.
        let (w, dw) = match self.drive {
            Drive::Angle => (self.hub * u + one, self.hub),
            Drive::Displacement => (u, one),
        };
        let (q, dq) = (p * w, dp * w + p * dw);
        let s = self.shear * u * u + one;
        (q / s, (dq - q * T::of(2.0) * self.shear * u / s) / s)
    }
}

impl StrainCurve {
    /// The curve of `signal` for the whisker `body`.
    pub fn built(self, body: &Arc<Body>, signal: Signal) -> Self {
        let Self { gauge, hub, drive, shear, .. } = self;
        let built = Flexure::new(Arc::clone(body), signal, gauge, (hub, drive), shear != 0.0);
        Self { built: Some(built), ..self }
    }

    /// The farthest contact that it covers, mm; `None` for a clamped cone, which continues beyond its tip.
    pub fn end(&self) -> Option<f64> {
        self.built.as_ref().map(|built| built.body.reach())
    }

    /// Places where the whisker is not smooth, mm.
    pub fn knots(&self) -> &[f64] {
        self.built.as_ref().map_or(&[], |built| built.body.knots())
    }

    /// True for the strain of a gauge.
    pub fn reads_strain(&self) -> bool {
        self.built.as_ref().is_none_or(|built| built.signal == Signal::Strain)
    }

    /// True for the strain of a cone clamped at its base.
    pub fn is_plain(&self) -> bool {
        self.built.is_none()
    }

    /// f and df/du at u = 1/a, for 0 ≤ u < 1/x1; 0 beyond.
    pub fn at_inverse(&self, u: f64) -> (f64, f64) {
        let Some(built) = &self.built else { return self.of_cone(u) };
        let a = 1.0 / u;
        let [f, slope] = built.value(a);
        (f, -slope * a * a)
    }

    /// Mean strain per radian (or per mm) for a contact at `a` mm; 0 at or inside the gauge's near end.
    pub fn value(&self, a: f64) -> f64 {
        self.at_inverse(1.0 / a).0
    }

    /// f for a → ∞: above 0 for a widening cone; for a built whisker extrapolated beyond its tip by the ratio of the cone.
    pub fn farthest(&self) -> f64 {
        let widens = self.taper.tau < 0.0;
        match self.end() {
            _ if !widens || !self.reads_strain() => 0.0,
            None => self.of_cone(0.0).0,
            Some(end) => self.value(end) * self.of_cone(0.0).0 / self.of_cone(1.0 / end).0,
        }
    }

    /// df/da, per radian (or mm) and mm.
    pub fn slope(&self, a: f64) -> f64 {
        -self.at_inverse(1.0 / a).1 / (a * a)
    }

    /// Contact force per unit of drive, N/rad (or N/mm), modulus `e` in MPa. Eq. 4 with shear.
    pub fn force(&self, e: f64, a: f64) -> f64 {
        if let Some(built) = &self.built {
            return built.force(a);
        }
        let v = 1.0 - self.taper.tau * a;
        let reach = match self.drive {
            Drive::Angle => a + self.hub,
            Drive::Displacement => 1.0,
        };
        e * (3.0 * PI) * self.taper.D.powi(4) * v * reach / (a.powi(3) * 64.0) / (self.shear / (a * a) + 1.0)
    }

    /// Wrench on the root per unit of drive: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, e: f64, a: f64) -> [f64; 3] {
        match &self.built {
            Some(built) => built.wrench(a),
            None => [-a, 0.0, -1.0].map(|x| x * self.force(e, a)),
        }
    }
}
