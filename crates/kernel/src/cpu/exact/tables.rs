//! Constants of a rule in the kernel's own precision.

use super::super::pack::{Pack, Scalar};
use crate::{Chart, Rule, nodes::Nodes};

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
    law: Option<Law<T>>,
}

/// A section chart.
#[derive(Debug, Clone)]
struct Law<T> {
    error: f64,
    /// Whether the chart tells of the material wherever a section bends beyond it.
    covers: bool,
    /// 1/axial.
    scale: T,
    bending: [T; 2],
    r: Vec<T>,
    c: Vec<T>,
    p: Vec<Vec<T>>,
    q: Vec<Vec<T>>,
}

impl<T: Scalar> Law<T> {
    fn new(chart: &Chart) -> Self {
        let line = |c: &Vec<f64>| c.iter().map(|&x| T::of(x)).collect::<Vec<T>>();
        Self {
            error: chart.error,
            covers: chart.covers,
            scale: T::of(1.0 / chart.axial),
            bending: chart.bending.map(T::of),
            r: line(&chart.r),
            c: line(&chart.c),
            p: chart.p.iter().map(line).collect(),
            q: chart.q.iter().map(line).collect(),
        }
    }
}

impl<T: Scalar, const N: usize> Tables<T, N> {
    /// Tables of `rule`, which has N nodes, and of the section law of `chart`.
    pub fn new(rule: &Rule, chart: Option<&Chart>) -> Self {
        let (nodes, gauge) = (Nodes::of(N), Nodes::of(rule.gauge_points()));
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| T::of(v[i])) };
        Self {
            count: rule.nodes,
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: std::array::from_fn(|i| row(&nodes.integral[i])),
            legendre: std::array::from_fn(|i| row(&nodes.legendre[i])),
            gauge: gauge.points.iter().zip(&gauge.weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect(),
            one_minus_cos: series(rule.terms, 2).into_iter().map(T::of).collect(),
            x_minus_sin: series(rule.terms, 3).into_iter().map(T::of).collect(),
            law: chart.map(Law::new),
        }
    }

    /// Number of nodes; a constant only where unrolling pays, with few nodes and all effects off.
    #[inline(always)]
    pub fn nodes<const PLAIN: bool>(&self) -> usize {
        if PLAIN { N } else { self.count.min(N) }
    }

    /// Error of the chart of the section law, if it is not Hooke's.
    pub fn chart_error(&self) -> Option<f64> {
        self.law.as_ref().map(|law| law.error)
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

    /// (e₀ − t, χ, load) of the section law at the Hookean strains t and b; above a load of 1 the chart does not tell.
    #[inline(always)]
    pub fn section<const L: usize, const FMA: bool>(
        &self,
        t: Pack<T, L, FMA>,
        b: Pack<T, L, FMA>,
    ) -> [Pack<T, L, FMA>; 3] {
        let of = Pack::<T, L, FMA>::of;
        let Some(law) = &self.law else { return [of(0.0); 3] };
        let most = t.mul_add(Pack::splat(law.bending[1]), Pack::splat(law.bending[0]));
        let b2 = b * b;
        let beta = b2 / (most * most);
        let x = t * Pack::splat(law.scale);
        let load = if law.covers { x.abs() } else { beta.max(x.abs()) };
        let (x, y) = (x.max(of(-1.0)).min(of(1.0)), beta.min(of(1.0)).mul_add(of(2.0), of(-1.0)));
        let (extra, chi) = (plane(&law.p, x, y), plane(&law.q, x, y));
        [t * t * polynomial(&law.r, x) + b2 * extra, t * polynomial(&law.c, x) + b2 * chi, load]
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
    let Some((&last, others)) = c.split_last() else { return Pack::of(0.0) };
    let mut sum = Pack::splat(last);
    for &next in others.iter().rev() {
        sum = sum.mul_add(z, Pack::splat(next));
    }
    sum
}

/// Σ c_jk x^k y^j. Loops only: a closure that the compiler leaves alone has neither the vectors nor the fused operations of its caller.
#[inline(always)]
fn plane<T: Scalar, const L: usize, const FMA: bool>(
    c: &[Vec<T>],
    x: Pack<T, L, FMA>,
    y: Pack<T, L, FMA>,
) -> Pack<T, L, FMA> {
    let mut sum = Pack::of(0.0);
    for row in c.iter().rev() {
        sum = sum.mul_add(y, polynomial(row, x));
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
