//! Times beside the cone's kernel, one thread.
use std::time::Instant;
use vibrissa_core::physics::linear::{StrainCurve, shear_length2};
use vibrissa_core::physics::onset::Grip;
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::*;
use vibrissa_kernel::cpu::Cpu;
use vibrissa_kernel::tap::{Ask, Frame};
use vibrissa_kernel::{Effects as Old, Rung, solve};
use vibrissa_rod::*;

fn main() {
    let arg = |k: usize, d: f64| std::env::args().nth(k).map_or(d, |x| x.parse().unwrap());
    let (n, most_deg, practical) = (arg(1, 10.0) as usize, arg(2, 10.0), arg(3, 1.0) > 0.0);
    let tolerance = arg(4, 1e-8);
    let mut seed = 12345u64;
    let mut random = |lo: f64, hi: f64| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        lo + (hi - lo) * ((seed >> 11) as f64 / (1u64 << 53) as f64)
    };
    let count = 20000;
    let model = Model {
        geometry: Geometry::Exact,
        material: Material::Hooke(3.2),
        nu: 0.5,
        shear: practical,
        extension: practical,
        surface: practical,
        pole_radius: if practical { 3.0 } else { 0.0 },
        contact: Contact::Frictionless,
        indentation: false,
        distorting: false,
        clamp: Clamp::Rigid,
    };
    let mut rods = Vec::new();
    let mut frames = Vec::new();
    let mut asks = Vec::new();
    for _ in 0..count {
        let (big, small, length) = (random(8.0, 12.0), random(2.0, 8.0), 50.0);
        let taper = Taper::new(big, small, length);
        let gauge = taper.gauge(5.0, 2.0);
        let a = random(20.0, 48.0);
        let th = random(0.5, most_deg).to_radians();
        let shear = if practical { shear_length2(&taper, 0.5) } else { 0.0 };
        let curve = StrainCurve::new(taper, gauge, 0.0, Drive::Angle, shear);
        let peak = 0.8;
        frames.push(
            Frame::new(&Ask {
                model: &model,
                side: Side::Contact,
                curve: &curve,
                peak,
                a,
                amount: th,
                grip: Grip::Slide(0.0),
                start: 0.0,
            })
            .unwrap(),
        );
        rods.push(Rod::cone(&taper, [3.2, 0.5], gauge, None));
        asks.push((a, th));
    }
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let taps: Vec<Tap> = rods
        .iter()
        .zip(&asks)
        .map(|(rod, &(a, th))| Tap {
            rod,
            a,
            hub: 0.0,
            turn: th,
            lift: 0.0,
            ratio: 0.0,
            pole: model.pole_radius,
            softer: 1.0,
            soft: [0.0; 2],
            skin: None,
            least: 0.0,
        })
        .collect();
    let effects =
        Effects { shear: practical, extension: practical, surface: practical, ..Effects::default() };
    let precision = if n == 32 { Precision::F32 } else { Precision::F64 };
    let rungs = Rung::ladder(precision, &model.material, tolerance);
    let old = Old::new(&model, Side::Contact, false);
    let old_taps: Vec<_> = frames.iter().map(|f| *f.tap()).collect();
    let mut out = Vec::new();
    let known = vibrissa_rod::solve(&taps, effects, 1e-10, None);
    let (mut old_best, mut new_best) = (f64::MAX, f64::MAX);
    for round in 0..12 {
        let t = Instant::now();
        solve(&mut Cpu::new(precision), old, &rungs, tolerance, &old_taps, &mut out).unwrap();
        let old_time = t.elapsed().as_secs_f64() / count as f64 * 1e9;
        let t = Instant::now();
        let new = vibrissa_rod::solve(&taps, effects, tolerance, None);
        let new_time = t.elapsed().as_secs_f64() / count as f64 * 1e9;
        let (mut worst, mut old_worst, mut sweeps, mut old_sweeps) = (0.0f64, 0.0f64, 0.0, 0.0);
        let (mut open, mut errors) = (0, Vec::new());
        for i in 0..count {
            let e = (new[i].strain / known[i].strain - 1.0).abs();
            errors.push(e);
            worst = worst.max(e);
            open += usize::from(new[i].error > tolerance);
            let r = frames[i].response(&out[i]);
            old_worst = old_worst.max((r.strain / known[i].strain - 1.0).abs());
            sweeps += new[i].sweeps / count as f64;
            old_sweeps += out[i].sweeps / count as f64;
        }
        errors.sort_by(f64::total_cmp);
        old_best = old_best.min(old_time);
        new_best = new_best.min(new_time);
        let (old_time, new_time) = (old_best, new_best);
        if round == 11 {
            println!(
                "{:.2}: old {old_time:.0} ns {old_sweeps:.2} sweeps worst {old_worst:.1e}; new {new_time:.0} ns {sweeps:.2} sweeps worst {worst:.1e} p99 {:.1e} median {:.1e} open {open}",
                new_best / old_best,
                errors[count * 99 / 100],
                errors[count / 2]
            );
        }
    }
}
