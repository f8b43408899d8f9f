//! AVX2 vectors of packs, and their operations under the names of pack operations.

pub use std::arch::x86_64::{__m256, __m256d};

use super::pack::AVX2;

/// A pack and its vectors. A union has no checks, which would cost a debug build minutes.
#[derive(Clone, Copy)]
pub union Same<P: Copy, V: Copy> {
    pub pack: P,
    pub vectors: V,
}

/// Operations of vectors of AVX2, under the same names for f32 and f64.
pub mod of_256 {
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

pub mod of_256_double {
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

pub const fn are<T, const L: usize>(set: u8, size: usize, bytes: usize) -> bool {
    set == AVX2 && size_of::<T>() == size && L * size == bytes
}

/// Calls `$each` with the size of a number, the vectors, their operations, and their places. No operation is a loop: LLVM takes minutes for thousands
/// of small loops in one function.
macro_rules! kinds {
    ($each:ident, $($rest:tt)+) => {
        $each!(4, [__m256; 4], of_256, [0 1 2 3], $($rest)+);
        $each!(4, [__m256; 2], of_256, [0 1], $($rest)+);
        $each!(8, [__m256d; 2], of_256_double, [0 1], $($rest)+);
    };
}

macro_rules! same {
    ($size:literal, $vectors:ty, $of:ident, [$($k:literal)+], $x:expr) => {
        if const { are::<T, L>(SET, $size, size_of::<$vectors>()) } {
            // SAFETY: such packs are only made where the CPU has the instructions, and these are as many numbers of this type.
            unsafe {
                let x = $of::set(Same::<T, _> { pack: $x }.vectors);
                let all: $vectors = [$({ let _ = $k; x }),+];
                return Same { vectors: all }.pack;
            }
        }
    };
}

macro_rules! vectors {
    ($size:literal, $vectors:ty, $of:ident, $which:tt, $operation:ident $packs:tt) => {
        if const { are::<T, L>(SET, $size, size_of::<$vectors>()) } {
            // SAFETY: as above.
            unsafe {
                let all: $vectors = each!($which, $vectors, $of, $operation $packs);
                return Same { vectors: all }.pack;
            }
        }
    };
}

macro_rules! all_vectors {
    ($size:literal, $vectors:ty, $of:ident, $which:tt, $holds:ident $packs:tt) => {
        if const { are::<T, L>(SET, $size, size_of::<$vectors>()) } {
            // SAFETY: as above.
            unsafe {
                return each!(all $vectors, $of, $which, $holds $packs);
            }
        }
    };
}

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

pub(super) use {all_vectors, each, kinds, same, vectors};
