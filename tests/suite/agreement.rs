//! Every backend against cases of another code (model §5, hubs, passive drives), and device kernels against CPU kernels. Missing backends fail.

use crate::common::cases::{Kind, evaluate, known};
use crate::common::configuration;
use crate::common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place, REFERENCE};
use vibrissa::census::cases;
use vibrissa::design::Design;
use vibrissa::kernel::cpu::Cpu;
use vibrissa::kernel::gpu::{self, Gpu};
use vibrissa::kernel::tap::Frame;
use vibrissa::kernel::{Effects, Job, Ladder, Solution, Solver, Tap};
use vibrissa::physics::driven::Driven;
use vibrissa::scene::Grip;
use vibrissa::scene::{Contact, Precision, Tuple};

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
    for name in ["hooke", "timoshenko-hub", "mooney-coulomb", "yeoh", "pole-far"] {
        let setup = all.iter().find(|c| c.name == name).expect("a configuration").setup.clone();
        let tuples = [cases::random(setup.drive, setup.hub > 0.0, 400, 9), cases::hard(&setup)].concat();
        let grip = match setup.model.contact {
            Contact::Coulomb(mu) => Grip::Slide(mu),
            _ => Grip::Slide(0.0),
        };
        let frame = |t: &Tuple| {
            let shared = Design::new(&setup, *t).shared?;
            Frame::new(&setup, &shared, (t.a, Driven::of_users(setup.drive, t.drive)), grip).map(|f| *f.tap())
        };
        let asked: Vec<Tap> = tuples.iter().filter_map(frame).collect();
        let effects = Effects::new(&setup.model, setup.gauge.side, false);
        let rung = &Ladder::new(Precision::F64, &setup.model.material, 1e-8).rungs[0];
        let job = Job { effects, rule: &rung.rule, tolerance: 1e-8, chart: rung.section.chart() };
        let (mut found, mut wanted) = (Vec::new(), Vec::new());
        device.solve(&job, &asked, &mut found).expect("answers");
        cpu.solve(&job, &asked, &mut wanted).expect("answers");
        let numbers = |s: &Solution| (s.error, s.values().to_vec());
        are_the_same(name, found.iter().map(numbers).zip(wanted.iter().map(numbers)));
    }
}
