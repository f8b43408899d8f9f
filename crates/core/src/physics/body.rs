//! A built whisker's shape, stiffness and rest curvature along its resting axis (model §7).

mod sound;

use std::f64::consts::PI;

use super::linear::shear_coefficient;
use super::nodes::each;
use super::real::{Real, Vector};
use crate::scene::built::{Built, Inner, Profile, Root};

/// Panels per smooth piece, each half as long as the one before towards the thinner end, where a tip may be sharp.
const PANELS: u32 = 6;

/// A built whisker.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Body<T = f64> {
    D: T,
    d: T,
    /// L_a, mm.
    pub length: T,
    /// Profile, core or bore, rest curvature and root.
    pub built: Built<T>,
    /// Initial modulus of the skin, MPa.
    pub modulus: T,
    /// Poisson's ratio.
    pub nu: T,
    knots: Vec<T>,
}

/// Stiffness of one section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section<T = f64> {
    /// R, mm.
    pub radius: T,
    /// EA, N.
    pub axial: T,
    /// EI, N mm².
    pub bending: T,
    /// k G A, N.
    pub shear: T,
}

/// Contact of an undeflected whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched<T = f64> {
    /// R for a contact on the surface, else 0, mm.
    pub height: T,
    /// sin α and cos α.
    pub tilt: Vector<T>,
    /// ψ₀, rad.
    pub angle: T,
    /// r₀, mm.
    pub place: Vector<T>,
}

impl<T: Real> Touched<T> {
    /// Centre of a pole of this radius, mm, in the frame of the base.
    pub fn pole(&self, radius: T) -> Vector<T> {
        let height = Vector::new(T::of(0.0), self.height);
        self.place + Vector::from_angle(self.angle).rotate(height + self.tilt * radius)
    }
}

fn rest_angle<T: Real>([base, slope]: [T; 2], s: T) -> T {
    -(base + slope * 0.5 * s) * s
}

/// r₀(s), mm, in the frame of the base; `curvature` is κ_base and κ_slope.
pub fn rest<T: Real>(curvature: [T; 2], s: T) -> Vector<T> {
    if nothing(curvature) || s == T::of(0.0) {
        return Vector::new(s, T::of(0.0));
    }
    let [base, slope] = curvature;
    if slope == T::of(0.0) && base.value() != 0.0 {
        let half = base * 0.5 * s;
        return Vector::from_angle(-half) * (s * half.sin() / half);
    }
    // One panel per radian.
    let turned = base.value().abs() * s.value() + slope.value().abs() * s.value() * s.value();
    let panels = 1.0 + turned.ceil();
    let step = s / panels;
    let mut sum = Vector::of(0.0, 0.0);
    for k in 0..panels as u32 {
        each(step * f64::from(k), step * f64::from(k + 1), |s, w| {
            sum = sum + Vector::from_angle(rest_angle(curvature, s)) * w;
        });
    }
    sum
}

/// True if both numbers and all their derivatives are 0.
fn nothing<T: Real>(pair: [T; 2]) -> bool {
    pair == [T::of(0.0); 2]
}

#[allow(non_snake_case)]
impl<T: Real> Body<T> {
    /// The whisker `built` with D, d and L_a, mm, and its skin's initial modulus, MPa. A table of diameters replaces D and d.
    pub fn new(built: &Built<T>, [D, d, L_a]: [T; 3], modulus: T, nu: T) -> Self {
        let profile = if let Profile::Table(table) = &built.profile { &table[..] } else { &[] };
        let inner = built.inner.iter().flat_map(|inner| &inner.diameter);
        let within = |s: &T| s.value() > 0.0 && s.value() < L_a.value();
        let mut knots: Vec<T> = profile.iter().chain(inner).map(|knot| knot[0]).filter(within).collect();
        knots.sort_by(|a, b| a.value().total_cmp(&b.value()));
        knots.dedup_by_key(|knot| knot.value());
        Self { D, d, length: L_a, built: built.clone(), modulus, nu, knots }
    }

    /// Farthest contact of linear theory, mm: L_a, but for a solid clamped cone almost to its apex, at most 10 L_a.
    pub fn reach(&self) -> T {
        let Root { k_theta, k_x, k_y } = self.built.root;
        let rigid = [k_theta, k_x, k_y].iter().all(|k| k.value().is_infinite());
        let plain = self.built.inner.is_none() && self.is_straight() && rigid;
        let Self { D, d, .. } = *self;
        match self.built.profile {
            Profile::Power(n) if plain && n.value() == 1.0 => {
                let narrows = D.value() > d.value();
                let apex = if narrows { self.length * 0.99 * D / (D - d) } else { T::of(f64::INFINITY) };
                Real::min(apex, self.length * 10.0)
            }
            _ => self.length,
        }
    }

