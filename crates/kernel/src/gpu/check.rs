//! Answers of a device beside those of the CPU in f64: of known taps before a kernel is used, and of some taps of each batch.

use vibrissa_core::error::SolveError;
use vibrissa_core::physics::linear::{StrainCurve, shear_length2};
use vibrissa_core::physics::onset::Grip;
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::sampler::Sampler;
use vibrissa_core::scene::{Drive, Model, Precision, Side};

use super::dispatch::{Gpu, Kernel};
use super::drawn::{drawn, key};
use super::fault::Fault;
use crate::cpu::Cpu;
use crate::rule::every_rule;
use crate::tap::{Ask, Frame};
use crate::{Effects, Job, Solution, Solver, Tap, trusted};

/// Known taps.
const TAPS: u32 = 256;

/// Error of a known answer at most, relative to the tolerance that is checked.
const KNOWN: f64 = 0.1;

/// Errors of the strain at most, relative to the tolerance: what is promised, and what the known answer may be off.
const STRAIN: f64 = 1.0 + KNOWN;

/// The same of force and arc, which the tolerance does not bound.
const FORCE: f64 = 10.0;

/// Share of the taps that the CPU solves with the same kernel and that the device must solve as well.
const SOLVED: f64 = 0.95;

/// A check that was passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// Taps compared.
    pub taps: usize,
    /// Largest error of the strain, relative to the tolerance.
    pub worst: f64,
}

/// Whiskers and taps over the ranges that robots have, as `effects` need them: d/D of 0.3 to 1.2, gauges on the first third, contacts from
/// the gauge to the tip, angles of 0.1° to 12°.
fn known_taps(effects: &Effects) -> Vec<Tap> {
    let model =
        Model { shear: effects.shear, extension: effects.extension, surface: effects.offset, ..Model::PLAIN };
    let one = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(22, dimension, index)) / 2f64.powi(32);
        let length = 40.0 + 60.0 * unit(0);
        let taper = Taper::new(10.0, 3.0 + 9.0 * unit(1), length);
        let gauge = taper.gauge(0.3 * length * unit(2), 1.0 + 3.0 * unit(3));
        let a = gauge[1] + (length - gauge[1]) * (0.05 + 0.95 * unit(4));
        let hub = if index.is_multiple_of(4) { 10.0 * unit(5) } else { 0.0 };
        let shear = if effects.shear { shear_length2(&taper, model.nu) } else { 0.0 };
        let curve = StrainCurve::new(taper, gauge, hub, Drive::Angle, shear);
        let places = (1..=32).map(|k| curve.value(gauge[0] + f64::from(k) / 32.0 * (length - gauge[0])));
        let friction = if effects.extension && index.is_multiple_of(2) { 0.2 } else { 0.0 };
        let ask = Ask {
            model: &model,
            side: if effects.far { Side::Far } else { Side::Contact },
            curve: &curve,
            peak: places.fold(0.0, f64::max),
            a,
            amount: (0.1 * 120f64.powf(unit(6))).to_radians(),
            grip: if effects.stick {
                Grip::Stick
            } else {
                Grip::Slide(if effects.offset { friction } else { 0.0 })
            },
            start: 0.0,
        };
        Frame::new(&ask).map(|frame| *frame.tap())
    };
    (0..TAPS).filter_map(one).collect()
}

/// Solves known taps by `kernel`, that of `job`, and compares.
///
/// # Errors
/// Answers that are wrong or missing, with figures; a device that fails.
pub(super) fn check(gpu: &mut Gpu, kernel: &Kernel, job: &Job<'_>) -> Result<Passed, Fault> {
    let wrong = |why: String| Fault::Wrong(format!("its self-check failed: {why}"));
    let taps = known_taps(&job.effects);
    let mut found = Vec::new();
    let unwritten = gpu.batch(kernel, &taps, &mut found)?;
    if unwritten > 0 {
        return Err(wrong(format!(
            "{unwritten} of {} answers were not written as they should be",
            taps.len()
        )));
    }
    let mut twin = Vec::new();
    Cpu::new(gpu.precision()).solve(job, &taps, &mut twin)?;
    let seen = Seen::of(job, &taps, &known(job, &taps)?, &found);
    let [solved, expected] = [&found, &twin].map(|all| all.iter().filter(|s| believed(job, s)).count());
    let few = (solved as f64) < SOLVED * expected as f64;
    if seen.apart > 0 || few {
        let figures = seen.words(job.tolerance);
        return Err(wrong(format!("of known taps {figures}; it solved {solved}, the CPU {expected}")));
    }
    Ok(seen.passed())
}

