//! Taps of whiskers of every kind, compared with the reference.

use vibrissa_core::physics::body::Body;
use vibrissa_core::physics::driven::Driven;
use vibrissa_core::physics::pole::{self, Pole};
use vibrissa_core::physics::rod::RodProblem;
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::built::{Built, Inner, Profile, Root};
use vibrissa_core::scene::{Clamp, Contact, Geometry, Material, Model, Precision, Side};
use vibrissa_kernel::Ladder;
use vibrissa_rod::{Effects, Rod, Tap, Tilt, solve};

const MODEL: Model = Model {
    geometry: Geometry::Exact,
    material: Material::Hooke(3.2),
    nu: 0.5,
    shear: false,
    extension: false,
    surface: false,
    pole_radius: 0.0,
    contact: Contact::Frictionless,
    indentation: false,
    distorting: false,
    clamp: Clamp::Rigid,
};

/// With all effects of a frictionless contact.
const ALL: Model =
    Model { material: Material::NeoHookean(3.2), shear: true, extension: true, surface: true, ..MODEL };

/// Tolerance of the strain, relative. Estimates are no bounds: one tap at 0.5 rad is 1.13e-8 off, so twice this passes.
const TOLERANCE: f64 = 1e-8;

/// A frictionless or sticking tap at `a`, mm, by `turn`, rad, with a hub of 4 mm.
fn tap<'a>(rod: &'a Rod, (a, turn): (f64, f64), model: &Model, tilt: Option<Tilt>) -> Tap<'a> {
    let (pole, soft) = (model.pole_radius, [0.0; 2]);
    Tap {
        rod,
        a,
        hub: 4.0,
        turn,
        lift: 0.0,
        ratio: 0.0,
        pole,
        softer: 1.0,
        soft,
        skin: None,
        tilt,
        least: 0.0,
    }
}

/// Compares taps at some distances and angles, rad; most of them must be solved.
fn compare(built: &Built, model: &Model, angles: &[f64]) {
    let (mut asked, mut told) = (0, 0);
    let (length, gauge_of) = (50.0, |body: &Body| body.gauge(5.0, 2.0));
    let section = Ladder::new(Precision::F64, &model.material, TOLERANCE).section;
    for (d, a) in [(2.0, 21.0), (4.0, 33.0), (7.0, 45.0), (10.0, 48.0), (11.0, 20.0)] {
        for &theta in angles {
            let body = Body::new(built, [10.0, d, length], model.material.e0(), model.nu);
            let gauge = gauge_of(&body);
            let problem = RodProblem {
                taper: Taper::new(10.0, d, length),
                gauge,
                side: Side::Contact,
                distance: a,
                hub: 4.0,
                driven: Driven::Radians(theta),
                foil: None,
                body: (*built != Built::CONE).then_some(&body),
                model,
            };
            let Ok(known) = problem.solve() else { continue };
            let rod = Rod::built(&body, gauge, None);
            let tap = tap(&rod, (a, theta), model, None);
            let effects = Effects::of(model, Side::Contact, model.contact == Contact::Stick);
            let found = solve(&[tap], effects, TOLERANCE, &section.charts())[0];
            asked += 1;
            if found.error > TOLERANCE {
                continue;
            }
            told += 1;
            let force = known.normal_force.hypot(known.tangential_force);
            let apart = [
                found.strain / known.strain - 1.0,
                (found.arc - known.contact_arc) / a,
                (found.normal - known.normal_force) / force,
                (found.tangential - known.tangential_force) / force,
                (found.wrench[0] - known.wrench[0]) / (force * a),
                (found.wrench[1] - known.wrench[1]) / force,
                (found.wrench[2] - known.wrench[2]) / force,
            ];
            assert!(
                apart[0].abs() <= 2.0 * TOLERANCE,
                "{apart:?}: d {d}, a {a}, {theta} of {built:?}, {model:?}"
            );
            assert!(apart.iter().all(|x| x.abs() <= 10.0 * TOLERANCE), "{apart:?}: {built:?}, {model:?}");
        }
    }
    assert!(told * 10 >= asked * 9 && told > 0, "{told} of {asked} are solved: {built:?}, {model:?}");
}

