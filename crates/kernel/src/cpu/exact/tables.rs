//! Constants of a rule in the precision of the kernel.

use super::super::pack::{Packed, Scalar};
use crate::{Chart, Rule, nodes::Nodes};

#[derive(Debug, Clone)]
pub struct Tables<T, const N: usize> {
    count: usize,
    pub points: [T; N],
    pub weights: [T; N],
    pub integral: [[T; N]; N],
    pub legendre: [[T; N]; N],
    pub gauge: Vec<(T, T)>,
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
    law: Option<Chart<T>>,
}

impl<T: Scalar, const N: usize> Tables<T, N> {
    /// Zeros beyond the nodes.
    pub fn new(rule: &Rule, chart: Option<&Chart>) -> Self {
        let (nodes, gauge) = (Nodes::of(rule.nodes), Nodes::of(rule.gauge_points()));
        let at = |v: &[f64], i: usize| T::of(v.get(i).copied().unwrap_or(0.0));
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| at(v, i)) };
        let rows = |m: &[Vec<f64>]| -> [[T; N]; N] {
            std::array::from_fn(|i| m.get(i).map_or([T::of(0.0); N], |v| row(v)))
        };
        Self {
            count: rule.nodes,
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: rows(&nodes.integral),
            legendre: rows(&nodes.legendre),
            gauge: gauge.points.iter().zip(&gauge.weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect(),
            one_minus_cos: series(rule.terms, 2).into_iter().map(T::of).collect(),
            x_minus_sin: series(rule.terms, 3).into_iter().map(T::of).collect(),
            law: chart.map(Chart::of),
        }
    }

    /// Number of nodes; a constant only where unrolling pays, with few nodes and all effects off.
    #[inline(always)]
    pub fn nodes<const PLAIN: bool>(&self) -> usize {
        if PLAIN { N } else { self.count.min(N) }
    }

    pub fn chart_error(&self) -> Option<f64> {
        self.law.as_ref().map(|law| law.error)
    }

    #[inline(always)]
    pub fn one_minus_cos<P: Packed<Scalar = T>>(&self, x: P) -> P {
        let z = x * x;
        z * P::polynomial(&self.one_minus_cos, z)
    }

    #[inline(always)]
    pub fn x_minus_sin<P: Packed<Scalar = T>>(&self, x: P) -> P {
        let z = x * x;
        x * z * P::polynomial(&self.x_minus_sin, z)
    }

    #[inline(always)]
    pub fn section<P: Packed<Scalar = T>>(&self, t: P, b: P) -> [P; 3] {
        match &self.law {
            Some(law) => law.section(t, b),
            None => [P::of(0.0); 3],
        }
    }
}

/// Coefficients of 1 − cos x = x² Σ c_k x^2k (`first` 2) or x − sin x = x³ Σ c_k x^2k (`first` 3).
pub fn series(terms: usize, first: u32) -> Vec<f64> {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    (0..terms as u32).map(|k| (if k % 2 == 0 { 1.0 } else { -1.0 }) / factorial(first + 2 * k)).collect()
}

/// Σ row y over `n` nodes.
#[inline(always)]
pub fn dot<P: Packed, const N: usize>(n: usize, row: &[P::Scalar; N], y: &[P; N]) -> P {
    let mut sum = P::splat(row[0]) * y[0];
    for j in 1..n {
        sum = sum.plus(row[j], y[j]);
    }
    sum
}
