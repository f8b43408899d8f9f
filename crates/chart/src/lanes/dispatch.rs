//! The instruction set of the lanes, found at run time.
//!
//! Inlined work grows with every place that asks for the same part of it, and most of the time of building this crate went into such copies:
//! a part that several places need, or that is large, is compiled [`apart`], once for each instruction set.

use crate::kernel::cpu::{AVX2, AVX512, COMMON};

/// Work over lanes. All of it must be inlined (`#[inline(always)]`, no closure that is called twice) or a [`Part`]: what is neither is
/// compiled for no particular instruction set.
pub(super) trait Work {
    type Out;

    /// By the instructions of a set.
    fn run<const SET: u8>(self) -> Self::Out;
}

/// A method of `$of` for each instruction set as [`Work`]: what it is called with.
macro_rules! work {
    ($(#[$doc:meta])+ $name:ident: $of:ident.$method:ident($($field:ident: $type:ty),+) -> $out:ty) => {
        $(#[$doc])+
        struct $name<'a> {
            of: &'a $of,
            $($field: $type,)+
        }

        impl Work for $name<'_> {
            type Out = $out;

            #[inline(always)]
            fn run<const SET: u8>(self) -> $out {
                self.of.$method::<SET>($(self.$field),+)
            }
        }
    };
}
pub(super) use work;

/// A part of work by the instructions of a set.
pub(super) trait Part<const SET: u8> {
    type Out;

    fn run(self) -> Self::Out;
}

/// Does `work` with the best instructions that the CPU has. Those with fused operations all give the same bits.
pub(super) fn best<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    {
        if has_fused() && has_512() {
            // SAFETY: the CPU has just been found to have them.
            return unsafe { avx512(work) };
        }
        if has_fused() {
            // SAFETY: as above.
            return unsafe { avx2(work) };
        }
    }
    work.run::<COMMON>()
}

/// Does `part` with the instructions of the work it is a part of, behind a call.
#[inline(always)]
pub(super) fn apart<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    #[cfg(target_arch = "x86_64")]
    match SET {
        // SAFETY: such lanes are only made where the CPU was found to have the instructions.
        AVX512 => return unsafe { avx512_part(part) },
        // SAFETY: as above.
        AVX2 => return unsafe { avx2_part(part) },
        _ => {}
    }
    plain_part(part)
}

#[cfg(target_arch = "x86_64")]
fn has_fused() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

#[cfg(target_arch = "x86_64")]
fn has_512() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
}

#[inline(never)]
fn plain_part<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    part.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
#[inline(never)]
fn avx512_part<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    part.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_part<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    part.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
fn avx512<W: Work>(work: W) -> W::Out {
    work.run::<AVX512>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Out {
    work.run::<AVX2>()
}