    /// True if the whisker is straight at rest.
    pub fn is_straight(&self) -> bool {
        nothing(self.built.curvature)
    }

    /// R(0), R(L_a), mm, and n of a diameter that is a power of the distance from the tip; `None` for cones and tables.
    pub fn power(&self) -> Option<[T; 3]> {
        match self.built.profile {
            Profile::Power(n) if n != T::of(1.0) => Some([self.D * 0.5, self.d * 0.5, n]),
            _ => None,
        }
    }

    /// Modulus of the core, MPa; 0 for a bore or a solid whisker.
    pub fn core_modulus(&self) -> T {
        self.built.inner.as_ref().map_or(T::of(0.0), |inner| inner.modulus)
    }

    /// Places where the whisker is not smooth, ascending, mm.
    pub fn knots(&self) -> &[T] {
        &self.knots
    }

    /// Ends of the smooth piece of the profile that holds `s`, mm; a knot belongs to the piece after it, and the last piece has no end.
    pub fn piece(&self, s: f64) -> [f64; 2] {
        match &self.built.profile {
            Profile::Power(_) => [0.0, f64::INFINITY],
            Profile::Table(table) => {
                let [near, far] = of_table(table, s).map(|knot| knot[0].value());
                [near, if far >= self.length.value() { f64::INFINITY } else { far }]
            }
        }
    }

    /// (1 − s/L_a)ⁿ; negative beyond the tip of a cone, else 0 there.
    fn powered(&self, s: T, n: T) -> T {
        let v = T::of(1.0) - s / self.length;
        match () {
            () if n == T::of(0.0) => T::of(1.0),
            () if n == T::of(1.0) => v,
            () => Real::max(v, T::of(0.0)).powf(n),
        }
    }

    /// R(s), mm, by the piece that holds `within`.
    pub fn radius(&self, s: T, within: f64) -> T {
        let diameter = match &self.built.profile {
            Profile::Power(n) => self.d + (self.D - self.d) * self.powered(s, *n),
            Profile::Table(table) => line(of_table(table, within), s),
        };
        diameter * 0.5
    }

    /// R′(s), likewise.
    pub fn slope(&self, s: T, within: f64) -> T {
        let Self { D, d, .. } = *self;
        let slope = match &self.built.profile {
            Profile::Power(_) if D == d => T::of(0.0),
            Profile::Power(n) => -(D - d) * *n / self.length * self.powered(s, *n - 1.0),
            Profile::Table(table) => {
                let [near, far] = of_table(table, within);
                (far[1] - near[1]) / (far[0] - near[0])
            }
        };
        slope * 0.5
    }

    /// R(a + by) − R(a), mm, without cancellation, by the piece that holds `a`.
    pub fn widening(&self, a: T, by: T) -> T {
        match &self.built.profile {
            Profile::Power(n) => {
                let v = T::of(1.0) - a / self.length;
                let grown = -by / (self.length * v);
                match v.value() <= 0.0 || grown.value() <= -1.0 {
                    true => self.radius(a + by, a.value()) - self.radius(a, a.value()),
                    false => (self.D - self.d) * 0.5 * v.powf(*n) * (*n * grown.ln_1p()).exp_m1(),
                }
            }
            Profile::Table(_) => self.slope(a, a.value()) * by,
        }
    }

    /// Inner diameter at `s`, mm; 0 outside core and bore.
    pub fn inside(&self, s: T, within: f64) -> T {
        let Some(Inner { diameter, .. }) = &self.built.inner else { return T::of(0.0) };
        let (first, last) = (diameter[0][0].value(), diameter[diameter.len() - 1][0].value());
        if within < first || within > last { T::of(0.0) } else { line(of_table(diameter, within), s) }
    }

    /// The section at `s`, on the piece that holds `within`; shear after Cowper, exact for disc, ring and bonded core.
    pub fn section(&self, s: T, within: f64) -> Section<T> {
        let one = T::of(1.0);
        let radius = self.radius(s, within);
        let (e, i) = (self.modulus, self.inside(s, within));
        let core = self.core_modulus();
        let (r2, i2) = (radius * radius, i * 0.25 * i);
        let axial = (e * (r2 - i2) + core * i2) * PI;
        let bending = (e * (r2 * r2 - i2 * i2) + core * i2 * i2) * (0.25 * PI);
        let (p, g, q) = (i2 / r2, core / e, self.nu * 0.5 + 0.75);
        if p == T::of(0.0) {
            let k = shear_coefficient(self.nu);
            return Section { radius, axial, bending, shear: k * axial * 0.5 / (self.nu + 1.0) };
        }
        let b_over_p = -(one - g) * q * (one - p) / (one + g - (one - g) * p);
        let b = p * b_over_p;
        let a = b - q;
        let j = a * (one - p * p) / 4.0
            + b * (one - p) / 2.0
            + (one - p.powi(3)) / 24.0
            + g * ((a + b_over_p) * p * p / 4.0 + p.powi(3) / 24.0);
        Section { radius, axial, bending, shear: -bending * bending / (e * PI * r2.powi(3) * j) }
    }