const ANGLES: [f64; 5] = [1e-4, 0.02, 0.1, 0.2, 0.5];

#[test]
fn cones_with_every_effect() {
    let all = Model { shear: true, extension: true, surface: true, ..MODEL };
    for model in [
        MODEL,
        all,
        Model { pole_radius: 3.0, ..all },
        Model { material: Material::NeoHookean(3.2), ..all },
        Model { material: Material::MooneyRivlin([0.35, 0.15]), ..all },
        Model { extension: true, contact: Contact::Stick, ..MODEL },
        Model { contact: Contact::Stick, ..all },
        Model { contact: Contact::Stick, pole_radius: 3.0, ..all },
    ] {
        compare(&Built::CONE, &model, &ANGLES);
    }
}

#[test]
fn built_whiskers() {
    let shear = Model { shear: true, extension: true, ..MODEL };
    let rolls = Model { contact: Contact::Stick, pole_radius: 3.0, surface: true, ..shear };
    let table = vec![[0.0, 10.0], [8.0, 9.2], [17.0, 8.6], [30.0, 6.2], [50.0, 4.0]];
    let inner = |modulus: f64, diameter: Vec<[f64; 2]>| Some(Inner { modulus, diameter });
    for (built, model) in [
        (Built { profile: Profile::Table(table), ..Built::CONE }, shear),
        (Built { profile: Profile::Power(2.0), ..Built::CONE }, Model { surface: true, ..shear }),
        (Built { inner: inner(0.0, vec![[0.0, 1.5], [25.0, 0.5]]), ..Built::CONE }, shear),
        (Built { inner: inner(60_000.0, vec![[0.0, 0.5], [50.0, 0.5]]), ..Built::CONE }, shear),
        (Built { curvature: [0.008, -1e-4], ..Built::CONE }, Model { surface: true, ..MODEL }),
        (Built { root: Root { k_theta: 800.0, k_y: 20.0, k_x: 30.0 }, ..Built::CONE }, shear),
        (Built { root: Root { k_theta: 800.0, k_y: 20.0, k_x: 30.0 }, ..Built::CONE }, rolls),
        (Built { inner: inner(0.0, vec![[0.0, 1.5], [25.0, 0.5]]), ..Built::CONE }, rolls),
    ] {
        compare(&built, &model, if model == rolls { &ANGLES[..4] } else { &ANGLES });
    }
}

