//! A built whisker's shape, stiffness and rest curvature along its resting axis (model §7).

use std::f64::consts::PI;

use glam::DVec2;

use super::gauss::each;
use super::linear::shear_coefficient;
use super::section::{SectionLaw, SectionStrain};
use crate::scene::built::{Built, Inner, Profile, Root};

/// Panels of the rule on each smooth piece, each half as long as the one before towards the piece's far end, where a tip may be sharp.
const PANELS: u32 = 6;

/// A whisker as it is built.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// L_a, mm.
    pub length: f64,
    shape: Shape,
    inner: Option<Inner>,
    /// κ_base and κ_slope.
    curvature: [f64; 2],
    /// What holds the base.
    pub root: Root,
    /// Initial modulus of the skin, MPa.
    pub modulus: f64,
    /// ν.
    pub nu: f64,
    /// Places in (0, L_a) where it is not smooth, rising, mm.
    knots: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
enum Shape {
    /// D, d and n.
    Power { D: f64, d: f64, n: f64 },
    /// (s, D).
    Table(Vec<[f64; 2]>),
}

/// Stiffness of one section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// R, mm.
    pub radius: f64,
    /// N.
    pub axial: f64,
    /// N mm².
    pub bending: f64,
    /// k G A, N.
    pub shear: f64,
}

/// Where an undeflected whisker is touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// R on the surface, else 0, mm.
    pub height: f64,
    /// sin α and cos α.
    pub tilt: DVec2,
    /// ψ₀.
    pub angle: f64,
    /// r₀, mm.
    pub place: DVec2,
}

impl Touched {
    /// Centre of a pole of this radius, mm, in the frame of the base.
    pub fn pole(&self, radius: f64) -> DVec2 {
        self.place + DVec2::from_angle(self.angle).rotate(self.height * DVec2::Y + radius * self.tilt)
    }
}

#[allow(non_snake_case)]
impl Body {
    /// The whisker `built` of diameters D and d and length L_a, mm, of a skin with the initial modulus `modulus`, MPa, and Poisson's ratio `nu`. A
    /// table of diameters has its own D, d and L_a.
    pub fn new(built: &Built, [D, d, L_a]: [f64; 3], modulus: f64, nu: f64) -> Self {
        let shape = match &built.profile {
            Profile::Power(n) => Shape::Power { D, d, n: *n },
            Profile::Table(table) => Shape::Table(table.clone()),
        };
        let profile = match &shape {
            Shape::Power { .. } => &[][..],
            Shape::Table(table) => table,
        };
        let inner = built.inner.iter().flat_map(|inner| &inner.diameter);
        let mut knots: Vec<f64> =
            profile.iter().chain(inner).map(|knot| knot[0]).filter(|s| *s > 0.0 && *s < L_a).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let Built { inner, curvature, root, .. } = built.clone();
        Self { length: L_a, shape, inner, curvature, root, modulus, nu, knots }
    }

    /// The farthest contact that linear theory is asked of, mm: a cone clamped at its base goes on beyond its tip, almost to its apex.
    pub fn reach(&self) -> f64 {
        let plain = self.inner.is_none() && self.is_straight() && self.root == Root::RIGID;
        match &self.shape {
            Shape::Power { D, d, n: 1.0 } if plain => {
                let apex = if D > d { 0.99 * self.length * D / (D - d) } else { f64::INFINITY };
                apex.min(10.0 * self.length)
            }
            _ => self.length,
        }
    }

    /// Whether the whisker is straight at rest.
    pub fn is_straight(&self) -> bool {
        self.curvature == [0.0; 2]
    }

    /// R(0), R(L_a), mm, and n of a diameter that is a power of the distance from the tip; none of a cone and of a table.
    pub fn power(&self) -> Option<[f64; 3]> {
        match self.shape {
            Shape::Power { D, d, n } if n != 1.0 => Some([0.5 * D, 0.5 * d, n]),
            _ => None,
        }
    }

    /// κ_base and κ_slope, 1/mm and 1/mm².
    pub fn base_curvature(&self) -> [f64; 2] {
        self.curvature
    }

