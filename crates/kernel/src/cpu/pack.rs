//! Lanes: `L` numbers that go through the same arithmetic, written so that the compiler vectorises them for whichever
//! instruction set the calling function enables.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;
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

/// Instruction sets of packs, their parameter `SET`: none in particular.
pub const UNFUSED: u8 = 0;
/// With fused multiply–add; without it a fused operation would be a library call per lane.
pub const FUSED: u8 = 1;
/// With fused multiply–add and AVX-512: sixteen f32 are one vector. The compiler, left alone, makes of some sums of packs vectors of two.
pub const WIDE: u8 = 2;

/// `L` lanes of `T`, by the instructions of `SET`, which the calling function must enable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Pack<T, const L: usize, const SET: u8>(pub [T; L]);

/// Whether packs are one vector of 512 bits.
#[cfg(target_arch = "x86_64")]
const fn whole<T, const L: usize>(set: u8) -> bool {
    set == WIDE && L == 16 && size_of::<T>() == 4
}

/// The operation of one vector, where the packs are.
macro_rules! vectors {
    ($($pack:expr),+ => $operation:ident) => {
        #[cfg(target_arch = "x86_64")]
        if whole::<T, L>(SET) {
            // SAFETY: WIDE packs are only made where the CPU has AVX-512, and these are sixteen f32, aligned as their pack.
            return unsafe { Self::of_vector($operation($(Self::vector(&$pack)),+)) };
        }
    };
}

#[cfg(target_arch = "x86_64")]
impl<T: Scalar, const L: usize, const SET: u8> Pack<T, L, SET> {
    /// As a vector, which it is.
    #[inline(always)]
    unsafe fn vector(&self) -> __m512 {
        unsafe { (&raw const self.0).cast::<__m512>().read() }
    }

    #[inline(always)]
    unsafe fn of_vector(vector: __m512) -> Self {
        let mut pack = Self([T::of(0.0); L]);
        unsafe { (&raw mut pack.0).cast::<__m512>().write(vector) };
        pack
    }
}

impl<T: Scalar, const L: usize, const SET: u8> Default for Pack<T, L, SET> {
    fn default() -> Self {
        Self::of(0.0)
    }
}

impl<T: Scalar, const L: usize, const SET: u8> Pack<T, L, SET> {
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
        vectors!(self, b, c => _mm512_fmadd_ps);
        let mut r = self.0;
        for i in 0..L {
            r[i] = if SET != UNFUSED {
                self.0[i].fma(b.0[i], c.0[i])
            } else {
                self.0[i].mul(b.0[i]).add(c.0[i])
            };
        }
        Self(r)
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        vectors!(self => _mm512_sqrt_ps);
        let mut r = self.0;
        for x in &mut r {
            *x = x.sqrt();
        }
        Self(r)
    }

    /// Larger of both; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        vectors!(self, o => _mm512_max_ps);
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    /// Smaller of both; the second where the first is NaN.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        vectors!(self, o => _mm512_min_ps);
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
        #[cfg(target_arch = "x86_64")]
        if whole::<T, L>(SET) {
            // SAFETY: as above.
            return unsafe {
                let less = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.vector(), o.vector());
                Self::of_vector(_mm512_mask_blend_ps(less, no.vector(), yes.vector()))
            };
        }
        let mut r = no.0;
        for i in 0..L {
            r[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        Self(r)
    }

    /// Whether self ≤ `o` in every lane; false where either is NaN.
    #[inline(always)]
    pub fn all_at_most(self, o: Self) -> bool {
        #[cfg(target_arch = "x86_64")]
        if whole::<T, L>(SET) {
            // SAFETY: as above.
            return unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.vector(), o.vector()) == u16::MAX };
        }
        let mut all = true;
        for i in 0..L {
            all &= self.0[i] <= o.0[i];
        }
        all
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $vectors:ident) => {
        impl<T: Scalar, const L: usize, const SET: u8> $trait for Pack<T, L, SET> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                vectors!(self, o => $vectors);
                self.map2(o, T::$name)
            }
        }
    };
}
operator!(Add, add, _mm512_add_ps);
operator!(Sub, sub, _mm512_sub_ps);
operator!(Mul, mul, _mm512_mul_ps);
operator!(Div, div, _mm512_div_ps);

impl<T: Scalar, const L: usize, const SET: u8> Neg for Pack<T, L, SET> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::of(0.0) - self
    }
}

/// Closed forms of several taps: no operation is fused.
impl<const L: usize> Number for Pack<f64, L, UNFUSED> {
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
