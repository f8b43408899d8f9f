//! Effects of a three-dimensional rubber rod beyond rod theory (model §8): a clamp that acts elsewhere than at its face, a skin that gives way
//! under the contact, sections that distort next to the clamp, and a stiff foil.
//! Fits to finite elements; x from the face of the clamp, t = tan α, D base diameter, R(x) radius, E initial modulus, P contact force.

use std::f64::consts::PI;

use super::inverse::bracketed;
use super::real::Real;
use super::taper::Taper;
use crate::scene::{Clamp, Contact, Foil, Model};

/// Shear coefficient k of ν = 0.5 that the rod has without a clamp: 6 (1 + ν)/(7 + 6 ν).
const TIMOSHENKO: f64 = 0.9;

/// Numbers of a clamp: start c₀ of the rod (in D); k; start b of its shear (in D); compliance c at the contact (of 1/(E R)).
/// Bonded: θ per newton within 0.13 % for a ≥ 1.8 D, d/D 0.4 … 1, and 0.33 % for d/D 0.2 … 1.2.
const BONDED: [f64; 4] = [0.0532, 1.1157, -0.7278, -0.6836];
/// Glued into a socket of 1 D: 0.15 % for a ≥ 2.1 D, d/D 0.4 and 1 (one number: 0.6 %).
const GLUED: [f64; 4] = [-0.028, 1.1157, -0.18, -0.25];

/// k with one number c₀, and c₀ of each clamp: θ within 0.7, 0.8 and 2 % for a ≥ 2.1 D.
const ONE: f64 = 1.011;
const ONES: [f64; 3] = [0.054, -0.021, -0.358];

/// Change of c₀ with n = 0.5 − ν, q₀ n + q₁ n²: θ within 0.4, 0.7 and 2 % for ν 0.3 … 0.5 (benches/solid; without it 6, 8 and 7 %).
const VOLUME: [[f64; 2]; 3] = [[-0.285, 0.378], [-0.370, 0.47], [-0.39, 0.14]];

/// Reduction of the indentation by the shape of the section, in P/(E R(a)).
const STIFFER: f64 = 0.185;

/// Model of a clamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Start of the free rod from the face of the clamp, in D.
    pub c0: f64,
    /// k over that of model §3.
    pub shear: f64,
    /// b and c of clamps with four numbers.
    rest: Option<[f64; 2]>,
}

impl Held {
    /// The clamp of `model`. Four numbers need shear, and a contact without friction; without shear they keep c₀ alone.
    pub fn new(model: &Model) -> Self {
        let one = |c0| Self { c0, shear: ONE / TIMOSHENKO, rest: None };
        let free = matches!(model.contact, Contact::Frictionless);
        let n = 0.5 - model.nu;
        let moved = |c0: f64, clamp: usize| n * (n * VOLUME[clamp][1] + VOLUME[clamp][0]) + c0;
        let four = |clamp: usize, [c0, k, b, c]: [f64; 4]| match (model.shear, free) {
            (true, true) => Self { c0: moved(c0, clamp), shear: k / TIMOSHENKO, rest: Some([b, c]) },
            (true, false) => one(moved(ONES[clamp], clamp)),
            (false, _) => Self { c0: moved(c0, clamp), shear: 1.0, rest: None },
        };
        match model.clamp {
            Clamp::Rigid => Self { c0: 0.0, shear: 1.0, rest: None },
            Clamp::At(c0) if c0 == 0.0 => Self { c0, shear: 1.0, rest: None },
            Clamp::Bonded => four(0, BONDED),
            Clamp::Glued => four(1, GLUED),
            Clamp::Socket => one(moved(ONES[2], 2)),
            Clamp::At(c0) => one(c0),
        }
    }

    /// Start of the free rod, mm from the face of the clamp.
    pub fn start(&self, taper: &Taper) -> f64 {
        self.c0 * taper.D
    }

    /// 1/(kG) of `model`, 1/MPa; 0 without shear. k is in proportion to that of model §3.
    pub fn shear_compliance(&self, model: &Model) -> f64 {
        if !model.shear {
            return 0.0;
        }
        let nu = model.nu;
        let k = (nu + 1.0) * (self.shear * 6.0) / (nu * 6.0 + 7.0);
        (nu + 1.0) * 2.0 / (k * model.material.e0())
    }

    /// Compliance of the contact at `a` along its normal, mm/N, in addition to that of the rod.
    fn compliance(&self, taper: &Taper, model: &Model, a: f64) -> f64 {
        let Some([b, c]) = self.rest else { return 0.0 };
        let e = model.material.e0();
        let [from, to] = [b, self.c0].map(|x| x * taper.D);
        let slack = (to - from) / (taper.radius(from) * PI * taper.radius(to));
        let cos = taper.cos_alpha();
        cos * cos * slack * self.shear_compliance(model) + c / (e * taper.radius(a))
    }
}

