//! CPU backend: the fast kernel in f32 or f64 on all cores, in lanes, for the instruction set found at run time.

// Index loops read like their WGSL twins, and vectorise where packs are not vectors.
#![allow(clippy::needless_range_loop)]

mod dual;
mod exact;
pub mod law;
pub mod pack;
#[cfg(target_arch = "x86_64")]
mod vectors;

use rayon::prelude::*;

use exact::Tables;
pub use exact::{dot, series};
pub use pack::{Instructions, Pack, Packed, Plain, Scalar, Set, WIDEST};

use super::{Job, Solution, Solver, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;

/// Taps of one work item: enough to hide scheduling, few enough to balance.
const GRAIN: usize = 1024;

/// The vectorised CPU kernels, on rayon's current thread pool.
#[derive(Debug)]
pub struct Cpu {
    precision: Precision,
}

impl Cpu {
    /// Kernels that compute in `precision`.
    pub fn new(precision: Precision) -> Self {
        Self { precision }
    }

    /// Instruction set in use, for `devices` and `run.json`.
    pub fn instructions() -> &'static str {
        match Vectors::found() {
            Some(_) if cfg!(target_arch = "x86_64") => "avx2+fma",
            _ => std::env::consts::ARCH,
        }
    }
}

/// Proof that this CPU has the instructions [`Self::HAVE`] of wide packs: on x86-64 AVX2 and FMA, elsewhere those that every CPU has.
#[derive(Debug, Clone, Copy)]
pub struct Vectors(());

impl Vectors {
    /// The instructions.
    pub const HAVE: Instructions = match () {
        () if cfg!(target_arch = "x86_64") => Instructions::Avx2,
        () if cfg!(target_arch = "aarch64") => Instructions::Fused,
        () => Instructions::Unfused,
    };

    /// The proof, if the CPU has them.
    pub fn found() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        let has = std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
        #[cfg(not(target_arch = "x86_64"))]
        let has = true;
        has.then_some(Self(()))
    }
}

/// The set of [`block`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wide;

// SAFETY: its packs are made in `block`, which needs the proof.
unsafe impl Set for Wide {
    const HAS: Instructions = Vectors::HAVE;
}

impl Solver for Cpu {
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<(), SolveError> {
        out.clear();
        out.resize(taps.len(), Solution::FAILED);
        match self.precision {
            Precision::F32 => by_nodes_f32(job, taps, out),
            Precision::F64 => by_nodes_f64(job, taps, out),
        }
    }

    fn batch_limit(&self) -> usize {
        1 << 20
    }

    fn has_full_newton(&self) -> bool {
        true
    }
}

/// With all effects off the number of nodes is a constant, which unrolls the loops. Other models take the smallest kernel that holds the nodes.
macro_rules! by_nodes {
    ($name:ident, $t:ty, $lanes:literal, plain $($n:literal)*, sizes $($size:literal)*, most $most:literal) => {
        fn $name(job: &Job<'_>, taps: &[Tap], out: &mut [Solution]) -> Result<(), SolveError> {
            match (job.rule.nodes, Vectors::found()) {
                $(($n, Some(has)) if job.effects.plain() => {
                    let tables = Tables::<$t, $n>::new(job.rule, job.chart);
                    // SAFETY: the CPU has the vectors.
                    parallel(taps, out, |t, o| unsafe { block::<$t, $n, $lanes, true>(has, &tables, job, t, o) });
                })*
                $((2..=$size, Some(has)) => {
                    let tables = Tables::<$t, $size>::new(job.rule, job.chart);
                    // SAFETY: the CPU has the vectors.
                    parallel(taps, out, |t, o| unsafe { block::<$t, $size, $lanes, false>(has, &tables, job, t, o) });
                })*
                (2..=$most, _) => {
                    let tables = Tables::<$t, $most>::new(job.rule, job.chart);
                    parallel(taps, out, |t, o| lanes::<Pack<$t, 1, Plain>, 1, $most, false>(&tables, job, t, o));
                }
                (n, _) => return Err(SolveError::Nodes(n)),
            }
            Ok(())
        }
    };
}
by_nodes!(by_nodes_f32, f32, 16, plain 6 10, sizes 10, most 10);
by_nodes!(by_nodes_f64, f64, 8, plain 10, sizes 10 24, most 24);

fn parallel(taps: &[Tap], out: &mut [Solution], f: impl Fn(&[Tap], &mut [Solution]) + Sync) {
    taps.par_chunks(GRAIN).zip(out.par_chunks_mut(GRAIN)).for_each(|(t, o)| f(t, o));
}

/// # Safety
/// As its first argument proves.
#[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
unsafe fn block<T: Scalar, const N: usize, const L: usize, const PLAIN: bool>(
    _: Vectors,
    tables: &Tables<T, N>,
    job: &Job<'_>,
    taps: &[Tap],
    out: &mut [Solution],
) {
    lanes::<Pack<T, L, Wide>, L, N, PLAIN>(tables, job, taps, out);
}

/// Packs `L` taps at a time; the last pack is filled up with copies of its first tap. `PLAIN`: all effects are off, and the rule has N nodes.
#[inline(always)]
fn lanes<P: Packed, const L: usize, const N: usize, const PLAIN: bool>(
    tables: &Tables<P::Scalar, N>,
    job: &Job<'_>,
    taps: &[Tap],
    out: &mut [Solution],
) {
    for (taps, out) in taps.chunks(L).zip(out.chunks_mut(L)) {
        let lane = |i: usize| &taps[if i < taps.len() { i } else { 0 }];
        let packed = Tap::gather(|field| P::gather(|i| lane(i).values()[field]));
        let solved = exact::taps::<P, N, PLAIN>(tables, job.rule, &job.effects, job.tolerance, &packed);
        for (i, o) in out.iter_mut().enumerate() {
            *o = solved.map(|x| x.lane(i));
        }
    }
}
