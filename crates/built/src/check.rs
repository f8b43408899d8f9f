//! Compares some answers of a device with those of the CPU in f64.

use super::{Job, Solution, Tap, solve};
use vibrissa_kernel::gpu::Passed;
use vibrissa_kernel::gpu::drawn::{drawn, key};

/// Largest error of wrench, forces and arc, in multiples of the tolerance, which bounds the error of the strain.
const FORCE: f64 = 10.0;

/// Compares some of the answers `found` to `taps` with those of the CPU.
///
/// # Errors
/// Answers that are wrong, with figures.
pub(super) fn compare(job: &Job<'_>, taps: &[Tap<'_>], found: &[Solution]) -> Result<Passed, String> {
    let tolerance = job.tolerance;
    let told = |s: &Solution| s.error <= tolerance;
    let drive = |i: usize| taps[i].turn.max(taps[i].lift);
    let of = |i: usize| key(&[taps[i].a, drive(i), taps[i].force, taps[i].least, taps[i].ratio]);
    let places = drawn(taps.len(), |i| told(&found[i]), of, drive);
    let those: Vec<Tap<'_>> = places.iter().map(|&i| taps[i]).collect();
    let known = solve(&those, job.effects, tolerance, job.chart);
    let (mut compared, mut apart, mut worst) = (0, 0, [0.0f64; 3]);
    for ((tap, known), &i) in those.iter().zip(&known).zip(&places).filter(|((_, known), _)| told(known)) {
        let errors = errors(tap, known, &found[i]).map(|e| e / (tolerance + known.error));
        let right = errors[0] <= 1.0 && errors[1] <= FORCE && errors[2] <= FORCE;
        (compared, apart) = (compared + 1, apart + usize::from(!right));
        worst = std::array::from_fn(|k| worst[k].max(errors[k]));
    }
    let [strain, force, arc] = worst;
    match apart {
        0 => Ok(Passed { taps: compared, worst: strain }),
        _ => Err(format!(
            "answers of built whiskers differ from those of the CPU: {apart} of {compared} are wrong, at worst the strain by {strain:.3e} times the \
             tolerance of {tolerance:e}, the force by {force:.3e} times and the contact arc by {arc:.3e} times"
        )),
    }
}

/// Errors of the strain, of forces and moment, and of the arc in `found`, relative to what the tolerance is relative to, to the force, and to a.
fn errors(tap: &Tap<'_>, known: &Solution, found: &Solution) -> [f64; 3] {
    let strain = (found.strain - known.strain).abs() / known.strain.abs().max(tap.least);
    let [moment, x, y] = std::array::from_fn(|k| found.wrench[k] - known.wrench[k]);
    let force = known.normal.hypot(known.tangential);
    let parts = [moment / tap.a, x, y, found.normal - known.normal, found.tangential - known.tangential];
    let off = parts.iter().fold(0.0, |worst: f64, part| worst.max(part.abs()));
    [strain, off / force, (found.arc - known.arc).abs() / tap.a]
}