/// True if taps of `model` go beyond rod theory: the contact gives way, or the strain of the skin differs from the rod's.
pub fn is_solid(model: &Model) -> bool {
    model.indentation || model.distorting || Held::new(model).rest.is_some()
}

/// A contact that gives way along its normal: δ(P), mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    hertz: f64,
    linear: f64,
}

impl Soft {
    /// The contact at `a` of the whisker `taper`, measured from the face of its clamp; `None` if it does not give way.
    pub fn new(model: &Model, taper: &Taper, a: f64) -> Option<Self> {
        let mut linear = Held::new(model).compliance(taper, model, a);
        let mut hertz = 0.0;
        if model.indentation {
            let (e, radius) = (model.material.e0(), taper.radius(a));
            let plane = e / (1.0 - model.nu * model.nu);
            hertz = crossed(radius, model.pole_radius) * plane.powf(-2.0 / 3.0);
            linear -= STIFFER / (e * radius);
        }
        (hertz != 0.0 || linear != 0.0).then_some(Self { hertz, linear })
    }

    /// δ(P) as Hertz's part in P^⅔ and the part in P, of P in N; where they have opposite signs δ stays at its largest value beyond that.
    pub fn parts(&self) -> [f64; 2] {
        [self.hertz, self.linear]
    }

    /// δ under a force P, N; an odd function.
    pub fn depth(&self, force: f64) -> f64 {
        // Hertz's δ less a linear one would fall beyond this force, far outside the range of both.
        let most = match self.hertz > 0.0 && self.linear < 0.0 {
            true => (self.hertz * -2.0 / (self.linear * 3.0)).powi(3),
            false => f64::INFINITY,
        };
        let size = force.abs().min(most);
        (self.hertz * (size * size).cbrt() + self.linear * size) * force.signum()
    }

    /// The force at which `stiffness`⁻¹ P + δ(P) = `way`; `stiffness` in N/mm, `way` > 0 in mm.
    pub fn force(&self, stiffness: f64, way: f64) -> f64 {
        // In the cube root of the force δ has no steep end.
        let lack = |root: f64| {
            let force = root * root * root;
            force / stiffness + self.depth(force) - way
        };
        let mut most = (stiffness * way).cbrt();
        for _ in 0..8 {
            if lack(most) >= 0.0 {
                break;
            }
            most *= 2.0;
        }
        bracketed(lack, 0.0, most).powi(3)
    }
}

/// δ/(P/E*)^⅔ of crossed cylinders of radii r and q, mm^(-⅓): Hertz's ellipse (Johnson, *Contact Mechanics*, §4.2).
fn crossed(r: f64, q: f64) -> f64 {
    let ratio = (r / q).max(q / r);
    let mean = (r * q).sqrt();
    let unit = (9.0 / (mean * 16.0)).cbrt();
    if ratio < 1.0 + 1e-6 {
        return unit;
    }
    // ratio^(-2/3) ≤ s ≤ ratio^(-0.55) up to ratios of 10⁷.
    let [least, most] = [-2.0 / 3.0, -0.55].map(|power| ratio.powf(power));
    let most = if ratio < 1e7 { most } else { 1.0 };
    let s = bracketed(|s| (ellipse(s).0 / ratio).ln(), least * (1.0 - 1e-9), most.min(1.0 - 1e-8));
    let (_, k, e, e2) = ellipse(s);
    let f1 = (4.0 / (e2 * PI) * s * s.sqrt() * ((e / (s * s) - k) * (k - e)).sqrt()).cbrt();
    unit * 2.0 / PI * s.sqrt() / f1 * k
}

/// B/A of Hertz's ellipse with b/a = `s` ≤ 1, which falls to 1 at s = 1; K, E and their parameter.
fn ellipse(s: f64) -> (f64, f64, f64, f64) {
    let e2 = (1.0 - s * s).max(0.0);
    let (k, e) = elliptic(e2);
    ((e / (s * s) - k) / (k - e), k, e, e2)
}

/// Complete elliptic integrals K and E of the parameter m = e², by the arithmetic–geometric mean.
fn elliptic(m: f64) -> (f64, f64) {
    let (mut a, mut b, mut sum, mut power) = (1.0, (1.0 - m).sqrt(), m * 0.5, 0.5);
    for _ in 0..8 {
        let c = (a - b) * 0.5;
        (a, b) = ((a + b) * 0.5, (a * b).sqrt());
        power *= 2.0;
        sum += c * power * c;
        if c < 1e-17 {
            break;
        }
    }
    let k = 0.5 * PI / a;
    (k, k * (1.0 - sum))
}

