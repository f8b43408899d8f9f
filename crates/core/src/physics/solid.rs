//! What a rubber rod of three dimensions has and a rod theory has not (model §8): a clamp that acts elsewhere than at its face, a skin that gives
//! way under the contact, sections that distort next to the clamp, and a foil that is stiffer than the skin it is bonded to.
//!
//! The numbers are fits to finite elements; where each was tested stands beside it. x is measured from the face of the clamp along the
//! whisker, t = tan α, D the base diameter, R(x) the radius, E the initial modulus, P the contact force.

use std::f64::consts::PI;

use super::root::bracketed;
use super::taper::Taper;
use crate::scene::{Clamp, Contact, Foil, Model};

/// Shear coefficient k of ν = 0.5 that the rod has without a clamp: 6 (1 + ν)/(7 + 6 ν).
const TIMOSHENKO: f64 = 0.9;

/// A clamp in four numbers: where the rod begins, c₀ (in D); k; where its shear begins, b (in D); a compliance next to the contact, c (of 1/(E R)).
/// Bonded: θ per newton within 0.13 % for a ≥ 1.8 D, d/D 0.4 … 1, and 0.33 % for d/D 0.2 … 1.2.
const BONDED: [f64; 4] = [0.0532, 1.1157, -0.7278, -0.6836];
/// Glued into a socket of 1 D: 0.15 % for a ≥ 2.1 D, d/D 0.4 and 1 (one number: 0.6 %).
const GLUED: [f64; 4] = [-0.028, 1.1157, -0.18, -0.25];

/// k with one number c₀, and c₀ of each clamp: θ within 0.7, 0.8 and 2 % for a ≥ 2.1 D.
const ONE: f64 = 1.011;
const ONES: [f64; 3] = [0.054, -0.021, -0.358];

/// How far c₀ moves with n = 0.5 − ν, for each clamp: q₀ n + q₁ n². A rubber that gives way in volume is held less. θ within 0.4, 0.7 and 2 % for ν 0.3 … 0.5
/// (benches/solid; without it up to 6, 8 and 7 %).
const VOLUME: [[f64; 2]; 3] = [[-0.285, 0.378], [-0.370, 0.47], [-0.39, 0.14]];

/// What of the indentation the shape of the section takes away, in P/(E R(a)).
const STIFFER: f64 = 0.185;

/// How a clamp holds the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The section that does not turn, from the face of the clamp, in D.
    pub c0: f64,
    /// k over that of model §3.
    pub shear: f64,
    /// b and c of four numbers.
    rest: Option<[f64; 2]>,
}

impl Held {
    /// The clamp of `model`. Four numbers need shear, and a contact without friction; without shear they keep c₀ alone.
    pub fn new(model: &Model) -> Self {
        let one = |c0| Self { c0, shear: ONE / TIMOSHENKO, rest: None };
        let free = model.contact == Contact::Frictionless;
        let n = 0.5 - model.nu;
        let moved = |c0: f64, clamp: usize| c0 + n * (VOLUME[clamp][0] + n * VOLUME[clamp][1]);
        let four = |clamp: usize, [c0, k, b, c]: [f64; 4]| match (model.shear, free) {
            (true, true) => Self { c0: moved(c0, clamp), shear: k / TIMOSHENKO, rest: Some([b, c]) },
            (true, false) => one(moved(ONES[clamp], clamp)),
            (false, _) => Self { c0: moved(c0, clamp), shear: 1.0, rest: None },
        };
        match model.clamp {
            Clamp::Rigid | Clamp::At(0.0) => Self { c0: 0.0, shear: 1.0, rest: None },
            Clamp::Bonded => four(0, BONDED),
            Clamp::Glued => four(1, GLUED),
            Clamp::Socket => one(moved(ONES[2], 2)),
            Clamp::At(c0) => one(c0),
        }
    }

    /// Where the rod begins, mm from the face of the clamp.
    pub fn start(&self, taper: &Taper) -> f64 {
        self.c0 * taper.D
    }

    /// 1/(kG) of `model`, 1/MPa; 0 without shear. k is that of model §3 in proportion.
    pub fn shear_compliance(&self, model: &Model) -> f64 {
        let k = self.shear * 6.0 * (1.0 + model.nu) / (7.0 + 6.0 * model.nu);
        if model.shear { 2.0 * (1.0 + model.nu) / (k * model.material.e0()) } else { 0.0 }
    }

