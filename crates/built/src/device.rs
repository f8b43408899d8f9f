//! The kernel on a device: its text, assembled for the effects of a batch, and its buffers. Twin of `lanes` and `newton`: `shaders/built.wgsl`.

use std::collections::HashMap;
use std::fmt::Write;

use super::newton;
use super::shot::GAUSS;
use super::{Effects, Job, Rod, Shape, Solution, Tap, lanes};
use vibrissa_core::error::SolveError;
use vibrissa_core::physics::tableau::{A, B, C, STAGES};
use vibrissa_core::scene::Precision;
use vibrissa_kernel::gpu::shader::{library, reals, rounding, structures, validate};
use vibrissa_kernel::gpu::{Gpu, Program};
use vibrissa_kernel::names;
use vibrissa_kernel::rule::limits::{HOPELESS, LOST, ROUNDINGS, TINY};

const TAP: [&str; 26] = names![
    first count a hub turn lift ratio force least pole begin end soft_theta soft_x soft_y curvature curvature_slope modulus
    core shear contact contact_slope wider tip length exponent
];

const PIECE: [&str; 8] = names![near far radius slope inner inner_slope gauge steps];

const ANSWER: [&str; 10] = names![strain normal tangential arc moment force_x force_y error load shots];

/// Taps of a batch: some milliseconds of work on a slow device.
pub(super) const BATCH: usize = 1 << 16;

/// Stands for an infinite arc in single precision.
const FAR: f64 = 1e30;

fn text(job: &Job<'_>, Shape { curved, inner, power }: Shape, precision: Precision) -> String {
    let rounding = rounding(precision);
    let Effects { shear, extension, surface, stick, law, far } = job.effects;
    let numbers = [
        ("ZERO", 0.0),
        ("ONE", 1.0),
        ("TWO", 2.0),
        ("FOUR", 4.0),
        ("HALF", 0.5),
        ("QUARTER", 0.25),
        ("EIGHTH", 0.125),
        ("TWENTY_FOURTH", 1.0 / 24.0),
        ("HUNDREDTH", 0.01),
        ("PI", std::f64::consts::PI),
        ("TINY", TINY),
        ("LEAST_SQUARE", lanes::least_square(rounding)),
        ("HOPELESS", HOPELESS),
        ("LOST", LOST),
        ("ROUNDINGS", ROUNDINGS),
        ("ROUNDING", rounding),
        ("TOLERANCE", job.tolerance),
        ("STEEPEST", lanes::STEEPEST),
        ("STRIDE", newton::STRIDE),
        ("MOST_STRIDES", newton::MOST_STRIDES as f64),
        ("STOP", newton::STOP),
        ("LONGEST", newton::LONGEST),
        ("PROBE", rounding.powf(newton::PROBE)),
        ("FORESEEN", newton::FORESEEN),
        ("UPRIGHT", newton::UPRIGHT),
        ("ACROSS", newton::ACROSS),
        ("CONTRACTED", newton::contracted(job.tolerance, rounding)),
        ("LEAST_ARC", newton::ARCS[0]),
        ("MOST_ARC", newton::ARCS[1]),
        ("LEAST_FORCE", newton::LEAST_FORCE),
        ("LEVERED", newton::LEVERED),
        ("WARY", newton::WARY),
        ("SIDE", if far { -1.0 } else { 1.0 }),
    ];
    let mut text = reals(precision, numbers);
    let switches = [
        ("SHEAR", shear),
        ("EXTENSION", extension),
        ("SURFACE", surface),
        ("STICK", stick),
        ("LAW", law),
        ("CURVED", curved),
        ("INNER", inner),
        ("POWER", power),
    ];
    for (name, on) in switches {
        let _ = writeln!(text, "const {name} = {on};");
    }
    text += &structures(&[("Tap", &TAP), ("Piece", &PIECE), ("Solution", &ANSWER)]);
    let _ = writeln!(text, "const STAGES = {STAGES}u;\nconst STEPS = {}u;", newton::STEPS);
    for (name, at) in tableau().1 {
        let _ = writeln!(text, "const {name} = {at}u;");
    }
    text += &library(precision, lanes::TERMS, job.chart.filter(|_| law));
    // A shader in double precision has no `pow`; such whiskers are left to the CPU.
    let powers = if precision == Precision::F32 { "pow(x, n)" } else { "x" };
    let _ = writeln!(text, "fn power(x: real, n: real) -> real {{\n    return {powers};\n}}");
    text + include_str!("../../../shaders/built.wgsl")
}

