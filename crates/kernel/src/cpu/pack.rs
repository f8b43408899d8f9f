//! Lanes: `L` numbers that go through the same arithmetic, written so that the compiler vectorises them for whichever
//! instruction set the calling function enables.

use std::ops::{Add, Div, Mul, Neg, Sub};

use vibrissa_core::physics::number::Number;

/// f32 or f64.
pub trait Scalar: Copy + PartialOrd + Send + Sync + 'static {
    /// Largest relative error of one rounding.
    const ROUNDING: f64;
    /// Rounded from f64.
    fn of(x: f64) -> Self;
    /// Widened.
    fn get(self) -> f64;
    /// + − × ÷, root, fused a b + c.
    fn add(self, o: Self) -> Self;
    /// Difference.
    fn sub(self, o: Self) -> Self;
    /// Product.
    fn mul(self, o: Self) -> Self;
    /// Quotient.
    fn div(self, o: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// a b + c, rounded once.
    fn fma(self, b: Self, c: Self) -> Self;
}

macro_rules! scalar {
    ($t:ty) => {
        impl Scalar for $t {
            const ROUNDING: f64 = 0.5 * <$t>::EPSILON as f64;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn get(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                self + o
            }
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                self - o
            }
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                self * o
            }
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                self / o
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                self.mul_add(b, c)
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

/// `L` lanes of `T`. `FMA` says that the target has fused multiply–add; without it a fused operation would be a
/// library call per lane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Pack<T, const L: usize, const FMA: bool>(pub [T; L]);

impl<T: Scalar, const L: usize, const FMA: bool> Default for Pack<T, L, FMA> {
    fn default() -> Self {
        Self::of(0.0)
    }
}

impl<T: Scalar, const L: usize, const FMA: bool> Pack<T, L, FMA> {
    /// The same number in every lane.
    #[inline(always)]
    pub fn of(x: f64) -> Self {
        Self([T::of(x); L])
    }

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    fn map2(self, o: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut r = self.0;
        for i in 0..L {
            r[i] = f(self.0[i], o.0[i]);
        }
        Self(r)
    }

    /// self · b + c.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        let mut r = self.0;
        for i in 0..L {
            r[i] = if FMA { self.0[i].fma(b.0[i], c.0[i]) } else { self.0[i].mul(b.0[i]).add(c.0[i]) };
        }
        Self(r)
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        let mut r = self.0;
        for x in &mut r {
            *x = x.sqrt();
        }
        Self(r)
    }

    /// Larger of both; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    /// Smaller of both; the second where the first is NaN.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        self.map2(o, |a, b| if a < b { a } else { b })
    }

    /// Absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.max(-self)
    }

    /// Per lane `yes` where self < `o`, else `no`.
    #[inline(always)]
    pub fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        let mut r = no.0;
        for i in 0..L {
            r[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        Self(r)
    }

    /// Whether self ≤ `o` in every lane; false where either is NaN.
    #[inline(always)]
    pub fn all_at_most(self, o: Self) -> bool {
        let mut all = true;
        for i in 0..L {
            all &= self.0[i] <= o.0[i];
        }
        all
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<T: Scalar, const L: usize, const FMA: bool> $trait for Pack<T, L, FMA> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                self.map2(o, T::$name)
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<T: Scalar, const L: usize, const FMA: bool> Neg for Pack<T, L, FMA> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::of(0.0) - self
    }
}

/// Closed forms of several taps: no operation is fused.
impl<const L: usize> Number for Pack<f64, L, false> {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::of(x)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn hypot(self, o: Self) -> Self {
        self.map2(o, f64::hypot)
    }
    #[inline(always)]
    fn atan2(self, o: Self) -> Self {
        self.map2(o, f64::atan2)
    }
    #[inline(always)]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        self.if_less(o, yes, no)
    }
    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        self.all_at_most(o)
    }
}
