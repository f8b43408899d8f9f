//! Real numbers of the exact physics: f64, or f64 with derivatives (forward mode).

use std::array::from_fn;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec2;

use super::number::Number;

macro_rules! functions {
    ($($(#[$attribute:meta])+ $name:ident: |$x:ident, $y:ident| $slope:expr;)+) => {$(
        $(#[$attribute])+
        fn $name(self) -> Self {
            let $x = self.value();
            let $y = $x.$name();
            self.chain($y, || $slope)
        }
    )+};
}

/// A real number, f64 or dual; functions of it have the value that f64 gives.
pub trait Real:
    Number
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + PartialEq
    + Debug
    + Send
    + Sync
{
    /// True for numbers without derivatives.
    const BARE: bool;

    /// The number without derivatives.
    fn value(self) -> f64;

    /// A function of this number with the value `value` and the derivative `slope()`.
    fn chain(self, value: f64, slope: impl FnOnce() -> f64) -> Self;

    /// sin and cos.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value().sin_cos();
        (self.chain(sin, || cos), self.chain(cos, || -sin))
    }

    functions! {
        /// Sine.
        #[inline(always)]
        sin: |x, _y| x.cos();
        /// Absolute value.
        #[inline(always)]
        abs: |x, _y| x.signum();
        /// eˣ.
        exp: |_x, y| y;
        /// Natural logarithm.
        ln: |x, _y| 1.0 / x;
        /// Logarithm to base 10.
        log10: |x, _y| std::f64::consts::LOG10_E / x;
        /// ln(1 + x).
        ln_1p: |x, _y| 1.0 / (1.0 + x);
        /// eˣ − 1.
        exp_m1: |x, _y| x.exp();
        /// Arctangent.
        atan: |x, _y| 1.0 / (1.0 + x * x);
        /// Tangent.
        tan: |_x, y| 1.0 + y * y;
        /// Arcsine.
        asin: |x, _y| 1.0 / (1.0 - x * x).sqrt();
        /// Cube root.
        cbrt: |_x, y| 1.0 / (3.0 * y * y);
    }

    /// An integer power.
    #[inline(always)]
    fn powi(self, n: i32) -> Self {
        let x = self.value();
        self.chain(x.powi(n), || f64::from(n) * x.powi(n - 1))
    }

    /// Any power of a positive number.
    fn powf(self, n: Self) -> Self {
        let (x, e) = (self.value(), n.value());
        let value = x.powf(e);
        if Self::BARE {
            return self.chain(value, || 0.0);
        }
        let over = if x > 0.0 { value * x.ln() } else { 0.0 };
        self.chain(value, || e * x.powf(e - 1.0)) + n.chain(0.0, || over)
    }

    /// The larger of both.
    fn max(self, o: Self) -> Self {
        if self.value() > o.value() || o.value().is_nan() { self } else { o }
    }

    /// The smaller of both.
    fn min(self, o: Self) -> Self {
        if self.value() < o.value() || o.value().is_nan() { self } else { o }
    }
}

impl Real for f64 {
    const BARE: bool = true;

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn chain(self, value: f64, _: impl FnOnce() -> f64) -> Self {
        value
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
    /// The variable of derivative `k`; its value changes by `unit` where the variable changes by 1.
    pub fn seed(value: f64, k: usize, unit: f64) -> Self {
        Self { value, slope: from_fn(|i| if i == k { unit } else { 0.0 }) }
    }

    #[inline(always)]
    fn of_two(self, o: Self, value: f64, [p, q]: [f64; 2]) -> Self {
        let mut slope = self.slope;
        for (s, o) in slope.iter_mut().zip(&o.slope) {
            *s = p * *s + q * o;
        }
        Self { value, slope }
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, |$a:ident, $b:ident| $value:expr, [$p:expr, $q:expr]) => {
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let ($a, $b) = (self.value, o.value);
                let _ = ($a, $b);
                self.of_two(o, $value, [$p, $q])
            }
        }
        impl<const N: usize> $trait<f64> for Dual<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: f64) -> Self {
                let ($a, $b) = (self.value, o);
                let _ = ($a, $b);
                self.chain($value, || $p)
            }
        }
    };
}
operator!(Add, add, |a, b| a + b, [1.0, 1.0]);
operator!(Sub, sub, |a, b| a - b, [1.0, -1.0]);
operator!(Mul, mul, |a, b| a * b, [b, a]);
operator!(Div, div, |a, b| a / b, [1.0 / b, -(a / b) * (1.0 / b)]);

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, || -1.0)
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let y = self.value.sqrt();
        self.chain(y, || 0.5 / y)
    }
    #[inline(always)]
    fn hypot(self, o: Self) -> Self {
        let y = self.value.hypot(o.value);
        self.of_two(o, y, [self.value / y, o.value / y])
    }
    #[inline(always)]
    fn atan2(self, o: Self) -> Self {
        let square = self.value * self.value + o.value * o.value;
        self.of_two(o, self.value.atan2(o.value), [o.value / square, -self.value / square])
    }
    #[inline(always)]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        if self.value < o.value { yes } else { no }
    }
    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        self.value <= o.value
    }
}

impl<const N: usize> Real for Dual<N> {
    const BARE: bool = false;

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn chain(self, value: f64, slope: impl FnOnce() -> f64) -> Self {
        let (by, mut slope) = (slope(), self.slope);
        for s in &mut slope {
            *s *= by;
        }
        Self { value, slope }
    }
}

/// A vector of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector<T = f64> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
}

impl<T: Real> Vector<T> {
    /// (x, y).
    #[inline(always)]
    pub fn new(x: T, y: T) -> Self {
        Self { x, y }
    }

    /// (x, y) without derivatives.
    pub fn of(x: f64, y: f64) -> Self {
        Self { x: T::of(x), y: T::of(y) }
    }

    /// `f` of each component.
    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Vector<U> {
        Vector { x: f(self.x), y: f(self.y) }
    }

    /// The unit vector at this angle, rad, from x.
    #[inline(always)]
    pub fn from_angle(angle: T) -> Self {
        let (y, x) = angle.sin_cos();
        Self { x, y }
    }

    /// `v` turned by the angle of this unit vector.
    #[inline(always)]
    pub fn rotate(self, v: Self) -> Self {
        Self { x: self.x * v.x - self.y * v.y, y: self.y * v.x + self.x * v.y }
    }

    /// Turned by 90°.
    #[inline(always)]
    pub fn perp(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, v: Self) -> T {
        self.x * v.x + self.y * v.y
    }

    /// Cross product.
    #[inline(always)]
    pub fn perp_dot(self, v: Self) -> T {
        self.x * v.y - self.y * v.x
    }

    /// The vector scaled to length 1.
    pub fn normalize(self) -> Self {
        self * (T::of(1.0) / self.dot(self).sqrt())
    }
}

impl<T: Real> Add for Vector<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y }
    }
}

impl<T: Real> Sub for Vector<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y }
    }
}

impl<T: Real> Mul<T> for Vector<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: T) -> Self {
        Self { x: self.x * o, y: self.y * o }
    }
}

impl From<Vector> for DVec2 {
    fn from(v: Vector) -> Self {
        Self::new(v.x, v.y)
    }
}