    /// κ₀(s), 1/mm.
    pub fn curvature(&self, s: T) -> T {
        self.built.curvature[0] + self.built.curvature[1] * s
    }

    /// ψ₀(s), rad.
    pub fn rest_angle(&self, s: T) -> T {
        rest_angle(self.built.curvature, s)
    }

    /// r₀(s), mm, in the frame of the base.
    pub fn rest(&self, s: T) -> Vector<T> {
        rest(self.built.curvature, s)
    }

    /// sin α and cos α of a contact at `s` on the `surface`, else on the axis.
    pub fn tilt(&self, s: T, within: f64, surface: bool) -> Vector<T> {
        if !surface {
            return Vector::of(0.0, 1.0);
        }
        let (one, straight) = (T::of(1.0), self.is_straight());
        let bend = if straight { one } else { self.curvature(s) * self.radius(s, within) + 1.0 };
        Vector::new(-self.slope(s, within) / bend, one).normalize()
    }

    /// Signed length of the skin on the object's side from `a` to `a` + `by`, mm, by the piece that holds `a`.
    pub fn skin(&self, a: T, by: T) -> T {
        let (mut mean, within) = (T::of(0.0), a.value());
        each(T::of(0.0), T::of(1.0), |share, weight| {
            let s = a + by * share;
            let stretched = self.curvature(s) * self.radius(s, within) + 1.0;
            mean = mean + stretched * weight / self.tilt(s, within, true).y;
        });
        by * mean
    }

    /// The undeflected whisker touched at the arc `a`, mm.
    pub fn touched(&self, a: T, surface: bool) -> Touched<T> {
        let height = if surface { self.radius(a, a.value()) } else { T::of(0.0) };
        let tilt = self.tilt(a, a.value(), surface);
        Touched { height, tilt, angle: self.rest_angle(a), place: self.rest(a) }
    }

    /// Axial span [x1, x2] of a gauge whose grid of length `l` is bonded along the surface from `x1`, mm.
    pub fn gauge(&self, x1: T, l: T) -> [T; 2] {
        let along = |from: T, to: T| {
            let mut sum = T::of(0.0);
            self.quadrature(from, to, |Place { s, within, .. }, w| {
                sum = sum + w * self.slope(s, within).hypot(T::of(1.0))
            });
            sum
        };
        let mut x2 = x1 + l;
        for _ in 0..50 {
            let lack = l - along(x1, x2);
            let step = lack / self.slope(x2, x2.value() * (1.0 - 1e-12)).hypot(T::of(1.0));
            x2 = x2 + step;
            if step.value().abs() <= 1e-15 * x2.value() {
                break;
            }
        }
        [x1, x2]
    }

    /// Calls `f` with places in [`from`, `to`] and weights w, Σ w g(s) = ∫ g ds; panels shrink towards the thin end of each smooth piece.
    pub fn quadrature(&self, from: T, to: T, mut f: impl FnMut(Place<T>, T)) {
        let within = |knot: &T| knot.value() > from.value() && knot.value() < to.value();
        let inside = self.knots.iter().copied().filter(within);
        let mut near = from;
        for far in inside.chain([to]) {
            let middle = 0.5 * (near.value() + far.value());
            let narrows = self.radius(far, middle).value() < self.radius(near, middle).value();
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

    /// [`Self::quadrature`] on one panel within a smooth piece.
    pub fn panel(&self, from: T, to: T, mut f: impl FnMut(Place<T>, T)) {
        let within = 0.5 * (from.value() + to.value());
        each(from, to, |s, weight| f(Place { s, within, end: to }, weight));
    }
}

/// A point of the quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<T = f64> {
    /// Arc, mm.
    pub s: T,
    /// A place on the same smooth piece.
    pub within: f64,
    /// Far end of its panel.
    pub end: T,
}

fn of_table<T: Real>(table: &[[T; 2]], s: f64) -> [[T; 2]; 2] {
    let after = table.partition_point(|knot| knot[0].value() <= s).clamp(1, table.len() - 1);
    [table[after - 1], table[after]]
}

fn line<T: Real>([near, far]: [[T; 2]; 2], s: T) -> T {
    near[1] + (far[1] - near[1]) / (far[0] - near[0]) * (s - near[0])
}