    /// Modulus of what is inside, MPa; 0 where there is nothing, or a bore.
    pub fn core_modulus(&self) -> f64 {
        self.inner.as_ref().map_or(0.0, |inner| inner.modulus)
    }

    /// Whether something is inside.
    pub fn is_composite(&self) -> bool {
        self.inner.is_some()
    }

    /// Places where the whisker is not smooth, rising, mm.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Ends of the smooth piece of the profile that holds `s`, mm; at a knot of the piece after it. Beyond the tip the last goes on.
    pub fn piece(&self, s: f64) -> [f64; 2] {
        match &self.shape {
            Shape::Power { .. } => [0.0, f64::INFINITY],
            Shape::Table(table) => {
                let [near, far] = of_table(table, s);
                [near[0], if far[0] >= self.length { f64::INFINITY } else { far[0] }]
            }
        }
    }

    /// (1 − s/L_a) to the power `n`; a cone goes on beyond its tip, others as they end there.
    fn powered(&self, s: f64, n: f64) -> f64 {
        let v = 1.0 - s / self.length;
        match n {
            0.0 => 1.0,
            1.0 => v,
            n => v.max(0.0).powf(n),
        }
    }

    /// R(s), mm, by the piece that holds `within`.
    pub fn radius(&self, s: f64, within: f64) -> f64 {
        0.5 * match &self.shape {
            Shape::Power { D, d, n } => d + (D - d) * self.powered(s, *n),
            Shape::Table(table) => line(of_table(table, within), s),
        }
    }

    /// R′(s), likewise.
    pub fn slope(&self, s: f64, within: f64) -> f64 {
        0.5 * match &self.shape {
            Shape::Power { D, d, .. } if D == d => 0.0,
            Shape::Power { D, d, n } => -(D - d) * n / self.length * self.powered(s, n - 1.0),
            Shape::Table(table) => {
                let [near, far] = of_table(table, within);
                (far[1] - near[1]) / (far[0] - near[0])
            }
        }
    }

    /// R(a + by) − R(a), mm, without the digits that cancel, by the piece that holds `a`.
    pub fn widening(&self, a: f64, by: f64) -> f64 {
        match &self.shape {
            Shape::Power { D, d, n } => {
                let v = 1.0 - a / self.length;
                let grown = -by / (self.length * v);
                match v <= 0.0 || grown <= -1.0 {
                    true => self.radius(a + by, a) - self.radius(a, a),
                    false => 0.5 * (D - d) * v.powf(*n) * (n * grown.ln_1p()).exp_m1(),
                }
            }
            Shape::Table(_) => self.slope(a, a) * by,
        }
    }

    /// Diameter of what is inside at `s`, mm; 0 where there is nothing.
    pub fn inside(&self, s: f64, within: f64) -> f64 {
        let Some(Inner { diameter, .. }) = &self.inner else { return 0.0 };
        let (first, last) = (diameter[0][0], diameter[diameter.len() - 1][0]);
        if within < first || within > last { 0.0 } else { line(of_table(diameter, within), s) }
    }

    /// The section at `s`, its piece that which holds `within` (Cowper's shear, exact for disc, ring and bonded core).
    pub fn section(&self, s: f64, within: f64) -> Section {
        let radius = self.radius(s, within);
        let (e, i) = (self.modulus, self.inside(s, within));
        let core = self.inner.as_ref().map_or(0.0, |inner| inner.modulus);
        let (r2, i2) = (radius * radius, 0.25 * i * i);
        let axial = PI * (e * (r2 - i2) + core * i2);
        let bending = 0.25 * PI * (e * (r2 * r2 - i2 * i2) + core * i2 * i2);
        let (p, g, q) = (i2 / r2, core / e, 0.75 + 0.5 * self.nu);
        if p == 0.0 {
            let k = shear_coefficient(self.nu);
            return Section { radius, axial, bending, shear: k * axial * 0.5 / (1.0 + self.nu) };
        }
        let b_over_p = -(1.0 - g) * q * (1.0 - p) / (1.0 + g - (1.0 - g) * p);
        let b = p * b_over_p;
        let a = b - q;
        let j = a * (1.0 - p * p) / 4.0
            + b * (1.0 - p) / 2.0
            + (1.0 - p.powi(3)) / 24.0
            + g * ((a + b_over_p) * p * p / 4.0 + p.powi(3) / 24.0);
        Section { radius, axial, bending, shear: -bending * bending / (PI * e * r2.powi(3) * j) }
    }

