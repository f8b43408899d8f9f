//! What strain cannot depend on: the unit of length, the unit of stress, and which side the gauge is on for the forces.

use super::*;

/// Factors of lengths and of moduli. A shader contains the coefficients of the law. A power of two does not change them, so that the shader is compiled once.
fn factors(place: Place) -> &'static [f64] {
    let gpu = [GPU, GPU_F64].contains(&place);
    if gpu { &[1.0 / 1024.0, 1024.0] } else { &[1e-3, 0.03, 0.5, 7.0, 100.0, 1e3] }
}

fn taps() -> Vec<Tuple> {
    grid(&[4.0, 10.0, 12.0], &[6.0, 21.0, 45.0], &[0.01, 1.0, 6.0])
}

/// The setup with all lengths times `k`; its tuples are scaled apart.
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

/// The same taps but for forces times `force` and lengths times `length`.
#[track_caller]
fn same(name: &str, place: Place, one: &[Outcome], other: &[Outcome], [force, length]: [f64; 2]) {
    // Other rounding, amplified where the strain is a small difference: far below the tolerance.
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

/// The two sides mirror each other where the centreline keeps its length; else the strain of the axial force is added to both, at most
/// (|P| + |T|)/(E A) of the thinnest section of the gauge.
#[test]
fn the_side_of_the_gauge_is_nothing_to_the_rod() {
    let hooke = common::model(Material::Hooke(3.2));
    let thick = Model { surface: true, shear: true, pole_radius: 2.0, ..hooke };
    let stretched = common::all_effects(Material::Hooke(3.2));
    let models = CONFIGURATIONS.map(|name| (name, common::configuration(name).0));
    let models = models.into_iter().chain([("thick", thick), ("stretched", stretched)]);
    let tuples = grid(&[4.0, 10.0, 12.0], &[6.0, 8.0, 21.0, 45.0], &[0.01, 1.0, 6.0]);
    for (i, (name, model)) in models.enumerate() {
        // Each shader takes its time to compile, and those of the two precisions have one source.
        for place in [CPU, CPU_F64, [GPU, GPU_F64][i % 2], REFERENCE] {
            let of = |side| outcomes(&setup(model, side), place, &tuples);
            for ((near, far), t) in of(Side::Contact).iter().zip(&of(Side::Far)).zip(&tuples) {
                let said = format!("{name} {place:?} {t:?}: {near:?} {far:?}");
                assert_eq!((near.status, near.sticking), (far.status, far.sticking), "{said}");
                let close =
                    |a: f64, b: f64| (a - b).abs() <= bound(place) * near.normal_force.abs().max(near.arc);
                let rod = |o: &Outcome| [o.arc, o.normal_force, o.tangential_force];
                assert!(rod(near).into_iter().zip(rod(far)).all(|(a, b)| close(a, b)), "{said}");
                // In tension on the contact side, compressed on the far side.
                assert!(near.strain > 0.0 && far.strain < 0.0, "{said}");
                assert_eq!(near.strain_linear, -far.strain_linear, "{said}");
                if name == "hooke" || name == "thick" {
                    assert_eq!(
                        (near.strain, near.deviation, rod(near)),
                        (-far.strain, far.deviation, rod(far)),
                        "{said}"
                    );
                } else if name == "stretched" {
                    let axial = 0.5 * (near.strain + far.strain);
                    let radius = 0.5 * (t.D + (t.d - t.D) * (t.x_ss + t.l) / t.L_a);
                    let most = near.normal_force / (3.2 * std::f64::consts::PI * radius * radius);
                    let noise = bound(place) * near.strain.abs();
                    assert!(axial.abs() < most + noise, "{axial} {most}: {said}");
                }
            }
        }
    }
}
