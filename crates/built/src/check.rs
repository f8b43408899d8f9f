//! Compares some answers of a device with those of the CPU in f64.

use vibrissa_rod::{Solution, solve};

use super::{Job, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_kernel::gpu::check::{Passed, Seen, drawn, key};

/// Compares some device answers with the CPU's f64 answers. Fails, with figures, where one is wrong.
pub(super) fn compare(job: &Job<'_>, taps: &[Tap<'_>], found: &[Solution]) -> Result<Passed, SolveError> {
    let told = |s: &Solution| s.error <= job.tolerance;
    let drive = |i: usize| taps[i].tap.turn.max(taps[i].tap.lift);
    let of = |i: usize| key(&[taps[i].tap.a, drive(i), taps[i].force, taps[i].tap.least, taps[i].tap.ratio]);
    let places = drawn(taps.len(), |i| told(&found[i]), of, drive);
    let those: Vec<vibrissa_rod::Tap<'_>> = places.iter().map(|&i| taps[i].tap).collect();
    let known = solve(&those, job.effects, job.tolerance, job.chart);
    let mut seen = Seen::default();
    for ((tap, known), &i) in those.iter().zip(&known).zip(&places).filter(|((_, known), _)| told(known)) {
        seen.add(errors(tap, known, &found[i]).map(|e| e / (job.tolerance + known.error)), 1.0);
    }
    seen.passed(job.tolerance)
}

/// Errors of the strain (over the strain), of forces and moment (over the contact force), and of the arc (over a).
fn errors(tap: &vibrissa_rod::Tap<'_>, known: &Solution, found: &Solution) -> [f64; 3] {
    let strain = (found.strain - known.strain).abs() / known.strain.abs().max(tap.least);
    let [moment, x, y] = std::array::from_fn(|k| found.wrench[k] - known.wrench[k]);
    let force = known.normal.hypot(known.tangential);
    let parts = [moment / tap.a, x, y, found.normal - known.normal, found.tangential - known.tangential];
    let off = parts.iter().fold(0.0, |worst: f64, part| worst.max(part.abs()));
    [strain, off / force, (found.arc - known.arc).abs() / tap.a]
}
