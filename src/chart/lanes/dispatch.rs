//! The instruction set of the lanes, found at run time.

/// Work over lanes. All of it must be inlined (`#[inline(always)]`, no closure that is called twice): what is not is compiled for no
/// particular instruction set.
pub(super) trait Work {
    type Out;

    /// With fused multiply–add or without.
    fn run<const FMA: bool>(self) -> Self::Out;
}

/// Does `work` with the best instructions that the CPU has. Those with fused operations all give the same bits.
pub(super) fn best<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    {
        let has_fused = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        if has_fused && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the CPU has just been found to have them.
            return unsafe { avx512(work) };
        }
        if has_fused {
            // SAFETY: as above.
            return unsafe { avx2(work) };
        }
    }
    work.run::<{ cfg!(target_arch = "aarch64") }>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
fn avx512<W: Work>(work: W) -> W::Out {
    work.run::<true>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Out {
    work.run::<true>()
}
