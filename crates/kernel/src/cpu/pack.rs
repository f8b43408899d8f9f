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
/// The same, where [`VECTORS`] f32 are vectors of AVX2. The compiler, left alone, makes of some sums of packs vectors of two.
pub const AVX2: u8 = 2;
/// The same of AVX-512.
pub const AVX512: u8 = 3;

/// f32 of a pack that is made of vectors.
pub const VECTORS: usize = 32;

/// `L` lanes of `T`, by the instructions of `SET`, which the calling function must enable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Pack<T, const L: usize, const SET: u8>(pub [T; L]);

/// Whether packs are vectors of the set `by`.
#[cfg(target_arch = "x86_64")]
const fn are_vectors<T, const L: usize>(set: u8, by: u8) -> bool {
    set == by && L == VECTORS && size_of::<T>() == 4
}

/// A pack and the vectors that it is. A union has no checks, which would cost a debug build minutes.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
union Same<P: Copy, V: Copy> {
    pack: P,
    vectors: V,
}

/// The first of some expressions.
macro_rules! first {
    ($first:expr $(, $rest:expr)*) => {
        $first
    };
}

/// The operation of vectors, where the packs are some.
macro_rules! vectors {
    ($($pack:expr),+ => $avx512:ident $avx2:ident) => {
        vectors!(AVX512, [__m512; 2], $($pack),+ => $avx512);
        vectors!(AVX2, [__m256; 4], $($pack),+ => $avx2);
    };
    ($by:ident, $vectors:ty, $($pack:expr),+ => $operation:ident) => {
        #[cfg(target_arch = "x86_64")]
        if const { are_vectors::<T, L>(SET, $by) } {
            // SAFETY: such packs are only made where the CPU has the instructions, and these are as many f32.
            unsafe {
                let mut all: $vectors = Same { pack: first!($($pack),+) }.vectors;
                for k in 0..all.len() {
                    all[k] = $operation($(Same::<Self, $vectors> { pack: $pack }.vectors[k]),+);
                }
                return Same { vectors: all }.pack;
            }
        }
    };
}

/// `yes` where a < b, else `no`, and whether a ≤ b everywhere.
#[cfg(target_arch = "x86_64")]
mod compare {
    use super::*;

    #[inline(always)]
    pub unsafe fn less_avx512(a: __m512, b: __m512, yes: __m512, no: __m512) -> __m512 {
        unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b), no, yes) }
    }

    #[inline(always)]
    pub unsafe fn less_avx2(a: __m256, b: __m256, yes: __m256, no: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    pub unsafe fn at_most_avx512(a: __m512, b: __m512) -> bool {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) == u16::MAX }
    }

    #[inline(always)]
    pub unsafe fn at_most_avx2(a: __m256, b: __m256) -> bool {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) == 0xff }
    }
}
#[cfg(target_arch = "x86_64")]
use compare::*;

/// Whether it holds of all vectors of two packs, where they are some.
macro_rules! all_vectors {
    ($a:expr, $b:expr => $($by:ident $vectors:ty, $holds:ident;)+) => {$(
        #[cfg(target_arch = "x86_64")]
        if const { are_vectors::<T, L>(SET, $by) } {
            // SAFETY: as above.
            unsafe {
                let (a, b): ($vectors, $vectors) = (Same { pack: $a }.vectors, Same { pack: $b }.vectors);
                let mut all = true;
                for k in 0..a.len() {
                    all &= $holds(a[k], b[k]);
                }
                return all;
            }
        }
    )+};
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
        vectors!(self, b, c => _mm512_fmadd_ps _mm256_fmadd_ps);
        let mut r = self.0;
        for i in 0..L {
            r[i] = if const { SET != UNFUSED } {
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
        vectors!(self => _mm512_sqrt_ps _mm256_sqrt_ps);
        let mut r = self.0;
        for x in &mut r {
            *x = x.sqrt();
        }
        Self(r)
    }

    /// Larger of both; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        vectors!(self, o => _mm512_max_ps _mm256_max_ps);
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    /// Smaller of both; the second where the first is NaN.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        vectors!(self, o => _mm512_min_ps _mm256_min_ps);
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
        vectors!(self, o, yes, no => less_avx512 less_avx2);
        let mut r = no.0;
        for i in 0..L {
            r[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        Self(r)
    }

    /// Whether self ≤ `o` in every lane; false where either is NaN.
    #[inline(always)]
    pub fn all_at_most(self, o: Self) -> bool {
        all_vectors!(self, o => AVX512 [__m512; 2], at_most_avx512; AVX2 [__m256; 4], at_most_avx2;);
        let mut all = true;
        for i in 0..L {
            all &= self.0[i] <= o.0[i];
        }
        all
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $($vectors:ident)+) => {
        impl<T: Scalar, const L: usize, const SET: u8> $trait for Pack<T, L, SET> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                vectors!(self, o => $($vectors)+);
                self.map2(o, T::$name)
            }
        }
    };
}
operator!(Add, add, _mm512_add_ps _mm256_add_ps);
operator!(Sub, sub, _mm512_sub_ps _mm256_sub_ps);
operator!(Mul, mul, _mm512_mul_ps _mm256_mul_ps);
operator!(Div, div, _mm512_div_ps _mm256_div_ps);

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
