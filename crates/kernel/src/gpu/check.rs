//! Compares some answers of each batch of a device with those of the CPU in f64.

use rayon::prelude::*;
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;

use super::dispatch::GRAIN;
use crate::cpu::Cpu;
use crate::rule::every_rule;
use crate::{Job, Solution, Solver, Tap, trusted};

/// One tap in this many is compared.
const EVERY: u64 = 1024;

const LEAST: usize = 32;

/// Largest error of a reference answer, relative to the tolerance that is checked.
const KNOWN: f64 = 0.1;

/// Largest errors of force and arc, in tolerances, which bound the strain.
const FORCE: f64 = 10.0;

/// A comparison that passed: taps compared, and the largest error of the strain, relative to the tolerance.
pub(super) type Passed = (usize, f64);

/// Compares answers with those of the CPU. Fails, with figures, where one is wrong.
pub(super) fn compare(job: &Job<'_>, taps: &[Tap], found: &[Solution]) -> Result<Passed, SolveError> {
    let believed = |s: &Solution| s.within(trusted(&job.effects) * job.tolerance);
    let key = |t: &Tap| key(&[t.angle, t.near, t.rest, t.strain, t.arc]);
    let places = drawn(taps.len(), |i| believed(&found[i]), |i| key(&taps[i]), |i| taps[i].angle);
    let those: Vec<Tap> = places.iter().map(|&i| taps[i]).collect();
    // The finest rung, which solves most taps; it reads the same section law.
    let rule = &every_rule(Precision::F64)[if job.effects.plain() { 1 } else { 2 }];
    let finest = Job { rule, tolerance: KNOWN * job.tolerance, ..*job };
    let mut known = Vec::new();
    Cpu::new(Precision::F64).solve(&finest, &those, &mut known)?;
    let told = those.iter().zip(&known).zip(&places).filter(|((_, known), _)| known.within(finest.tolerance));
    let (mut compared, mut apart, mut worst) = (0, 0, [0.0_f64; 3]);
    for ((tap, known), &i) in told {
        let errors = errors(tap, known, &found[i]).map(|e| e / job.tolerance);
        compared += 1;
        worst = std::array::from_fn(|k| worst[k].max(errors[k]));
        apart += usize::from(!(errors[0] <= 1.0 + KNOWN && errors[1].max(errors[2]) <= FORCE));
    }
    let [strain, force, arc] = worst;
    match apart {
        0 => Ok((compared, strain)),
        _ => Err(SolveError::Device(format!(
            "answers differ from those of the CPU: {apart} of {compared} are wrong, at worst the strain by {strain:.3e} times the tolerance of \
             {:e}, the force by {force:.3e} times and the contact arc by {arc:.3e} times",
            job.tolerance
        ))),
    }
}

fn errors(tap: &Tap, known: &Solution, found: &Solution) -> [f64; 3] {
    let relative = |x: f64, known: f64| (x - known).abs() / (1.0 + known.abs());
    let strain =
        tap.weight * (found.strain - known.strain).abs() / (1.0 + known.strain).abs().clamp(1e-3, 1.0);
    let force = relative(found.force, known.force).max(relative(found.along, known.along));
    [strain, force, (found.arc - known.arc).abs()]
}

/// A hash of a tap's numbers, spread evenly over `u64`: whether a tap is drawn does not depend on the others.
pub fn key(numbers: &[f64]) -> u64 {
    let mix = |h: u64, x: &f64| (h ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    numbers.iter().fold(0, mix).wrapping_mul(0xbf58_476d_1ce4_e5b9)
}

/// Taps to compare of the first `count` that are `told`: one in 1024 by `key`, or the lowest keys; and the smallest and the largest `drive`.
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