/// The tableau and Gauss's rule as numbers, and where each part begins.
fn tableau() -> (Vec<f64>, [(&'static str, usize); 7]) {
    let mut first = vec![0.0];
    let (mut before, mut shares): (Vec<f64>, Vec<f64>) = Default::default();
    for row in A {
        for (stage, share) in row {
            before.push(*stage as f64);
            shares.push(*share);
        }
        first.push(before.len() as f64);
    }
    let (mut numbers, mut parts) = (Vec::new(), [("PIECES", 0); 7]);
    let lists = [
        ("PLACES", C.to_vec()),
        ("FIRST", first),
        ("BEFORE", before),
        ("SHARES", shares),
        ("ENDS", B.concat()),
        ("GAUSS", GAUSS.concat()),
    ];
    for (part, (name, list)) in parts.iter_mut().zip(lists) {
        *part = (name, numbers.len());
        numbers.extend(list);
    }
    parts[6].1 = numbers.len();
    (numbers, parts)
}

pub(super) fn solve(
    device: &mut Gpu,
    precision: Precision,
    job: &Job<'_>,
    (shape, taps): (Shape, &[Tap<'_>]),
) -> Result<Vec<Solution>, SolveError> {
    let wgsl = text(job, shape, precision);
    let (numbers, shared) = numbers(taps, job.steps);
    let (count, words) = (taps.len(), ANSWER.len());
    let answers = device.compute(&Program {
        name: "built",
        wgsl: &wgsl,
        taps: &numbers,
        shared: &shared,
        count,
        words,
        counted: words - 1,
    })?;
    Ok(answers.chunks_exact(words).map(read).collect())
}

/// Validates the text of a batch, for tests.
///
/// # Errors
/// The text is not valid WGSL.
pub fn validated(
    (effects, shape): (Effects, Shape),
    (precision, tolerance): (Precision, f64),
    chart: Option<&vibrissa_kernel::Chart>,
) -> Result<(), SolveError> {
    let job = Job { effects, steps: 3, tolerance, chart };
    validate("built", &text(&job, shape, precision)).map(drop)
}

fn read(answer: &[f64]) -> Solution {
    let [strain, normal, tangential, arc, moment, x, y, error, load, shots] =
        std::array::from_fn(|k| answer[k]);
    let finite = answer.iter().all(|x| x.is_finite());
    let error = if finite { error } else { f64::INFINITY };
    Solution { strain, normal, tangential, arc, wrench: [moment, x, y], error, load, shots }
}

fn numbers(taps: &[Tap<'_>], steps: usize) -> (Vec<f64>, Vec<f64>) {
    let mut known: HashMap<*const Rod, usize> = HashMap::new();
    let (mut pieces, parts) = tableau();
    let begin = parts[6].1;
    let mut all = Vec::with_capacity(taps.len() * TAP.len());
    for tap in taps {
        let rod = tap.rod;
        let first = *known.entry(std::ptr::from_ref(rod)).or_insert_with(|| {
            let first = (pieces.len() - begin) / PIECE.len();
            for piece in &rod.pieces {
                let steps = piece.steps(steps) as f64;
                pieces.extend([piece.near, piece.far.min(FAR), piece.radius[0], piece.radius[1]]);
                pieces.extend([piece.inner[0], piece.inner[1], piece.gauge, steps]);
            }
            first
        });
        let [contact, contact_slope] = rod.radius(tap.a, tap.a);
        let [base, tip, n] = rod.power.unwrap_or([0.0; 3]);
        all.extend([first as f64, rod.pieces.len() as f64, tap.a, tap.hub, tap.turn, tap.lift, tap.ratio]);
        all.extend([tap.force, tap.least, tap.pole]);
        all.extend([rod.gauge[0], rod.gauge[1], rod.root[0], rod.root[1], rod.root[2]]);
        all.extend([rod.curvature[0], rod.curvature[1], rod.moduli[0], rod.moduli[1], 0.75 + 0.5 * rod.nu]);
        all.extend([contact, contact_slope, base - tip, tip, rod.length, n]);
    }
    (all, pieces)
}
