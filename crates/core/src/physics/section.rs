//! The round section of an incompressible solid: axial force and moment against stretch and curvature (model §3).
//!
//! Scaled by the radius, n = N/R² and m = M/R³ (both MPa) against e₀ and k = κR, the law is the same for every
//! section of a whisker. The integrals over the disc use Gauss–Chebyshev quadrature of the second kind, whose
//! weight √(1 − y²) is the width of the disc: n = 2 ∫ s(e₀ + k y) √(1 − y²) dy over −1 … 1.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::real::Real;
use crate::scene::Material;

/// Quadrature points over the diameter; inside [`STRAIN_RANGE`] they leave an error below 1e-15.
const POINTS: usize = 20;

/// Point y and weight 2 w of the quadrature over the unit disc.
static NODES: LazyLock<[[f64; 2]; POINTS]> = LazyLock::new(|| {
    let step = PI / (POINTS + 1) as f64;
    std::array::from_fn(|i| {
        let (sin, cos) = (step * (i + 1) as f64).sin_cos();
        [cos, 2.0 * step * sin * sin]
    })
});

/// Fibre strains within which a hyperelastic law is trusted.
pub const STRAIN_RANGE: [f64; 2] = [-0.5, 1.0];

/// Newton iterates are kept above this fibre strain; the stress is singular at −1.
const CRUSHED: f64 = -0.95;

/// Relative size of the last Newton step; being quadratic, it leaves an error of the order of its square.
const LAST_STEP: f64 = 1e-9;

/// Deformation of a section, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionStrain<T = f64> {
    /// Strain e₀ of the centreline.
    pub axial: T,
    /// k = κR: bending strain of the outer fibre.
    pub bending: T,
}

impl SectionStrain {
    /// Whether every fibre lies in [`STRAIN_RANGE`].
    pub fn is_in_range(&self) -> bool {
        let half = self.bending.abs();
        self.axial - half >= STRAIN_RANGE[0] && self.axial + half <= STRAIN_RANGE[1]
    }
}

/// Uniaxial law of one material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SectionLaw<T = f64> {
    /// Linear elasticity with Young's modulus E, MPa: e₀ = N/(EA), κ = M/(EI).
    Linear(T),
    /// An incompressible hyperelastic solid.
    Hyperelastic(Hyperelastic<T>),
}

/// s = 2 (λ − λ⁻²)(C10 + C01/λ + 2 C20 (I₁ − 3) + 3 C30 (I₁ − 3)²), I₁ = λ² + 2/λ, λ = 1 + e; C10, C01, C20, C30 in MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperelastic<T = f64>([T; 4]);

/// Scaled resultants and their derivatives with respect to (e₀, k).
struct Resultants<T> {
    n: T,
    m: T,
    n_axial: T,
    n_bending: T,
    m_bending: T,
}

impl<T: Real> SectionLaw<T> {
    /// The law of `material`.
    pub fn new(material: &Material<T>) -> Self {
        let zero = T::of(0.0);
        let coefficients = match *material {
            Material::Hooke(e) => return Self::Linear(e),
            Material::NeoHookean(e) => [e / 6.0, zero, zero, zero],
            Material::MooneyRivlin([c10, c01]) => [c10, c01, zero, zero],
            Material::Yeoh([c10, c20, c30]) => [c10, zero, c20, c30],
        };
        Self::Hyperelastic(Hyperelastic(coefficients))
    }

    /// Whether the law is linear, hence without a range of validity.
    pub fn is_linear(&self) -> bool {
        matches!(self, Self::Linear(_))
    }

