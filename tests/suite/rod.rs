//! The reference rod against published numbers; limits and symmetries (model §5).

use std::f64::consts::PI;

use crate::common::{all_effects, configuration, model, tap};
use glam::DVec2;
use vibrissa::physics::driven::Driven;
use vibrissa::physics::rod::{RodProblem, RodTap};
use vibrissa::physics::taper::Taper;
use vibrissa::scene::{Contact, Material, Model};
use vibrissa::status::Status;

fn hooke() -> Model {
    model(Material::Hooke(3.2))
}

#[track_caller]
fn assert_close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
}

#[track_caller]
fn assert_same(one: RodTap, other: RodTap, tolerance: f64) {
    assert_close(one.strain / other.strain, 1.0, tolerance);
    assert_close(one.normal_force / other.normal_force, 1.0, tolerance);
    assert_close(one.contact_arc / other.contact_arc, 1.0, tolerance);
    assert_close(one.tangential_force, other.tangential_force, tolerance * other.normal_force);
}

#[test]
fn uniform_rod_has_the_exact_elastica() {
    let model = hooke();
    for (degrees, base, strain, force, arc) in [
        (1.0, 1.50001, 0.9999275, 0.9999655, 1.0000305),
        (4.0, 6.00035, 0.9988397, 0.9994488, 1.0004877),
        (10.0, 15.00547, 0.9927540, 0.9965545, 1.0030584),
        (20.0, 30.04445, 0.9710969, 0.9862128, 1.0123834),
        (30.0, 45.15422, 0.9352594, 0.9689541, 1.0284497),
    ] {
        let problem = RodProblem { gauge: [0.0, 1e-8], ..tap(&model, 10.0, 40.0, degrees) };
        let (a, theta) = (problem.distance, problem.driven.size());
        let stiffness = 3.2 * PI * 10.0_f64.powi(4) / 64.0;
        let tap = problem.solve().unwrap();
        assert_close(tap.base_angle.to_degrees(), base, 0.51e-5);
        assert_close(tap.strain / (30.0 * theta / (2.0 * a)), strain, 0.51e-7);
        assert_close(tap.normal_force * a * a / (3.0 * stiffness * theta), force, 0.51e-7);
        assert_close(tap.contact_arc / a, arc, 0.51e-7);
    }
}

/// Tip angle and position of a clamped rod under a dead load on its tip, by the secant method in the angle.
fn cantilever(length: f64, taper: Taper, modulus: f64, load: DVec2) -> (f64, DVec2) {
    let model = model(Material::Hooke(modulus));
    let problem = RodProblem { taper, distance: length, ..tap(&model, 10.0, 40.0, 1.0) };
    let bent = |angle: f64| {
        let force = DVec2::from_angle(-angle).rotate(load);
        problem.bent(length, [-force.y, force.x], 1).unwrap().clamp
    };
    let lack = |angle: f64| bent(angle).angle + angle;
    let (mut before, mut now) = (0.0, -lack(0.0).signum() * 0.1);
    while (now - before).abs() > 1e-12 {
        let (lack_before, lack_now) = (lack(before), lack(now));
        (before, now) = (now, now - lack_now * (now - before) / (lack_now - lack_before));
    }
    let rod = bent(now);
    (now, DVec2::from_angle(-rod.angle).rotate(-rod.place))
}

#[test]
fn cantilevers_under_a_dead_load_are_the_published_ones() {
    for (slenderness, load, angle, deflection, shortening, digits) in [
        (1.0, 1.0, 0.461352, 0.301721, 0.056433, 1e-6),
        (1.0, 2.0, 0.781750, 0.493457, 0.160642, 1e-6),
        (1.0, 5.0, 1.215368, 0.713792, 0.387628, 1e-6),
        (1.0, 10.0, 1.430286, 0.810609, 0.554996, 1e-6),
        (0.7, 1.0, 0.6858840, 0.3879646, 0.1027618, 1e-7),
        (0.4, 1.0, 1.1270460, 0.4925373, 0.2017951, 1e-7),
    ] {
        // EI = 1 at the clamp.
        let taper = Taper::new(1.0, slenderness, 1.0);
        let (tip_angle, tip) = cantilever(1.0, taper, 64.0 / PI, DVec2::new(0.0, load));
        assert_close(tip_angle, angle, 0.51 * digits);
        assert_close(tip.y, deflection, 0.51 * digits);
        assert_close(1.0 - tip.x, shortening, 0.51 * digits);
    }
}

