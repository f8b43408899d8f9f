//! The instruction set of the lanes. Code is inlined (no closure that is called twice) into functions with `target_feature`, else it is compiled for
//! the baseline set. A large or shared part has the attribute itself, which saves build time.

use crate::kernel::cpu::{Instructions, Set, Vectors};

/// The set of the lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wide;

// SAFETY: its packs are made in functions that `by_lanes` calls, which needs the proof that rankers and readings hold. A PC without AVX2 has neither, and
// solves taps instead.
unsafe impl Set for Wide {
    const HAS: Instructions = Vectors::HAVE;
}

/// Calls a function with the attribute `target_feature` from one that is inlined into such functions.
macro_rules! part {
    ($call:expr) => {{
        // SAFETY: lanes are only made where the CPU was found to have the instructions.
        #[cfg(target_arch = "x86_64")]
        unsafe {
            $call
        }
        #[cfg(not(target_arch = "x86_64"))]
        $call
    }};
}

/// Calls such a function before any lanes exist, on a CPU that `$has` them.
macro_rules! by_lanes {
    ($has:expr, $call:expr) => {{
        let _: crate::kernel::cpu::Vectors = $has;
        crate::lanes::dispatch::part!($call)
    }};
}

pub(super) use {by_lanes, part};
