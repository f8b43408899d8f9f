//! The instruction set of the lanes, found at run time.
//!
//! Inlined work grows with every place that asks for the same part of it, and most of the time of building this crate went into such copies:
//! a part that several places need, or that is large, is compiled [`apart`], once for each instruction set.

#[cfg(not(target_arch = "x86_64"))]
use crate::kernel::cpu::COMMON;
#[cfg(target_arch = "x86_64")]
use crate::kernel::cpu::{AVX2, fused};

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

/// Whether this CPU has lanes: a PC without AVX2 solves taps instead.
pub fn has_lanes() -> bool {
    cfg!(not(target_arch = "x86_64")) || crate::kernel::cpu::fused()
}

/// Does `work` with the instructions of lanes.
///
/// # Panics
/// On a CPU that has none: charts of lanes are not made there ([`has_lanes`]).
pub(super) fn by_lanes<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    {
        assert!(fused());
        // SAFETY: the CPU has just been found to have the instructions.
        unsafe { avx2(work) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    work.run::<COMMON>()
}

/// Does `part` with the instructions of the work it is a part of, behind a call.
#[inline(always)]
pub(super) fn apart<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    // SAFETY: such lanes are only made where the CPU was found to have the instructions.
    #[cfg(target_arch = "x86_64")]
    return unsafe { avx2_part(part) };
    #[cfg(not(target_arch = "x86_64"))]
    plain_part(part)
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(never)]
fn plain_part<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    part.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_part<const SET: u8, P: Part<SET>>(part: P) -> P::Out {
    part.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Out {
    work.run::<AVX2>()
}
