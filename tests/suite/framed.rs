//! Taps framed in lanes have the strains of taps solved one by one, bit for bit.

use vibrissa::api::{BackendChoice, Contact, Drive, Material, RunOptions, Setup, Side, Taps, Tuple};
use vibrissa::design::Design;
use vibrissa::kernel::frames::{Framed, Framing};
use vibrissa::kernel::tap::{Frame, Tap};
use vibrissa::physics::driven::Driven;
use vibrissa::scene::Grip;
use vibrissa::scene::Precision;
use vibrissa::scene::sampler::Sampler;

const TAPS: u32 = 6000;

/// Random taps of a search; every third may have numbers of any size and sign, or a tilted pole.
#[allow(non_snake_case)]
fn tap(i: u32) -> Tuple {
    let uniform = |dimension: u32| f64::from(Sampler::Random.coordinate(7, dimension, i)) / 4_294_967_296.0;
    let ranges = [[8.0, 12.0], [2.0, 10.0], [50.0, 60.0], [0.0, 15.0], [1.0, 4.0], [1.0, 60.0], [0.1, 20.0]];
    let number = |k: u32| {
        let [low, high] = ranges[k as usize];
        let odd = i.is_multiple_of(3) && uniform(20 + k) < 0.2;
        let any = || 10f64.powf(40.0 * uniform(30 + k) - 20.0).copysign(uniform(40 + k) - 0.1);
        let ends = [0.0, f64::NAN, f64::INFINITY, 90.0, 1e308, 5e-324];
        match (odd, uniform(50 + k) < 0.3) {
            (true, true) => ends[(uniform(60 + k) * 6.0) as usize],
            (true, false) => any(),
            (false, _) => low + (high - low) * uniform(k),
        }
    };
    let [D, d, L_a, x_ss, l, a, drive] = std::array::from_fn(|k| number(k as u32));
    let [tilt, lean] = [70, 71].map(|k| if i % 50 == 1 { 20.0 * uniform(k) } else { 0.0 });
    Tuple { D, d, L_a, x_ss, l, a, drive, tilt, lean, rig: 0 }
}

/// The same at the ends of the domain: cylinders, sharp tips, gauges from the clamp, contacts on and next to the gauge and at the tip.
#[allow(non_snake_case)]
fn hard(i: u32) -> Tuple {
    let t = tap(i);
    let x2 = t.x_ss + t.l;
    match i % 10 {
        0 => Tuple { d: t.D, ..t },
        1 => Tuple { d: 1e-9 * t.D, ..t },
        2 => Tuple { d: 5e-4 * t.D, a: t.L_a * (1.0 - 1e-6), ..t },
        3 => Tuple { d: 3.0 * t.D, ..t },
        4 => Tuple { a: t.x_ss + 0.5 * t.l, ..t },
        5 => Tuple { a: x2 * (1.0 + 1e-9), ..t },
        6 => Tuple { a: t.L_a, ..t },
        7 => Tuple { x_ss: if i.is_multiple_of(20) { 0.0 } else { 1e-4 }, ..t },
        8 => Tuple { l: t.L_a - t.x_ss, ..t },
        _ => Tuple { d: 1e-17 * t.D, a: t.L_a, ..t },
    }
}

fn setups() -> Vec<(&'static str, Setup)> {
    let plain = Setup::default;
    let displaced = |setup: Setup| Setup { drive: Drive::Displacement, ..setup };
    let practical = || plain().surface().shear().extension();
    let law = || plain().material(Material::NeoHookean(3.2)).shear();
    let turned = vec![
        ("plain", plain()),
        ("far side", plain().side(Side::Far)),
        ("shear, extension", plain().shear().extension()),
        ("pole", plain().pole_radius(1.5)),
        ("law", law().pole_radius(3.0)),
        ("surface", plain().surface().pole_radius(2.0)),
        ("practical", practical().material(Material::NeoHookean(3.2))),
        ("far side, practical", practical().side(Side::Far).pole_radius(0.5)),
        ("hub", plain().hub(10.0)),
        ("hub, surface", plain().surface().hub(20.0).shear()),
        ("no friction", plain().contact(Contact::Coulomb(0.0)).extension()),
        ("stick", plain().contact(Contact::Stick).extension()),
        ("stick, practical", practical().contact(Contact::Stick).hub(3.0).pole_radius(1.0)),
    ];
    let moved = vec![
        ("displaced", displaced(plain().hub(5.0))),
        ("displaced, pole", displaced(plain().pole_radius(2.0).extension())),
        ("displaced, surface", displaced(plain().surface().pole_radius(2.0))),
        ("displaced, stick", displaced(practical().contact(Contact::Stick))),
    ];
    turned.into_iter().chain(moved).collect()
}