/// Strain of the skin next to the clamp against that of the rod: A, p, B, c₁, c₂ of model §8 b). Within 0.33 % for x ≥ 0.24 D, a − x ≥ 1.2 D.
pub const SKIN: [f64; 5] = [0.576, 7.137, -0.1616, 0.5508, -0.0084];

/// Loss on both sides for a nonlinear law, in (κR)²: fitted with neo-hookean, others within 5 % (results/2026-11-23-solid/finite_laws.csv).
pub const HALVED: f64 = 0.55 / 4.0;

/// Strain of the skin at x: the factor of the rod's bending strain, and the strain per N of shear force. `e`: the modulus, MPa.
pub fn distorted<T: Real>(taper: &Taper<T>, e: T, x: T) -> [T; 2] {
    let ([bending, lever], radius) = (distorted_linear(taper, x), taper.radius(x));
    [bending, lever * T::of(4.0) / (e * T::of(PI) * (radius * radius * radius))]
}

/// [`distorted`] at the linear limit: for a contact at a the strain of the skin at x is the rod's times s₀ + s₁/(a − x), s₁ a length.
pub fn distorted_linear<T: Real>(taper: &Taper<T>, x: T) -> [T; 2] {
    let [a, p, b, c1, c2] = SKIN.map(T::of);
    let t = taper.tan_alpha;
    let near = (x * (T::of(0.0) - p) / taper.D).exp();
    [T::of(1.0) - near * a + t * c2 * t, taper.D * b * near + t * c1 * taper.radius(x)]
}

/// A foil on a whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bonded {
    /// Range in which it stiffens the rod, mm from the face of the clamp.
    pub span: [f64; 2],
    /// T: its reading over the strain of the bare skin at the same force.
    pub transfer: f64,
    /// χ: the rod under it bends 1 − χ times as much.
    pub stiffening: f64,
}

/// ln(λ/L) in 1, y, y², y³, y⁴, q, q², qy, qy², u, uy, uq: model §8 e). ±1.6 % for D 10, widths of 0.28 D, L 0.4 … 1 D.
const TRANSFER: [f64; 12] =
    [-1.0578, 0.0075, 0.1299, 0.0304, -0.0008, 0.2012, -0.42, 0.0449, 0.0458, -0.3125, 0.2399, -0.4013];

/// Width of that fit, in D, and its powers in 1/T − 1 and χ. For widths 0.15 … 0.5 D, L 0.6 … 1 D, up to 3 E D, T is right to 12 %, the angle
/// to 0.7 % (benches/solid); stiffer and shorter foils need finer meshes than were tried.
const WIDTH: f64 = 0.28;
const WIDER: f64 = 0.6;
const STIFFER_WIDER: [f64; 3] = [0.5, -0.29, 0.06];

/// D and L of that fit, mm.
const FITTED: [f64; 2] = [10.0, 6.3];

impl Bonded {
    /// `foil` centred on the grid `gauge`, mm, of a whisker with the modulus `e`, MPa.
    pub fn new(foil: &Foil, taper: &Taper, gauge: [f64; 2], e: f64) -> Self {
        let middle = (gauge[0] + gauge[1]) * 0.5;
        let half = foil.length * 0.5 * taper.cos_alpha();
        let (l, radius) = (foil.length, taper.radius(middle));
        let y = (foil.stiffness / (e * l)).log10();
        let q = (l / FITTED[1] * (FITTED[0] / taper.D)).ln();
        let u = taper.tan_alpha * l / radius;
        let terms = [1.0, y, y * y, y.powi(3), y.powi(4), q, q * q, q * y, q * y * y, u, u * y, u * q];
        let sum = TRANSFER.iter().zip(terms).fold(0.0, |sum, (c, x)| sum + x * *c);
        let lambda = l * sum.exp();
        let width = foil.width / (taper.D * WIDTH);
        let transfer = 1.0 / (foil.stiffness / (e * lambda) * width.powf(WIDER) + 1.0);
        let (z, [own, by_length, by_width]) = (l / radius, STIFFER_WIDER);
        let power = q * by_length + own + width.ln() * by_width;
        let stiffening = (z * 0.229 - 0.008 - z * 0.0216 * z)
            * (1.0 - transfer)
            * (1.0 - transfer * 0.065 + transfer * 0.393 * transfer)
            * (taper.tan_alpha * 1.446 + 1.0)
            * width.powf(power.clamp(0.0, 1.0));
        Self { span: [middle - half, middle + half], transfer, stiffening }
    }
}
