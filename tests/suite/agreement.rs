//! Every backend against the same known answers: the cases of another code, of every configuration of model §5, hubs and passive drives
//! included, and random taps of the reference solver. A backend that the machine lacks fails.

use std::sync::LazyLock;

use crate::common::cases::{Kind, Known, evaluate, known, random};
use crate::common::configuration;
use crate::common::specs;
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place, REFERENCE};
use vibrissa::census::{configuration as configurations, hard, sample};
use vibrissa::design::{Design, amount};
use vibrissa::evaluate::Outcome;
use vibrissa::kernel::cpu::Cpu;
use vibrissa::kernel::gpu::{self, Gpu};
use vibrissa::kernel::tap::{Ask, Frame};
use vibrissa::kernel::{Effects, Job, Rung, Solution, Solver, Tap};
use vibrissa::physics::onset::Grip;
use vibrissa::scene::{Contact, Material, Precision, Tuple};
use vibrissa::status::Status;
use vibrissa_built::{Rod, first_rung};

/// Random taps of each kind.
const RANDOM: u32 = 800;

/// Share of the random taps that may remain `not_converged` where the reference has an answer.
const UNSOLVED: f64 = 0.01;

/// What is promised of the strain, relative, without any option (interface: defaults of `--tolerance`).
fn promised(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 1e-8 }
}

/// Errors and where they were met.
#[derive(Debug, Default)]
struct Census(Vec<(f64, String)>);

impl Census {
    fn push(&mut self, error: f64, at: impl FnOnce() -> String) {
        self.0.push((error, at()));
    }

    /// Prints worst, median and place; what exceeds `bound` goes to `faults`.
    fn close(mut self, name: &str, bound: f64, faults: &mut Vec<String>) {
        self.0.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (count, over) =
            (self.0.len(), self.0.iter().filter(|(error, _)| error.is_nan() || *error > bound).count());
        let (Some(median), Some((worst, at))) = (self.0.get(count / 2), self.0.last()) else {
            return faults.push(format!("{name}: nothing was compared"));
        };
        println!("{name:24} {count:4} compared, worst {worst:.1e}, median {:.1e}; worst: {at}", median.0);
        if over > 0 {
            faults.push(format!("{name}: {over} of {count} exceed {bound:.0e}, worst {worst:.2e} at {at}"));
        }
    }
}

