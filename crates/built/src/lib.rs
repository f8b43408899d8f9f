//! Taps of built whiskers, all but a cone clamped at its base (model §7), on devices: `shaders/built.wgsl`.
//!
//! From the contact to the base the rod is an initial value problem in two unknowns: the force P, and the contact arc c or the friction T. Each piece
//! is integrated with the explicit method of order 8 of `tableau.rs`; within a step 1/R is linear. Broyden's method,
//! started from a finite-difference Jacobian, closes the tap; large drives are reached in strides. Taps whose estimated error exceeds the tolerance are
//! solved on the CPU ([`vibrissa_rod`]), which checks some of the others.

mod check;
mod classes;
pub mod device;
mod rod;
mod tableau;

use std::collections::{BTreeMap, HashMap};

pub use classes::Shape;
pub use rod::{Piece, Rod};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;
use vibrissa_kernel::{Chart, Solver, gpu::Gpu};
use vibrissa_rod::{Effects, Solution, solve};

/// One tap.
#[derive(Debug, Clone, Copy)]
pub struct Tap<'a> {
    /// The tap.
    pub tap: vibrissa_rod::Tap<'a>,
    /// P of linear theory, N.
    pub force: f64,
}

/// Least steps between contact and base.
const STEPS: usize = 3;

/// Solves `taps` on the device of `solver`, if it has one; the CPU solves what the device cannot.
pub fn solve_on(
    solver: &mut dyn Solver,
    taps: &[Tap<'_>],
    effects: Effects,
    (precision, tolerance): (Precision, f64),
    chart: Option<&Chart>,
) -> Result<Vec<Solution>, SolveError> {
    let plain: Vec<vibrissa_rod::Tap<'_>> = taps.iter().map(|tap| tap.tap).collect();
    let Some(device) = solver.device().filter(|_| !(effects.soft || effects.distorting || effects.roll))
    else {
        return Ok(solve(&plain, effects, tolerance, chart));
    };
    let job = Job { effects, steps: STEPS, tolerance, chart };
    let mut shapes: BTreeMap<Shape, Vec<usize>> = BTreeMap::new();
    let mut known: HashMap<*const vibrissa_rod::Rod, Shape> = HashMap::new();
    for (i, tap) in taps.iter().enumerate() {
        let rod = tap.tap.rod;
        let shape = *known.entry(std::ptr::from_ref(rod)).or_insert_with(|| Shape::of(&Rod::of(rod)));
        shapes.entry(shape).or_default().push(i);
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
    let by_cpu = |places: &[usize]| {
        let those: Vec<vibrissa_rod::Tap<'_>> = places.iter().map(|&i| taps[i].tap).collect();
        solve(&those, job.effects, job.tolerance, job.chart)
    };
    let all: Vec<usize> = (0..taps.len()).collect();
    // Foils are left to the CPU, and powers in double precision.
    let foil = taps.iter().any(|tap| tap.tap.rod.pieces.iter().any(|piece| piece.bends != 1.0));
    if foil || precision == Precision::F64 && shape.power {
        return Ok(by_cpu(&all));
    }
    let call = |device: &mut Gpu| device::solve(device, precision, job, (shape, taps));
    let found = device.attempt(taps.len(), call, |found| check::compare(job, taps, found))?;
    let Some(mut out) = found else { return Ok(by_cpu(&all)) };
    let open: Vec<usize> = all.into_iter().filter(|&i| out[i].error > job.tolerance).collect();
    for (&i, new) in open.iter().zip(by_cpu(&open)) {
        out[i] = Solution { sweeps: out[i].sweeps + new.sweeps, ..new };
    }
    Ok(out)
}

/// Answers of `device` to `taps` of whiskers of one shape in f64: for tests.
#[doc(hidden)]
pub fn on_device(
    device: &mut Gpu,
    taps: &[Tap<'_>],
    effects: Effects,
    tolerance: f64,
    chart: Option<&Chart>,
) -> Result<Vec<Solution>, SolveError> {
    let job = Job { effects, steps: STEPS, tolerance, chart };
    device::solve(device, Precision::F64, &job, (Shape::of(&Rod::of(taps[0].tap.rod)), taps))
}

pub(crate) struct Job<'a> {
    effects: Effects,
    steps: usize,
    tolerance: f64,
    chart: Option<&'a Chart>,
}