/// Compares some answers of a batch with those of the CPU.
///
/// # Errors
/// Answers that are wrong, with figures.
pub(super) fn compare(job: &Job<'_>, taps: &[Tap], found: &[Solution]) -> Result<Passed, Fault> {
    let of = |i: usize| &taps[i];
    let key = |i: usize| key(&[of(i).angle, of(i).near, of(i).rest, of(i).strain, of(i).arc]);
    let places = drawn(taps.len(), |i| believed(job, &found[i]), key, |i| of(i).angle);
    let taps: Vec<Tap> = places.iter().map(|&i| taps[i]).collect();
    let found: Vec<Solution> = places.iter().map(|&i| found[i]).collect();
    let seen = Seen::of(job, &taps, &known(job, &taps)?, &found);
    match seen.apart {
        0 => Ok(seen.passed()),
        _ => {
            Err(Fault::Wrong(format!("answers differ from those of the CPU: {}", seen.words(job.tolerance))))
        }
    }
}

/// Whether a kernel is believed to have solved the tap of `s`.
fn believed(job: &Job<'_>, s: &Solution) -> bool {
    s.within(trusted(&job.effects) * job.tolerance)
}

/// What is right to a tenth of the tolerance.
fn known(job: &Job<'_>, taps: &[Tap]) -> Result<Vec<Solution>, SolveError> {
    let rules = every_rule(Precision::F64);
    // The finest rung, which solves most; it reads the same section law.
    let rule = &rules[if job.effects.plain() { 1 } else { 2 }];
    let finest = Job { rule, tolerance: KNOWN * job.tolerance, ..*job };
    let mut known = Vec::new();
    Cpu::new(Precision::F64).solve(&finest, taps, &mut known)?;
    Ok(known)
}

/// Answers beside those that are known.
#[derive(Default)]
struct Seen {
    compared: usize,
    /// Those that are wrong.
    apart: usize,
    /// Largest errors of strain, force and arc, in tolerances.
    worst: [f64; 3],
}

impl Seen {
    fn of(job: &Job<'_>, taps: &[Tap], known: &[Solution], found: &[Solution]) -> Self {
        let mut seen = Self::default();
        for ((tap, known), found) in taps.iter().zip(known).zip(found) {
            if !believed(job, found) || !known.within(KNOWN * job.tolerance) {
                continue;
            }
            let strain = tap.weight * (found.strain - known.strain).abs()
                / (1.0 + known.strain).abs().clamp(1e-3, 1.0);
            let force = (found.force - known.force).abs() / (1.0 + known.force.abs());
            let along = (found.along - known.along).abs() / (1.0 + known.along.abs());
            let beside = (found.base - known.base).abs().max((found.axial - known.axial).abs());
            let force = force.max(along).max(beside);
            let errors = [strain, force, (found.arc - known.arc).abs()].map(|e| e / job.tolerance);
            seen.compared += 1;
            seen.worst = std::array::from_fn(|k| seen.worst[k].max(errors[k]));
            seen.apart += usize::from(errors[0] > STRAIN || errors[1].max(errors[2]) > FORCE);
        }
        seen
    }

    fn words(&self, tolerance: f64) -> String {
        let Self { compared, apart, worst: [strain, force, arc] } = self;
        format!(
            "{apart} of {compared} are wrong, at worst the strain by {strain:.3e} times the tolerance of {tolerance:e}, \
             the force by {force:.3e} times and the contact arc by {arc:.3e} times"
        )
    }

    fn passed(&self) -> Passed {
        Passed { taps: self.compared, worst: self.worst[0] }
    }
}
