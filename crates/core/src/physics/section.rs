//! The round section of an incompressible solid: axial force and moment against stretch and curvature (model §3).
//! n = N/R² and m = M/R³ over e₀ and k = κR is one law for every section. Integrals over the disc use Gauss–Chebyshev quadrature of the
//! second kind, whose weight √(1 − y²) is the width of the disc: n = 2 ∫ s(e₀ + k y) √(1 − y²) dy over −1 … 1.

use std::array::from_fn;
use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::scene::Material;

/// `N` points y over the diameter of the unit disc, and weights 2 w of the quadrature.
struct Rule<const N: usize>(LazyLock<[[f64; N]; 2]>);

impl<const N: usize> Rule<N> {
    const fn new() -> Self {
        Self(LazyLock::new(|| {
            let step = PI / (N + 1) as f64;
            let angle = |i: usize| step * (i + 1) as f64;
            [from_fn(|i| angle(i).cos()), from_fn(|i| 2.0 * step * angle(i).sin().powi(2))]
        }))
    }
}

/// Relative error below 1e-15 for fibre strains up to 0.1, up to 0.2, and in all of [`STRAIN_RANGE`].
static RULES: (Rule<8>, Rule<12>, Rule<20>) = (Rule::new(), Rule::new(), Rule::new());

const LANES: usize = 4;

/// Fibre strains within which a hyperelastic law is trusted.
pub const STRAIN_RANGE: [f64; 2] = [-0.5, 1.0];

/// Newton iterates are kept above this fibre strain; the stress is singular at −1.
const CRUSHED: f64 = -0.95;

/// Relative size of the last Newton step; being quadratic, it leaves an error of the order of its square.
const LAST_STEP: f64 = 1e-8;

/// Deformation of a section, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionStrain {
    /// Strain e₀ of the centreline.
    pub axial: f64,
    /// k = κR: bending strain of the outer fibre.
    pub bending: f64,
}

impl SectionStrain {
    /// True if every fibre lies in [`STRAIN_RANGE`].
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

    /// True if the law is linear, hence without a range of validity.
    pub fn is_linear(&self) -> bool {
        matches!(self, Self::Linear(_))
    }

    /// The deformation under n = N/R², m = M/R³, MPa, on the unloaded branch, also outside [`STRAIN_RANGE`]; `None` past a vanishing tangent.
    pub fn deform(&self, n: f64, m: f64) -> Option<SectionStrain> {
        match self {
            Self::Linear(e) => Some(linear(*e, n, m)),
            Self::Hyperelastic(law) => law.deform(n, m),
        }
    }
}

#[inline(always)]
fn linear(e: f64, n: f64, m: f64) -> SectionStrain {
    let pi_e = e * PI;
    SectionStrain { axial: n / pi_e, bending: m * 4.0 / pi_e }
}

impl Hyperelastic {
    /// Nominal uniaxial stress and its slope, MPa, at the strain `e` > −1; free of cancellation at e = 0.
    #[inline(always)]
    pub fn stress(&self, e: f64) -> (f64, f64) {
        let [c10, c01, c20, c30] = self.0;
        let inverse = 1.0 / (e + 1.0);
        let g = e * (e * (e + 3.0) + 3.0) * inverse * inverse;
        let j = e * e * (e + 3.0) * inverse;
        let w = c10 + c01 * inverse + j * (c20 * 2.0 + c30 * 3.0 * j);
        let slope = -c01 * inverse * inverse + g * 2.0 * (c20 * 2.0 + c30 * 6.0 * j);
        (g * 2.0 * w, ((inverse.powi(3) * 2.0 + 1.0) * w + g * slope) * 2.0)
    }

    /// One Newton step from `near`; `None` past a vanishing tangent.
    fn step(&self, near: SectionStrain, n: f64, m: f64) -> Option<SectionStrain> {
        let r = self.resultants(near);
        let tangent = r.n_axial * r.m_bending - r.n_bending * r.n_bending;
        if !(r.n_axial > 0.0 && tangent > 0.0) {
            return None;
        }
        let (dn, dm) = (n - r.n, m - r.m);
        let [soft, cross, bent] = [r.m_bending, -r.n_bending, r.n_axial].map(|x| x / tangent);
        Some(SectionStrain {
            axial: dn * soft + dm * cross + near.axial,
            bending: dn * cross + dm * bent + near.bending,
        })
    }

    fn resultants(&self, at: SectionStrain) -> Resultants {
        match at.axial.abs() + at.bending.abs() {
            largest if largest <= 0.1 => self.sums(at, &RULES.0),
            largest if largest <= 0.2 => self.sums(at, &RULES.1),
            _ => self.sums(at, &RULES.2),
        }
    }

    #[inline(always)]
    fn sums<const N: usize>(&self, at: SectionStrain, rule: &Rule<N>) -> Resultants {
        let [points, weights] = &*rule.0;
        let (mut stress, mut slope) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (stress[i], slope[i]) = self.stress(at.axial + at.bending * points[i]);
        }
        let mut sums = [[0.0; LANES]; 5];
        for k in (0..N).step_by(LANES) {
            for i in 0..LANES {
                let y = points[k + i];
                let (s, slope) = (stress[k + i] * weights[k + i], slope[k + i] * weights[k + i]);
                sums[0][i] += s;
                sums[1][i] += s * y;
                sums[2][i] += slope;
                sums[3][i] += slope * y;
                sums[4][i] += slope * y * y;
            }
        }
        let [n, m, n_axial, n_bending, m_bending] = sums.map(|lanes| lanes.iter().sum());
        Resultants { n, m, n_axial, n_bending, m_bending }
    }

    fn deform(&self, n: f64, m: f64) -> Option<SectionStrain> {
        let mut at = SectionStrain { axial: 0.0, bending: 0.0 };
        // The first step, of the unloaded section.
        let mut next = linear(6.0 * (self.0[0] + self.0[1]), n, m);
        for _ in 0..60 {
            let [mut axial, mut bending] = [next.axial - at.axial, next.bending - at.bending];
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
            next = self.step(at, n, m)?;
        }
        None
    }
}
