//! The fast solver of taps: every whisker and every effect, in lanes.
//!
//! In the frame of the contact the force F is constant, and the turn ψ and the moment M follow from the contact to the base: ψ′ = κ(N, M),
//! M′ = −[(1 + e₀) Q − γ N], with N and Q along and across the section. From the base to a, where the contact is at rest, lie panels that end where the
//! whisker is not smooth. Each has Gauss's nodes in w; D^(−½) is linear in w, so that integrals of linear theory over a cone are polynomials. From a to
//! the contact at c a short panel moves with c. A pass takes M from the last ψ, and ψ from that M; the closure then gives a step of P and of c (or of T).
//! The unknown shape is the difference to linear theory under the same force; the integrals of linear theory do not change while a tap is iterated.
//!
//! Taps whose estimated error exceeds the tolerance go on to more nodes, and at last, if no derivatives are asked, to Newton's method.

// Index loops vectorise over lanes.
#![allow(clippy::needless_range_loop)]

mod close;
mod gauge;
mod ground;
mod lane;
mod panel;
mod rod;
mod rule;
mod section;
#[cfg(target_arch = "x86_64")]
mod sloped;
mod solve;
mod tap;
mod tilt;
mod vector;

use std::collections::BTreeMap;
use std::iter;

use rayon::prelude::*;

use ground::{Fixed, Ground};
use lane::Lane;
pub use rod::{Piece, Rod};
use rule::{Rule, Turns};
use section::Charted;
#[cfg(target_arch = "x86_64")]
use sloped::{NUMBERS, Sloped};
pub use tap::{Effects, Skin, Solution, Tap, Tilt};
use vibrissa_core::physics::nodes::Nodes;
use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::{Dual as One, Real};
use vibrissa_kernel::Chart;
use vibrissa_kernel::cpu::{Instructions, Pack, Set, Vectors};

/// Nodes of a panel and of the stretch between a and c.
type Rung = [usize; 2];

/// Rungs for whiskers of few pieces, and of many; the last is Newton's method.
const RUNGS: [&[Rung]; 2] = [&[[10, 4], [16, 6], [NEWTON, SLIDE]], &[[7, 4], [12, 6], [NEWTON, SLIDE]]];

/// The same for derivatives. With 10 nodes half of the cones to 20° would be solved twice.
const OF_SLOPES: [&[Rung]; 2] = [&[[12, 5], [16, 6]], &[[7, 4], [12, 6]]];

/// Number of pieces from which on there are many.
const PIECES: usize = 5;

/// Tolerance of the lanes where a larger one is asked, at least this share of it: at small drives SD(K) is the difference of nearly equal numbers.
/// At a tolerance of 1e-5, K − 1 of 20 000 practical cones to 10° is then right to 1e-6. They take 0.89 of the time that 1e-8 takes; to 30°, 0.79.
const FINE: f64 = 1e-8;
const SHARE: f64 = 0.01;

/// Tolerance of the lanes where components of the wrench are asked, as they may nearly cancel.
const CANCELLING: f64 = 1e-9;

/// Least tolerance of the lanes in units of the error of the section chart, which more nodes do not reduce.
const CHARTED: f64 = 4.0;

/// Length of a gauge over a up to which four points serve.
const LONG: f64 = 0.2;

/// Most nodes in lanes; those of Newton's method.
const MOST: usize = 16;
const NEWTON: usize = 24;
const SLIDE: usize = 6;

/// Terms of the series of a turn: enough for 2 rad.
const TERMS: usize = 14;

/// Most passes of a rung.
const PASSES: usize = 40;

/// Number of inputs by which derivatives are found in one solve.
pub const SLOPES: usize = 3;

const GRAIN: usize = 128;
const LANES: usize = 8;
#[cfg(not(target_arch = "x86_64"))]
const NUMBERS: usize = 1;
#[cfg(not(target_arch = "x86_64"))]
type Sloped = One<SLOPES>;

