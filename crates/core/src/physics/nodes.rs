//! Gauss–Legendre collocation on w ∈ [0, 1], from the contact (w = 0) to the base (w = 1), in f64; kernels and shaders use these tables.

use std::sync::OnceLock;

/// Tables of an n-point rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Nodes {
    /// Nodes w_i, ascending.
    pub points: Vec<f64>,
    /// Weights: ∫₀¹ y dw ≈ Σ weights_i y_i, exact to degree 2n − 1.
    pub weights: Vec<f64>,
    /// Row i: ∫₀^{w_i} y dw ≈ Σ_j integral_ij y_j, exact to degree n − 1.
    pub integral: Vec<Vec<f64>>,
    /// Row k: coefficient of the shifted Legendre polynomial P_k(2w − 1) of the interpolant of y.
    pub legendre: Vec<Vec<f64>>,
}

fn legendre(n: usize, x: f64) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for k in 1..n {
        let (kf, prev, last) = (k as f64, p[k - 1], p[k]);
        p.push(((2.0 * kf + 1.0) * x * last - kf * prev) / (kf + 1.0));
    }
    p.truncate(n + 1);
    p
}

/// Nodes and weights on [0, 1], by Newton from Tricomi's estimate.
pub fn gauss(n: usize) -> (Vec<f64>, Vec<f64>) {
    let nf = n as f64;
    let pair = |i: usize| {
        let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (nf + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let p = legendre(n, x);
            slope = nf * (p[n - 1] - x * p[n]) / (1.0 - x * x);
            let step = p[n] / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(pair).unzip()
}

const MOST: usize = 64;

impl Nodes {
    /// [`Self::new`], computed once: it takes as long as many taps.
    pub fn of(n: usize) -> &'static Self {
        static KEPT: [OnceLock<Nodes>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
        KEPT[n].get_or_init(|| Self::new(n))
    }

    /// Tables of the n-point rule, n ≥ 2.
    pub fn new(n: usize) -> Self {
        let (points, weights) = gauss(n);
        let at: Vec<Vec<f64>> = points.iter().map(|w| legendre(n, 2.0 * w - 1.0)).collect();
        // Discrete orthogonality: c_k = (2k + 1) Σ_j weights_j P_k(w_j) y_j, exact for degree ≤ n − 1.
        let coefficient = |k: usize| (0..n).map(|j| (2 * k + 1) as f64 * weights[j] * at[j][k]).collect();
        let legendre: Vec<Vec<f64>> = (0..n).map(coefficient).collect();
        // ∫₀^w P_k = (P_{k+1} − P_{k−1})/(2(2k + 1)), and w for k = 0.
        let primitive = |i: usize, k: usize| match k {
            0 => points[i],
            _ => (at[i][k + 1] - at[i][k - 1]) / (2 * (2 * k + 1)) as f64,
        };
        let integral = (0..n)
            .map(|i| (0..n).map(|j| (0..n).map(|k| primitive(i, k) * legendre[k][j]).sum()).collect())
            .collect();
        Self { points, weights, integral, legendre }
    }
}

/// Calls `f` with twelve points between `from` and `to` and their weights.
pub fn each(from: f64, to: f64, mut f: impl FnMut(f64, f64)) {
    let (Nodes { points, weights, .. }, length) = (Nodes::of(12), to - from);
    for (point, weight) in points.iter().zip(weights) {
        f(from + length * *point, length * *weight);
    }
}
