//! A line or a circle, as one family: a place, a direction and a curvature, which is 0 of a line. Nothing is singular where one becomes the other.

use nalgebra::{DMatrix, DVector};

use super::Sample;
use vibrissa_learned::least::{FREE, by_values, slopes};

/// Small changes of offset (mm), direction (rad), curvature (1/mm).
const STEPS: [f64; 3] = [1e-5, 1e-6, 1e-7];

const SETTLED: f64 = 1e-10;

#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// A place near it, mm, and the direction there, rad, from which offset and turn are counted.
    origin: [f64; 2],
    direction: f64,
    /// Offset to the left (mm), turn (rad) and, of a circle, curvature (1/mm), > 0 where the centre lies to the left.
    values: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Arc {
    /// With nothing known of its uncertainty.
    fn new(origin: [f64; 2], direction: f64, curvature: Option<f64>) -> Self {
        let values: Vec<f64> = [0.0, 0.0].into_iter().chain(curvature).collect();
        let n = values.len();
        Self { origin, direction, values, covariance: DMatrix::zeros(n, n) }
    }

    /// Through two places, or three.
    pub fn through(points: &[[f64; 2]]) -> Option<Self> {
        let [p, q, ..] = *points else { return None };
        let d = [q[0] - p[0], q[1] - p[1]];
        let along = d[1].atan2(d[0]);
        let Some(r) = points.get(2) else {
            return (d[0].hypot(d[1]) > 0.0).then(|| Self::new(p, along, None));
        };
        let e = [r[0] - p[0], r[1] - p[1]];
        let (a, b, c) = (d[0].hypot(d[1]), e[0].hypot(e[1]), (e[0] - d[0]).hypot(e[1] - d[1]));
        let cross = d[0] * e[1] - d[1] * e[0];
        let curvature = 2.0 * cross / (a * b * c);
        // Tangent and chord make the angle under which the chord is seen from the third place.
        let [u, v] = [[-e[0], -e[1]], [d[0] - e[0], d[1] - e[1]]];
        let lift = (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]);
        curvature.is_finite().then(|| Self::new(p, along - lift, Some(curvature)))
    }

    /// 1/mm; 0 of a line.
    pub fn curvature(&self) -> f64 {
        self.values.get(2).copied().unwrap_or(0.0)
    }

    /// A place on it, and the unit vectors along it and to the left there.
    fn frame(&self) -> ([f64; 2], [f64; 2], [f64; 2]) {
        let (sin, cos) = (self.direction + self.values[1]).sin_cos();
        let (s0, c0) = self.direction.sin_cos();
        let origin = [self.origin[0] - self.values[0] * s0, self.origin[1] + self.values[0] * c0];
        (origin, [cos, sin], [-sin, cos])
    }

    /// How far a place lies to the left, mm.
    pub fn off(&self, p: [f64; 2]) -> f64 {
        let (origin, _, n) = self.frame();
        let (u, k) = ([p[0] - origin[0], p[1] - origin[1]], self.curvature());
        let q = 2.0 * (u[0] * n[0] + u[1] * n[1]) - k * (u[0] * u[0] + u[1] * u[1]);
        q / (1.0 + (1.0 - k * q).max(0.0).sqrt())
    }

    /// Unit vector to the left at a place beside it.
    pub fn normal(&self, p: [f64; 2]) -> [f64; 2] {
        let (origin, _, n) = self.frame();
        let k = self.curvature();
        let v = [n[0] - k * (p[0] - origin[0]), n[1] - k * (p[1] - origin[1])];
        let size = v[0].hypot(v[1]);
        if size > 0.0 { [v[0] / size, v[1] / size] } else { n }
    }

    /// Length along it from its origin to the foot of a place, mm; of a circle within half a turn.
    pub fn along(&self, p: [f64; 2]) -> f64 {
        let (origin, t, n) = self.frame();
        let u = [p[0] - origin[0], p[1] - origin[1]];
        let (x, y, k) = (u[0] * t[0] + u[1] * t[1], u[0] * n[0] + u[1] * n[1], self.curvature());
        if k == 0.0 { x } else { (k * x).atan2(1.0 - k * y) / k }
    }

    /// The place at a length along it, and the direction there.
    pub fn at(&self, s: f64) -> ([f64; 2], f64) {
        let (origin, t, n) = self.frame();
        let k = self.curvature();
        let turn = k * s;
        let round = (turn.sin() / k, (1.0 - turn.cos()) / k);
        let (x, y) = if turn.abs() < 1e-6 { (s, 0.5 * turn * s) } else { round };
        let at = [origin[0] + x * t[0] + y * n[0], origin[1] + x * t[1] + y * n[1]];
        (at, self.direction + self.values[1] + turn)
    }

    /// Standard deviations of numbers that follow from it.
    fn deviations_of<const N: usize>(&self, of: impl Fn(&Self) -> Option<[f64; N]>) -> Option<[f64; N]> {
        let moved = |v: &[f64]| Some(of(&Self { values: v.to_vec(), ..self.clone() })?.to_vec());
        let j = slopes(&moved, &self.values, &STEPS[..self.values.len()], &vec![FREE; self.values.len()])?;
        let covariance = &j * &self.covariance * j.transpose();
        Some(std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()))
    }

    /// Standard deviation square to it at a place of it, mm.
    pub fn deviation(&self, p: [f64; 2]) -> f64 {
        self.deviations_of(|arc| Some([arc.off(p)])).map_or(f64::NAN, |[off]| off)
    }

    /// Standard deviations of offset (mm), turn (rad), curvature (1/mm).
    pub fn deviations(&self) -> DVector<f64> {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    /// Centre and radius of a circle, mm.
    pub fn circle(&self) -> Option<([f64; 2], f64)> {
        let k = self.curvature();
        let (origin, _, n) = self.frame();
        (k != 0.0).then(|| ([origin[0] + n[0] / k, origin[1] + n[1] / k], 1.0 / k.abs()))
    }

    /// Standard deviation of the centre's coordinates and of the radius, mm.
    pub fn circle_deviations(&self) -> Option<([f64; 2], f64)> {
        self.circle()?;
        let [x, y, radius] = self.deviations_of(|arc| arc.circle().map(|([x, y], r)| [x, y, r]))?;
        Some(([x, y], radius))
    }

    /// Least squares of the distances of the `samples` with `weights` > 0, each over its standard deviation across the arc.
    pub fn fit(&self, samples: &[Sample], weights: &[f64]) -> Option<Self> {
        let used = || samples.iter().zip(weights).filter(|(_, w)| **w > 0.0);
        if used().count() < self.values.len() {
            return None;
        }
        let of = |values: &[f64]| -> Option<Vec<f64>> {
            let arc = Self { values: values.to_vec(), ..self.clone() };
            let one = |(s, w): (&Sample, &f64)| {
                let sigma = s.covariance.of(arc.normal(s.at)).sqrt();
                let off = arc.off(s.at) / sigma * w.sqrt();
                off.is_finite().then_some(off)
            };
            used().map(one).collect()
        };
        let n = self.values.len();
        let found = by_values(&of, &self.values, &STEPS[..n], &vec![FREE; n], SETTLED)?;
        Some(Self { values: found.at, covariance: found.covariance, ..self.clone() })
    }
}
