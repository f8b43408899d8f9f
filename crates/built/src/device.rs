//! The text of `shaders/built.wgsl`, assembled for the effects of a batch, and its buffers.

use std::collections::HashMap;
use std::fmt::Write;

use super::tableau::{A, B, C, STAGES};
use super::{Effects, Job, Rod, Shape, Solution, Tap};
use vibrissa_core::error::SolveError;
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

/// Terms of the series of a turn: accurate up to 2 rad.
const TERMS: usize = 14;

/// The largest ratio of radii over which 1/R is linear within a step.
const STEEPEST: f64 = 30.0;

/// Largest drive (rad, or δ/a) solved directly from the resting whisker; larger ones are reached in strides.
const STRIDE: f64 = 0.3;
const MOST_STRIDES: usize = 32;

/// Most steps of the iteration; share of the tolerance at which it stops; its largest step, relative.
const STEPS: usize = 14;
const STOP: f64 = 0.05;
const LONGEST: f64 = 0.5;

/// Finite-difference step of an unknown, as a power of the rounding.
const PROBE: f64 = 0.4;

/// Largest deviation of the force at the end of a stride from its extrapolation, relative; beyond it, it may be another branch.
const FORESEEN: f64 = 0.5;

/// Jacobian determinant over that at zero load; below this the path may have folded back.
const UPRIGHT: f64 = 0.1;

/// Floor of P over that of linear theory when its changes are taken relative to it.
const LEAST_FORCE: f64 = 1e-6;

/// Weight of the rounding of the contact's place in the error of the strain: next to the gauge the lever is short, and the error large.
const LEVERED: f64 = 0.5;

/// Least c/a, and largest.
const ARCS: [f64; 2] = [0.05, 3.0];

/// Safety factor on integration errors: the estimate is of one shot at its load.
const WARY: f64 = 3.0;

/// The relative error estimate e of y counts as e (ACROSS e)^¼, less than e below 1e-4.
const ACROSS: f64 = 1e4;

const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Stands for an infinite arc in single precision.
const FAR: f64 = 1e30;

fn text(job: &Job<'_>, Shape { curved, inner, power }: Shape, precision: Precision) -> String {
    let rounding = rounding(precision);
    let Effects { shear, extension, surface, stick, law, far, .. } = job.effects;
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
        ("LEAST_SQUARE", if rounding > 1e-10 { 1e-36 } else { 1e-300 }),
        ("HOPELESS", HOPELESS),
        ("LOST", LOST),
        ("ROUNDINGS", ROUNDINGS),
        ("ROUNDING", rounding),
        ("TOLERANCE", job.tolerance),
        ("STEEPEST", STEEPEST),
        ("STRIDE", STRIDE),
        ("MOST_STRIDES", MOST_STRIDES as f64),
        ("STOP", STOP),
        ("LONGEST", LONGEST),
        ("PROBE", rounding.powf(PROBE)),
        ("FORESEEN", FORESEEN),
        ("UPRIGHT", UPRIGHT),
        ("ACROSS", ACROSS),
        ("CONTRACTED", (2.0 * STOP * job.tolerance).max(1e3 * rounding)),
        ("LEAST_ARC", ARCS[0]),
        ("MOST_ARC", ARCS[1]),
        ("LEAST_FORCE", LEAST_FORCE),
        ("LEVERED", LEVERED),
        ("WARY", WARY),
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
    let _ = writeln!(text, "const STAGES = {STAGES}u;\nconst STEPS = {}u;", STEPS);
    for (name, at) in tableau().1 {
        let _ = writeln!(text, "const {name} = {at}u;");
    }
    text += &library(precision, TERMS, job.chart.filter(|_| law));
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
        // The lengths of its loops are data.
        bounded: false,
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
    let [strain, normal, tangential, arc, moment, x, y, error, load, sweeps] =
        std::array::from_fn(|k| answer[k]);
    let finite = answer.iter().all(|x| x.is_finite());
    let error = if finite { error } else { f64::INFINITY };
    Solution {
        strain,
        normal,
        tangential,
        arc,
        wrench: [moment, x, y],
        error,
        load,
        sweeps,
        ..Solution::FAILED
    }
}

fn numbers(taps: &[Tap<'_>], steps: usize) -> (Vec<f64>, Vec<f64>) {
    let mut known: HashMap<*const vibrissa_rod::Rod, (usize, Rod)> = HashMap::new();
    let (mut pieces, parts) = tableau();
    let begin = parts[6].1;
    let mut all = Vec::with_capacity(taps.len() * TAP.len());
    for &Tap { tap, force } in taps {
        let (first, rod) = &*known.entry(std::ptr::from_ref(tap.rod)).or_insert_with(|| {
            let rod = Rod::of(tap.rod);
            let first = (pieces.len() - begin) / PIECE.len();
            for piece in &rod.pieces {
                let steps = piece.steps(steps) as f64;
                pieces.extend([piece.near, piece.far.min(FAR), piece.radius[0], piece.radius[1]]);
                pieces.extend([piece.inner[0], piece.inner[1], piece.gauge, steps]);
            }
            (first, rod)
        });
        let [contact, contact_slope] = rod.radius(tap.a, tap.a);
        let [base, tip, n] = rod.power.unwrap_or([0.0; 3]);
        all.extend([*first as f64, rod.pieces.len() as f64, tap.a, tap.hub, tap.turn, tap.lift, tap.ratio]);
        all.extend([force, tap.least, tap.pole]);
        all.extend([rod.gauge[0], rod.gauge[1], rod.root[0], rod.root[1], rod.root[2]]);
        all.extend([rod.curvature[0], rod.curvature[1], rod.moduli[0], rod.moduli[1], 0.75 + 0.5 * rod.nu]);
        all.extend([contact, contact_slope, base - tip, tip, rod.length, n]);
    }
    (all, pieces)
}