struct Job<'a> {
    effects: Effects,
    rung: Rung,
    tolerance: f64,
    /// Charts of the section law from the smallest loads to the largest; none for Hooke's.
    charts: &'a [&'a Chart],
    /// Those of nearby moduli, with their weights in its derivative.
    nearby: &'a [(f64, Vec<&'a Chart>)],
}

fn fixed<T: vibrissa_kernel::cpu::Scalar, const N: usize>(job: &Job<'_>) -> Fixed<T, N, SLIDE> {
    let [nodes, slide] = job.rung;
    let points = |count| {
        let Nodes { points, weights, .. } = Nodes::of(count);
        points.iter().zip(weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect()
    };
    let each = |charts: &[&Chart]| charts.iter().map(|chart| Chart::of(chart)).collect();
    Fixed {
        rule: Rule::new(nodes),
        slide: Rule::new(slide),
        turns: Turns::new(TERMS),
        law: (!job.charts.is_empty()).then(|| {
            let nearby = job.nearby.iter().map(|(weight, charts)| (T::of(*weight), each(charts)));
            Charted(iter::once((T::of(0.0), each(job.charts))).chain(nearby).collect())
        }),
        gauge: points(if job.effects.long { nodes / 2 + 3 } else { 4 }),
        path: points(8),
    }
}

/// Solves `taps`, each to `tolerance` where a rung reaches it. `charts` of the section law: from the smallest loads to the largest, none for Hooke's.
/// `effects`: those of the model.
pub fn solve(taps: &[Tap<'_>], effects: Effects, tolerance: f64, charts: &[&Chart]) -> Vec<Solution> {
    climb(taps, effects, tolerance, (charts, &[]), RUNGS, block)
}

/// The same of taps with their derivatives by [`SLOPES`] numbers each, without Newton's method. Values and derivatives are iterated to the same tolerance:
/// a unit of each number must change a tap by as much as the tap itself. `nearby`: charts of laws of nearby moduli, with their weights in the
/// derivative of the law by the first number.
pub fn slopes(
    taps: &[Tap<'_, One<SLOPES>>],
    effects: Effects,
    tolerance: f64,
    charts: &[&Chart],
    nearby: &[(f64, Vec<&Chart>)],
) -> Vec<Solution<One<SLOPES>>> {
    climb(taps, effects, tolerance, (charts, nearby), OF_SLOPES, dual_block)
}

/// Takes `taps` up the `rungs` for their whiskers.
fn climb<T: Real>(
    taps: &[Tap<'_, T>],
    effects: Effects,
    tolerance: f64,
    (charts, nearby): (&[&Chart], &[(f64, Vec<&Chart>)]),
    rungs: [&[Rung]; 2],
    solve: impl Fn(&Job<'_>, &[Tap<'_, T>]) -> Vec<Solution<T>> + Sync,
) -> Vec<Solution<T>> {
    let mut classes: BTreeMap<(Effects, usize), Vec<usize>> = BTreeMap::new();
    for (i, tap) in taps.iter().enumerate() {
        let [x1, x2] = tap.rod.gauge;
        let long = effects.distorting || (x2 - x1).value() > LONG * tap.a.value();
        let effects = Effects { long, tilt: tap.tilt.is_some(), ..tap.rod.effects(effects) };
        classes.entry((effects, tap.rod.pieces.len())).or_default().push(i);
    }
    let mut out = vec![Solution::FAILED.map(T::of); taps.len()];
    let error = |s: &Solution<T>| s.error.value();
    if effects.law && charts.is_empty() {
        return out;
    }
    for ((effects, pieces), places) in classes {
        let fine = if effects.wrench { CANCELLING } else { FINE.max(SHARE * tolerance) };
        let charted = charts.iter().map(|chart| CHARTED * chart.error).fold(0.0, f64::max);
        let fine = fine.max(charted).min(tolerance);
        // A pack takes the passes of its hardest tap: those of like drives share packs.
        let mut open = places;
        let drive = |i: &usize| taps[*i].turn.value() + (taps[*i].lift / taps[*i].a).value();
        open.sort_by(|i, k| drive(i).total_cmp(&drive(k)));
        for &rung in rungs[usize::from(pieces >= PIECES)] {
            let enough = if rung[0] == NEWTON { tolerance } else { fine };
            open.retain(|&i| error(&out[i]) > enough);
            if open.is_empty() {
                break;
            }
            let job = Job { effects, rung, tolerance: fine, charts, nearby };
            let part = |part: &[usize]| {
                let those: Vec<Tap<'_, T>> = part.iter().map(|&i| taps[i]).collect();
                solve(&job, &those)
            };
            let solved: Vec<Vec<Solution<T>>> = open.par_chunks(GRAIN).map(part).collect();
            for (&i, new) in open.iter().zip(solved.into_iter().flatten()) {
                let sweeps = out[i].sweeps + new.sweeps;
                // A finer rung may lose what a coarser one has found.
                let kept = error(&out[i]) <= tolerance && error(&new) > tolerance;
                out[i] = Solution { sweeps, ..if kept { out[i] } else { new } };
            }
        }
    }
    out
}

/// The set of [`packs`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wide;

// SAFETY: its packs are made in `packs`, which needs the proof.
unsafe impl Set for Wide {
    const HAS: Instructions = Vectors::HAVE;
}

/// Newton's method is for taps that the lanes do not solve as asked, and for CPUs without the vectors.
fn block(job: &Job<'_>, taps: &[Tap<'_>]) -> Vec<Solution> {
    match Vectors::found() {
        // SAFETY: the CPU has the vectors.
        Some(has) if job.rung[0] != NEWTON => unsafe {
            packs::<Pack<f64, LANES, Wide>, LANES>(has, job, taps)
        },
        _ => exactly(job, taps),
    }
}

/// On x86-64 without the vectors nothing is solved: the reference gives such derivatives.
fn dual_block(job: &Job<'_>, taps: &[Tap<'_, One<SLOPES>>]) -> Vec<Solution<One<SLOPES>>> {
    match Vectors::found() {
        // SAFETY: the CPU has the vectors.
        Some(has) => unsafe { packs::<Sloped, NUMBERS>(has, job, taps) },
        None => vec![Solution::FAILED.map(One::of); taps.len()],
    }
}

/// Packs `L` taps at a time; the last pack is filled up with copies of its first tap.
///
/// # Safety
/// As its first argument proves.
#[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
unsafe fn packs<P: Lane, const L: usize>(
    has: Vectors,
    job: &Job<'_>,
    taps: &[Tap<'_, P::One>],
) -> Vec<Solution<P::One>> {
    let fixed = fixed::<P::Scalar, MOST>(job);
    let mut out = Vec::with_capacity(taps.len());
    let mut panels = Default::default();
    for taps in taps.chunks(L) {
        let lane = |i: usize| &taps[if i < taps.len() { i } else { 0 }];
        let mut ground = Ground::<P, MOST, SLIDE>::new(&fixed, job.effects, lane, panels);
        let solved = ground.solve(has, &fixed, (job.tolerance, PASSES), &lane);
        out.extend((0..taps.len()).map(|i| solution(&solved, i)));
        panels = (ground.panels, ground.slides);
    }
    out
}

/// Newton's method, tap by tap.
fn exactly(job: &Job<'_>, taps: &[Tap<'_>]) -> Vec<Solution> {
    let fixed = fixed::<f64, NEWTON>(job);
    let solve = |tap: &Tap<'_>| {
        let rod = tap.rod.map(One::<2>::of);
        let tap = tap.map(&rod, One::<2>::of);
        let lane = |_: usize| &tap;
        let mut ground = Ground::<One<2>, NEWTON, SLIDE>::new(&fixed, job.effects, lane, Default::default());
        solution(&ground.solve_exactly(&fixed, (job.tolerance, PASSES), &lane), 0).map(|x| x.value)
    };
    taps.iter().map(solve).collect()
}

fn solution<P: Lane>(answer: &Solution<P>, i: usize) -> Solution<P::One> {
    let mut one = answer.map(|x| x.one(i));
    if one.error.value().is_nan() {
        one.error = P::One::of(f64::INFINITY);
    }
    one
}