    /// R, mm, and what the section at `at`, as in [`Self::section`], does under an axial force, N, and a moment, N mm; `None` if its `law`
    /// cannot bear them. What is composite is Hooke's.
    pub fn deform(
        &self,
        (law, extension): (&SectionLaw, bool),
        (s, within): (f64, f64),
        [axial, moment]: [f64; 2],
    ) -> Option<(f64, SectionStrain)> {
        if self.inner.is_some() {
            let section = self.section(s, within);
            let stretch = if extension { axial / section.axial } else { 0.0 };
            let strain = SectionStrain { axial: stretch, bending: moment * section.radius / section.bending };
            return Some((section.radius, strain));
        }
        let r = self.radius(s, within);
        let n = if extension { axial / (r * r) } else { 0.0 };
        Some((r, law.deform(n, moment / (r * r * r))?))
    }

    /// κ₀(s), 1/mm.
    pub fn curvature(&self, s: f64) -> f64 {
        self.curvature[0] + self.curvature[1] * s
    }

    /// ψ₀(s), rad.
    pub fn rest_angle(&self, s: f64) -> f64 {
        -(self.curvature[0] + 0.5 * self.curvature[1] * s) * s
    }

    /// r₀(s), mm, in the frame of the base.
    pub fn rest(&self, s: f64) -> DVec2 {
        if self.is_straight() || s == 0.0 {
            return DVec2::new(s, 0.0);
        }
        if self.curvature[1] == 0.0 {
            let half = 0.5 * self.curvature[0] * s;
            return s * half.sin() / half * DVec2::from_angle(-half);
        }
        // As many panels as the angle needs.
        let turned = self.curvature[0].abs() * s + self.curvature[1].abs() * s * s;
        let panels = 1.0 + turned.ceil();
        let step = s / panels;
        let mut sum = DVec2::ZERO;
        for k in 0..panels as u32 {
            each(f64::from(k) * step, f64::from(k + 1) * step, |s, w| {
                sum += w * DVec2::from_angle(self.rest_angle(s));
            });
        }
        sum
    }

    /// tan α of a contact at `s`, its piece that which holds `within`.
    fn tan_alpha(&self, s: f64, within: f64) -> f64 {
        let bend = if self.is_straight() { 1.0 } else { 1.0 + self.curvature(s) * self.radius(s, within) };
        -self.slope(s, within) / bend
    }

    /// sin α and cos α of a contact at `s` on the `surface`, else on the axis.
    pub fn tilt(&self, s: f64, within: f64, surface: bool) -> DVec2 {
        if surface { DVec2::new(self.tan_alpha(s, within), 1.0).normalize() } else { DVec2::Y }
    }

    /// The undeflected whisker touched at the arc `a`, mm.
    pub fn touched(&self, a: f64, surface: bool) -> Touched {
        let height = if surface { self.radius(a, a) } else { 0.0 };
        let tilt = self.tilt(a, a, surface);
        Touched { height, tilt, angle: self.rest_angle(a), place: self.rest(a) }
    }

    /// Where what is inside is as thick as the whisker: place, and both diameters, mm.
    pub fn burst(&self) -> Option<(f64, f64, f64)> {
        let ends = [0.0, self.length];
        // Where a line meets a curve that is no line no knot need tell.
        let between = (1..64).map(|k| self.length * f64::from(k) / 64.0);
        let mut places = ends.into_iter().chain(self.knots.iter().copied()).chain(between);
        let seen = |s: f64| {
            let inner = self.inside(s, s);
            (s, inner, 2.0 * self.radius(s, s))
        };
        places.find_map(|s| Some(seen(s)).filter(|(_, inner, outer)| inner >= outer))
    }

