//! Chebyshev interpolation at points of the first kind, x_i = −cos(π (i + ½)/n), ascending; a series is Σ c_k T_k(x).

/// The n points; for an even n 0 is not among them.
pub fn points(n: usize) -> Vec<f64> {
    (0..n).map(|i| -(std::f64::consts::PI * (i as f64 + 0.5) / n as f64).cos()).collect()
}

/// Coefficients of the interpolant of values at the points.
pub fn coefficients(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    // T_k at point i is cos(k φ_i).
    let angle = |i: usize| std::f64::consts::PI * (1.0 - (i as f64 + 0.5) / n as f64);
    let coefficient = |k: usize| {
        let sum: f64 = values.iter().enumerate().map(|(i, v)| v * (k as f64 * angle(i)).cos()).sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / n as f64
    };
    (0..n).map(coefficient).collect()
}

/// `f` of the rows of a table, then of its columns.
pub fn twice(f: impl Fn(&[f64]) -> Vec<f64>, table: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let each = |table: &[Vec<f64>]| table.iter().map(|row| f(row)).collect::<Vec<_>>();
    transpose(&each(&transpose(&each(table))))
}

/// Rows and columns swapped.
pub fn transpose(m: &[Vec<f64>]) -> Vec<Vec<f64>> {
    (0..m[0].len()).map(|j| m.iter().map(|row| row[j]).collect()).collect()
}

/// The matrix of [`coefficients`]: row k, column i.
pub fn matrix(n: usize) -> Vec<Vec<f64>> {
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>();
    transpose(&(0..n).map(|i| coefficients(&unit(i))).collect::<Vec<_>>())
}

/// T_0(x) … T_{n−1}(x).
pub fn basis(n: usize, x: f64) -> Vec<f64> {
    let mut all = vec![1.0, x];
    for k in 1..n {
        all.push(2.0 * x * all[k] - all[k - 1]);
    }
    all.truncate(n);
    all
}

/// Σ c_k T_k(x) and its derivative (Clenshaw 1955, and its derivative line by line); 0 for an empty series.
pub fn series(c: &[f64], x: f64) -> (f64, f64) {
    let Some((first, rest)) = c.split_first() else { return (0.0, 0.0) };
    let (mut b1, mut b2, mut d1, mut d2) = (0.0, 0.0, 0.0, 0.0);
    for c in rest.iter().rev() {
        let b = 2.0 * x * b1 - b2 + c;
        let d = 2.0 * b1 + 2.0 * x * d1 - d2;
        (b2, b1, d2, d1) = (b1, b, d1, d);
    }
    (first + x * b1 - b2, b1 + x * d1 - d2)
}

/// Point of `range` at x ∈ [−1, 1].
pub fn placed([lo, hi]: [f64; 2], x: f64) -> f64 {
    0.5 * (hi + lo) + 0.5 * (hi - lo) * x
}

/// The inverse of [`placed`]; 0 for a range of zero width.
pub fn scaled([lo, hi]: [f64; 2], v: f64) -> f64 {
    if hi > lo { (2.0 * v - (hi + lo)) / (hi - lo) } else { 0.0 }
}
