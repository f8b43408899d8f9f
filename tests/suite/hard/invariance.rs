//! Strain does not depend on the unit of length or of stress; forces do not depend on the side of the gauge.

use super::*;

/// Factors of lengths and moduli. The shader contains the coefficients of the law; a power of two keeps them, so it is compiled once.
fn factors(place: Place) -> &'static [f64] {
    match place {
        GPU | GPU_F64 => &[1.0 / 1024.0, 1024.0],
        REFERENCE => &[0.03, 700.0],
        _ => &[1e-3, 0.03, 0.5, 7.0, 100.0, 1e3],
    }
}

fn taps() -> Vec<Tuple> {
    grid(&[4.0, 10.0, 12.0], &[6.0, 21.0, 45.0], &[0.01, 1.0, 6.0])
}

fn longer(setup: &Setup, k: f64) -> Setup {
    let mut longer = setup.clone();
    longer.hub *= k;
    longer.model.pole_radius *= k;
    longer
}

fn scaled(t: &Tuple, k: f64) -> Tuple {
    let mut all = t.to_array();
    all[..6].iter_mut().for_each(|length| *length *= k);
    Tuple::from_array(all)
}

fn stiffer(material: &Material, k: f64) -> Material {
    match *material {
        Material::Hooke(e) => Material::Hooke(k * e),
        Material::NeoHookean(e) => Material::NeoHookean(k * e),
        Material::MooneyRivlin(c) => Material::MooneyRivlin(c.map(|c| k * c)),
        Material::Yeoh(c) => Material::Yeoh(c.map(|c| k * c)),
    }
}

/// Fails unless taps are the same, up to the factors of forces and lengths.
#[track_caller]
fn same(name: &str, place: Place, one: &[Outcome], other: &[Outcome], [force, length]: [f64; 2]) {
    // Rounding differs, and is amplified where the strain is a small difference; still far below the tolerance.
    let close = 0.3 * bound(place);
    for (i, (a, b)) in one.iter().zip(other).enumerate() {
        assert_eq!((a.status, a.sticking), (b.status, b.sticking), "{name} {place:?} {i}");
        if a.strain.is_nan() {
            assert!(b.strain.is_nan());
            continue;
        }
        let forces = a.normal_force.abs().max(a.tangential_force.abs());
        for (x, y, scale) in [
            (a.strain, b.strain, a.strain.abs()),
            (a.strain_linear, b.strain_linear, a.strain_linear.abs()),
            (a.deviation, b.deviation, 1.0 + a.deviation.abs()),
            (a.normal_force, b.normal_force / force, forces),
            (a.tangential_force, b.tangential_force / force, forces),
            (a.arc, b.arc / length, a.arc),
        ] {
            assert!((x - y).abs() <= close * scale, "{name} {place:?} tap {i}: {x} is not {y}");
        }
    }
}

#[test]
fn units_of_length_and_stress_leave_the_strain_and_scale_the_force() {
    for name in CONFIGURATIONS {
        let (model, side) = common::configuration(name);
        let mut setup = setup(model, side);
        for (place, hub) in ALL.into_iter().flat_map(|place| [(place, 4.0), (place, 0.0)]) {
            setup.hub = hub;
            let one = outcomes(&setup, place, &taps());
            for &k in factors(place) {
                if hub > 0.0 {
                    let tuples: Vec<Tuple> = taps().iter().map(|t| scaled(t, k)).collect();
                    same(name, place, &one, &outcomes(&longer(&setup, k), place, &tuples), [k * k, k]);
                } else {
                    let mut stiff = setup.clone();
                    stiff.model.material = stiffer(&setup.model.material, k);
                    same(name, place, &one, &outcomes(&stiff, place, &taps()), [k, 1.0]);
                }
            }
        }
    }
}
