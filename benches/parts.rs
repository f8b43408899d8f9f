//! Micro-benchmarks of the parts a tap goes through: `cargo bench --bench parts`. For speed against error see `vibrissa bench`.

use divan::{Bencher, black_box, counter::ItemsCount};
use vibrissa::census::Taps;
use vibrissa::census::bench::{exact, taps};
use vibrissa::census::cases::{Configuration, all};
use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Method, Outcome};
use vibrissa::kernel::cpu::Cpu;
use vibrissa::physics::inverse::Inverse;
use vibrissa::reduce::Spread;
use vibrissa::scene::{Precision, Tuple};
use vibrissa::sink::table::{Table, TapRow};
use vibrissa::statistics::{Reduction, Told};

fn main() {
    divan::main();
}

const TAPS: usize = 1 << 13;

fn method(taps: &Taps, precision: Precision, tolerance: f64) -> Method {
    Method::fast(Box::new(Cpu::new(precision)), precision, &taps.setup.model.material, tolerance)
}

fn outcomes(taps: &Taps) -> Vec<Outcome> {
    let mut evaluator = Evaluator::new(&taps.setup, method(taps, Precision::F32, 1e-5));
    evaluator.run(&taps.designs, &taps.tasks).expect("the CPU answers")
}

/// From tuple to outcome on all cores: hooke, neo, stick, linear.
mod kernel {
    use super::*;

    fn run(bencher: Bencher<'_, '_>, c: &Configuration, precision: Precision, tolerance: f64) {
        let taps = taps(c, TAPS);
        let mut evaluator = Evaluator::new(&taps.setup, method(&taps, precision, tolerance));
        bencher
            .counter(ItemsCount::new(TAPS))
            .bench_local(|| evaluator.run(&taps.designs, &taps.tasks).expect("the CPU answers"));
    }

    #[divan::bench(args = [0, 3, 5])]
    fn exact_f32(bencher: Bencher<'_, '_>, configuration: usize) {
        run(bencher, &exact()[configuration], Precision::F32, 1e-5);
    }

    #[divan::bench(args = [0, 3, 5])]
    fn exact_f64(bencher: Bencher<'_, '_>, configuration: usize) {
        run(bencher, &exact()[configuration], Precision::F64, 1e-8);
    }

    #[divan::bench]
    fn linear_f32(bencher: Bencher<'_, '_>) {
        run(bencher, &all()[0], Precision::F32, 1e-5);
    }
}

/// K statistics and distance estimates of one design with 10 distances and 100 drives.
mod reduction {
    use super::*;

    #[divan::bench]
    fn spread(bencher: Bencher<'_, '_>) {
        let values: Vec<f64> = (0..TAPS).map(|i| 1e-5 * (i as f64).sin()).collect();
        bencher.counter(ItemsCount::new(TAPS)).bench(|| {
            let mut s = Spread::default();
            black_box(&values).iter().for_each(|x| s.push(*x));
            s
        });
    }

    #[divan::bench]
    fn both_passes(bencher: Bencher<'_, '_>) {
        let taps = taps(&exact()[0], 1000);
        let (outcomes, design) = (outcomes(&taps), &taps.designs[0]);
        bencher.counter(ItemsCount::new(1000usize)).bench(|| {
            let mut reduced = Reduction::new(&taps.setup, design, [20.0, 48.0], (10, 100));
            for (k, o) in outcomes.iter().enumerate() {
                let tap = (taps.tasks[k].a, taps.tasks[k].drive);
                reduced.count((k % 10, k / 10), tap, black_box(o));
            }
            reduced.calibrate();
            for (k, o) in outcomes.iter().enumerate() {
                let tap = (taps.tasks[k].a, taps.tasks[k].drive);
                black_box(reduced.estimate((k % 10, k / 10), tap, o, Told::Formula));
            }
            reduced.drives
        });
    }
}

/// Distance from a reading: the closed form (Euler–Bernoulli), and the pieces of the curve with shear.
mod inverse {
    use super::*;

    fn run(bencher: Bencher<'_, '_>, shear: f64) {
        let taps = taps(&exact()[0], TAPS);
        let shared = taps.designs[0].shared.as_ref().expect("a whisker");
        let m = &shared.model;
        let curve = vibrissa::physics::linear::StrainCurve::new(m.taper, m.gauge, m.hub, m.drive, shear);
        let inverse = Inverse::new(curve.clone());
        let readings: Vec<f64> = (0..1000).map(|i| curve.value(20.0 + 0.028 * f64::from(i))).collect();
        bencher.counter(ItemsCount::new(readings.len())).bench(|| {
            readings.iter().filter_map(|f| inverse.roots(*black_box(f))).map(|r| r.far).sum::<f64>()
        });
    }

    #[divan::bench]
    fn closed_form(bencher: Bencher<'_, '_>) {
        run(bencher, 0.0);
    }

    #[divan::bench]
    fn with_shear(bencher: Bencher<'_, '_>) {
        run(bencher, 60.0);
    }
}

#[divan::bench]
fn csv(bencher: Bencher<'_, '_>) {
    let taps = taps(&exact()[0], 1000);
    let (outcomes, design): (_, &Design) = (outcomes(&taps), &taps.designs[0]);
    let mut reduced = Reduction::new(&taps.setup, design, [20.0, 48.0], (1, 1));
    let task = &taps.tasks[0];
    outcomes.iter().for_each(|o| reduced.count((0, 0), (task.a, task.drive), o));
    reduced.calibrate();
    let estimated = reduced.estimate((0, 0), (task.a, task.drive), &outcomes[0], Told::Formula);
    bencher.counter(ItemsCount::new(outcomes.len())).bench(|| {
        let columns = TapRow::chosen(&taps.setup);
        let mut table = Table::Tuples.heading().frame_for(&taps.setup);
        for (o, t) in outcomes.iter().zip(&taps.tasks) {
            let tap = Tuple { a: t.a, drive: t.drive, ..design.tuple.towards(t.direction) };
            let row = TapRow::of(&reduced, design, tap, (black_box(o), &estimated));
            table.row(columns.fields(&row)).expect("memory");
        }
        table.lines().expect("memory")
    });
}
