//! A line or a circle, as one family: a place, a direction and a curvature, which is 0 of a line. Nothing is singular where one becomes the other.
//!
//! A smooth curve: such a base, and how far left of it the curve lies, as cubic B-splines whose coefficients bend as little as the points
//! allow (P-splines: Eilers and Marx, Stat. Sci. 11:89, 1996).

use nalgebra::{DMatrix, DVector};

use super::Sample;
use vibrissa_core::reduce::sorted;
use vibrissa_learned::least::{self, FREE, by_values, slopes};

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
    pub covariance: DMatrix<f64>,
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

    /// Distance of a place to the left of the curve, mm.
    pub fn off(&self, p: [f64; 2]) -> f64 {
        let (origin, _, n) = self.frame();
        let (u, k) = ([p[0] - origin[0], p[1] - origin[1]], self.curvature());
        let q = 2.0 * (u[0] * n[0] + u[1] * n[1]) - k * (u[0] * u[0] + u[1] * u[1]);
        q / (1.0 + (1.0 - k * q).max(0.0).sqrt())
    }

    /// Unit vector to the left, at a place next to the curve.
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
    pub fn deviations_of<const N: usize>(&self, of: impl Fn(&Self) -> Option<[f64; N]>) -> Option<[f64; N]> {
        let moved = |v: &[f64]| Some(of(&Self { values: v.to_vec(), ..self.clone() })?.to_vec());
        let j = slopes(&moved, &self.values, &STEPS[..self.values.len()], &vec![FREE; self.values.len()])?;
        let covariance = &j * &self.covariance * j.transpose();
        Some(std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()))
    }

    /// Standard deviation square to it at a place of it, mm.
    pub fn deviation(&self, p: [f64; 2]) -> f64 {
        self.deviations_of(|arc| Some([arc.off(p)])).map_or(f64::NAN, |[off]| off)
    }

    /// Centre and radius of a circle, mm.
    pub fn circle(&self) -> Option<[f64; 3]> {
        let k = self.curvature();
        let (origin, _, n) = self.frame();
        (k != 0.0).then(|| [origin[0] + n[0] / k, origin[1] + n[1] / k, 1.0 / k.abs()])
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

/// Most intervals between knots.
const INTERVALS: usize = 40;
/// Widest gap between points of a circle, as a share of a turn, over which the curve is closed.
const GAP: f64 = 0.25;
/// Passes over the lean of the curve against its base, which enters the variance of a point across it.
const PASSES: usize = 3;

/// Cubic B-splines on even knots along a base.
#[derive(Debug, Clone, PartialEq)]
pub struct Smooth {
    pub(super) base: Arc,
    /// Ends along the base, mm.
    pub(super) ends: [f64; 2],
    intervals: usize,
    closed: bool,
    stiffness: f64,
    /// Of the offset to the left of the base, mm.
    values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

/// Ends of points along an arc, and whether they close it: the widest gap of a circle is left out, or narrow.
pub fn ends(base: &Arc, points: impl Iterator<Item = [f64; 2]>) -> ([f64; 2], bool) {
    let all = sorted(points.map(|p| base.along(p)));
    let (Some(first), Some(last)) = (all.first(), all.last()) else { return ([0.0, 0.0], false) };
    let Some([.., radius]) = base.circle() else { return ([*first, *last], false) };
    let turn = std::f64::consts::TAU * radius;
    let across = [(first + turn - last, *first, *last)];
    let gaps = all.windows(2).map(|w| (w[1] - w[0], w[1], w[0] + turn)).chain(across);
    let (gap, from, to) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)).expect("one at least");
    if gap < GAP * turn { ([from, from + turn], true) } else { ([from, to], false) }
}

/// Normal equations of one fit, to which points can be added and taken away.
type Sums = (DMatrix<f64>, DVector<f64>);

impl Smooth {
    /// Beside `base`, as flat as it, on a basis for these samples; `None` where they cover nothing.
    pub fn beside(base: &Arc, samples: &[Sample], groups: usize, stiffness: f64) -> Option<Self> {
        let (ends, closed) = ends(base, samples.iter().map(|s| s.at));
        let intervals = groups.clamp(6, INTERVALS);
        let n = if closed { intervals } else { intervals + 3 };
        let (base, values, covariance) = (base.clone(), DVector::zeros(n), DMatrix::zeros(n, n));
        let curve = Self { base, ends, intervals, closed, stiffness, values, covariance };
        (ends[1] - ends[0] > 0.0).then_some(curve)
    }

    /// Place of the first of four splines at s, their values and slopes.
    fn splines(&self, s: f64) -> ([usize; 4], [f64; 4], [f64; 4]) {
        let h = (self.ends[1] - self.ends[0]) / self.intervals as f64;
        let x = (s - self.ends[0]) / h;
        let x = if self.closed { x.rem_euclid(self.intervals as f64) } else { x };
        let k = (x.floor().max(0.0) as usize).min(self.intervals - 1);
        let (t, n) = (x - k as f64, self.values.len());
        let u = 1.0 - t;
        let (hump, fall) = (|t: f64| (3.0 * t - 6.0) * t * t + 4.0, |t: f64| (3.0 * t - 4.0) * t);
        let values = [u * u * u, hump(t), hump(u), t * t * t].map(|x| x / 6.0);
        let slopes = [-u * u, fall(t), -fall(u), t * t].map(|x| 0.5 * x);
        (std::array::from_fn(|i| (k + i) % n), values, slopes.map(|d| d / h))
    }

