//! The fast solver of taps: every whisker and every effect, in lanes.
//!
//! In the frame of the contact the force F is constant, and the turn ψ and the moment M follow from the contact to the base: ψ′ = κ(N, M),
//! M′ = −[(1 + e₀) Q − γ N], with N and Q along and across the section. From the base to a, where the contact is at rest, lie panels that end where the
//! whisker is not smooth. Each has Gauss's nodes in w; D^(−½) is linear in w, so that integrals of linear theory over a cone are polynomials. From a to
//! the contact at c a short panel moves with c. A pass takes M from the last ψ, and ψ from that M; the closure then gives a step of P and of c (or of T).
//! The unknown shape is the difference to linear theory under the same force; the integrals of linear theory do not change while a tap is iterated.
//!
//! Taps whose estimated error exceeds the tolerance go on to more nodes, and at last to Newton's method with the derivatives of the passes.

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
mod solve;
mod tap;
mod tilt;
mod vector;

use std::collections::BTreeMap;

use rayon::prelude::*;

use ground::{Fixed, Ground};
use lane::Lane;
pub use rod::{Piece, Rod};
use rule::{Rule, Turns};
pub use tap::{Effects, Skin, Solution, Tap, Tilt};
use vibrissa_core::physics::nodes::Nodes;
use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::Dual as One;
use vibrissa_kernel::Chart;
use vibrissa_kernel::cpu::law::Law;
use vibrissa_kernel::cpu::{Instructions, Pack, Packed, Plain, Set, Vectors};

/// Nodes of a panel and of the stretch between a and c.
type Rung = [usize; 2];

/// Rungs for whiskers of few pieces, and of many.
const FEW: [Rung; 2] = [[10, 4], [16, 6]];
const MANY: [Rung; 2] = [[7, 4], [12, 6]];

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

const GRAIN: usize = 128;
const LANES: usize = 8;

/// Taps of a group: half a pack.
pub const GROUP: usize = 4;

/// Tolerance of the iteration of groups, as a share of theirs.
const SMOOTH: f64 = 0.01;

struct Job<'a> {
    effects: Effects,
    rung: Rung,
    tolerance: f64,
    /// True if the lanes of a pack stop after the same pass.
    together: bool,
    chart: Option<&'a Chart>,
}

