//! Gauss's nodes on a panel, from its end at the contact (w = 0) to that at the base (w = 1), and the series of small turns.

use vibrissa_core::physics::nodes::Nodes;
use vibrissa_kernel::cpu::pack::{Packed, Scalar};
use vibrissa_kernel::cpu::{law::polynomial, series};

/// Tables of N nodes.
#[derive(Debug, Clone)]
pub struct Rule<T, const N: usize> {
    /// N, as a number that the compiler does not know: loops over nodes stay loops.
    pub count: usize,
    /// Nodes w.
    pub points: [T; N],
    /// ∫₀¹ y dw = Σ weights y.
    pub weights: [T; N],
    /// Row i: ∫ y dw from 0 to node i.
    pub integral: [[T; N]; N],
    /// Row k: the coefficient of the k-th shifted Legendre polynomial.
    pub legendre: [[T; N]; N],
}

impl<T: Scalar, const N: usize> Rule<T, N> {
    /// The rule of N nodes.
    pub fn new() -> Self {
        let nodes = Nodes::of(N);
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| T::of(v[i])) };
        let rows = |m: &[Vec<f64>]| -> [[T; N]; N] { std::array::from_fn(|i| row(&m[i])) };
        Self {
            count: std::hint::black_box(N),
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: rows(&nodes.integral),
            legendre: rows(&nodes.legendre),
        }
    }
}

/// Σ row y.
#[inline(always)]
pub fn dot<P: Packed, const N: usize>(n: usize, row: &[P::Scalar; N], y: &[P; N]) -> P {
    let mut sum = P::splat(row[0]) * y[0];
    for j in 1..n.min(N) {
        sum = P::splat(row[j]).mul_add(y[j], sum);
    }
    sum
}

/// Series of 1 − cos x and x − sin x.
#[derive(Debug, Clone)]
pub struct Turns<T> {
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
}

impl<T: Scalar> Turns<T> {
    /// Series of so many terms.
    pub fn new(terms: usize) -> Self {
        let of = |first| series(terms, first).into_iter().map(T::of).collect();
        Self { one_minus_cos: of(2), x_minus_sin: of(3) }
    }

    /// 1 − cos x and x − sin x.
    #[inline(always)]
    pub fn of<P: Packed<Scalar = T>>(&self, x: P) -> [P; 2] {
        let z = x * x;
        [z * polynomial(&self.one_minus_cos, z), x * z * polynomial(&self.x_minus_sin, z)]
    }
}
