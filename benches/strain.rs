//! Strains of single taps (`Taps::strains`, used by `vibrissa.strain` of Python) against the kernel alone, and the cost of framing, as tables.
//!
//! 10⁶ random taps of different whiskers, in CPU time of one thread. The kernel's taps are framed beforehand. Both take turns, round after round.
//! An argument names the models to measure.

mod clock;

use std::hint::black_box;

use clock::spent;
use vibrissa::api::{BackendChoice, Drive, Material, RunOptions, Setup, Taps, Tuple};
use vibrissa::design::Design;
use vibrissa::evaluate::Method;
use vibrissa::kernel::frames::{Framed, Framing};
use vibrissa::kernel::tap::Frame;
use vibrissa::kernel::{self, Effects, Tap};
use vibrissa::physics::driven::Driven;
use vibrissa::scene::Grip;
use vibrissa::scene::Precision;
use vibrissa::scene::sampler::Sampler;

const TAPS: usize = 1_000_000;

const ROUNDS: usize = 7;

/// Fewer taps for framing: one by one it can take microseconds.
const FRAMED: usize = TAPS / 10;

const BLOCK: usize = 1024;

/// Taps of one call of the kernel.
const PART: usize = 1 << 17;

fn models() -> Vec<(&'static str, Setup)> {
    let practical = Setup::default().material(Material::NeoHookean(3.2)).surface().shear().extension();
    let displaced = |setup: Setup| Setup { drive: Drive::Displacement, ..setup };
    vec![
        ("ideal rod", Setup::default()),
        ("surface", Setup::default().surface()),
        ("neo-hookean, surface, shear, extension", practical.clone()),
        ("surface, hub of 20 mm", Setup::default().surface().hub(20.0)),
        ("displacement", displaced(Setup::default())),
        ("displacement, surface", displaced(Setup::default().surface())),
        ("practical, displacement", displaced(practical)),
    ]
}

/// D 8…12, d 3…10, x_ss 3…8, l 1…4, a 21…48 mm, θ 0.5…10°, or δ as large as aθ.
fn tuple(kind: Drive, index: usize) -> Tuple {
    let unit = |k: u32| f64::from(Sampler::Random.coordinate(1, k, index as u32)) / 2f64.powi(32);
    let between = |k: u32, from: f64, to: f64| from + (to - from) * unit(k);
    let (a, theta) = (between(4, 21.0, 48.0), between(5, 0.5, 10.0));
    Tuple {
        D: between(0, 8.0, 12.0),
        d: between(1, 3.0, 10.0),
        L_a: 50.0,
        x_ss: between(2, 3.0, 8.0),
        l: between(3, 1.0, 4.0),
        a,
        drive: if kind == Drive::Angle { theta } else { a * theta.to_radians() },
        ..Tuple::default()
    }
}

fn framed(setup: &Setup, t: &Tuple) -> Option<Tap<f64>> {
    let design = Design::new(setup, *t);
    let shared = design.shared.as_ref().filter(|_| design.admits(setup, t.a, t.drive))?;
    Frame::new(setup, shared, (t.a, Driven::of_users(setup.drive, t.drive)), Grip::Slide(0.0))
        .map(|frame| *frame.tap())
}

fn told(mut all: Vec<f64>) -> [f64; 2] {
    all.sort_by(f64::total_cmp);
    [all[0], all[all.len() / 2]]
}

fn strains(setup: &Setup, precision: Precision, tuples: &[Tuple]) -> [Vec<f64>; 2] {
    let options =
        RunOptions { backend: Some(BackendChoice::Cpu), precision: Some(precision), ..RunOptions::default() };
    let taps = Taps::new(setup.clone(), &options).expect("the CPU opens");
    let Method::Fast { mut solver, ladder, tolerance } = taps.method().expect("the CPU opens") else {
        unreachable!("no reference here")
    };
    let effects = Effects::new(&setup.model, setup.gauge.side, false);
    let all: Vec<Tap<f64>> = tuples.iter().filter_map(|t| framed(setup, t)).collect();
    let (mut solutions, mut found) = (Vec::new(), vec![0.0; TAPS]);
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..=ROUNDS {
        times[0].push(spent(|| {
            for some in all.chunks(PART) {
                kernel::solve(solver.as_mut(), effects, &ladder.rungs, tolerance, some, &mut solutions)
                    .expect("the CPU answers");
            }
        }));
        times[1].push(spent(|| taps.strains(|i| tuples[i], &mut found).expect("the CPU answers")));
    }
    // The first round includes charting the law.
    times.map(|all| all[1..].to_vec())
}

/// Seconds to frame `tuples` one by one and in lanes, and the share framed in lanes.
fn framing(setup: &Setup, tuples: &[Tuple]) -> ([Vec<f64>; 2], f64) {
    let lanes = Framing::new(setup);
    let (mut some, mut whole, mut times) = (Framed::default(), 0, [Vec::new(), Vec::new()]);
    for _ in 0..ROUNDS {
        times[0].push(spent(|| {
            tuples.iter().for_each(|t| {
                black_box(framed(setup, t));
            });
        }));
        whole = 0;
        times[1].push(spent(|| {
            for tuples in tuples.chunks(BLOCK) {
                let Some(lanes) = &lanes else { continue };
                let of = |i: usize| {
                    let t: &Tuple = &tuples[i];
                    [t.D, t.d, t.L_a, t.x_ss, t.l, t.a, t.drive]
                };
                lanes.frame(tuples.len(), of, &mut some);
                whole += some.whole.iter().filter(|whole| **whole).count();
            }
        }));
    }
    (times, whole as f64 / tuples.len() as f64)
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test` also runs bench targets: skip it.
    if !args.iter().any(|a| a == "--bench") {
        return;
    }
    let wanted = |name: &str| args.iter().all(|a| a == "--bench" || a == name);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        println!(
            "| 10⁶ random taps, CPU s, least of {ROUNDS} (median) | kernel alone | strain | ratio (of medians) |"
        );
        println!("|---|---|---|---|");
        let models: Vec<_> = models().into_iter().filter(|(name, _)| wanted(name)).collect();
        let tuples =
            |setup: &Setup| -> Vec<Tuple> { (0..TAPS).map(|i| tuple(setup.drive, i)).collect() };
        for (name, setup) in &models {
            let tuples = tuples(setup);
            for (precision, word) in [(Precision::F32, "f32 to 1e-5"), (Precision::F64, "f64 to 1e-8")] {
                let [[kernel, middle], [least, median]] = strains(setup, precision, &tuples).map(told);
                println!(
                    "| {name}, {word} | {kernel:.3} ({middle:.3}) | {least:.3} ({median:.3}) | {:.2} ({:.2}) |",
                    least / kernel,
                    median / middle,
                );
            }
        }
        println!("\n| framing, ns a tap, least of {ROUNDS} (median) | one after the other | in lanes | share in lanes |");
        println!("|---|---|---|---|");
        for (name, setup) in &models {
            let (times, share) = framing(setup, &tuples(setup)[..FRAMED]);
            let per = 1e9 / FRAMED as f64;
            let [one, lanes] =
                times.map(told).map(|[least, median]| format!("{:.1} ({:.1})", per * least, per * median));
            println!("| {name} | {one} | {lanes} | {share:.5} |");
        }
    });
}
