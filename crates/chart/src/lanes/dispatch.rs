//! The instruction set of the lanes. Code is inlined (no closure that is called twice) into functions with `target_feature`, else it is compiled for
//! the baseline set. A large or shared part has the attribute itself, which saves build time.

use crate::kernel::cpu;

pub(super) const SET: u8 = if cfg!(target_arch = "x86_64") { cpu::AVX2 } else { cpu::COMMON };

/// True if this CPU has lanes: a PC without AVX2 solves taps instead.
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

/// Calls such a function before any lanes exist. Panics on a CPU without lanes, where charts of lanes are not made ([`has_lanes`]).
macro_rules! by_lanes {
    ($call:expr) => {{
        assert!(crate::lanes::has_lanes());
        crate::lanes::dispatch::part!($call)
    }};
}

pub(super) use {by_lanes, part};
