//! Taps read from a few drives against the same taps solved one by one: every configuration of model.md §5, three kinds of drive.

use crate::common::cases::Kind;
use crate::common::configuration;
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place};
use vibrissa::design::{Design, amount};
use vibrissa::evaluate::{Evaluator, Outcome, Task};
use vibrissa::scene::{Drive, Setup, Tuple};

const CONFIGURATIONS: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

fn setup(kind: Kind, name: &str) -> Setup {
    let (model, side) = configuration(name);
    let mut setup = kind.setup();
    (setup.model, setup.gauge.side) = (model, side);
    setup
}

/// Designs from strong to no taper, distances next to the gauge and up to the tip.
fn designs(setup: &Setup) -> (Vec<Design>, Vec<f64>) {
    let tuple = |tip: f64, place: f64| Tuple {
        D: 10.0,
        d: tip,
        L_a: 50.0,
        x_ss: place,
        l: 2.0,
        a: 30.0,
        drive: 1.0,
        ..Tuple::default()
    };
    let tuples = [tuple(3.0, 5.0), tuple(4.0, 0.0), tuple(7.0, 8.0), tuple(10.0, 5.0), tuple(12.0, 5.0)];
    (tuples.into_iter().map(|t| Design::new(setup, t)).collect(), vec![9.5, 21.0, 30.0, 39.0, 48.0, 50.0])
}

/// Outcomes over all drives, read and one by one, and how many taps the former solved.
fn both(place: Place, setup: &Setup, drives: &[f64]) -> (Vec<Outcome>, Vec<Outcome>, u64, Vec<f64>) {
    let (designs, distances) = designs(setup);
    let mut tasks = Vec::new();
    let mut least = Vec::new();
    for (k, design) in designs.iter().enumerate() {
        for &a in &distances {
            for &drive in drives {
                tasks.push(Task { design: k as u32, a, drive, ..Task::default() });
                least.push(1e-3 * design.shared.as_ref().unwrap().peak * amount(setup.drive, drive));
            }
        }
    }
    let mut evaluator = Evaluator::new(setup, place.open(setup));
    let (read, solved) = evaluator.run_over_drives(&designs, &tasks, drives).expect("it runs");
    let one_by_one = evaluator.run(&designs, &tasks).expect("it runs");
    (read, one_by_one, solved, least)
}

#[test]
fn reading_agrees_with_solving_on_every_configuration() {
    let mut lines = Vec::new();
    for (place, tolerance) in [(CPU, 1e-5), (GPU, 1e-5), (CPU_F64, 1e-8)] {
        for kind in Kind::ALL {
            for name in CONFIGURATIONS {
                let setup = setup(kind, name);
                let most = if kind.drive() == Drive::Displacement { 5.0 } else { 10.0 };
                let drives: Vec<f64> = (0..48).map(|j| 0.2 + (most - 0.2) * f64::from(j) / 47.0).collect();
                let (read, solved, count, least) = both(place, &setup, &drives);
                let (mut worst, mut worst_k, mut worst_others, mut readings) = (0.0f64, 0.0f64, 0.0f64, 0);
                for ((r, s), least) in read.iter().zip(&solved).zip(&least) {
                    assert_eq!((r.status, r.sticking), (s.status, s.sticking), "{place:?} {kind:?} {name}");
                    readings += usize::from(r.interpolated);
                    if !s.strain.is_finite() {
                        assert!(!r.strain.is_finite());
                        continue;
                    }
                    worst = worst.max((r.strain - s.strain).abs() / s.strain.abs().max(*least));
                    if s.deviation.is_finite() {
                        worst_k = worst_k.max((r.deviation - s.deviation).abs());
                    }
                    // The tolerance binds the strain; force and arc follow it by a small factor.
                    let force = (r.normal_force - s.normal_force).abs() / s.normal_force.abs();
                    let arc = (r.arc - s.arc).abs() / s.arc;
                    worst_others = worst_others.max(force).max(arc);
                }
                lines.push(format!(
                    "{place:?} {kind:?} {name}: strain {worst:.1e}, force and arc {worst_others:.1e}, K {worst_k:.1e}, {readings} of {} read, {count} solved",
                    read.len()
                ));
                assert!(worst <= tolerance && worst_others <= 10.0 * tolerance, "{}", lines.last().unwrap());
                // Most runs are smooth; with friction those that change from sticking to sliding are not.
                let least_read = if name == "mooney-coulomb" { 0 } else { read.len() / 2 };
                assert!(readings >= least_read, "{}", lines.last().unwrap());
                assert!(
                    count >= (read.len() - readings) as u64 && (readings == 0 || count < read.len() as u64)
                );
            }
        }
    }
    println!("{}", lines.join("\n"));
}

/// A run whose contact sticks at first and slides then is solved drive by drive.
#[test]
fn a_run_across_the_friction_boundary_is_not_read() {
    let setup = setup(Kind::Tap, "mooney-coulomb");
    let drives: Vec<f64> = (0..48).map(|j| 0.2 + 0.2 * f64::from(j)).collect();
    let (read, solved, ..) = both(CPU, &setup, &drives);
    let mut mixed = 0;
    for (read, solved) in read.chunks(drives.len()).zip(solved.chunks(drives.len())) {
        let sticking = solved.iter().filter(|s| s.sticking).count();
        if sticking > 0 && sticking < drives.len() {
            mixed += 1;
            assert!(read.iter().all(|r| !r.interpolated));
        }
    }
    assert!(mixed > 0, "no run crosses the boundary");
}
