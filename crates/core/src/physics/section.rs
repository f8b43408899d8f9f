//! The round section of an incompressible solid: axial force and moment against stretch and curvature (model §3).
//!
//! Scaled by the radius, n = N/R² and m = M/R³ (both MPa) against e₀ and k = κR, the law is the same for every
//! section of a whisker. The integrals over the disc use Gauss–Chebyshev quadrature of the second kind, whose
//! weight √(1 − y²) is the width of the disc: n = 2 ∫ s(e₀ + k y) √(1 − y²) dy over −1 … 1.

use std::f64::consts::PI;
use std::sync::LazyLock;

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
pub struct SectionStrain {
    /// Strain e₀ of the centreline.
    pub axial: f64,
    /// k = κR: bending strain of the outer fibre.
    pub bending: f64,
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
pub enum SectionLaw {
    /// Linear elasticity with Young's modulus E, MPa: e₀ = N/(EA), κ = M/(EI).
    Linear(f64),
    /// An incompressible hyperelastic solid.
    Hyperelastic(Hyperelastic),
}

/// s = 2 (λ − λ⁻²)(C10 + C01/λ + 2 C20 (I₁ − 3) + 3 C30 (I₁ − 3)²), I₁ = λ² + 2/λ, λ = 1 + e; C10, C01, C20, C30 in MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperelastic([f64; 4]);

/// Scaled resultants and their derivatives with respect to (e₀, k).
struct Resultants {
    n: f64,
    m: f64,
    n_axial: f64,
    n_bending: f64,
    m_bending: f64,
}

impl SectionLaw {
    /// The law of `material`.
    pub fn new(material: &Material) -> Self {
        let coefficients = match *material {
            Material::Hooke(e) => return Self::Linear(e),
            Material::NeoHookean(e) => [e / 6.0, 0.0, 0.0, 0.0],
            Material::MooneyRivlin([c10, c01]) => [c10, c01, 0.0, 0.0],
            Material::Yeoh([c10, c20, c30]) => [c10, 0.0, c20, c30],
        };
        Self::Hyperelastic(Hyperelastic(coefficients))
    }

    /// Whether the law is linear, hence without a range of validity.
    pub fn is_linear(&self) -> bool {
        matches!(self, Self::Linear(_))
    }

    /// The deformation under n = N/R² and m = M/R³, MPa, on the branch that starts unloaded; `None` where that
    /// branch has no such load, its tangent having vanished before. Strains outside [`STRAIN_RANGE`] are returned.
    pub fn deform(&self, n: f64, m: f64) -> Option<SectionStrain> {
        match self {
            Self::Linear(e) => Some(SectionStrain { axial: n / (PI * e), bending: 4.0 * m / (PI * e) }),
            Self::Hyperelastic(law) => law.deform(n, m),
        }
    }
}

impl Hyperelastic {
    /// Nominal uniaxial stress and its slope, MPa, at the strain `e` > −1; free of cancellation at e = 0.
    pub fn stress(&self, e: f64) -> (f64, f64) {
        let [c10, c01, c20, c30] = self.0;
        let inverse = 1.0 / (1.0 + e);
        let g = e * (3.0 + e * (3.0 + e)) * inverse * inverse;
        let j = e * e * (3.0 + e) * inverse;
        let w = c10 + c01 * inverse + j * (2.0 * c20 + 3.0 * c30 * j);
        let slope = -c01 * inverse * inverse + 2.0 * g * (2.0 * c20 + 6.0 * c30 * j);
        (2.0 * g * w, 2.0 * ((1.0 + 2.0 * inverse.powi(3)) * w + g * slope))
    }

    fn resultants(&self, at: SectionStrain) -> Resultants {
        let mut sum = Resultants { n: 0.0, m: 0.0, n_axial: 0.0, n_bending: 0.0, m_bending: 0.0 };
        for &[y, weight] in NODES.iter() {
            let (s, slope) = self.stress(at.axial + at.bending * y);
            let (s, slope) = (weight * s, weight * slope);
            sum.n += s;
            sum.m += s * y;
            sum.n_axial += slope;
            sum.n_bending += slope * y;
            sum.m_bending += slope * y * y;
        }
        sum
    }

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
