//! The cone of a whisker (model §1) by τ = (D − d)/(D L_a), so that cylinders (τ = 0) and widening whiskers (τ < 0) need no special case.

use super::number::Number;

/// A straight, round, linearly tapered whisker clamped at s = 0; or several, in lanes. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(non_snake_case)]
pub struct Taper<T = f64> {
    /// Base diameter D, mm.
    pub D: T,
    /// Taper τ, 1/mm; the paper's virtual apex is at L = 1/τ.
    pub tau: T,
    /// tan α, α the taper half-angle.
    pub tan_alpha: T,
}

#[allow(non_snake_case)]
impl<T: Number> Taper<T> {
    /// From base diameter `D`, tip diameter `d` and length `L_a`, all in mm and positive.
    #[inline(always)]
    pub fn new(D: T, d: T, L_a: T) -> Self {
        Self { D, tau: (D - d) / (D * L_a), tan_alpha: (D - d) / (T::of(2.0) * L_a) }
    }

    /// Radius R(s) = D/2 (1 − τ s), mm.
    #[inline(always)]
    pub fn radius(&self, s: T) -> T {
        T::of(0.5) * self.D * (T::of(1.0) - self.tau * s)
    }

    /// The whisker clamped at `s`; the cone continues if `s` is negative.
    #[inline]
    pub fn from(&self, s: T) -> Self {
        let rest = T::of(1.0) - self.tau * s;
        Self { D: self.D * rest, tau: self.tau / rest, tan_alpha: self.tan_alpha }
    }

    /// cos α.
    #[inline(always)]
    pub fn cos_alpha(&self) -> T {
        T::of(1.0) / self.secant()
    }

    #[inline(always)]
    fn secant(&self) -> T {
        (T::of(1.0) + self.tan_alpha * self.tan_alpha).sqrt()
    }

    /// sin α; negative for a whisker that widens towards its tip.
    #[inline]
    pub fn sin_alpha(&self) -> T {
        self.tan_alpha / self.secant()
    }

    /// R, sin α and cos α of a contact at `a` on the `surface`; of one on the centreline 0, 0 and 1.
    pub fn touched(&self, a: T, surface: bool) -> [T; 3] {
        match surface {
            true => [self.radius(a), self.sin_alpha(), self.cos_alpha()],
            false => [0.0, 0.0, 1.0].map(T::of),
        }
    }

    /// Axial span [x1, x2] of a gauge whose grid of length `l` is bonded along the surface from `x_ss`, mm.
    #[inline(always)]
    pub fn gauge(&self, x_ss: T, l: T) -> [T; 2] {
        [x_ss, x_ss + l * self.cos_alpha()]
    }
}