/// Fails with all `faults`.
#[track_caller]
fn none(faults: &[String]) {
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn relative(value: f64, expected: f64) -> f64 {
    if value == expected { 0.0 } else { ((value - expected) / expected).abs() }
}

/// The cases of another code: strain; of Hooke's rod, to which the reference is held here, also force and arc.
fn agrees_with_another_code(place: Place) {
    let mut faults = Vec::new();
    let known = |kind: Kind| known(kind).into_iter().map(move |(name, rows)| (kind, name, rows));
    for (kind, name, mut known) in Kind::ALL.into_iter().flat_map(known) {
        let hooke = name == "hooke";
        if place.backend == REFERENCE.backend && !hooke {
            continue;
        }
        if place.precision == Precision::F64 && place.backend == GPU_F64.backend && !hooke {
            // Double precision is slow in software.
            let mut at = 0..;
            known.retain(|_| at.next().is_some_and(|k| k % 2 == 0));
        }
        let mut setup = kind.setup();
        (setup.model, setup.gauge.side) = configuration(&name);
        let tuples: Vec<Tuple> = known.iter().map(|k| k.tuple).collect();
        let solved = evaluate(&setup, place.open(&setup), &tuples);
        let mut census = [Census::default(), Census::default(), Census::default()];
        for (Known { line, strain, force, arc, .. }, (found, _)) in known.iter().zip(&solved) {
            assert!(!hooke || found.status.counts(), "{kind:?} line {line}: {}", found.status);
            let pairs = [(found.strain, *strain), (found.normal_force, *force), (found.arc, *arc)];
            for (census, (value, expected)) in census.iter_mut().zip(pairs) {
                census.push(relative(value, expected), || format!("line {line}"));
            }
        }
        let bound = promised(place) * if hooke || place.precision == Precision::F32 { 1.0 } else { 2.0 };
        for (census, quantity) in
            census.into_iter().zip(["strain", "force", "arc"]).take(if hooke { 3 } else { 1 })
        {
            census.close(&format!("{kind:?} {name}, {quantity}"), bound, &mut faults);
        }
    }
    none(&faults);
}

/// Random tuples of one kind and what the reference makes of them.
struct Sample {
    kind: Kind,
    tuples: Vec<Tuple>,
    answers: Vec<(Outcome, f64)>,
}

static SAMPLES: LazyLock<[Sample; 3]> = LazyLock::new(|| {
    Kind::ALL.map(|kind| {
        let tuples = random(kind, RANDOM);
        let answers = evaluate(&kind.setup(), REFERENCE.open(&kind.setup()), &tuples);
        Sample { kind, tuples, answers }
    })
});

/// Random taps: strain as the tolerance is defined, force and arc relative; none is solved that has no answer.
fn agrees_with_the_reference(place: Place) {
    let mut faults = Vec::new();
    for Sample { kind, tuples, answers } in &*SAMPLES {
        let solved = evaluate(&kind.setup(), place.open(&kind.setup()), tuples);
        let mut census = [Census::default(), Census::default(), Census::default()];
        let (mut unsolved, mut beyond) = (0, 0);
        for (i, ((found, _), (expected, least))) in solved.iter().zip(answers).enumerate() {
            let at = || format!("{kind:?} tap {i}: {:?}", tuples[i]);
            if expected.status.has(Status::NOT_CONVERGED) {
                beyond += 1;
                if !found.status.has(Status::NOT_CONVERGED) {
                    faults.push(format!("no equilibrium, yet {}: {}", found.status, at()));
                }
                continue;
            }
            if found.status.has(Status::NOT_CONVERGED) {
                unsolved += 1;
                println!("not_converged: {}", at());
                continue;
            }
            let edge = Status::SLIPPED_OFF | Status::STRAIN_LIMIT;
            if !(found.status | expected.status).has(edge) && found.status != expected.status {
                faults.push(format!("{} instead of {}: {}", found.status, expected.status, at()));
            }
            let strain = (found.strain - expected.strain).abs() / expected.strain.abs().max(*least);
            census[0].push(strain, at);
            census[1].push(relative(found.normal_force, expected.normal_force), at);
            census[2].push(relative(found.arc, expected.arc), at);
        }
        println!("{kind:?}: {unsolved} of {} not converged, {beyond} without equilibrium", tuples.len());
        if f64::from(unsolved) > UNSOLVED * tuples.len() as f64 {
            faults.push(format!("{unsolved} {kind:?} taps are not solved"));
        }
        for (census, quantity) in census.into_iter().zip(["strain", "force", "arc"]) {
            census.close(&format!("random {kind:?}, {quantity}"), promised(place), &mut faults);
        }
    }
    none(&faults);
}

macro_rules! backends {
    ($($name:ident: $place:expr;)*) => {$(
        mod $name {
            use super::*;

            #[test]
            fn agrees_with_another_code() {
                super::agrees_with_another_code($place);
            }

            #[test]
            fn agrees_with_the_reference() {
                super::agrees_with_the_reference($place);
            }
        }
    )*};
}

backends! {
    reference: REFERENCE;
    cpu_f32: CPU;
    cpu_f64: CPU_F64;
    gpu_f32: GPU;
}

/// On the first adapter that has f64 in its shaders; lavapipe is one, so a machine that tests has one.
#[test]
fn gpu_f64_agrees() {
    let adapters = gpu::adapters();
    let names: Vec<&str> = adapters.iter().map(|a| a.name.as_str()).collect();
    let first = adapters.first().is_some_and(|a| a.f64);
    assert!(
        first,
        "the adapter that is taken has no f64 in its shaders: {names:?} (Debian: apt install mesa-vulkan-drivers)"
    );
    agrees_with_another_code(GPU_F64);
    agrees_with_the_reference(GPU_F64);
}

/// Errors and all numbers of answers of a device and of the CPU, in pairs: the same but for rounding, which few taps make much of. What has gone astray has no number
/// worth a comparison.
#[track_caller]
fn are_the_same(name: &str, pairs: impl Iterator<Item = ((f64, Vec<f64>), (f64, Vec<f64>))>) {
    let near = |x: &f64, y: &f64| (x - y).abs() <= 1e-4 * y.abs() + 1e-11;
    let kept: Vec<_> = pairs.filter(|(a, b)| a.0 < 1e-2 || b.0 < 1e-2).collect();
    let apart: Vec<_> = kept.iter().filter(|(a, b)| !a.1.iter().zip(&b.1).all(|(x, y)| near(x, y))).collect();
    println!("{name}: {} of {} apart", apart.len(), kept.len());
    assert!(kept.len() > 100 && 50 * apart.len() <= kept.len(), "{name}: {:#?}", apart.first());
}

/// In f64 a device and the CPU do the same on a rung: every number of an answer, its estimated error and the sweeps among them.
#[test]
fn the_kernels_of_device_and_cpu_are_the_same() {
    let mut device = Gpu::new(gpu::adapters().swap_remove(0), Precision::F64).expect("shaders with f64");
    let mut cpu = Cpu::new(Precision::F64);
    let all = configurations::all();
    for (name, spatial) in [
        ("hooke", false),
        ("timoshenko-hub", true),
        ("mooney-coulomb", false),
        ("stick", true),
        ("yeoh", true),
        ("pole-far", true),
    ] {
        let setup = all.iter().find(|c| c.name == name).expect("a configuration").setup();
        let tuples = [hard::random(setup.drive, setup.hub > 0.0, 400, 9), hard::hard(&setup)].concat();
        let grip = match setup.model.contact {
            Contact::Stick => Grip::Stick,
            Contact::Coulomb(mu) => Grip::Slide(mu),
            Contact::Frictionless => Grip::Slide(0.0),
        };
        let frame = |t: &Tuple| {
            let shared = Design::new(&setup, *t).shared?;
            let (curve, peak, amount) = (&shared.model, shared.peak, amount(setup.drive, t.drive));
            let (model, side) = (&setup.model, setup.gauge.side);
            Frame::new(&Ask { model, side, curve, peak, a: t.a, amount, grip, start: 0.0 }).map(|f| *f.tap())
        };
        let asked: Vec<Tap> = tuples.iter().filter_map(frame).collect();
        let effects = Effects::new(&setup.model, setup.gauge.side, grip == Grip::Stick);
        let effects = Effects { spatial, ..effects };
        let rung = &Rung::ladder(Precision::F64, &setup.model.material, 1e-8)[usize::from(name == "stick")];
        let job = Job { effects, rule: &rung.rule, tolerance: 1e-8, chart: rung.chart() };
        let (mut found, mut wanted) = (Vec::new(), Vec::new());
        device.solve(&job, &asked, &mut found).expect("answers");
        cpu.solve(&job, &asked, &mut wanted).expect("answers");
        let numbers = |s: &Solution| (s.error, s.values().to_vec());
        are_the_same(name, found.iter().map(numbers).zip(wanted.iter().map(numbers)));
    }
}

/// In f64 a device and the lanes of the CPU do the same on a rung: every number of an answer, its estimated error and the shots among them.
#[test]
fn the_kernels_of_device_and_cpu_are_the_same_for_built_whiskers() {
    let mut gpu = Gpu::new(gpu::adapters().swap_remove(0), Precision::F64).expect("shaders with f64");
    for (whisker, model) in [
        (
            "bore = [[0, 3], [12, 2], [20, 1]]",
            "surface = true\nshear = true\nextension = true\npole_radius = 2",
        ),
        (
            "curvature = 0.006\ncurvature_slope = -1e-4",
            "surface = true\nmaterial = { yeoh = [0.5, -0.08, 0.02] }",
        ),
        ("core = { diameter = 0.5, modulus = 60000 }", "extension = true"),
        (
            "root = { k_theta = 500, k_y = 20, k_x = 30 }\nhub = 5",
            "extension = true\ncontact = \"stick\"\nmaterial = { mooney-rivlin = [0.35, 0.15] }",
        ),
    ] {
        let text = format!(
            "[whisker]\nD = 10\nd = 5\nL_a = 50\n{whisker}\n[gauge]\nx_ss = 5\nl = 2\n\
             [tap]\na = [6, 12, 23, 34, 45]\ntheta = {{ from = 0.01, to = 50, steps = 40 }}\n[model]\n{model}\n"
        );
        let study = specs::parse(&text).expect("a spec").study;
        let (setup, model) = (&study.setup, &study.setup.model);
        let tuples = sample::random(&study.space, 1000, 0);
        let shared = Design::new(setup, tuples[0]).shared.expect("a whisker");
        let rod = Rod::new(shared.body.as_deref().expect("a body"), shared.gauge);
        let tap = |t: &Tuple| {
            let turn = amount(setup.drive, t.drive);
            let force = turn * shared.model.force(model.material.e0(), t.a);
            let (hub, least, pole) = (setup.hub, 1e-3 * turn * shared.peak, model.pole_radius);
            vibrissa_built::Tap { rod: &rod, a: t.a, hub, turn, lift: 0.0, ratio: 0.0, force, least, pole }
        };
        let asked: Vec<vibrissa_built::Tap<'_>> = tuples.iter().map(tap).collect();
        let effects = vibrissa_built::Effects {
            shear: model.shear,
            extension: model.extension,
            surface: model.surface,
            stick: model.contact == Contact::Stick,
            law: !matches!(model.material, Material::Hooke(_)),
            far: false,
        };
        let rungs = Rung::ladder(Precision::F64, &model.material, 1e-8);
        let chart = rungs.iter().rev().find_map(|rung| rung.chart());
        let [device, lanes] = first_rung(&mut gpu, &asked, effects, 1e-8, chart).expect("answers");
        // A device judges the error by a shot more.
        let numbers = |s: &vibrissa_built::Solution, more: f64| {
            let ([moment, x, y], shots) = (s.wrench, s.shots - more);
            let of_tap = [s.strain, s.normal, s.tangential, s.arc, moment, x, y, s.error, s.load, shots];
            (s.error, of_tap.to_vec())
        };
        are_the_same(
            &text,
            device.iter().map(|s| numbers(s, 1.0)).zip(lanes.iter().map(|s| numbers(s, 0.0))),
        );
    }
}