#[test]
fn square_cantilever_is_where_abaqus_has_it() {
    // A square of side b has EI = E b⁴/12, a circle of diameter b π E b⁴/64.
    let modulus = 210e3 * 64.0 / (12.0 * PI);
    let (_, tip) = cantilever(1000.0, Taper::new(10.0, 5.0, 1000.0), modulus, DVec2::new(-100.0, 100.0));
    println!("tip at {tip} mm");
    assert!(tip.distance(DVec2::new(821.444, 468.253)) < 0.1, "{tip}");
}

const LAWS: [Material; 5] = [
    Material::Hooke(3.2),
    Material::NeoHookean(3.2),
    Material::MooneyRivlin([0.35, 0.15]),
    Material::Yeoh([0.5, 0.1, 0.02]),
    Material::Yeoh([0.5, -0.3, 0.0]),
];

/// The gauge's position changes neither force nor contact, and strain × length adds up over its parts, also next to the contact or the clamp.
#[test]
fn gauges_that_end_next_to_the_contact_or_the_clamp_end_no_material() {
    for material in LAWS {
        let held = |contact| Model { contact, extension: true, ..model(material) };
        for model in [
            model(material),
            Model { pole_radius: 7.2, surface: true, ..model(material) },
            held(Contact::Stick),
            held(Contact::Coulomb(0.3)),
            Model { contact: Contact::Coulomb(0.3), ..all_effects(material) },
        ] {
            let whole = tap(&model, 9.9, 7.0, 5.0);
            let solve = |from: f64, to: f64| {
                let tap = RodProblem { gauge: [from, to], ..whole }.solve();
                let tap = tap.unwrap_or_else(|e| panic!("{model:?} gauge {from} … {to} mm: {e}"));
                (tap.strain * (to - from), tap)
            };
            let (_, plain) = solve(1.0, 2.0);
            let arc = plain.contact_arc;
            for delta in [1e-6, 1e-4, 1e-2] {
                for [from, at, to] in [[1.0, 5.0, arc - delta], [1.0, 5.0, arc + delta], [0.0, delta, 5.0]] {
                    let (all, near) = solve(from, to);
                    let parts = solve(from, at).0 + solve(at, to).0;
                    assert_close(parts / all, 1.0, 1e-9);
                    assert_close(near.normal_force / plain.normal_force, 1.0, 1e-10);
                    assert_close(near.contact_arc / arc, 1.0, 1e-10);
                }
                // Only a short part of this gauge lies before the contact.
                solve(arc - delta, arc + 2.0);
            }
        }
    }
}

/// Every law is linear at small strains, also with the contact 1e-6 radii from the clamp.
#[test]
fn contacts_next_to_the_clamp_of_a_thick_whisker_have_the_strain_of_hookes_rod() {
    for a in [1e-5, 1e-4, 1e-3, 1e-2] {
        for surface in [false, true] {
            let strain = |material: Material| {
                let model = Model { surface, extension: !surface, ..model(material) };
                let driven = Driven::Radians(1e-7 * a / 15.0);
                let tap =
                    RodProblem { gauge: [0.3 * a, 0.9 * a], driven, ..tap(&model, 4.0, a, 1.0) }.solve();
                tap.unwrap_or_else(|e| panic!("{material:?} surface {surface} a {a}: {e}")).strain
            };
            let hooke = strain(LAWS[0]);
            LAWS[1..].iter().for_each(|law| assert_close(strain(*law) / hooke, 1.0, 1e-6));
        }
    }
}

