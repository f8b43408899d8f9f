//! A built whisker's shape, stiffness and rest curvature along its resting axis (model §7).

mod sound;

use std::f64::consts::PI;

use glam::DVec2;

use super::linear::shear_coefficient;
use super::nodes::each;
use crate::scene::built::{Built, Inner, Profile, Root};

/// Ends of panels of a gauge on a power law, each half of the way to the tip.
const HALVES: i32 = 6;

/// A built whisker.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Body {
    D: f64,
    d: f64,
    /// L_a, mm.
    pub length: f64,
    /// Profile, core or bore, rest curvature and root.
    pub built: Built,
    /// Initial modulus of the skin, MPa.
    pub modulus: f64,
    /// Poisson's ratio.
    pub nu: f64,
    knots: Vec<f64>,
}

/// Stiffness of one section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// R, mm.
    pub radius: f64,
    /// EA, N.
    pub axial: f64,
    /// EI, N mm².
    pub bending: f64,
    /// k G A, N.
    pub shear: f64,
}

/// Contact of an undeflected whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// R for a contact on the surface, else 0, mm.
    pub height: f64,
    /// sin α and cos α.
    pub tilt: DVec2,
    /// ψ₀, rad.
    pub angle: f64,
    /// r₀, mm.
    pub place: DVec2,
}

impl Touched {
    /// Centre of a pole of this radius, mm, in the frame of the base.
    pub fn pole(&self, radius: f64) -> DVec2 {
        let height = DVec2::new(0.0, self.height);
        self.place + DVec2::from_angle(self.angle).rotate(height + self.tilt * radius)
    }
}

fn rest_angle([base, slope]: [f64; 2], s: f64) -> f64 {
    -(base + slope * 0.5 * s) * s
}

/// r₀(s), mm, in the frame of the base; `curvature` is κ_base and κ_slope.
pub fn rest(curvature: [f64; 2], s: f64) -> DVec2 {
    if curvature == [0.0; 2] || s == 0.0 {
        return DVec2::new(s, 0.0);
    }
    let [base, slope] = curvature;
    if slope == 0.0 && base != 0.0 {
        let half = base * 0.5 * s;
        return DVec2::from_angle(-half) * (s * half.sin() / half);
    }
    // One panel per radian.
    let turned = base.abs() * s + slope.abs() * s * s;
    let panels = 1.0 + turned.ceil();
    let step = s / panels;
    let mut sum = DVec2::ZERO;
    for k in 0..panels as u32 {
        each(step * f64::from(k), step * f64::from(k + 1), |s, w| {
            sum += DVec2::from_angle(rest_angle(curvature, s)) * w;
        });
    }
    sum
}

#[allow(non_snake_case)]
impl Body {
    /// The whisker `built` with D, d and L_a, mm, and its skin's initial modulus, MPa. A table of diameters replaces D and d.
    pub fn new(built: &Built, [D, d, L_a]: [f64; 3], modulus: f64, nu: f64) -> Self {
        let profile = if let Profile::Table(table) = &built.profile { &table[..] } else { &[] };
        let inner = built.inner.iter().flat_map(|inner| &inner.diameter);
        let within = |s: &f64| *s > 0.0 && *s < L_a;
        let mut knots: Vec<f64> = profile.iter().chain(inner).map(|knot| knot[0]).filter(within).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        Self { D, d, length: L_a, built: built.clone(), modulus, nu, knots }
    }

    /// Farthest contact of linear theory, mm: L_a, but for a solid clamped cone almost to its apex, at most 10 L_a.
    pub fn reach(&self) -> f64 {
        let Root { k_theta, k_x, k_y } = self.built.root;
        let rigid = [k_theta, k_x, k_y].iter().all(|k| k.is_infinite());
        let plain = self.built.inner.is_none() && self.built.is_straight() && rigid;
        let Self { D, d, .. } = *self;
        match self.built.profile {
            Profile::Power(n) if plain && n == 1.0 => {
                let narrows = D > d;
                let apex = if narrows { self.length * 0.99 * D / (D - d) } else { f64::INFINITY };
                apex.min(self.length * 10.0)
            }
            _ => self.length,
        }
    }

