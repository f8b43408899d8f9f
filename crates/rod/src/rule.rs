//! Gauss's nodes on a panel, from its end at the contact (w = 0) to that at the base (w = 1), and the series of small turns.

use vibrissa_core::physics::nodes::Nodes;
pub use vibrissa_kernel::cpu::dot;
use vibrissa_kernel::cpu::pack::{Packed, Scalar};
use vibrissa_kernel::cpu::series;

use super::lane::Lane;

/// Tables of up to N nodes.
#[derive(Debug, Clone)]
pub struct Rule<T, const N: usize> {
    /// Number of nodes.
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
    /// The rule of `count` nodes.
    pub fn new(count: usize) -> Self {
        let nodes = Nodes::of(count);
        let zero = T::of(0.0);
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| v.get(i).map_or(zero, |x| T::of(*x))) };
        let rows = |m: &[Vec<f64>]| -> [[T; N]; N] {
            std::array::from_fn(|i| m.get(i).map_or([zero; N], |v| row(v)))
        };
        Self {
            count,
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: rows(&nodes.integral),
            legendre: rows(&nodes.legendre),
        }
    }

    /// Number of nodes.
    #[inline(always)]
    pub fn nodes(&self) -> usize {
        self.count.min(N)
    }
}

/// [`dot`] of both components of vectors.
#[inline(always)]
pub fn dots<P: Packed, const N: usize>(n: usize, row: &[P::Scalar; N], y: &[[P; N]; 2]) -> [P; 2] {
    [dot(n, row, &y[0]), dot(n, row, &y[1])]
}

/// Σ c_k P_k(2w − 1) of `n` coefficients, and its integral from 0 to w.
#[inline(always)]
pub fn at<P: Packed, const N: usize>(n: usize, c: &[P; N], w: P) -> [P; 2] {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let (mut value, mut integral) = (c[0], c[0] * w);
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        value = value + c[k] * now;
        integral = integral + c[k] * (next - before) * of(0.5 / (2.0 * kf + 1.0));
        (before, now) = (now, next);
    }
    [value, integral]
}

/// Series of 1 − cos x and x − sin x.
#[derive(Debug, Clone)]
pub struct Turns<T> {
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
}

impl<T: Scalar> Turns<T> {
    /// Both series with `terms` terms each.
    pub fn new(terms: usize) -> Self {
        let of = |first| series(terms, first).into_iter().map(T::of).collect();
        Self { one_minus_cos: of(2), x_minus_sin: of(3) }
    }

    /// 1 − cos x and x − sin x.
    #[inline(always)]
    pub fn of<P: Lane<Scalar = T>>(&self, x: P) -> [P; 2] {
        P::turn(&self.one_minus_cos, &self.x_minus_sin, x)
    }

    /// 1 − cos x and sin x.
    #[inline(always)]
    pub fn rotation<P: Lane<Scalar = T>>(&self, x: P) -> [P; 2] {
        let [versine, over] = self.of(x);
        [versine, x - over]
    }
}