    /// How far the contact at `a` gives way along its normal, mm/N, beside what the rod does.
    fn compliance(&self, taper: &Taper, model: &Model, a: f64) -> f64 {
        let Some([b, c]) = self.rest else { return 0.0 };
        let e = model.material.e0();
        let [from, to] = [b, self.c0].map(|x| x * taper.D);
        // ∫ ds/(π R²) of a cone.
        let slack = (to - from) / (PI * taper.radius(from) * taper.radius(to));
        let cos = taper.cos_alpha();
        cos * cos * slack * self.shear_compliance(model) + c / (e * taper.radius(a))
    }
}

/// Whether taps of `model` are more than those of a rod: the contact gives way, or the strain of the skin is not the rod's.
pub fn is_solid(model: &Model) -> bool {
    model.indentation || model.distorting || Held::new(model).rest.is_some()
}

/// A contact that gives way along its normal: δ(P), mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    /// Of Hertz, mm/N^⅔.
    hertz: f64,
    /// mm/N.
    linear: f64,
}

impl Soft {
    /// The contact at `a` of the whisker `taper`, measured from the face of its clamp; `None` where it does not give way.
    pub fn new(model: &Model, taper: &Taper, a: f64) -> Option<Self> {
        let mut linear = Held::new(model).compliance(taper, model, a);
        let mut hertz = 0.0;
        if model.indentation {
            let (e, radius) = (model.material.e0(), taper.radius(a));
            hertz = crossed(radius, model.pole_radius) * (e / (1.0 - model.nu * model.nu)).powf(-2.0 / 3.0);
            linear -= STIFFER / (e * radius);
        }
        (hertz != 0.0 || linear != 0.0).then_some(Self { hertz, linear })
    }

    /// δ under a force P, N; that of a force that pulls is its mirror image.
    pub fn depth(&self, force: f64) -> f64 {
        // Hertz's δ less a linear one would fall beyond this, far from what either stands for.
        let most = match self.hertz > 0.0 && self.linear < 0.0 {
            true => (-2.0 * self.hertz / (3.0 * self.linear)).powi(3),
            false => f64::INFINITY,
        };
        let size = force.abs().min(most);
        force.signum() * (self.hertz * (size * size).cbrt() + self.linear * size)
    }

