//! The fast kernel of built whiskers, all but a cone clamped at its base (model §7): in lanes in f64, and on devices.
//!
//! From the contact to the base the rod is an initial value problem in two unknowns: the force P, and the contact arc c or the friction T. Each piece
//! is integrated with the explicit method of order 8 of [`tableau`](vibrissa_core::physics::tableau); within a step 1/R is linear, so that on a cone the integrands of linear theory
//! are quadratic. The state is the *difference to the resting whisker*, and the closure avoids lengths that cancel, so that small taps keep their
//! digits in f32. Broyden's method, started from a finite-difference Jacobian, closes the tap; large drives are reached in strides.
//!
//! A tap whose estimated error exceeds the tolerance continues on a rung with more steps. The reference solves the rest, and contacts next to a
//! corner of the profile, the tip, or the end of the material. The cone's kernel (`cpu::exact`) uses closed forms; it is some ten times as fast.

// Index loops vectorise over lanes.
#![allow(clippy::needless_range_loop)]

mod check;
mod classes;
pub mod device;
mod lanes;
mod newton;
mod rod;
mod shot;

use std::collections::BTreeMap;

use rayon::prelude::*;

pub use classes::Shape;
use lanes::{Fixed, Ground};
use newton::End;
pub use rod::{Piece, Rod};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;
use vibrissa_kernel::Chart;
use vibrissa_kernel::Solver;
use vibrissa_kernel::cpu::{Pack, Packed, UNFUSED, fused};
use vibrissa_kernel::gpu::Gpu;

/// Effects of the model, equal for all taps of a batch; an effect that is off costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// Timoshenko shear.
    pub shear: bool,
    /// Stretch of the centreline.
    pub extension: bool,
    /// Contact on the surface.
    pub surface: bool,
    /// The contact stays at its arc length.
    pub stick: bool,
    /// A hyperelastic section law, read from a chart.
    pub law: bool,
    /// The gauge is on the far side.
    pub far: bool,
}

/// One tap; mm, N, rad.
#[derive(Debug, Clone, Copy)]
pub struct Tap<'a> {
    /// The whisker.
    pub rod: &'a Rod,
    /// Contact distance a.
    pub a: f64,
    /// Hub radius r₀; 0 where the object moves.
    pub hub: f64,
    /// θ; 0 where the object moves.
    pub turn: f64,
    /// δ; 0 where the base turns.
    pub lift: f64,
    /// T/P of a sliding contact.
    pub ratio: f64,
    /// P of linear theory.
    pub force: f64,
    /// Least strain that errors are relative to.
    pub least: f64,
    /// Pole radius ρ.
    pub pole: f64,
}

/// The answer to a tap; mm, N, N mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Mean strain of the gauge's fibre.
    pub strain: f64,
    /// Normal force P.
    pub normal: f64,
    /// Friction T.
    pub tangential: f64,
    /// Contact arc c.
    pub arc: f64,
    /// Base moment and forces M₀, F_x, F_y.
    pub wrench: [f64; 3],
    /// Estimated error relative to the strain, or to the tap's `least` where that is larger.
    pub error: f64,
    /// Largest load of a fibre; above 1 it is outside the range of the law.
    pub load: f64,
    /// Number of integrations of the rod.
    pub shots: f64,
}

impl Solution {
    /// No equilibrium was found.
    pub const FAILED: Self = Self {
        strain: f64::NAN,
        normal: f64::NAN,
        tangential: f64::NAN,
        arc: f64::NAN,
        wrench: [f64::NAN; 3],
        error: f64::INFINITY,
        load: 0.0,
        shots: 0.0,
    };
}

/// Least steps between contact and base on each rung.
const RUNGS: [usize; 4] = [3, 6, 14, 30];

const GRAIN: usize = 64;

const LANES: usize = 8;

