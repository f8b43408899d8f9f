//! AVX2 vectors of packs, and their operations under the names of pack operations.

pub use std::arch::x86_64::{__m256, __m256d};

use super::pack::Instructions;

/// A pack and its vectors. A union has no checks, which would cost a debug build minutes.
#[derive(Clone, Copy)]
pub union Same<P: Copy, V: Copy> {
    pub pack: P,
    pub vectors: V,
}

/// Operations of vectors of AVX2, under the same names for f32 and f64.
macro_rules! operations {
    ($name:ident, $vector:ident, $all:literal, $compare:ident $blend:ident $mask:ident, $($operation:ident = $short:ident),+) => {
        pub mod $name {
            use std::arch::x86_64::{$vector, _CMP_LE_OQ, _CMP_LT_OQ, $compare, $blend, $mask};
            pub use std::arch::x86_64::{$($operation as $short),+};

            #[inline(always)]
            pub unsafe fn if_less(a: $vector, b: $vector, yes: $vector, no: $vector) -> $vector {
                unsafe { $blend(no, yes, $compare::<_CMP_LT_OQ>(a, b)) }
            }

            #[inline(always)]
            pub unsafe fn all_at_most(a: $vector, b: $vector) -> bool {
                unsafe { $mask($compare::<_CMP_LE_OQ>(a, b)) == $all }
            }
        }
    };
}
operations!(
    of_256, __m256, 0xff, _mm256_cmp_ps _mm256_blendv_ps _mm256_movemask_ps,
    _mm256_add_ps = add, _mm256_div_ps = div, _mm256_fmadd_ps = mul_add, _mm256_max_ps = max, _mm256_min_ps = min,
    _mm256_mul_ps = mul, _mm256_set1_ps = set, _mm256_sqrt_ps = sqrt, _mm256_sub_ps = sub
);
operations!(
    of_256_double, __m256d, 0xf, _mm256_cmp_pd _mm256_blendv_pd _mm256_movemask_pd,
    _mm256_add_pd = add, _mm256_div_pd = div, _mm256_fmadd_pd = mul_add, _mm256_max_pd = max, _mm256_min_pd = min,
    _mm256_mul_pd = mul, _mm256_set1_pd = set, _mm256_sqrt_pd = sqrt, _mm256_sub_pd = sub
);

pub const fn are<T, const L: usize>(has: Instructions, size: usize, bytes: usize) -> bool {
    matches!(has, Instructions::Avx2) && size_of::<T>() == size && L * size == bytes
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
        if const { are::<T, L>(S::HAS, $size, size_of::<$vectors>()) } {
            // SAFETY: packs of this set exist only where the CPU has its instructions, and these are as many numbers of this type.
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
        if const { are::<T, L>(S::HAS, $size, size_of::<$vectors>()) } {
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
        if const { are::<T, L>(S::HAS, $size, size_of::<$vectors>()) } {
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
