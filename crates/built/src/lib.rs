//! The fast kernel of whiskers that are no cone clamped at its base (model §7): in lanes in f64, and on devices.
//!
//! # Theory
//! From the contact to the base the rod is an initial value problem in two unknowns: the force P, and the contact arc c or the friction T. It is
//! integrated piece by piece with the explicit method of order 8 of [`tableau`]; within a step 1/R is linear, so that on a cone the integrands of
//! linear theory are polynomials of degree two. What is integrated is the *difference to the resting whisker*, and the closure is written without the
//! lengths that cancel, so that small taps keep their digits in f32. Broyden's method, begun with a Jacobian of differences, closes the tap; large
//! drives are reached in strides.
//!
//! # Practice
//! Each rung has more steps than the one before. A tap whose estimated error exceeds the tolerance climbs, goes on from where it ended, and what the last rung cannot tell is left to
//! the reference, as is what lies next to a corner of the profile, the tip, or the end of the material.
//!
//! Taps are packed with those that agree in strides, steps and pieces (`classes`), so that the bits of one do not depend on the others.
//!
//! The cone's own kernel (`cpu::exact`) carries deviations from closed forms that only a clamped cone has; it is some ten times as fast.

// Index loops are what the lanes vectorise on.
#![allow(clippy::needless_range_loop)]

mod check;
mod classes;
pub mod device;
mod lanes;
mod newton;
mod rod;
mod shot;
pub mod tableau;

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

/// Effects of the model, the same of all taps of a batch; one that is off costs nothing.
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
    /// a.
    pub a: f64,
    /// r₀; 0 where the object moves.
    pub hub: f64,
    /// θ, or 0 where the object moves.
    pub turn: f64,
    /// δ, or 0 where the base turns.
    pub lift: f64,
    /// T/P of a contact that slides.
    pub ratio: f64,
    /// P of linear theory.
    pub force: f64,
    /// Strain that errors are relative to, at least.
    pub least: f64,
    /// ρ.
    pub pole: f64,
}

/// What a tap gives; mm, N, N mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Mean strain of the gauge's fibre.
    pub strain: f64,
    /// P.
    pub normal: f64,
    /// T.
    pub tangential: f64,
    /// c.
    pub arc: f64,
    /// M₀, F_x, F_y.
    pub wrench: [f64; 3],
    /// Estimated error relative to the strain, or to what errors are measured by at least.
    pub error: f64,
    /// Largest load of a fibre; above 1 it is outside the range of the law.
    pub load: f64,
    /// Times that the rod was integrated.
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

/// Steps between contact and base on each rung, at least.
const RUNGS: [usize; 4] = [3, 6, 14, 30];

/// Taps of one work item.
const GRAIN: usize = 64;

/// Taps that are solved side by side.
const LANES: usize = 8;

/// The same on the device of `solver`, where it has one; what it cannot tell is solved on the CPU.
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

/// A batch of them, of whiskers of one shape.
fn batch(
    device: &mut Gpu,
    precision: Precision,
    job: &Job<'_>,
    (shape, taps): (Shape, &[Tap<'_>]),
) -> Result<Vec<Solution>, SolveError> {
    let by_cpu = |taps: &[Tap<'_>]| solve(taps, job.effects, job.tolerance, job.chart);
    // Shaders in f64 have no powers.
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

/// The answers of the first rung to `taps` of whiskers of one shape in f64, by `device` and in lanes: for tests.
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

/// Solves `taps`, each to `tolerance` where a rung reaches it, with sections charted by `chart` where they are not Hooke's.
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
        // Those that go on from a rung below are packed apart from those that begin.
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

/// What a batch is solved with.
pub(crate) struct Job<'a> {
    effects: Effects,
    steps: usize,
    tolerance: f64,
    chart: Option<&'a Chart>,
}

/// A tap and where it goes on from, as all of a pack do or none.
type Begun<'a> = (Tap<'a>, Option<End<f64>>);

/// An answer and where it ended.
type Solved = (Solution, Option<End<f64>>);

/// Solves one work item, taps of one class, with the best instruction set there is.
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