/// Solves `taps` on the device of `solver`, if it has one; the CPU solves what the device cannot.
pub fn solve_on(
    solver: &mut dyn Solver,
    taps: &[Tap<'_>],
    effects: Effects,
    (precision, tolerance): (Precision, f64),
    chart: Option<&Chart>,
) -> Result<Vec<Solution>, SolveError> {
    let Some(device) = solver.device() else { return Ok(solve(taps, effects, tolerance, chart)) };
    let job = Job { effects, steps: RUNGS[0], tolerance, chart };
    let mut shapes: BTreeMap<Shape, Vec<usize>> = BTreeMap::new();
    for (i, tap) in taps.iter().enumerate() {
        shapes.entry(Shape::of(tap.rod)).or_default().push(i);
    }
    let mut out = vec![Solution::FAILED; taps.len()];
    for (shape, places) in shapes {
        for places in places.chunks(device::BATCH) {
            let part: Vec<Tap<'_>> = places.iter().map(|&i| taps[i]).collect();
            let solved = batch(device, precision, &job, (shape, &part))?;
            places.iter().zip(solved).for_each(|(&i, answer)| out[i] = answer);
        }
    }
    Ok(out)
}

fn batch(
    device: &mut Gpu,
    precision: Precision,
    job: &Job<'_>,
    (shape, taps): (Shape, &[Tap<'_>]),
) -> Result<Vec<Solution>, SolveError> {
    let by_cpu = |taps: &[Tap<'_>]| solve(taps, job.effects, job.tolerance, job.chart);
    if precision == Precision::F64 && shape.power {
        return Ok(by_cpu(taps));
    }
    let call = |device: &mut Gpu| device::solve(device, precision, job, (shape, taps));
    let found = device.attempt(taps.len(), call, |found| check::compare(job, taps, found))?;
    let Some(mut out) = found else { return Ok(by_cpu(taps)) };
    let told = |s: &Solution| s.error <= job.tolerance;
    let open: Vec<usize> = (0..taps.len()).filter(|&i| !told(&out[i])).collect();
    let those: Vec<Tap<'_>> = open.iter().map(|&i| taps[i]).collect();
    for (&i, new) in open.iter().zip(by_cpu(&those)) {
        out[i] = Solution { shots: out[i].shots + new.shots, ..new };
    }
    Ok(out)
}

/// First-rung answers to `taps` of whiskers of one shape in f64, by `device` and in lanes: for tests.
#[doc(hidden)]
pub fn first_rung(
    device: &mut Gpu,
    taps: &[Tap<'_>],
    effects: Effects,
    tolerance: f64,
    chart: Option<&Chart>,
) -> Result<[Vec<Solution>; 2], SolveError> {
    let job = Job { effects, steps: RUNGS[0], tolerance, chart };
    let (all, mut lanes): (Vec<usize>, _) = ((0..taps.len()).collect(), vec![Solution::FAILED; taps.len()]);
    for part in classes::items(taps, &all, job.steps, |_| false) {
        let begun: Vec<Begun<'_>> = part.iter().map(|&i| (taps[i], None)).collect();
        part.iter().zip(block(&job, &begun)).for_each(|(&i, (answer, _))| lanes[i] = answer);
    }
    Ok([device::solve(device, Precision::F64, &job, (Shape::of(taps[0].rod), taps))?, lanes])
}

/// Solves `taps`, each to `tolerance` where a rung reaches it; `chart` gives the section law where it is not Hooke's.
pub fn solve(taps: &[Tap<'_>], effects: Effects, tolerance: f64, chart: Option<&Chart>) -> Vec<Solution> {
    let mut out = vec![Solution::FAILED; taps.len()];
    let mut ends: Vec<Option<End<f64>>> = vec![None; taps.len()];
    let told = |s: &Solution| s.error <= tolerance;
    for steps in RUNGS {
        let open: Vec<usize> = (0..taps.len()).filter(|&i| !told(&out[i])).collect();
        if open.is_empty() {
            break;
        }
        let job = Job { effects, steps, tolerance, chart };
        let parts = classes::items(taps, &open, steps, |i| ends[i].is_some());
        let solved: Vec<Vec<Solved>> = parts
            .par_iter()
            .map(|part| {
                let those: Vec<Begun<'_>> = part.iter().map(|&i| (taps[i], ends[i])).collect();
                block(&job, &those)
            })
            .collect();
        for (&i, (new, end)) in parts.iter().flatten().zip(solved.into_iter().flatten()) {
            let shots = out[i].shots + new.shots;
            (out[i], ends[i]) = (Solution { shots, ..new }, end);
        }
    }
    out
}

pub(crate) struct Job<'a> {
    effects: Effects,
    steps: usize,
    tolerance: f64,
    chart: Option<&'a Chart>,
}

/// A tap and its end on the rung before; within a pack, all or none have one.
type Begun<'a> = (Tap<'a>, Option<End<f64>>);

type Solved = (Solution, Option<End<f64>>);

fn block(job: &Job<'_>, taps: &[Begun<'_>]) -> Vec<Solved> {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the CPU has just been found to have both features.
        return unsafe { block_avx2(job, taps) };
    }
    #[cfg(target_arch = "x86_64")]
    return packs::<Pack<f64, 1, UNFUSED>, 1>(job, taps);
    #[cfg(not(target_arch = "x86_64"))]
    packs::<Pack<f64, LANES, { vibrissa_kernel::cpu::COMMON }>, LANES>(job, taps)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn block_avx2(job: &Job<'_>, taps: &[Begun<'_>]) -> Vec<Solved> {
    packs::<Pack<f64, LANES, { vibrissa_kernel::cpu::AVX2 }>, LANES>(job, taps)
}

/// Packs `L` taps at a time; the last pack is filled up with copies of its first tap.
#[inline(always)]
fn packs<P: Packed, const L: usize>(job: &Job<'_>, taps: &[Begun<'_>]) -> Vec<Solved> {
    let fixed = Fixed::new(job.chart);
    let mut out = Vec::with_capacity(taps.len());
    for taps in taps.chunks(L) {
        let lane = |i: usize| &taps[if i < taps.len() { i } else { 0 }];
        let ground = Ground::<P>::new(|i| &lane(i).0, job.effects, job.steps);
        let start = taps[0].1.is_some().then(|| End::of(|i| lane(i).1.as_ref().expect("all of a pack")));
        let solved = newton::close(&fixed, &ground, job.tolerance, start);
        out.extend((0..taps.len()).map(|i| (solved.lane(i), solved.end(i))));
    }
    out
}
