//! Lanes: `L` numbers that go through the same arithmetic, as vectors of an instruction set that the calling function enables; where packs are of no
//! such size, as numbers that the compiler makes vectors of.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m128, __m256, __m256d, __m512};
use std::ops::{Add, Div, Mul, Neg, Sub};

use vibrissa_core::physics::number::Number;

mod sealed {
    /// Packs that are vectors tell f32 and f64 by their size: no other type is a [`super::Scalar`].
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// f32 or f64.
pub trait Scalar: sealed::Sealed + Copy + PartialOrd + Send + Sync + 'static {
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

/// Instruction sets of packs, their parameter `SET`: what every CPU has. On a PC packs of [`VECTORS`] f32 are vectors of SSE2.
pub const UNFUSED: u8 = 0;
/// With fused multiply–add; without it a fused operation would be a library call per lane.
pub const FUSED: u8 = 1;
/// The same, where packs of [`VECTORS`] or 16 f32, or of 8 f64, are vectors of AVX2: left alone, the compiler makes of some sums of packs vectors of two.
pub const AVX2: u8 = 2;
/// The same, where packs of [`VECTORS`] f32 are vectors of AVX-512.
pub const AVX512: u8 = 3;

/// f32 of the widest packs that are made of vectors.
pub const VECTORS: usize = 32;

/// `L` lanes of `T`, by the instructions of `SET`, which the calling function must enable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Pack<T, const L: usize, const SET: u8>(pub [T; L]);

/// A pack and the vectors that it is. A union has no checks, which would cost a debug build minutes.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
union Same<P: Copy, V: Copy> {
    pack: P,
    vectors: V,
}

/// Operations of the vectors of a set, under the same names.
#[cfg(target_arch = "x86_64")]
mod of_512 {
    use std::arch::x86_64::{__m512, _CMP_LE_OQ, _CMP_LT_OQ, _mm512_cmp_ps_mask, _mm512_mask_blend_ps};
    pub use std::arch::x86_64::{
        _mm512_add_ps as add, _mm512_div_ps as div, _mm512_fmadd_ps as mul_add, _mm512_max_ps as max,
        _mm512_min_ps as min, _mm512_mul_ps as mul, _mm512_set1_ps as set, _mm512_sqrt_ps as sqrt,
        _mm512_sub_ps as sub,
    };

    /// `yes` where a < b, else `no`.
    #[inline(always)]
    pub unsafe fn if_less(a: __m512, b: __m512, yes: __m512, no: __m512) -> __m512 {
        unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b), no, yes) }
    }

    /// Whether a ≤ b everywhere.
    #[inline(always)]
    pub unsafe fn all_at_most(a: __m512, b: __m512) -> bool {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) == u16::MAX }
    }
}

#[cfg(target_arch = "x86_64")]
mod of_256 {
    use std::arch::x86_64::{
        __m256, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_blendv_ps, _mm256_cmp_ps, _mm256_movemask_ps,
    };
    pub use std::arch::x86_64::{
        _mm256_add_ps as add, _mm256_div_ps as div, _mm256_fmadd_ps as mul_add, _mm256_max_ps as max,
        _mm256_min_ps as min, _mm256_mul_ps as mul, _mm256_set1_ps as set, _mm256_sqrt_ps as sqrt,
        _mm256_sub_ps as sub,
    };

    #[inline(always)]
    pub unsafe fn if_less(a: __m256, b: __m256, yes: __m256, no: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    pub unsafe fn all_at_most(a: __m256, b: __m256) -> bool {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) == 0xff }
    }
}

#[cfg(target_arch = "x86_64")]
mod of_256_double {
    use std::arch::x86_64::{
        __m256d, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_blendv_pd, _mm256_cmp_pd, _mm256_movemask_pd,
    };
    pub use std::arch::x86_64::{
        _mm256_add_pd as add, _mm256_div_pd as div, _mm256_fmadd_pd as mul_add, _mm256_max_pd as max,
        _mm256_min_pd as min, _mm256_mul_pd as mul, _mm256_set1_pd as set, _mm256_sqrt_pd as sqrt,
        _mm256_sub_pd as sub,
    };

    #[inline(always)]
    pub unsafe fn if_less(a: __m256d, b: __m256d, yes: __m256d, no: __m256d) -> __m256d {
        unsafe { _mm256_blendv_pd(no, yes, _mm256_cmp_pd::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    pub unsafe fn all_at_most(a: __m256d, b: __m256d) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a, b)) == 0xf }
    }
}

#[cfg(target_arch = "x86_64")]
mod of_128 {
    use std::arch::x86_64::{
        __m128, _mm_and_ps, _mm_andnot_ps, _mm_cmple_ps, _mm_cmplt_ps, _mm_movemask_ps, _mm_or_ps,
    };
    pub use std::arch::x86_64::{
        _mm_add_ps as add, _mm_div_ps as div, _mm_max_ps as max, _mm_min_ps as min, _mm_mul_ps as mul,
        _mm_set1_ps as set, _mm_sqrt_ps as sqrt, _mm_sub_ps as sub,
    };

    /// Rounded twice.
    #[inline(always)]
    pub unsafe fn mul_add(a: __m128, b: __m128, c: __m128) -> __m128 {
        unsafe { add(mul(a, b), c) }
    }

