//! Every backend against cases of another code (model §5, hubs, passive drives), and device kernels against CPU kernels. Missing backends fail.

use crate::common::cases::{Kind, evaluate, known};
use crate::common::configuration;
use crate::common::specs;
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place, REFERENCE};
use vibrissa::census::{cases, sample};
use vibrissa::design::{Design, amount};
use vibrissa::kernel::cpu::Cpu;
use vibrissa::kernel::gpu::{self, Gpu};
use vibrissa::kernel::tap::{Ask, Frame};
use vibrissa::kernel::{Effects, Job, Rung, Solution, Solver, Tap};
use vibrissa::physics::onset::Grip;
use vibrissa::scene::{Contact, Precision, Tuple};
use vibrissa_built::on_device;
use vibrissa_rod::Rod;

/// Largest relative strain error allowed at the default `--tolerance`; for the reference, the error it must meet.
fn promised(place: Place) -> f64 {
    match place.precision {
        Precision::F32 => 1e-5,
        Precision::F64 if place == REFERENCE => 1e-9,
        Precision::F64 => 1e-8,
    }
}

/// Strain of every case of the other code; for Hooke's rod, and by the reference for every model, also forces, arc and sticking.
#[test]
fn every_backend_agrees_with_another_code() {
    let mut faults = Vec::new();
    for place in [REFERENCE, CPU, CPU_F64, GPU, GPU_F64] {
        for kind in Kind::ALL {
            for (name, mut known) in known(kind) {
                let (hooke, refers) = (name == "hooke", place == REFERENCE);
                if place == GPU_F64 && !hooke {
                    // Double precision is slow on a software device: it gets every second case.
                    let mut at = 0..;
                    known.retain(|_| at.next().is_some_and(|k| k % 2 == 0));
                }
                let mut setup = kind.setup();
                (setup.model, setup.gauge.side) = configuration(&name);
                let tuples: Vec<Tuple> = known.iter().map(|k| k.tuple).collect();
                let solved = evaluate(&setup, place.open(&setup), &tuples);
                let twice = !hooke && place.precision == Precision::F64 && !refers;
                let bound = promised(place) * if twice { 2.0 } else { 1.0 };
                for (known, (found, _)) in known.iter().zip(&solved) {
                    let mut told = |what: &str, wrong: bool| {
                        let at =
                            || format!("{place:?}, {kind:?} {name}, line {}: {what} {found:?}", known.line);
                        faults.extend(wrong.then(at));
                    };
                    told("status", hooke && !found.status.counts());
                    told("sticking", refers && known.sticks.is_some_and(|sticks| sticks != found.sticking));
                    let rubbed = if refers { known.rubbed } else { None };
                    let all = [
                        ("strain", found.strain, Some(known.strain)),
                        ("force", found.normal_force, Some(known.force)),
                        ("arc", found.arc, Some(known.arc)),
                        ("friction", found.tangential_force, rubbed),
                    ];
                    for (what, value, expected) in &all[..if hooke || refers { 4 } else { 1 }] {
                        let Some(expected) = *expected else { continue };
                        let size = if expected == 0.0 { 1.0 } else { expected.abs() };
                        let error = (value - expected).abs() / size;
                        told(what, error.is_nan() || error > bound);
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults.join("\n"));
}

/// Compares (estimated error, numbers) of device and CPU. Pairs with an error above 1e-2 have diverged and are left out; 2 % may differ.
#[track_caller]
fn are_the_same(name: &str, pairs: impl Iterator<Item = ((f64, Vec<f64>), (f64, Vec<f64>))>) {
    let near = |x: &f64, y: &f64| (x - y).abs() <= 1e-4 * y.abs() + 1e-11;
    let kept: Vec<_> = pairs.filter(|(a, b)| a.0 < 1e-2 || b.0 < 1e-2).collect();
    let apart: Vec<_> = kept.iter().filter(|(a, b)| !a.1.iter().zip(&b.1).all(|(x, y)| near(x, y))).collect();
    println!("{name}: {} of {} apart", apart.len(), kept.len());
    assert!(kept.len() > 100 && 50 * apart.len() <= kept.len(), "{name}: {:#?}", apart.first());
}

/// In f64 a device and the CPU take the same steps on a rung: all numbers agree, the estimated error and the count of sweeps included.
#[test]
fn the_kernels_of_device_and_cpu_are_the_same() {
    let mut device = Gpu::new(gpu::adapters().swap_remove(0), Precision::F64).expect("shaders with f64");
    let mut cpu = Cpu::new(Precision::F64);
    let all = cases::all();
    for name in ["hooke", "timoshenko-hub", "mooney-coulomb", "stick", "yeoh", "pole-far"] {
        let setup = all.iter().find(|c| c.name == name).expect("a configuration").setup.clone();
        let tuples = [cases::random(setup.drive, setup.hub > 0.0, 400, 9), cases::hard(&setup)].concat();
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
        let rung = &Rung::ladder(Precision::F64, &setup.model.material, 1e-8)[usize::from(name == "stick")];
        let job = Job { effects, rule: &rung.rule, tolerance: 1e-8, chart: rung.chart() };
        let (mut found, mut wanted) = (Vec::new(), Vec::new());
        device.solve(&job, &asked, &mut found).expect("answers");
        cpu.solve(&job, &asked, &mut wanted).expect("answers");
        let numbers = |s: &Solution| (s.error, s.values().to_vec());
        are_the_same(name, found.iter().map(numbers).zip(wanted.iter().map(numbers)));
    }
}

/// The shader of built whiskers and the solver of the CPU share no method: their answers differ by their errors.
#[test]
fn devices_and_the_cpu_agree_on_built_whiskers() {
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
        let rod = Rod::built(shared.body.as_deref().expect("a body"), shared.gauge, None);
        let tap = |t: &Tuple| {
            let turn = amount(setup.drive, t.drive);
            let tap = vibrissa_rod::Tap {
                rod: &rod,
                a: t.a,
                hub: setup.hub,
                turn,
                lift: 0.0,
                ratio: 0.0,
                pole: model.pole_radius,
                softer: 1.0,
                soft: [0.0; 2],
                skin: None,
                tilt: None,
                least: 1e-3 * turn * shared.peak,
            };
            vibrissa_built::Tap { tap, force: turn * shared.model.force(model.material.e0(), t.a) }
        };
        let asked: Vec<vibrissa_built::Tap<'_>> = tuples.iter().map(tap).collect();
        let effects = vibrissa_rod::Effects::of(model, setup.gauge.side, model.contact == Contact::Stick);
        let rungs = Rung::ladder(Precision::F64, &model.material, 1e-8);
        let chart = rungs.iter().rev().find_map(|rung| rung.chart());
        let device = on_device(&mut gpu, &asked, effects, 1e-6, chart).expect("answers");
        let plain: Vec<vibrissa_rod::Tap<'_>> = asked.iter().map(|tap| tap.tap).collect();
        let lanes = vibrissa_rod::solve(&plain, effects, 1e-8, chart);
        let mut compared = 0;
        for ((tap, one), other) in plain.iter().zip(&device).zip(&lanes) {
            if one.error > 1e-6 || other.error > 1e-8 {
                continue;
            }
            compared += 1;
            let force = other.normal.hypot(other.tangential);
            let strain = (one.strain - other.strain) / other.strain.abs().max(tap.least);
            let apart = [
                (one.normal - other.normal) / force,
                (one.tangential - other.tangential) / force,
                (one.arc - other.arc) / tap.a,
                (one.wrench[0] - other.wrench[0]) / (force * tap.a),
                (one.wrench[1] - other.wrench[1]) / force,
                (one.wrench[2] - other.wrench[2]) / force,
            ];
            // Estimates are no bounds.
            let errors = 2.0 * (one.error + other.error);
            assert!(strain.abs() <= errors, "{text}: {strain} for {tap:?}, {errors}");
            assert!(
                apart.iter().all(|x| x.abs() <= 10.0 * errors),
                "{text}: {apart:?} for {tap:?}, {errors}"
            );
        }
        assert!(3 * compared > plain.len(), "{text}: {compared} taps were solved by both");
    }
}
