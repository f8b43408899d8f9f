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

/// Whether packs are whole vectors of `bits` of f32, or of f64, by `by`.
#[cfg(target_arch = "x86_64")]
const fn whole<T, const L: usize>((set, by): (u8, u8), bytes: usize, bits: usize) -> bool {
    set == by && size_of::<T>() == bytes && (8 * bytes * L).is_multiple_of(bits)
}

/// The operation of vectors, where the packs are some: of f32 and of f64, of 512 and of 256 bits.
macro_rules! vectors {
    ($($pack:expr),+ => $f32x16:ident $f64x8:ident $f32x8:ident $f64x4:ident) => {
        vectors!(WIDE, 4, 512, __m512, $($pack),+ => $f32x16);
        vectors!(WIDE, 8, 512, __m512d, $($pack),+ => $f64x8);
        vectors!(FUSED, 4, 256, __m256, $($pack),+ => $f32x8);
        vectors!(FUSED, 8, 256, __m256d, $($pack),+ => $f64x4);
    };
    ($by:ident, $bytes:literal, $bits:literal, $vector:ty, $($pack:expr),+ => $operation:ident) => {
        #[cfg(target_arch = "x86_64")]
        if whole::<T, L>((SET, $by), $bytes, $bits) {
            let mut all = Self([T::of(0.0); L]);
            for k in 0..8 * $bytes * L / $bits {
                // SAFETY: such packs are only made where the CPU has the instructions, and these are as many numbers, aligned as their pack.
                unsafe { all.put_vector::<$vector>(k, $operation($($pack.vector::<$vector>(k)),+)) };
            }
            return all;
        }
    };
}

#[cfg(target_arch = "x86_64")]
impl<T: Scalar, const L: usize, const SET: u8> Pack<T, L, SET> {
    /// Vector `k` of those that it is.
    #[inline(always)]
    unsafe fn vector<V>(&self, k: usize) -> V {
        unsafe { (&raw const self.0).cast::<V>().add(k).read() }
    }

    #[inline(always)]
    unsafe fn put_vector<V>(&mut self, k: usize, vector: V) {
        unsafe { (&raw mut self.0).cast::<V>().add(k).write(vector) };
    }
}

/// `yes` where a < b, else `no`, and whether a ≤ b everywhere.
#[cfg(target_arch = "x86_64")]
mod compare {
    use super::*;

    macro_rules! wide {
        ($v:ty, $less:ident, $most:ident, $mask:ident, $blend:ident, $all:expr) => {
            #[inline(always)]
            pub unsafe fn $less(a: $v, b: $v, yes: $v, no: $v) -> $v {
                unsafe { $blend($mask::<_CMP_LT_OQ>(a, b), no, yes) }
            }

            #[inline(always)]
            pub unsafe fn $most(a: $v, b: $v) -> bool {
                unsafe { $mask::<_CMP_LE_OQ>(a, b) == $all }
            }
        };
    }
    wide!(__m512, less_f32x16, most_f32x16, _mm512_cmp_ps_mask, _mm512_mask_blend_ps, u16::MAX);
    wide!(__m512d, less_f64x8, most_f64x8, _mm512_cmp_pd_mask, _mm512_mask_blend_pd, u8::MAX);

    macro_rules! fused {
        ($v:ty, $less:ident, $most:ident, $compare:ident, $blend:ident, $bits:ident, $all:expr) => {
            #[inline(always)]
            pub unsafe fn $less(a: $v, b: $v, yes: $v, no: $v) -> $v {
                unsafe { $blend(no, yes, $compare::<_CMP_LT_OQ>(a, b)) }
            }

            #[inline(always)]
            pub unsafe fn $most(a: $v, b: $v) -> bool {
                unsafe { $bits($compare::<_CMP_LE_OQ>(a, b)) == $all }
            }
        };
    }
    fused!(__m256, less_f32x8, most_f32x8, _mm256_cmp_ps, _mm256_blendv_ps, _mm256_movemask_ps, 0xff);
    fused!(__m256d, less_f64x4, most_f64x4, _mm256_cmp_pd, _mm256_blendv_pd, _mm256_movemask_pd, 0xf);
}
#[cfg(target_arch = "x86_64")]
use compare::*;

/// Whether it holds of all vectors of two packs, where they are some.
macro_rules! all_vectors {
    ($a:expr, $b:expr => $($by:ident $bytes:literal $bits:literal $vector:ty, $holds:ident;)+) => {$(
        #[cfg(target_arch = "x86_64")]
        if whole::<T, L>((SET, $by), $bytes, $bits) {
            let mut all = true;
            for k in 0..8 * $bytes * L / $bits {
                // SAFETY: as above.
                all &= unsafe { $holds($a.vector::<$vector>(k), $b.vector::<$vector>(k)) };
            }
            return all;
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
        vectors!(self, b, c => _mm512_fmadd_ps _mm512_fmadd_pd _mm256_fmadd_ps _mm256_fmadd_pd);
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
        vectors!(self => _mm512_sqrt_ps _mm512_sqrt_pd _mm256_sqrt_ps _mm256_sqrt_pd);
        let mut r = self.0;
        for x in &mut r {
            *x = x.sqrt();
        }
        Self(r)
    }

    /// Larger of both; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        vectors!(self, o => _mm512_max_ps _mm512_max_pd _mm256_max_ps _mm256_max_pd);
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    /// Smaller of both; the second where the first is NaN.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        vectors!(self, o => _mm512_min_ps _mm512_min_pd _mm256_min_ps _mm256_min_pd);
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
        vectors!(self, o, yes, no => less_f32x16 less_f64x8 less_f32x8 less_f64x4);
        let mut r = no.0;
        for i in 0..L {
            r[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        Self(r)
    }

    /// Whether self ≤ `o` in every lane; false where either is NaN.
    #[inline(always)]
    pub fn all_at_most(self, o: Self) -> bool {
        all_vectors!(self, o =>
            WIDE 4 512 __m512, most_f32x16;
            WIDE 8 512 __m512d, most_f64x8;
            FUSED 4 256 __m256, most_f32x8;
            FUSED 8 256 __m256d, most_f64x4;
        );
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
operator!(Add, add, _mm512_add_ps _mm512_add_pd _mm256_add_ps _mm256_add_pd);
operator!(Sub, sub, _mm512_sub_ps _mm512_sub_pd _mm256_sub_ps _mm256_sub_pd);
operator!(Mul, mul, _mm512_mul_ps _mm512_mul_pd _mm256_mul_ps _mm256_mul_pd);
operator!(Div, div, _mm512_div_ps _mm512_div_pd _mm256_div_ps _mm256_div_pd);

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