    /// R(0), R(L_a), mm, and n of a diameter that is a power of the distance from the tip; `None` for cones and tables.
    pub fn power(&self) -> Option<[f64; 3]> {
        match self.built.profile {
            Profile::Power(n) if n != 1.0 => Some([self.D * 0.5, self.d * 0.5, n]),
            _ => None,
        }
    }

    /// Modulus of the core, MPa; 0 for a bore or a solid whisker.
    pub fn core_modulus(&self) -> f64 {
        self.built.inner.as_ref().map_or(0.0, |inner| inner.modulus)
    }

    /// Places where the whisker is not smooth, ascending, mm.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Ends of the smooth piece of the profile that holds `s`, mm; a knot belongs to the piece after it, and the last piece has no end.
    pub fn piece(&self, s: f64) -> [f64; 2] {
        match &self.built.profile {
            Profile::Power(_) => [0.0, f64::INFINITY],
            Profile::Table(table) => {
                let [near, far] = of_table(table, s).map(|knot| knot[0]);
                [near, if far >= self.length { f64::INFINITY } else { far }]
            }
        }
    }

    /// (1 − s/L_a)ⁿ; negative beyond the tip of a cone, else 0 there.
    fn powered(&self, s: f64, n: f64) -> f64 {
        let v = 1.0 - s / self.length;
        match () {
            () if n == 0.0 => 1.0,
            () if n == 1.0 => v,
            () => v.max(0.0).powf(n),
        }
    }

    /// R(s), mm, by the piece that holds `within`.
    pub fn radius(&self, s: f64, within: f64) -> f64 {
        let diameter = match &self.built.profile {
            Profile::Power(n) => self.d + (self.D - self.d) * self.powered(s, *n),
            Profile::Table(table) => line(of_table(table, within), s),
        };
        diameter * 0.5
    }

    /// R′(s), likewise.
    pub fn slope(&self, s: f64, within: f64) -> f64 {
        let Self { D, d, .. } = *self;
        let slope = match &self.built.profile {
            Profile::Power(_) if D == d => 0.0,
            Profile::Power(n) => -(D - d) * *n / self.length * self.powered(s, *n - 1.0),
            Profile::Table(table) => {
                let [near, far] = of_table(table, within);
                (far[1] - near[1]) / (far[0] - near[0])
            }
        };
        slope * 0.5
    }

    /// R(a + by) − R(a), mm, without cancellation, by the piece that holds `a`.
    pub fn widening(&self, a: f64, by: f64) -> f64 {
        match &self.built.profile {
            Profile::Power(n) => {
                let v = 1.0 - a / self.length;
                let grown = -by / (self.length * v);
                match v <= 0.0 || grown <= -1.0 {
                    true => self.radius(a + by, a) - self.radius(a, a),
                    false => (self.D - self.d) * 0.5 * v.powf(*n) * (*n * grown.ln_1p()).exp_m1(),
                }
            }
            Profile::Table(_) => self.slope(a, a) * by,
        }
    }

    /// Inner diameter at `s`, mm; 0 outside core and bore.
    pub fn inside(&self, s: f64, within: f64) -> f64 {
        let Some(Inner { diameter, .. }) = &self.built.inner else { return 0.0 };
        let (first, last) = (diameter[0][0], diameter[diameter.len() - 1][0]);
        if within < first || within > last { 0.0 } else { line(of_table(diameter, within), s) }
    }

    /// The section at `s`, on the piece that holds `within`; shear after Cowper, exact for disc, ring and bonded core.
    pub fn section(&self, s: f64, within: f64) -> Section {
        let radius = self.radius(s, within);
        let (e, i) = (self.modulus, self.inside(s, within));
        let core = self.core_modulus();
        let (r2, i2) = (radius * radius, i * 0.25 * i);
        let axial = (e * (r2 - i2) + core * i2) * PI;
        let bending = (e * (r2 * r2 - i2 * i2) + core * i2 * i2) * (0.25 * PI);
        let (p, g, q) = (i2 / r2, core / e, self.nu * 0.5 + 0.75);
        if p == 0.0 {
            let k = shear_coefficient(self.nu);
            return Section { radius, axial, bending, shear: k * axial * 0.5 / (self.nu + 1.0) };
        }
        let b_over_p = -(1.0 - g) * q * (1.0 - p) / (1.0 + g - (1.0 - g) * p);
        let b = p * b_over_p;
        let a = b - q;
        let j = a * (1.0 - p * p) / 4.0
            + b * (1.0 - p) / 2.0
            + (1.0 - p.powi(3)) / 24.0
            + g * ((a + b_over_p) * p * p / 4.0 + p.powi(3) / 24.0);
        Section { radius, axial, bending, shear: -bending * bending / (e * PI * r2.powi(3) * j) }
    }