    /// The deformation under n = N/R² and m = M/R³, MPa, on the branch that starts unloaded; `None` where that
    /// branch has no such load, its tangent having vanished before. Strains outside [`STRAIN_RANGE`] are returned.
    pub fn deform(&self, n: T, m: T) -> Option<SectionStrain<T>> {
        match self {
            Self::Linear(e) => {
                let pi_e = *e * PI;
                Some(SectionStrain { axial: n / pi_e, bending: m * 4.0 / pi_e })
            }
            Self::Hyperelastic(law) => {
                let bare = Hyperelastic(law.0.map(T::value)).deform(n.value(), m.value())?;
                Some(law.follow(bare, n, m))
            }
        }
    }
}

impl<T: Real> Hyperelastic<T> {
    /// Nominal uniaxial stress and its slope, MPa, at the strain `e` > −1; free of cancellation at e = 0.
    pub fn stress(&self, e: T) -> (T, T) {
        let [c10, c01, c20, c30] = self.0;
        let inverse = T::of(1.0) / (e + 1.0);
        let g = e * (e * (e + 3.0) + 3.0) * inverse * inverse;
        let j = e * e * (e + 3.0) * inverse;
        let w = c10 + c01 * inverse + j * (c20 * 2.0 + c30 * 3.0 * j);
        let slope = -c01 * inverse * inverse + g * 2.0 * (c20 * 2.0 + c30 * 6.0 * j);
        (g * 2.0 * w, ((inverse.powi(3) * 2.0 + 1.0) * w + g * slope) * 2.0)
    }

    fn resultants(&self, at: SectionStrain<T>) -> Resultants<T> {
        let zero = T::of(0.0);
        let mut sum = Resultants { n: zero, m: zero, n_axial: zero, n_bending: zero, m_bending: zero };
        for &[y, weight] in NODES.iter() {
            let (s, slope) = self.stress(at.axial + at.bending * y);
            let (s, slope) = (s * weight, slope * weight);
            sum.n = sum.n + s;
            sum.m = sum.m + s * y;
            sum.n_axial = sum.n_axial + slope;
            sum.n_bending = sum.n_bending + slope * y;
            sum.m_bending = sum.m_bending + slope * y * y;
        }
        sum
    }

    /// The deformation under n and m, MPa, that has the value `bare`, with its derivatives: one step of Newton's method.
    fn follow(&self, bare: SectionStrain, n: T, m: T) -> SectionStrain<T> {
        let at = SectionStrain { axial: T::of(bare.axial), bending: T::of(bare.bending) };
        if T::BARE {
            return at;
        }
        let r = self.resultants(at);
        let (dn, dm) = (n - r.n, m - r.m);
        let tangent = r.n_axial * r.m_bending - r.n_bending * r.n_bending;
        SectionStrain {
            axial: at.axial + (dn * r.m_bending - dm * r.n_bending) / tangent,
            bending: at.bending + (dm * r.n_axial - dn * r.n_bending) / tangent,
        }
    }
}

impl Hyperelastic {
    fn deform(&self, n: f64, m: f64) -> Option<SectionStrain> {
        let mut at = SectionStrain { axial: 0.0, bending: 0.0 };
        for _ in 0..60 {
            let r = self.resultants(at);
            let tangent = r.n_axial * r.m_bending - r.n_bending * r.n_bending;
            if r.n_axial.is_nan() || r.n_axial <= 0.0 || tangent <= 0.0 {
                return None;
            }
            let (dn, dm) = (n - r.n, m - r.m);
            let mut axial = (dn * r.m_bending - dm * r.n_bending) / tangent;
            let mut bending = (dm * r.n_axial - dn * r.n_bending) / tangent;
            let crushing = bending.abs() - axial;
            let room = at.axial - at.bending.abs() - CRUSHED;
            if crushing > 0.8 * room {
                let shorten = 0.8 * room / crushing;
                axial *= shorten;
                bending *= shorten;
            }
            at = SectionStrain { axial: at.axial + axial, bending: at.bending + bending };
            let size = at.axial.abs().max(at.bending.abs());
            if axial.abs().max(bending.abs()) <= LAST_STEP * size {
                return Some(at);
            }
        }
        None
    }
}
