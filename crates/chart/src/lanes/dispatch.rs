//! The instruction set of the lanes.
//!
//! What works on lanes is inlined (`#[inline(always)]`, no closure that is called twice) into functions with the attribute `target_feature`: what is
//! neither is compiled for no particular instruction set. A part that several places need, or that is large, has the attribute itself: inlined copies
//! of it would take most of the time of building this crate.

use crate::kernel::cpu;

/// Instruction set of the lanes.
pub(super) const SET: u8 = if cfg!(target_arch = "x86_64") { cpu::AVX2 } else { cpu::COMMON };

/// Whether this CPU has lanes: a PC without AVX2 solves taps instead.
pub fn has_lanes() -> bool {
    cfg!(not(target_arch = "x86_64")) || cpu::fused()
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

/// Calls a function with the attribute `target_feature` where no lanes have been made yet. Panics on a CPU that has none: charts of lanes are not made
/// there ([`has_lanes`]).
macro_rules! by_lanes {
    ($call:expr) => {{
        assert!(crate::lanes::has_lanes());
        crate::lanes::dispatch::part!($call)
    }};
}

pub(super) use {by_lanes, part};