/// Poles that are not upright, from the plane of a contact that has not turned.
#[test]
fn tilted_poles() {
    let all = Model { shear: true, extension: true, surface: true, ..MODEL };
    let (mut asked, mut told) = (0, 0);
    for model in
        [MODEL, all, Model { pole_radius: 3.0, ..all }, Model { material: Material::NeoHookean(3.2), ..all }]
    {
        let section = Ladder::new(Precision::F64, &model.material, TOLERANCE).section;
        for (k, [tilt, lean]) in
            [[0.0, 0.0], [0.3, 0.0], [0.0, 0.4], [-0.2, 0.3], [0.7, -0.6], [0.1, 1.1]].iter().enumerate()
        {
            for theta in ANGLES {
                let (d, a) = [(2.0, 21.0), (4.0, 33.0), (7.0, 45.0)][k % 3];
                let taper = Taper::new(10.0, d, 50.0);
                let gauge = taper.gauge(5.0, 2.0);
                let driven = Driven::Radians(theta);
                let problem = RodProblem {
                    taper,
                    gauge,
                    side: Side::Contact,
                    distance: a,
                    hub: 4.0,
                    driven,
                    foil: None,
                    body: None,
                    model: &model,
                };
                let Ok(known) = problem.solve_tilted([*tilt, *lean]) else { continue };
                let pole = Pole::new(&taper, &model, [*tilt, *lean], (a, 4.0, driven));
                let alpha = if model.surface { taper.tan_alpha.atan() } else { 0.0 };
                let azimuth = pole::azimuth(pole.along, alpha).expect("a plane");
                let planar = pole.planar(azimuth).expect("a pole that can be touched");
                let rod = Rod::cone(&taper, [3.2, model.nu], gauge, None);
                let seen = Some(Tilt { point: pole.point, along: pole.along, azimuth });
                let tap = tap(&rod, (planar.distance, planar.angle), &model, seen);
                let found =
                    solve(&[tap], Effects::of(&model, Side::Contact, false), TOLERANCE, &section.charts())[0];
                asked += 1;
                if found.error > TOLERANCE {
                    continue;
                }
                told += 1;
                let phi = pole::azimuth(pole.along, found.turned + alpha).expect("a plane");
                let bending = found.strain - found.axial;
                let apart = [
                    (found.axial + bending * phi.cos()) / known.tap.strain - 1.0,
                    (found.axial + bending * phi.sin() - known.strain_2) / known.tap.strain,
                    phi - known.azimuth,
                    (pole::slide(pole.point, pole.along, phi) - known.slide) / a,
                    (found.arc - known.tap.contact_arc) / a,
                    found.normal / known.tap.normal_force - 1.0,
                ];
                assert!(
                    apart.iter().all(|x| x.abs() <= 2.0 * TOLERANCE),
                    "{apart:?}: {tilt}, {lean}, {theta}, {model:?} {found:?}"
                );
            }
        }
    }
    assert!(told * 10 >= asked * 9 && told > 0, "{told} of {asked} are solved");
}

/// Contacts next to the gauge, under it and beyond it, which need different numbers of passes and charts: each has the same bits alone and among others,
/// also where panels of a whisker of four pieces were used before.
#[test]
fn neighbours_do_not_matter() {
    let profile = Profile::Table(vec![[0.0, 10.0], [14.0, 8.0], [23.0, 3.0], [30.0, 9.0], [50.0, 5.0]]);
    let pieces = Built { profile, ..Built::CONE };
    for (model, tolerance) in [(MODEL, 1e-5), (MODEL, TOLERANCE), (ALL, 1e-5), (ALL, TOLERANCE)] {
        let model = Model { pole_radius: 1.5, ..model };
        let rods: Vec<Rod> = (0..400)
            .map(|i| {
                let at = |step: usize, count: usize| (i * step % count) as f64 / count as f64;
                let (base, d, x_ss) = (8.0 + 4.0 * at(7, 11), 2.0 + 8.0 * at(5, 13), 3.0 + 9.0 * at(11, 17));
                let built = if i % 3 == 0 { &pieces } else { &Built::CONE };
                let body = Body::new(built, [base, d, 50.0], 3.2, 0.5);
                Rod::built(&body, body.gauge(x_ss, 2.0), None)
            })
            .collect();
        let at = |i: usize, [x1, x2]: [f64; 2]| {
            (x1 + (x2 - x1) * (0.1 + 0.3 * (i % 23) as f64), (0.1 + 0.7 * (i % 29) as f64).to_radians())
        };
        let taps: Vec<Tap<'_>> =
            rods.iter().enumerate().map(|(i, rod)| tap(rod, at(i, rod.gauge), &model, None)).collect();
        let effects = Effects::of(&model, Side::Contact, false);
        let section = Ladder::new(Precision::F64, &model.material, tolerance).section;
        let together = solve(&taps, effects, tolerance, &section.charts());
        assert!(together.iter().filter(|s| s.error <= tolerance).count() > 300);
        let bits = |x: f64| if x.is_nan() { 0 } else { x.to_bits() };
        for (tap, found) in taps.iter().zip(together) {
            let alone = solve(&[*tap], effects, tolerance, &section.charts())[0];
            assert_eq!(bits(alone.strain), bits(found.strain), "{tap:?}: {alone:?} {found:?}");
        }
    }
}
