//! What this machine can do at most, for rooflines: fused multiply–adds and bytes per second, on rayon's current threads.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

use super::{
    fused,
    pack::{Pack, Scalar},
};
use vibrissa_core::scene::Precision;

/// Chains that hide the latency of a fused operation; with two constants they fill the 16 vector registers of AVX2.
const CHAINS: usize = 12;

/// Least time of a measurement, s.
const LEAST: f64 = 0.05;

/// Floating-point operations per second of independent fused multiply–adds (2 each) in the vectors that the kernels use: the
/// best of `repeats`.
pub fn flops(precision: Precision, repeats: usize) -> f64 {
    let (lanes, run): (usize, fn(u64)) = match precision {
        Precision::F32 => (8, chains::<f32, 8>),
        Precision::F64 => (4, chains::<f64, 4>),
    };
    let threads = rayon::current_num_threads();
    let rate = best(repeats, |rounds| {
        rayon::broadcast(|_| run(rounds * 4096));
        rounds as f64 * 4096.0
    });
    rate * (2 * lanes * CHAINS * threads) as f64
}

/// Bytes per second of the triad a = b + s c (three numbers moved per element): the best of `repeats`.
pub fn bandwidth(repeats: usize) -> f64 {
    // Three arrays of 64 MiB: larger than the caches that a core can claim.
    const LEN: usize = 1 << 23;
    let (b, c) = (vec![1.0f64; LEN], vec![2.0f64; LEN]);
    let mut a = vec![0.0f64; LEN];
    let rate = best(repeats, |rounds| {
        for _ in 0..rounds {
            a.par_chunks_mut(1 << 16).zip(b.par_chunks(1 << 16)).zip(c.par_chunks(1 << 16)).for_each(
                |((a, b), c)| {
                    for i in 0..a.len() {
                        a[i] = b[i] + 3.0 * c[i];
                    }
                },
            );
            black_box(&mut a);
        }
        rounds as f64
    });
    rate * (3 * size_of::<f64>() * LEN) as f64
}

/// Largest work per second of `repeats` runs, each long enough; `run` does that many rounds and returns its work.
fn best(repeats: usize, mut run: impl FnMut(u64) -> f64) -> f64 {
    let mut timed = |rounds| {
        let start = Instant::now();
        let work = run(rounds);
        (work, start.elapsed().as_secs_f64())
    };
    let mut rounds = 1;
    while timed(rounds).1 < LEAST {
        rounds *= 2;
    }
    (0..repeats.max(1)).map(|_| timed(rounds)).map(|(work, s)| work / s).fold(0.0, f64::max)
}

fn chains<T: Scalar, const L: usize>(rounds: u64) {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the CPU has just been found to have both features.
        unsafe { chains_avx2::<T, L>(rounds) };
        return;
    }
    turn::<T, L, { cfg!(target_arch = "aarch64") }>(rounds);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chains_avx2<T: Scalar, const L: usize>(rounds: u64) {
    turn::<T, L, true>(rounds);
}

/// x ← a x + b on every chain; the numbers stay between 0 and 1.
#[inline(always)]
fn turn<T: Scalar, const L: usize, const FMA: bool>(rounds: u64) {
    let of = Pack::<T, L, FMA>::of;
    let (a, b) = (black_box(of(0.75)), black_box(of(0.125)));
    let mut chains = [of(0.5); CHAINS];
    for _ in 0..rounds {
        for chain in &mut chains {
            *chain = chain.mul_add(a, b);
        }
    }
    black_box(chains);
}