    /// The force at which `stiffness`⁻¹ P + δ(P) = `way`; `stiffness` in N/mm, `way` > 0 in mm.
    pub fn force(&self, stiffness: f64, way: f64) -> f64 {
        // In the cube root of the force, in which δ has no steep end.
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

/// δ/(P/E*)^⅔ of crossed cylinders of radii r and q, mm^(-⅓): Hertz's ellipse, by complete elliptic integrals (Johnson, *Contact Mechanics*,
/// §4.2).
fn crossed(r: f64, q: f64) -> f64 {
    let ratio = (r / q).max(q / r);
    let mean = (r * q).sqrt();
    // B/A as a function of b/a = s ≤ 1 is decreasing; it is 1 at s = 1.
    let of = |s: f64| {
        let e2 = (1.0 - s * s).max(0.0);
        let (k, e) = elliptic(e2);
        ((e / (s * s) - k) / (k - e), k, e, e2)
    };
    let unit = (9.0 / (16.0 * mean)).cbrt();
    if ratio < 1.0 + 1e-6 {
        return unit;
    }
    let s = bracketed(|s| (of(s).0 / ratio).ln(), ratio.powf(-0.75).min(0.999) * 0.5, 1.0 - 1e-8);
    let (_, k, e, e2) = of(s);
    let f1 = (4.0 / (PI * e2) * s * s.sqrt() * ((e / (s * s) - k) * (k - e)).sqrt()).cbrt();
    unit * 2.0 / PI * s.sqrt() / f1 * k
}

/// Complete elliptic integrals K and E of the parameter m = e², by the arithmetic–geometric mean.
fn elliptic(m: f64) -> (f64, f64) {
    let (mut a, mut b, mut sum, mut power) = (1.0, (1.0 - m).sqrt(), 0.5 * m, 0.5);
    for _ in 0..8 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let k = 0.5 * PI / a;
    (k, k * (1.0 - sum))
}

/// Strain of the skin next to the clamp against that of the rod: A, p, B, c₁, c₂ of model §8 b). Within 0.33 % for x ≥ 0.24 D, a − x ≥ 1.2 D.
pub const SKIN: [f64; 5] = [0.576, FADES, -0.1616, 0.5508, -0.0084];

/// p: how fast that fades away from the clamp.
pub const FADES: f64 = 7.137;

/// What sections that distort take from both sides of a neo-hookean rod, in (κR)².
pub const HALVED: f64 = 0.55 / 4.0;

/// How the strain of the skin at x differs from the rod's: the factor of its bending strain, and what it shows of the shear force, per N. `e`: the
/// modulus, MPa.
pub fn distorted(taper: &Taper, e: f64, x: f64) -> [f64; 2] {
    let [bending, lever] = distorted_linear(taper, x);
    [bending, 4.0 * lever / (PI * e * taper.radius(x).powi(3))]
}

/// The same at the linear limit: of a contact at a the strain of the skin at x is that of the rod times s₀ + s₁/(a − x); s₁ in the unit of length.
pub fn distorted_linear(taper: &Taper, x: f64) -> [f64; 2] {
    let [a, p, b, c1, c2] = SKIN;
    let t = taper.tan_alpha;
    let near = (-p * x / taper.D).exp();
    [1.0 - a * near + c2 * t * t, b * taper.D * near + c1 * t * taper.radius(x)]
}

/// A foil on a whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bonded {
    /// From where to where it stiffens the rod, mm from the face of the clamp.
    pub span: [f64; 2],
    /// T: its reading over the strain of the bare skin at the same force.
    pub transfer: f64,
    /// χ: the rod under it bends 1 − χ times as much.
    pub stiffening: f64,
}

/// ln(λ/L) in 1, y, y², y³, y⁴, q, q², qy, qy², u, uy, uq: model §8 e). ±1.6 % for D 10, widths of 0.28 D, L 0.4 … 1 D.
const TRANSFER: [f64; 12] =
    [-1.0578, 0.0075, 0.1299, 0.0304, -0.0008, 0.2012, -0.42, 0.0449, 0.0458, -0.3125, 0.2399, -0.4013];

/// Width of that fit, in D; the power of the width with which 1/T − 1 grows; and that of χ: of itself, and with q and the logarithm of the width. Of foils
/// of 0.15 to 0.5 D and up to 3 E D, L 0.6 … 1 D, T is right to 12 %, the angle to 0.7 % (benches/solid; stiffer and shorter foils need finer meshes
/// than were tried).
const WIDTH: f64 = 0.28;
const WIDER: f64 = 0.6;
const STIFFER_WIDER: [f64; 3] = [0.5, -0.29, 0.06];

/// D and L of the whisker and the foil of that fit; another whisker is the same in units of D.
const FITTED: [f64; 2] = [10.0, 6.3];

impl Bonded {
    /// `foil` centred on the grid `gauge`, mm, of a whisker with the modulus `e`, MPa.
    pub fn new(foil: &Foil, taper: &Taper, gauge: [f64; 2], e: f64) -> Self {
        let middle = 0.5 * (gauge[0] + gauge[1]);
        let half = 0.5 * foil.length * taper.cos_alpha();
        let (l, radius) = (foil.length, taper.radius(middle));
        let y = (foil.stiffness / (e * l)).log10();
        let q = (l / FITTED[1] * (FITTED[0] / taper.D)).ln();
        let u = taper.tan_alpha * l / radius;
        let terms = [1.0, y, y * y, y.powi(3), y.powi(4), q, q * q, q * y, q * y * y, u, u * y, u * q];
        let lambda = l * TRANSFER.iter().zip(terms).map(|(c, x)| c * x).sum::<f64>().exp();
        let width = foil.width / (WIDTH * taper.D);
        let transfer = 1.0 / (1.0 + foil.stiffness / (e * lambda) * width.powf(WIDER));
        let (z, [own, by_length, by_width]) = (l / radius, STIFFER_WIDER);
        let stiffening = (-0.008 + 0.229 * z - 0.0216 * z * z)
            * (1.0 - transfer)
            * (1.0 - 0.065 * transfer + 0.393 * transfer * transfer)
            * (1.0 + 1.446 * taper.tan_alpha)
            * width.powf((own + by_length * q + by_width * width.ln()).clamp(0.0, 1.0));
        Self { span: [middle - half, middle + half], transfer, stiffening }
    }
}
