//! Constants of a rule in the kernel's own precision.

use super::super::pack::{Pack, Scalar};
use crate::kernel::{
    Chart, Rule,
    nodes::{Nodes, gauss},
};

/// Tables of [`Nodes`], of the two series and of the section law.
#[derive(Debug, Clone)]
pub struct Tables<T, const N: usize> {
    /// N, but not to the compiler.
    count: usize,
    pub points: [T; N],
    pub weights: [T; N],
    pub integral: [[T; N]; N],
    pub legendre: [[T; N]; N],
    pub gauge: Vec<(T, T)>,
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
    chart: Option<Chart>,
}

impl<T: Scalar, const N: usize> Tables<T, N> {
    /// Tables of `rule`, which has N nodes, and of the section law of `chart`.
    pub fn new(rule: &Rule, chart: Option<&Chart>) -> Self {
        let nodes = Nodes::new(N);
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| T::of(v[i])) };
        let (points, weights) = gauss(rule.gauge_points());
        Self {
            count: rule.nodes,
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: std::array::from_fn(|i| row(&nodes.integral[i])),
            legendre: std::array::from_fn(|i| row(&nodes.legendre[i])),
            gauge: points.iter().zip(&weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect(),
            one_minus_cos: series(rule.terms, 2).into_iter().map(T::of).collect(),
            x_minus_sin: series(rule.terms, 3).into_iter().map(T::of).collect(),
            chart: chart.cloned(),
        }
    }

    /// Number of nodes; a constant only where unrolling pays, with few nodes and all effects off.
    #[inline(always)]
    pub fn nodes<const PLAIN: bool>(&self) -> usize {
        if PLAIN { N } else { self.count.min(N) }
    }

    /// Section law, if it is not Hooke's.
    pub fn chart(&self) -> Option<&Chart> {
        self.chart.as_ref()
    }

    /// 1 − cos x.
    #[inline(always)]
    pub fn one_minus_cos<const L: usize, const FMA: bool>(&self, x: Pack<T, L, FMA>) -> Pack<T, L, FMA> {
        let z = x * x;
        z * polynomial(&self.one_minus_cos, z)
    }

    /// x − sin x.
    #[inline(always)]
    pub fn x_minus_sin<const L: usize, const FMA: bool>(&self, x: Pack<T, L, FMA>) -> Pack<T, L, FMA> {
        let z = x * x;
        x * z * polynomial(&self.x_minus_sin, z)
    }

    /// (e₀ − t, χ, load) of the section law at the Hookean strains t and b; load > 1 is outside the chart.
    #[inline(always)]
    pub fn section<const L: usize, const FMA: bool>(
        &self,
        t: Pack<T, L, FMA>,
        b: Pack<T, L, FMA>,
    ) -> [Pack<T, L, FMA>; 3] {
        let of = Pack::<T, L, FMA>::of;
        let Some(chart) = &self.chart else { return [of(0.0); 3] };
        let most = t.mul_add(of(chart.bending[1]), of(chart.bending[0]));
        let b2 = b * b;
        let beta = b2 / (most * most);
        let x = t * of(1.0 / chart.axial);
        let load = beta.max(x.abs());
        let (x, y) = (x.max(of(-1.0)).min(of(1.0)), beta.min(of(1.0)).mul_add(of(2.0), of(-1.0)));
        let line = |c: &[f64]| c.iter().rev().fold(of(0.0), |sum, &c| sum.mul_add(x, of(c)));
        let plane = |c: &[Vec<f64>]| c.iter().rev().fold(of(0.0), |sum, row| sum.mul_add(y, line(row)));
        [t * t * line(&chart.r) + b2 * plane(&chart.p), t * line(&chart.c) + b2 * plane(&chart.q), load]
    }
}

/// Coefficients of 1 − cos x = x² Σ c_k x^2k (`first` 2) or x − sin x = x³ Σ c_k x^2k (`first` 3).
pub fn series(terms: usize, first: u32) -> Vec<f64> {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    (0..terms as u32).map(|k| (if k % 2 == 0 { 1.0 } else { -1.0 }) / factorial(first + 2 * k)).collect()
}

/// Σ c_k z^k.
#[inline(always)]
fn polynomial<T: Scalar, const L: usize, const FMA: bool>(c: &[T], z: Pack<T, L, FMA>) -> Pack<T, L, FMA> {
    let mut sum = Pack::splat(c[c.len() - 1]);
    for &next in c[..c.len() - 1].iter().rev() {
        sum = sum.mul_add(z, Pack::splat(next));
    }
    sum
}

/// Σ row_j y_j over the first `n`.
#[inline(always)]
pub fn dot<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    n: usize,
    row: &[T; N],
    y: &[Pack<T, L, FMA>; N],
) -> Pack<T, L, FMA> {
    let mut sum = Pack::splat(row[0]) * y[0];
    for j in 1..n {
        sum = Pack::splat(row[j]).mul_add(y[j], sum);
    }
    sum
}