    /// Why a pole of this radius, mm, cannot touch the resting whisker at the arc `a`, from outside its bend, with a lever about a motor's axis `hub`
    /// behind the base (a displaced object: none).
    pub fn refuses(&self, a: f64, pole: f64, hub: Option<f64>) -> Option<&'static str> {
        if self.is_straight() {
            return None;
        }
        let angle = self.rest_angle(a);
        let normal = DVec2::from_angle(angle).perp();
        let lever = hub.map_or(normal.y, |hub| (self.rest(a) + DVec2::new(hub, 0.0)).perp_dot(normal));
        let fits = |s: f64| pole * self.curvature(s) > -1.0;
        match () {
            () if angle.abs() >= 0.5 * PI => Some("the resting whisker has turned by 90° or more"),
            () if lever <= 0.0 => Some("the drive does not press the resting whisker against its object"),
            () if !(fits(0.0) && fits(self.length)) => {
                Some("the pole does not fit into the bend of the whisker")
            }
            () => None,
        }
    }

    /// Axial span [x1, x2] of a gauge whose grid of length `l` is bonded along the surface from `x1`, mm.
    pub fn gauge(&self, x1: f64, l: f64) -> [f64; 2] {
        // ds on the surface per ds of the axis.
        let along = |from: f64, to: f64| {
            let mut sum = 0.0;
            self.quadrature(from, to, |Place { s, within, .. }, w| {
                sum += w * self.slope(s, within).hypot(1.0)
            });
            sum
        };
        let mut x2 = x1 + l;
        for _ in 0..50 {
            let lack = l - along(x1, x2);
            let step = lack / self.slope(x2, x2 * (1.0 - 1e-12)).hypot(1.0);
            x2 += step;
            if step.abs() <= 1e-15 * x2 {
                break;
            }
        }
        [x1, x2]
    }

    /// Calls `f` with places between `from` and `to`, both in [0, L_a], and weights: Σ w g(s) is ∫ g ds. Panels get shorter towards the thinner end of
    /// each smooth piece.
    pub fn quadrature(&self, from: f64, to: f64, mut f: impl FnMut(Place, f64)) {
        let inside = self.knots.iter().copied().filter(|knot| *knot > from && *knot < to);
        let mut near = from;
        for far in inside.chain([to]) {
            let middle = 0.5 * (near + far);
            let narrows = self.radius(far, middle) < self.radius(near, middle);
            let place = |k: u32| match (k, narrows) {
                (0, _) => near,
                (PANELS, _) => far,
                (k, true) => far - (far - near) * 0.5_f64.powi(k as i32),
                (k, false) => near + (far - near) * 0.5_f64.powi((PANELS - k) as i32),
            };
            for k in 0..PANELS {
                self.panel(place(k), place(k + 1), &mut f);
            }
            near = far;
        }
    }

    /// The same on one panel, within a smooth piece.
    pub fn panel(&self, from: f64, to: f64, mut f: impl FnMut(Place, f64)) {
        let within = 0.5 * (from + to);
        each(from, to, |s, weight| f(Place { s, within, end: to }, weight));
    }
}

/// A place of a quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Arc, mm.
    pub s: f64,
    /// A place on the same smooth piece.
    pub within: f64,
    /// Far end of its panel.
    pub end: f64,
}

/// The knots of `table` on both sides of `s`, the first or last two outside; at a knot those after it.
fn of_table(table: &[[f64; 2]], s: f64) -> [[f64; 2]; 2] {
    let after = table.partition_point(|knot| knot[0] <= s).clamp(1, table.len() - 1);
    [table[after - 1], table[after]]
}

/// The line through two knots.
fn line([near, far]: [[f64; 2]; 2], s: f64) -> f64 {
    near[1] + (far[1] - near[1]) / (far[0] - near[0]) * (s - near[0])
}
