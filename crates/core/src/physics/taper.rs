//! The whisker's shape and where the gauge sits on it (model §1).
//!
//! Everything is written with τ = (D − d)/(D L_a), so that a cylinder (τ = 0) and a whisker that widens
//! towards its tip (τ < 0) need no special case.

/// A straight, round, linearly tapered whisker clamped at s = 0. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(non_snake_case)]
pub struct Taper {
    /// Base diameter D, mm.
    pub D: f64,
    /// Taper τ, 1/mm; the paper's virtual apex is at L = 1/τ.
    pub tau: f64,
    /// tan α, α the taper half-angle.
    pub tan_alpha: f64,
}

#[allow(non_snake_case)]
impl Taper {
    /// From base diameter `D`, tip diameter `d` and length `L_a`, all in mm and positive.
    pub fn new(D: f64, d: f64, L_a: f64) -> Self {
        Self { D, tau: (D - d) / (D * L_a), tan_alpha: (D - d) / (2.0 * L_a) }
    }

    /// Radius R(s) = D/2 (1 − τ s), mm.
    pub fn radius(&self, s: f64) -> f64 {
        0.5 * self.D * (1.0 - self.tau * s)
    }

    /// cos α.
    pub fn cos_alpha(&self) -> f64 {
        1.0 / self.secant()
    }

    /// 1/cos α.
    fn secant(&self) -> f64 {
        (1.0 + self.tan_alpha * self.tan_alpha).sqrt()
    }

    /// sin α; negative for a whisker that widens towards its tip.
    pub fn sin_alpha(&self) -> f64 {
        self.tan_alpha / self.secant()
    }

    /// Axial span [x1, x2] of a gauge whose grid of length `l` is bonded along the surface from `x_ss`, mm.
    pub fn gauge(&self, x_ss: f64, l: f64) -> [f64; 2] {
        [x_ss, x_ss + l * self.cos_alpha()]
    }
}
