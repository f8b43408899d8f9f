//! Quadratic models of smooth functions in a few variables, and the step that minimises one while others stay below zero.

use nalgebra::{DMatrix, DVector};

/// v + gᵀp + ½ pᵀHp.
#[derive(Debug, Clone, PartialEq)]
pub struct Quadratic {
    pub value: f64,
    pub slope: Vec<f64>,
    /// H, row by row.
    pub curvature: Vec<f64>,
}

impl Quadratic {
    pub fn at(&self, p: &[f64]) -> f64 {
        let k = p.len();
        let bend: f64 = (0..k * k).map(|ij| self.curvature[ij] * p[ij / k] * p[ij % k]).sum();
        self.value + dot(&self.slope, p) + 0.5 * bend
    }

    fn slope_at(&self, p: &[f64]) -> Vec<f64> {
        let k = p.len();
        (0..k).map(|i| self.slope[i] + dot(&self.curvature[i * k..(i + 1) * k], p)).collect()
    }

    pub fn is_finite(&self) -> bool {
        self.value.is_finite() && self.slope.iter().chain(&self.curvature).all(|x| x.is_finite())
    }
}

/// Places around `u` in the unit box where functions are evaluated to model them: two per axis, one per pair of axes.
#[derive(Debug, Clone)]
pub struct Stencil {
    axes: Vec<[f64; 2]>,
    pub places: Vec<Vec<f64>>,
}

impl Stencil {
    /// Arms of length `h`; both on the inner side if a bound is nearer than `h`.
    pub fn new(u: &[f64], h: f64) -> Self {
        let arms = |x: &f64| match *x {
            x if x + h > 1.0 => [-h, -2.0 * h],
            x if x - h < 0.0 => [h, 2.0 * h],
            _ => [h, -h],
        };
        let axes: Vec<[f64; 2]> = u.iter().map(arms).collect();
        let moved = |by: &[(usize, f64)]| {
            let mut place = u.to_vec();
            by.iter().for_each(|&(i, t)| place[i] = (place[i] + t).clamp(0.0, 1.0));
            place
        };
        let mut places = vec![u.to_vec()];
        for (i, arm) in axes.iter().enumerate() {
            places.extend(arm.map(|t| moved(&[(i, t)])));
        }
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate().take(i) {
                places.push(moved(&[(i, a[0]), (j, b[0])]));
            }
        }
        Self { axes, places }
    }

    pub fn model(&self, values: &[f64]) -> Quadratic {
        let k = self.axes.len();
        let (mut slope, mut curvature) = (vec![0.0; k], vec![0.0; k * k]);
        let along = |i: usize| [values[1 + 2 * i] - values[0], values[2 + 2 * i] - values[0]];
        for (i, &[s, t]) in self.axes.iter().enumerate() {
            let [a, b] = along(i);
            let (a, b) = (a / s, b / t);
            curvature[i * k + i] = 2.0 * (a - b) / (s - t);
            slope[i] = a - s * (a - b) / (s - t);
        }
        let mut corner = 1 + 2 * k;
        for i in 0..k {
            for j in 0..i {
                let mixed = values[corner] - values[0] - along(i)[0] - along(j)[0];
                curvature[i * k + j] = mixed / (self.axes[i][0] * self.axes[j][0]);
                curvature[j * k + i] = curvature[i * k + j];
                corner += 1;
            }
        }
        Quadratic { value: values[0], slope, curvature }
    }
}

const UPDATES: usize = 40;
const STEPS: usize = 40;

