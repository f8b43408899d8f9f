//! Real numbers of the exact physics: f64, or f64 with derivatives (forward mode).

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::number::Number;

/// A real number, f64 or dual; functions of it have the value that f64 gives.
pub trait Real: Number + PartialEq + Debug + Send + Sync {
    /// The number without derivatives.
    fn value(self) -> f64;
    /// sin and cos.
    fn sin_cos(self) -> (Self, Self);
    /// eˣ.
    fn exp(self) -> Self;
    /// Any power of a positive number.
    fn powf(self, n: Self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        Self::sin_cos(self)
    }
    fn exp(self) -> Self {
        Self::exp(self)
    }
    #[inline(always)]
    fn powf(self, n: Self) -> Self {
        Self::powf(self, n)
    }
}

/// A number and its derivatives by `N` others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub value: f64,
    /// The derivatives.
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A function of this number with the value `value` and the derivative `by`.
    #[inline]
    fn chain(self, value: f64, by: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * by) }
    }

    #[inline]
    fn of_two(self, o: Self, value: f64, [p, q]: [f64; 2]) -> Self {
        let mut slope = self.slope;
        for (s, o) in slope.iter_mut().zip(&o.slope) {
            *s = p * *s + q * o;
        }
        Self { value, slope }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self::of(0.0)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, |$a:ident, $b:ident| $value:expr, [$p:expr, $q:expr]) => {
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            #[inline]
            fn $name(self, o: Self) -> Self {
                let ($a, $b) = (self.value, o.value);
                let _ = ($a, $b);
                self.of_two(o, $value, [$p, $q])
            }
        }
    };
}
operator!(Add, add, |a, b| a + b, [1.0, 1.0]);
operator!(Sub, sub, |a, b| a - b, [1.0, -1.0]);
operator!(Mul, mul, |a, b| a * b, [b, a]);
operator!(Div, div, |a, b| a / b, [1.0 / b, -(a / b) * (1.0 / b)]);

impl<const N: usize> Number for Dual<N> {
    #[inline]
    fn of(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
    #[inline]
    fn sqrt(self) -> Self {
        let y = self.value.sqrt();
        self.chain(y, 0.5 / y)
    }
}

impl<const N: usize> Real for Dual<N> {
    #[inline]
    fn value(self) -> f64 {
        self.value
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    fn exp(self) -> Self {
        let y = self.value.exp();
        self.chain(y, y)
    }
    fn powf(self, n: Self) -> Self {
        let (x, e) = (self.value, n.value);
        let value = x.powf(e);
        let over = if x > 0.0 { value * x.ln() } else { 0.0 };
        self.of_two(n, value, [e * x.powf(e - 1.0), over])
    }
}
