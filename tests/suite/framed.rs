//! Strains of taps that are framed in lanes are those of taps solved one after the other, to the last bit.

use vibrissa::api::{BackendChoice, Contact, Drive, Material, Model, RunOptions, Setup, Side, Taps, Tuple};
use vibrissa::kernel::frames::{Framed, Framing};
use vibrissa::scene::Precision;
use vibrissa::scene::sampler::Sampler;

const TAPS: u32 = 6000;

/// Whiskers, gauges and taps of a search; every third has numbers of any size and sign among them, or poles that are not upright.
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
    Tuple { D, d, L_a, x_ss, l, a, drive, tilt, lean }
}

fn setups() -> Vec<(&'static str, Setup)> {
    let of = |model: Model| Setup { model, ..Setup::default() };
    let far = Setup::default();
    let gauge = vibrissa::scene::Gauge { side: Side::Far, ..far.gauge };
    let surface = Model { surface: true, pole_radius: 2.0, ..Model::default() };
    vec![
        ("plain", Setup::default()),
        ("far side", Setup { gauge, ..far }),
        ("shear, extension", of(Model { shear: true, extension: true, ..Model::default() })),
        ("pole", of(Model { pole_radius: 1.5, ..Model::default() })),
        (
            "law",
            of(Model {
                material: Material::NeoHookean(3.2),
                shear: true,
                pole_radius: 3.0,
                ..Model::default()
            }),
        ),
        ("surface", of(surface)),
        ("friction", of(Model { contact: Contact::Coulomb(0.2), extension: true, ..Model::default() })),
        ("hub", Setup { hub: 10.0, ..Setup::default() }),
        ("displaced", Setup { drive: Drive::Displacement, ..Setup::default() }),
    ]
}

#[test]
fn strains_have_the_bits_of_outcomes() {
    for (name, setup) in setups() {
        for precision in [Precision::F32, Precision::F64] {
            let options = RunOptions {
                backend: Some(BackendChoice::Cpu),
                precision: Some(precision),
                ..RunOptions::default()
            };
            let taps = Taps::new(setup.clone(), &options).unwrap();
            // The reference, which some of these are left to, is slow.
            let n = if ["plain", "far side", "pole"].contains(&name) { TAPS } else { TAPS / 10 } as usize;
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

#[test]
fn most_taps_of_a_search_are_framed_in_lanes() {
    let mut framed = Framed::default();
    for (name, setup) in setups() {
        let Some(framing) = Framing::new(&setup) else {
            assert!(["surface", "friction", "hub", "displaced"].contains(&name), "{name}");
            continue;
        };
        let inside = |i: usize| {
            let t = tap(3 * i as u32 + 2);
            [t.D, t.d, t.L_a, t.x_ss, t.l, 25.0 + 0.4 * t.a, t.drive]
        };
        framing.frame(1001, inside, &mut framed);
        let whole = framed.whole.iter().filter(|whole| **whole).count();
        assert!(framed.taps.len() == 1001 && whole > 990, "{name}: {whole}");
    }
}