/// The step p in the box [`lo`, `hi`] that minimises `goal` with all `limits` ≤ 0: augmented Lagrangian, projected Newton steps (D. P. Bertsekas,
/// SIAM J. Control Optim. 20, 1982). If the limits cannot be kept, it violates them little. `goal` and `limits` are of order 1.
pub fn step(goal: &Quadratic, limits: &[Quadratic], [lo, hi]: [&[f64]; 2]) -> Vec<f64> {
    let mut p: Vec<f64> = lo.iter().zip(hi).map(|(lo, hi)| 0.0f64.clamp(*lo, *hi)).collect();
    let mut multipliers = vec![0.0; limits.len()];
    let (mut weight, mut before) = (10.0, f64::INFINITY);
    for _ in 0..UPDATES {
        newton(&mut p, [lo, hi], &|p| lagrangian(goal, limits, &multipliers, weight, p));
        let mut gap: f64 = 0.0;
        for (limit, m) in limits.iter().zip(&mut multipliers) {
            let value = limit.at(&p).max(-*m / weight);
            gap = gap.max(value.abs());
            *m = (*m + weight * value).max(0.0);
        }
        if gap < 1e-13 {
            break;
        }
        if gap > 0.25 * before {
            weight = f64::min(weight * 10.0, 1e9);
        }
        before = gap;
    }
    p
}

type Local = (f64, Vec<f64>, Vec<f64>);

/// goal + Σ (max(0, λ + w c)² − λ²)/(2w).
fn lagrangian(goal: &Quadratic, limits: &[Quadratic], multipliers: &[f64], weight: f64, p: &[f64]) -> Local {
    let k = p.len();
    let (mut value, mut slope, mut curvature) = (goal.at(p), goal.slope_at(p), goal.curvature.clone());
    for (limit, m) in limits.iter().zip(multipliers) {
        let push = m + weight * limit.at(p);
        if push <= 0.0 {
            value -= m * m / (2.0 * weight);
            continue;
        }
        value += (push * push - m * m) / (2.0 * weight);
        let g = limit.slope_at(p);
        for i in 0..k {
            slope[i] += push * g[i];
            for j in 0..k {
                curvature[i * k + j] += push * limit.curvature[i * k + j] + weight * g[i] * g[j];
            }
        }
    }
    (value, slope, curvature)
}

fn newton(p: &mut [f64], [lo, hi]: [&[f64]; 2], f: &dyn Fn(&[f64]) -> Local) {
    let k = p.len();
    for _ in 0..STEPS {
        let (value, slope, curvature) = f(p);
        let free: Vec<usize> = (0..k)
            .filter(|&i| !(p[i] <= lo[i] && slope[i] > 0.0 || p[i] >= hi[i] && slope[i] < 0.0))
            .collect();
        let g: Vec<f64> = free.iter().map(|&i| slope[i]).collect();
        let h: Vec<f64> =
            free.iter().flat_map(|&i| free.iter().map(move |&j| i * k + j)).map(|ij| curvature[ij]).collect();
        if g.iter().all(|g| *g == 0.0) {
            return;
        }
        let direction = descent(&g, &h);
        let mut share = 1.0;
        let lower = loop {
            let mut next = p.to_vec();
            for (&i, d) in free.iter().zip(&direction) {
                next[i] = (p[i] + share * d).clamp(lo[i], hi[i]);
            }
            if f(&next).0 < value {
                break Some(next);
            }
            share *= 0.5;
            if share < 1e-9 {
                break None;
            }
        };
        let Some(next) = lower else { return };
        let moved = next.iter().zip(&*p).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        p.copy_from_slice(&next);
        if moved < 1e-15 {
            return;
        }
    }
}

/// −H⁻¹g with the eigenvalues of H made positive: Newton where H is positive definite; elsewhere it leads away from a saddle.
fn descent(g: &[f64], h: &[f64]) -> Vec<f64> {
    let k = g.len();
    if !g.iter().chain(h).all(|x| x.is_finite()) {
        return vec![0.0; k];
    }
    let eigen = DMatrix::from_row_slice(k, k, h).symmetric_eigen();
    let least = eigen.eigenvalues.amax().max(1e-12) * 1e-10;
    let along = eigen.eigenvectors.tr_mul(&DVector::from_row_slice(g));
    let scaled = along.zip_map(&eigen.eigenvalues, |g, l| -g / l.abs().max(least));
    (&eigen.eigenvectors * scaled).iter().copied().collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
