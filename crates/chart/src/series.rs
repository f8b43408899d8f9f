//! A sparse Chebyshev series of several variables: the terms of a tensor product that matter.

use super::axis::AXES;
use crate::physics::chebyshev::basis;

/// Coefficients over the last axis that share their orders over the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Orders over all axes but the last.
    pub orders: [usize; AXES - 1],
    /// Ascending orders over the last.
    pub coefficients: Vec<f64>,
}

/// Σ c T_i(x₀) T_j(x₁) …, of which only terms that matter are kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// In ascending order of `orders`.
    pub rows: Vec<Row>,
}

impl Series {
    /// Number of coefficients.
    pub fn terms(&self) -> usize {
        self.rows.iter().map(|r| r.coefficients.len()).sum()
    }

    /// Upper bound on |value|.
    pub fn bound(&self) -> f64 {
        self.rows.iter().flat_map(|r| &r.coefficients).map(|c| c.abs()).sum()
    }

    /// The largest terms, so that the others sum to at most `error`; and that sum.
    pub fn largest(&self, error: f64) -> (Self, f64) {
        let mut sizes: Vec<f64> = self.rows.iter().flat_map(|r| &r.coefficients).map(|c| c.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let (mut missed, mut least) = (0.0, 0.0);
        for size in sizes {
            if missed + size > error {
                least = size;
                break;
            }
            missed += size;
        }
        let kept = |c: &f64| if c.abs() < least || least == 0.0 { 0.0 } else { *c };
        let row = |row: &Row| {
            let mut coefficients: Vec<f64> = row.coefficients.iter().map(kept).collect();
            coefficients.truncate(coefficients.iter().rposition(|c| *c != 0.0).map_or(0, |last| last + 1));
            Row { orders: row.orders, coefficients }
        };
        let rows = self.rows.iter().map(row).filter(|row| !row.coefficients.is_empty()).collect();
        (Self { rows }, missed)
    }

    /// Orders over each axis.
    pub fn sizes(&self) -> [usize; AXES] {
        let mut sizes = [1; AXES];
        for row in &self.rows {
            for (size, order) in sizes.iter_mut().zip(row.orders) {
                *size = (*size).max(order + 1);
            }
            sizes[AXES - 1] = sizes[AXES - 1].max(row.coefficients.len());
        }
        sizes
    }

    /// Its value at `x` ∈ [−1, 1] of every axis.
    pub fn at(&self, x: [f64; AXES]) -> f64 {
        let sizes = self.sizes();
        let t: [Vec<f64>; AXES] = std::array::from_fn(|axis| basis(sizes[axis], x[axis]));
        let row = |row: &Row| {
            let shared: f64 = row.orders.iter().zip(&t).map(|(order, t)| t[*order]).product();
            shared * row.coefficients.iter().zip(&t[AXES - 1]).map(|(c, t)| c * t).sum::<f64>()
        };
        self.rows.iter().map(row).sum()
    }
}
