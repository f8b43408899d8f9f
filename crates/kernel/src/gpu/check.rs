//! Some answers of each batch of a device beside those of the CPU in f64.

use rayon::prelude::*;
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;

use super::dispatch::GRAIN;
use crate::cpu::Cpu;
use crate::rule::every_rule;
use crate::{Job, Solution, Solver, Tap, trusted};

/// One of so many taps is drawn.
const EVERY: u64 = 1024;

/// Taps that are drawn at least of a batch that has them.
const LEAST: usize = 32;

/// Error of a known answer at most, relative to the tolerance that is checked.
const KNOWN: f64 = 0.1;

/// Largest errors of force and arc, in tolerances, which bound the strain.
const FORCE: f64 = 10.0;

/// A comparison that was passed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Passed {
    /// Taps compared.
    pub taps: usize,
    /// Largest error of the strain, relative to the tolerance.
    pub worst: f64,
}

/// Answers beside those that are known.
#[derive(Debug, Default)]
pub struct Seen {
    compared: usize,
    /// Those that are wrong.
    apart: usize,
    /// Largest errors of strain, force and arc, in tolerances.
    worst: [f64; 3],
}

impl Seen {
    /// An answer with these `errors` of strain, force and arc, in tolerances, of which the first may be `most`.
    pub fn add(&mut self, errors: [f64; 3], most: f64) {
        self.compared += 1;
        self.worst = std::array::from_fn(|k| self.worst[k].max(errors[k]));
        self.apart += usize::from(!(errors[0] <= most && errors[1].max(errors[2]) <= FORCE));
    }

    /// What was compared.
    ///
    /// # Errors
    /// Answers that are wrong, with figures.
    pub fn passed(&self, tolerance: f64) -> Result<Passed, SolveError> {
        let Self { compared, apart, worst: [strain, force, arc] } = self;
        match apart {
            0 => Ok(Passed { taps: *compared, worst: *strain }),
            _ => Err(SolveError::Device(format!(
                "answers differ from those of the CPU: {apart} of {compared} are wrong, at worst the strain by {strain:.3e} times the tolerance of \
                 {tolerance:e}, the force by {force:.3e} times and the contact arc by {arc:.3e} times"
            ))),
        }
    }
}

/// Compares some answers of a batch with those of the CPU.
///
/// # Errors
/// Answers that are wrong, with figures.
pub(super) fn compare(job: &Job<'_>, taps: &[Tap], found: &[Solution]) -> Result<Passed, SolveError> {
    let believed = |s: &Solution| s.within(trusted(&job.effects) * job.tolerance);
    let key = |t: &Tap| key(&[t.angle, t.near, t.rest, t.strain, t.arc]);
    let places = drawn(taps.len(), |i| believed(&found[i]), |i| key(&taps[i]), |i| taps[i].angle);
    let those: Vec<Tap> = places.iter().map(|&i| taps[i]).collect();
    // The finest rung, which solves most; it reads the same section law.
    let rule = &every_rule(Precision::F64)[if job.effects.plain() { 1 } else { 2 }];
    let finest = Job { rule, tolerance: KNOWN * job.tolerance, ..*job };
    let mut known = Vec::new();
    Cpu::new(Precision::F64).solve(&finest, &those, &mut known)?;
    let mut seen = Seen::default();
    for ((tap, known), &i) in those.iter().zip(&known).zip(&places) {
        if known.within(finest.tolerance) {
            seen.add(errors(tap, known, &found[i]).map(|e| e / job.tolerance), 1.0 + KNOWN);
        }
    }
    seen.passed(job.tolerance)
}

/// Errors of strain, force and arc, each relative to its size.
fn errors(tap: &Tap, known: &Solution, found: &Solution) -> [f64; 3] {
    let relative = |x: f64, known: f64| (x - known).abs() / (1.0 + known.abs());
    let strain =
        tap.weight * (found.strain - known.strain).abs() / (1.0 + known.strain).abs().clamp(1e-3, 1.0);
    let beside = (found.base - known.base).abs().max((found.axial - known.axial).abs());
    let force = relative(found.force, known.force).max(relative(found.along, known.along)).max(beside);
    [strain, force, (found.arc - known.arc).abs()]
}

/// A number that is spread evenly over `u64`, of the numbers of a tap alone: a tap is drawn or not whatever stands beside it.
pub fn key(numbers: &[f64]) -> u64 {
    let mix = |h: u64, x: &f64| (h ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    numbers.iter().fold(0, mix).wrapping_mul(0xbf58_476d_1ce4_e5b9)
}

/// Places of the taps to compare among the first `count`, of those that are `told`: one in 1024 by its `key`, those of the lowest keys where these are few, and
/// those of the smallest and the largest `drive`.
pub fn drawn(
    count: usize,
    told: impl Fn(usize) -> bool + Sync,
    key: impl Fn(usize) -> u64 + Sync,
    drive: impl Fn(usize) -> f64 + Sync,
) -> Vec<usize> {
    let all = || (0..count).into_par_iter().with_min_len(GRAIN).filter(|&i| told(i));
    let mut places: Vec<usize> = all().filter(|&i| key(i) < u64::MAX / EVERY).collect();
    if places.len() < LEAST {
        let mut keys: Vec<(u64, usize)> = all().map(|i| (key(i), i)).collect();
        keys.sort_unstable();
        places = keys.into_iter().take(LEAST).map(|(_, i)| i).collect();
    }
    let order = |i: &usize, k: &usize| drive(*i).total_cmp(&drive(*k)).then(i.cmp(k));
    places.extend(all().min_by(order).into_iter().chain(all().max_by(order)));
    places.sort_unstable();
    places.dedup();
    places
}