fn fixed<T: vibrissa_kernel::cpu::Scalar, const N: usize>(job: &Job<'_>) -> Fixed<T, N, SLIDE> {
    let [nodes, slide] = job.rung;
    let points = |count| {
        let Nodes { points, weights, .. } = Nodes::of(count);
        points.iter().zip(weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect()
    };
    Fixed {
        rule: Rule::new(nodes),
        slide: Rule::new(slide),
        turns: Turns::new(TERMS),
        law: job.chart.map(Law::new),
        gauge: points(if job.effects.long { nodes / 2 + 3 } else { 4 }),
        path: points(8),
    }
}

/// Solves `taps`, each to `tolerance` where a rung reaches it; `chart` gives the section law where it is not Hooke's. `effects`: those of the model.
pub fn solve(taps: &[Tap<'_>], effects: Effects, tolerance: f64, chart: Option<&Chart>) -> Vec<Solution> {
    climb(taps, 1, effects, tolerance, chart)
}

/// The same for neighbours [`GROUP`] by [`GROUP`], which differ little: all with the same nodes and passes, so that their differences are those of a
/// smooth function.
pub fn groups(taps: &[Tap<'_>], effects: Effects, tolerance: f64, chart: Option<&Chart>) -> Vec<Solution> {
    climb(taps, GROUP, effects, tolerance, chart)
}

/// Solves `taps` in groups of `size`, whose effects are those of their first and which climb the ladder together.
fn climb(
    taps: &[Tap<'_>],
    size: usize,
    effects: Effects,
    tolerance: f64,
    chart: Option<&Chart>,
) -> Vec<Solution> {
    let together = size > 1;
    let mut classes: BTreeMap<(Effects, usize), Vec<usize>> = BTreeMap::new();
    let kind = |tap: &Tap<'_>, long: bool| {
        let effects = Effects { long, tilt: tap.tilt.is_some(), ..tap.rod.effects(effects) };
        (effects, tap.rod.pieces.len())
    };
    for (k, group) in taps.chunks(size).enumerate() {
        let [x1, x2] = group[0].rod.gauge;
        let long = effects.distorting || x2 - x1 > LONG * group[0].a;
        let first = kind(&group[0], long);
        // One that is beyond a knot or an end of its foil is no neighbour.
        if group.iter().all(|tap| kind(tap, long) == first) {
            classes.entry(first).or_default().push(size * k);
        }
    }
    let mut out = vec![Solution::FAILED; taps.len()];
    for ((effects, pieces), places) in classes {
        let all = if pieces < PIECES { FEW } else { MANY };
        let fine = if effects.wrench { CANCELLING } else { FINE.max(SHARE * tolerance) };
        let fine = fine.max(chart.map_or(0.0, |chart| CHARTED * chart.error)).min(tolerance);
        // Newton's method is for taps that the lanes do not solve as asked.
        let rungs = all.iter().map(|rung| (*rung, fine)).chain([([NEWTON, SLIDE], tolerance)]);
        let mut open = places;
        for (rung, enough) in rungs {
            open.retain(|&i| out[i..i + size].iter().any(|s| s.error.is_nan() || s.error > enough));
            if open.is_empty() {
                break;
            }
            let newton = rung[0] == NEWTON;
            let stop = if together { SMOOTH * fine } else { fine };
            let job = Job { effects, rung, tolerance: stop, together, chart };
            let solve = |part: &[usize]| {
                let those: Vec<Tap<'_>> = part.iter().flat_map(|&i| &taps[i..i + size]).copied().collect();
                if newton { exactly(&job, &those) } else { block(&job, &those) }
            };
            let solved: Vec<Vec<Solution>> = open.par_chunks(GRAIN).map(solve).collect();
            let places = open.iter().flat_map(|&i| i..i + size);
            for (i, new) in places.zip(solved.into_iter().flatten()) {
                let sweeps = out[i].sweeps + new.sweeps;
                // A finer rung may lose what a coarser one has found.
                let kept = !together && out[i].error <= tolerance && new.error > tolerance;
                out[i] = Solution { sweeps, ..if kept { out[i] } else { new } };
            }
        }
    }
    out
}

/// The set of [`wide`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wide;

// SAFETY: its packs are made in `wide`, which needs the proof.
unsafe impl Set for Wide {
    const HAS: Instructions = Vectors::HAVE;
}

fn block(job: &Job<'_>, taps: &[Tap<'_>]) -> Vec<Solution> {
    match Vectors::found() {
        // SAFETY: the CPU has the vectors.
        Some(has) => unsafe { wide(has, job, taps) },
        None => packs::<Pack<f64, 1, Plain>, 1>(job, taps),
    }
}

/// # Safety
/// As its first argument proves.
#[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
unsafe fn wide(_: Vectors, job: &Job<'_>, taps: &[Tap<'_>]) -> Vec<Solution> {
    packs::<Pack<f64, LANES, Wide>, LANES>(job, taps)
}

/// Packs `L` taps at a time; the last pack is filled up with copies of its first tap.
#[inline(always)]
fn packs<P: Lane<One = f64>, const L: usize>(job: &Job<'_>, taps: &[Tap<'_>]) -> Vec<Solution> {
    let fixed = fixed::<P::Scalar, MOST>(job);
    let mut out = Vec::with_capacity(taps.len());
    for taps in taps.chunks(L) {
        let lane = |i: usize| &taps[if i < taps.len() { i } else { 0 }];
        let mut ground = Ground::<P, MOST, SLIDE>::new(&fixed, job.effects, lane);
        let solved = ground.solve(&fixed, (job.tolerance, PASSES, job.together), &lane);
        out.extend((0..taps.len()).map(|i| solution(&solved, i)));
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
        let mut ground =
            Ground::<lane::Dual<Pack<f64, 1, Plain>, 2>, NEWTON, SLIDE>::new(&fixed, job.effects, lane);
        solution(&ground.solve_exactly(&fixed, (job.tolerance, PASSES), &lane), 0)
    };
    taps.iter().map(solve).collect()
}

fn solution<P: Packed>(answer: &Solution<P>, i: usize) -> Solution {
    let of = |x: P| x.lane(i);
    let error = of(answer.error);
    Solution {
        strain: of(answer.strain),
        axial: of(answer.axial),
        turned: of(answer.turned),
        normal: of(answer.normal),
        tangential: of(answer.tangential),
        arc: of(answer.arc),
        wrench: answer.wrench.map(of),
        error: if error.is_nan() { f64::INFINITY } else { error },
        load: of(answer.load),
        sweeps: of(answer.sweeps),
    }
}