fn others() -> Vec<(&'static str, Setup)> {
    let plain = Setup::default();
    let gauge = vibrissa::scene::Gauge { second: true, ..plain.gauge };
    vec![
        ("friction", plain.clone().contact(Contact::Coulomb(0.2)).extension()),
        ("two gauges", Setup { gauge, ..plain.clone() }),
        ("linear", plain.linear()),
    ]
}

fn dimensions(t: &Tuple) -> [f64; 7] {
    [t.D, t.d, t.L_a, t.x_ss, t.l, t.a, t.drive]
}

fn alone(setup: &Setup, t: &Tuple) -> Option<Tap<f64>> {
    let design = Design::new(setup, *t);
    let shared = design.shared.as_ref().filter(|_| design.admits(setup, t.a, t.drive))?;
    let grip = if setup.model.contact == Contact::Stick { Grip::Stick } else { Grip::Slide(0.0) };
    Frame::new(setup, shared, (t.a, Driven::of_users(setup.drive, t.drive)), grip).map(|frame| *frame.tap())
}

#[test]
fn every_number_of_a_framed_tap_is_that_of_a_tap_framed_alone() {
    let mut framed = Framed::default();
    for (name, setup) in setups() {
        let framing = Framing::new(&setup).unwrap();
        let n = 30_000;
        let each = |i: usize| if i.is_multiple_of(2) { tap(i as u32) } else { hard(i as u32 / 2) };
        framing.frame(n, |i| dimensions(&each(i)), &mut framed);
        for i in (0..n).filter(|&i| framed.whole[i]) {
            let expected = alone(&setup, &each(i)).unwrap_or_else(|| panic!("{name}: {:?}", each(i)));
            let bits = |t: &Tap<f64>| t.map(f64::to_bits).values();
            let found = &framed.taps[i];
            assert_eq!(bits(found), bits(&expected), "{name}: {:?}: {found:?} {expected:?}", each(i));
        }
        let whole = framed.whole.iter().filter(|whole| **whole).count();
        assert!(whole > n / 8, "{name}: {whole} of {n}");
        let inside = |i: usize| {
            let t = tap(3 * i as u32 + 2);
            dimensions(&Tuple { x_ss: 3.0 + 0.3 * t.x_ss, a: 25.0 + 0.4 * t.a, ..t })
        };
        framing.frame(1001, inside, &mut framed);
        let whole = framed.whole.iter().filter(|whole| **whole).count();
        assert!(framed.taps.len() == 1001 && whole > 990, "{name}: {whole}");
    }
    for (name, setup) in others() {
        assert!(Framing::new(&setup).is_none(), "{name}");
    }
}

#[test]
fn strains_have_the_bits_of_outcomes() {
    for (name, setup) in setups().into_iter().chain(others()) {
        for precision in [Precision::F32, Precision::F64] {
            let options = RunOptions {
                backend: Some(BackendChoice::Cpu),
                precision: Some(precision),
                ..RunOptions::default()
            };
            let taps = Taps::new(setup.clone(), &options).unwrap();
            // The reference, which solves some of these, is slow, mostly with friction.
            let n = match name {
                "plain" | "far side" | "pole" => TAPS / 2,
                "friction" | "stick" | "stick, practical" | "displaced, stick" => TAPS / 300,
                _ => TAPS / 40,
            } as usize;
            let [mut expected, mut found] = [vec![0.0; n], vec![0.0; n]];
            taps.solve(|i| tap(i as u32), |o| o.strain, &mut expected).unwrap();
            taps.strains(|i| tap(i as u32), &mut found).unwrap();
            for i in 0..n {
                let [e, f] = [expected[i], found[i]];
                assert!(
                    e.to_bits() == f.to_bits() || e.is_nan() && f.is_nan(),
                    "{name}: {:?}: {e} {f}",
                    tap(i as u32)
                );
            }
            assert!(found.iter().filter(|x| x.is_finite()).count() > n / 2, "{name}");
        }
    }
}