#[test]
fn tiny_taps_are_linear() {
    let model = hooke();
    for (d, distance, degrees) in
        [(10.0, 30.0, 1e-3), (4.0, 40.0, 1e-3), (14.0, 40.0, 1e-3), (0.2, 48.5, 1e-5)]
    {
        let problem = tap(&model, d, distance, degrees);
        let (a, tau) = (distance, problem.taper.tau);
        let [r1, r2] = problem.gauge.map(|x| (a - x) / (1.0 - tau * x));
        let [x1, x2] = problem.gauge;
        let strain = 30.0 / (4.0 * a * a) * (r1 - r2) * (r1 + r2) / (x2 - x1) * problem.driven.size();
        let force = 3.0 * PI * 3.2e4 * (1.0 - tau * a) / (64.0 * a * a) * problem.driven.size();
        let tap = problem.solve().unwrap();
        assert_close(tap.strain / strain, 1.0, 1e-8);
        assert_close(tap.normal_force / force, 1.0, 1e-8);
        assert_close(tap.contact_arc / a, 1.0, 1e-8);
    }
}

#[test]
fn large_taps_converge_or_say_why_not() {
    let (linear, rubber) = (hooke(), model(Material::NeoHookean(3.2)));
    let large = tap(&linear, 10.0, 40.0, 60.0).solve().unwrap();
    assert!(large.contact_arc > 44.0 && large.base_angle > 1.5);
    assert_eq!(tap(&linear, 4.0, 48.0, 60.0).solve(), Err(Status::NOT_CONVERGED));
    assert_eq!(tap(&rubber, 10.0, 12.0, 60.0).solve(), Err(Status::MATERIAL_LIMIT));
}

#[test]
fn cylinders_are_the_limit_of_cones() {
    for (model, _) in ["hooke", "surface", "timoshenko", "neo"].map(configuration) {
        let solve = |d| tap(&model, d, 40.0, 10.0).solve().unwrap();
        let (cylinder, narrow, wide) = (solve(10.0), solve(10.0 * (1.0 - 1e-7)), solve(10.0 * (1.0 + 1e-7)));
        let mean = RodTap {
            strain: 0.5 * (narrow.strain + wide.strain),
            normal_force: 0.5 * (narrow.normal_force + wide.normal_force),
            contact_arc: 0.5 * (narrow.contact_arc + wide.contact_arc),
            ..cylinder
        };
        assert_same(mean, cylinder, 1e-11);
        assert_same(narrow, cylinder, 1e-6);
    }
}

#[test]
fn rubber_bears_every_moderate_tap() {
    // Next to the contact of a cylinder the stretch is lost in the rounding of the bending strain (a = 39 mm, 4°).
    let rubber = |shear| Model { shear, extension: true, surface: true, ..model(Material::NeoHookean(3.2)) };
    for (model, d) in [(rubber(false), 10.0), (rubber(true), 10.0), (rubber(false), 4.0)] {
        for k in 0..300 {
            let (distance, degrees) = (20.0 + f64::from(k % 30), 0.1 + f64::from(k / 30));
            let tap = tap(&model, d, distance, degrees).solve();
            assert!(tap.is_ok_and(|tap| tap.strain > 0.0), "d {d}, a {distance}, {degrees}°: {tap:?}");
        }
    }
}

#[test]
fn gauges_see_nothing_beyond_the_contact() {
    let model = hooke();
    let strain = |gauge| RodProblem { gauge, ..tap(&model, 7.0, 30.0, 5.0) }.solve().unwrap().strain;
    assert_eq!(strain([31.0, 33.0]), 0.0);
    assert_close(strain([25.0, 45.0]), 0.5 * strain([25.0, 35.0]), 1e-13);
}

#[test]
fn nothing_moves_without_a_tap() {
    let model = hooke();
    let tap = tap(&model, 7.0, 30.0, 0.0).solve().unwrap();
    assert_eq!((tap.strain, tap.normal_force, tap.contact_arc), (0.0, 0.0, 30.0));
}