    /// κ₀(s), 1/mm.
    pub fn curvature(&self, s: f64) -> f64 {
        self.built.curvature[0] + self.built.curvature[1] * s
    }

    /// ψ₀(s), rad.
    pub fn rest_angle(&self, s: f64) -> f64 {
        rest_angle(self.built.curvature, s)
    }

    /// r₀(s), mm, in the frame of the base.
    pub fn rest(&self, s: f64) -> DVec2 {
        rest(self.built.curvature, s)
    }

    /// sin α and cos α of a contact at `s` on the `surface`, else on the axis.
    pub fn tilt(&self, s: f64, within: f64, surface: bool) -> DVec2 {
        if !surface {
            return DVec2::new(0.0, 1.0);
        }
        let bend =
            if self.built.is_straight() { 1.0 } else { self.curvature(s) * self.radius(s, within) + 1.0 };
        DVec2::new(-self.slope(s, within) / bend, 1.0).normalize()
    }

    /// Signed length of the skin on the object's side from `a` to `a` + `by`, mm, by the piece that holds `a`.
    pub fn skin(&self, a: f64, by: f64) -> f64 {
        let mut mean = 0.0;
        each(0.0, 1.0, |share, weight| {
            let s = a + by * share;
            let stretched = self.curvature(s) * self.radius(s, a) + 1.0;
            mean += stretched * weight / self.tilt(s, a, true).y;
        });
        by * mean
    }

    /// The undeflected whisker touched at the arc `a`, mm.
    pub fn touched(&self, a: f64, surface: bool) -> Touched {
        let height = if surface { self.radius(a, a) } else { 0.0 };
        let tilt = self.tilt(a, a, surface);
        Touched { height, tilt, angle: self.rest_angle(a), place: self.rest(a) }
    }

    /// Axial span [x1, x2] of a gauge whose grid of length `l` is bonded along the surface from `x1`, mm.
    pub fn gauge(&self, x1: f64, l: f64) -> [f64; 2] {
        let power = self.power().is_some();
        let panel = |near: f64, far: f64| {
            let (within, mut mean) = (0.5 * (near + far), 0.0);
            match power {
                true => each(0.0, 1.0, |share, weight| {
                    mean += weight * self.slope(near + (far - near) * share, within).hypot(1.0);
                }),
                false => mean = self.slope(within, within).hypot(1.0),
            }
            (far - near) * mean
        };
        // A power law may have no slope at the tip: each panel covers half of the way to it.
        let halves =
            (1..=if power { HALVES } else { 0 }).map(|k| self.length - (self.length - x1) * 0.5_f64.powi(k));
        let mut ends: Vec<f64> = self.knots.iter().copied().chain(halves).filter(|end| *end > x1).collect();
        ends.sort_by(f64::total_cmp);
        let along = |to: f64| {
            let inside = ends.iter().copied().take_while(|end| *end < to).chain([to]);
            inside.fold((0.0, x1), |(sum, near), far| (sum + panel(near, far), far)).0
        };
        let mut x2 = x1 + l;
        for _ in 0..50 {
            let lack = l - along(x2);
            let step = lack / self.slope(x2, x2 * (1.0 - 1e-12)).hypot(1.0);
            x2 += step;
            if step.abs() <= 1e-15 * x2 {
                break;
            }
        }
        [x1, x2]
    }
}

fn of_table(table: &[[f64; 2]], s: f64) -> [[f64; 2]; 2] {
    let after = table.partition_point(|knot| knot[0] <= s).clamp(1, table.len() - 1);
    [table[after - 1], table[after]]
}

fn line([near, far]: [[f64; 2]; 2], s: f64) -> f64 {
    near[1] + (far[1] - near[1]) / (far[0] - near[0]) * (s - near[0])
}