    #[inline(always)]
    pub unsafe fn if_less(a: __m128, b: __m128, yes: __m128, no: __m128) -> __m128 {
        unsafe {
            let less = _mm_cmplt_ps(a, b);
            _mm_or_ps(_mm_and_ps(less, yes), _mm_andnot_ps(less, no))
        }
    }

    #[inline(always)]
    pub unsafe fn all_at_most(a: __m128, b: __m128) -> bool {
        unsafe { _mm_movemask_ps(_mm_cmple_ps(a, b)) == 0xf }
    }
}

/// Whether packs of `L` numbers `T` are vectors of the set `by`, in all of `bytes` bytes, of numbers of `size` bytes.
#[cfg(target_arch = "x86_64")]
const fn are<T, const L: usize>(set: u8, by: u8, size: usize, bytes: usize) -> bool {
    set == by && size_of::<T>() == size && L * size == bytes
}

/// Hands what packs are made of to `$each`: a set, the size of a number, the vectors, their operations, and which there are. None of these operations is a
/// loop: LLVM takes minutes for thousands of small loops in one function.
macro_rules! kinds {
    ($each:ident, $($rest:tt)+) => {
        $each!(UNFUSED, 4, [__m128; 8], of_128, [0 1 2 3 4 5 6 7], $($rest)+);
        $each!(AVX512, 4, [__m512; 2], of_512, [0 1], $($rest)+);
        $each!(AVX2, 4, [__m256; 4], of_256, [0 1 2 3], $($rest)+);
        $each!(AVX2, 4, [__m256; 2], of_256, [0 1], $($rest)+);
        $each!(AVX2, 8, [__m256d; 2], of_256_double, [0 1], $($rest)+);
    };
}

/// The same number in all vectors, where packs are some.
macro_rules! same {
    ($by:ident, $size:literal, $vectors:ty, $of:ident, [$($k:literal)+], $x:expr) => {
        #[cfg(target_arch = "x86_64")]
        if const { are::<T, L>(SET, $by, $size, size_of::<$vectors>()) } {
            // SAFETY: such packs are only made where the CPU has the instructions, and these are as many numbers of this type.
            unsafe {
                let x = $of::set(Same::<T, _> { pack: $x }.vectors);
                let all: $vectors = [$({ let _ = $k; x }),+];
                return Same { vectors: all }.pack;
            }
        }
    };
}

/// The operation of vectors, where the packs are some.
macro_rules! vectors {
    ($by:ident, $size:literal, $vectors:ty, $of:ident, $which:tt, $operation:ident $packs:tt) => {
        #[cfg(target_arch = "x86_64")]
        if const { are::<T, L>(SET, $by, $size, size_of::<$vectors>()) } {
            // SAFETY: as above.
            unsafe {
                let all: $vectors = each!($which, $vectors, $of, $operation $packs);
                return Same { vectors: all }.pack;
            }
        }
    };
}

/// Whether it holds of all vectors of two packs, where they are some.
macro_rules! all_vectors {
    ($by:ident, $size:literal, $vectors:ty, $of:ident, $which:tt, $holds:ident $packs:tt) => {
        #[cfg(target_arch = "x86_64")]
        if const { are::<T, L>(SET, $by, $size, size_of::<$vectors>()) } {
            // SAFETY: as above.
            unsafe {
                return each!(all $vectors, $of, $which, $holds $packs);
            }
        }
    };
}

/// What an operation gives of each of some vectors, or whether it is true of all.
#[cfg(target_arch = "x86_64")]
macro_rules! each {
    ([$($k:literal)+], $vectors:ty, $of:ident, $operation:ident $packs:tt) => {
        [$(each!(at $k, $vectors, $of, $operation $packs)),+]
    };
    (all $vectors:ty, $of:ident, [$($k:literal)+], $holds:ident $packs:tt) => {
        true $(& each!(at $k, $vectors, $of, $holds $packs))+
    };
    (at $k:literal, $vectors:ty, $of:ident, $operation:ident ($($pack:expr),+)) => {
        $of::$operation($(Same::<Self, $vectors> { pack: $pack }.vectors[$k]),+)
    };
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
        Self::splat(T::of(x))
    }

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        kinds!(same, x);
        Self([x; L])
    }

    #[inline(always)]
    fn map2(self, o: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut r = self.0;
        if const { L == 1 } {
            r[0] = f(self.0[0], o.0[0]);
            return Self(r);
        }
        for i in 0..L {
            r[i] = f(self.0[i], o.0[i]);
        }
        Self(r)
    }

    /// self · b + c.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        kinds!(vectors, mul_add(self, b, c));
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
        kinds!(vectors, sqrt(self));
        let mut r = self.0;
        for x in &mut r {
            *x = x.sqrt();
        }
        Self(r)
    }

    /// Larger of both; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        kinds!(vectors, max(self, o));
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    /// Smaller of both; the second where the first is NaN.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        kinds!(vectors, min(self, o));
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
        kinds!(vectors, if_less(self, o, yes, no));
        let mut r = no.0;
        for i in 0..L {
            r[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        Self(r)
    }

    /// Whether self ≤ `o` in every lane; false where either is NaN.
    #[inline(always)]
    pub fn all_at_most(self, o: Self) -> bool {
        kinds!(all_vectors, all_at_most(self, o));
        let mut all = true;
        for i in 0..L {
            all &= self.0[i] <= o.0[i];
        }
        all
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<T: Scalar, const L: usize, const SET: u8> $trait for Pack<T, L, SET> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                kinds!(vectors, $name(self, o));
                self.map2(o, T::$name)
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

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