    /// Squares of second differences of the coefficients.
    fn roughness(&self) -> DMatrix<f64> {
        let n = self.values.len();
        let mut p = DMatrix::zeros(n, n);
        let rows = if self.closed { n } else { n - 2 };
        for k in 0..rows {
            for (i, x) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                for (j, y) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                    p[((k + i) % n, (k + j) % n)] += x * y;
                }
            }
        }
        p
    }

    /// Along the base, into the range of the curve.
    fn along(&self, p: [f64; 2]) -> f64 {
        let s = self.base.along(p);
        match self.base.circle() {
            // Moved by whole turns into the range.
            Some([.., radius]) => {
                let turn = std::f64::consts::TAU * radius;
                let middle = 0.5 * (self.ends[0] + self.ends[1]);
                s + turn * ((middle - s) / turn).round()
            }
            None => s,
        }
    }

    /// Offset to the left of the base (mm), slope and standard deviation of the offset, at s along it.
    fn offset(&self, s: f64) -> (f64, f64, f64) {
        let (places, values, slopes) = self.splines(s);
        let of = |x: &[f64; 4]| places.iter().zip(x).map(|(k, x)| self.values[*k] * x).sum::<f64>();
        let mut variance = 0.0;
        for (i, x) in places.iter().zip(&values) {
            for (j, y) in places.iter().zip(&values) {
                variance += x * y * self.covariance[(*i, *j)];
            }
        }
        let offset = of(&values);
        // Lengths shrink towards the centre of the base.
        let slope = of(&slopes) / (1.0 - self.base.curvature() * offset).max(0.1);
        (offset, slope, variance.max(0.0).sqrt())
    }

    /// Distance of a place to the left of the curve, mm, and the unit vector across the curve there.
    pub fn off(&self, p: [f64; 2]) -> (f64, [f64; 2]) {
        let (offset, slope, _) = self.offset(self.along(p));
        let size = 1.0f64.hypot(slope);
        let n = self.base.normal(p);
        let across = [(n[0] - slope * n[1]) / size, (n[1] + slope * n[0]) / size];
        // The normal of the base turned by the lean: n is to the left of t, so that t = (n_y, −n_x).
        ((self.base.off(p) - offset) / size, across)
    }

    /// Standard deviation across the curve beside a place, mm, with that of its base, which no stiffness takes away.
    pub fn deviation(&self, p: [f64; 2]) -> f64 {
        let (_, slope, sigma) = self.offset(self.along(p));
        (sigma / 1.0f64.hypot(slope)).hypot(self.base.deviation(p))
    }

    /// The place at s along the base, and the direction of the curve there.
    pub fn at(&self, s: f64) -> ([f64; 2], f64) {
        let (on, direction) = self.base.at(s);
        let (offset, slope, _) = self.offset(s);
        let (sin, cos) = direction.sin_cos();
        ([on[0] - offset * sin, on[1] + offset * cos], direction + slope.atan())
    }

    /// Weighted sums of some samples; weights as they lie across the curve so far.
    fn sums<'a>(&self, samples: impl Iterator<Item = (&'a Sample, f64)>) -> Sums {
        let n = self.values.len();
        let (mut matrix, mut vector): Sums = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (s, weight) in samples.filter(|(_, w)| *w > 0.0) {
            let along = self.along(s.at);
            let (places, values, _) = self.splines(along);
            let (_, slope, _) = self.offset(along);
            let (_, across) = self.off(s.at);
            let w = weight / (s.covariance.of(across) * (1.0 + slope * slope));
            let off = self.base.off(s.at);
            for (i, x) in places.iter().zip(&values) {
                vector[*i] += w * x * off;
                for (j, y) in places.iter().zip(&values) {
                    matrix[(*i, *j)] += w * x * y;
                }
            }
        }
        (matrix, vector)
    }

    fn solved(&self, (matrix, vector): &Sums) -> Option<Self> {
        // A trace of stiffness against the base keeps the matrix regular where there are no points.
        let n = self.values.len();
        let scale = (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n as f64;
        let stiff = self.roughness() * (self.stiffness * scale);
        let m = matrix + stiff + DMatrix::identity(n, n) * (1e-9 * scale);
        let (values, covariance) = least::solve(&m, vector)?;
        Some(Self { values, covariance, ..self.clone() })
    }

    pub fn fit(&self, samples: &[Sample], weights: &[f64]) -> Option<Self> {
        let drawn = |curve: Self, _| curve.solved(&curve.sums(samples.iter().zip(weights.iter().copied())));
        (0..PASSES).try_fold(self.clone(), drawn)
    }

    /// The curve without each of `groups`, in their order; weights lean as this curve does, which saw all of them.
    pub fn without(&self, samples: &[Sample], weights: &[f64], groups: &[Vec<usize>]) -> Option<Vec<Self>> {
        let all = self.sums(samples.iter().zip(weights.iter().copied()));
        let one = |group: &Vec<usize>| {
            let out = self.sums(group.iter().map(|&i| (&samples[i], weights[i])));
            self.solved(&(&all.0 - out.0, &all.1 - out.1))
        };
        groups.iter().map(one).collect()
    }
}
