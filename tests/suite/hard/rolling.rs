//! Friction on a round pole: a contact that sticks rolls, another slides.

use super::*;
use crate::common::sweeping::{Table, number, sweep};
use crate::common::{all_effects, tap};
use vibrissa::physics::rod::RodProblem;
use vibrissa::scene::Drive;

/// Poles and coefficients of friction of a lab.
const POLES: [f64; 4] = [0.5, 2.0, 4.0, 10.0];

fn on_a_pole(model: Model, radius: f64) -> Model {
    Model { pole_radius: radius, ..model }
}

/// Whiskers, distances and angles at which contacts roll and slide.
fn taps() -> Vec<Tuple> {
    grid(&[3.0, 4.0, 10.0, 11.0], &[9.0, 21.0, 33.0, 47.0], &[0.05, 1.0, 4.0, 15.0])
}

#[test]
fn friction_on_a_pole_agrees_on_every_backend() {
    let centreline = Model { extension: true, ..common::model(Material::Hooke(3.2)) };
    let (mut stuck, mut slid) = (0, 0);
    for (name, model) in [("centreline", centreline), ("rubber", rubber(Contact::Frictionless))] {
        for radius in POLES {
            for mu in [0.1, 0.4, 1.0] {
                let model = on_a_pole(Model { contact: Contact::Coulomb(mu), ..model }, radius);
                let side = if radius > 3.0 { Side::Far } else { Side::Contact };
                let exact = agree(&format!("{name}, ρ {radius}, μ {mu}"), &setup(model, side), &taps());
                stuck += exact.iter().filter(|o| o.sticking).count();
                slid += exact.iter().filter(|o| !o.sticking && o.strain.is_finite()).count();
            }
        }
    }
    assert!(stuck > 100 && slid > 100, "{stuck} roll, {slid} slide");
}

#[test]
fn what_sticks_on_a_pole_agrees_on_every_backend() {
    for radius in POLES {
        let model = on_a_pole(rubber(Contact::Stick), radius);
        let mut setup = setup(model, Side::Contact);
        let exact = agree(&format!("stick, ρ {radius}"), &setup, &taps());
        assert!(exact.iter().filter(|o| o.strain.is_finite()).count() > 40);
        setup.hub = 10.0;
        agree(&format!("stick behind a hub, ρ {radius}"), &setup, &taps());
        (setup.hub, setup.drive) = (0.0, Drive::Displacement);
        let moved: Vec<Tuple> =
            taps().iter().map(|t| Tuple { drive: t.a * t.drive.to_radians(), ..*t }).collect();
        agree(&format!("stick, moved, ρ {radius}"), &setup, &moved);
    }
}

/// Forces and arc by another program, which adds up the slip of the skin along the path in steps and lets it be none
/// (1/n² towards n = ∞): D = 10, d = 4, L_a = 50 mm, E = 3.2 MPa, ν = 0.5; ρ, a, surface, drive, P, T, c.
#[test]
fn a_rolling_contact_does_not_slip() {
    let hooke = Material::Hooke(3.2);
    let all = Model { contact: Contact::Stick, ..all_effects(hooke) };
    let turned = |degrees: f64| (Drive::Angle, degrees.to_radians());
    for (radius, a, surface, (drive, amount), expected) in [
        (3.0, 33.0, true, turned(10.0), [0.586_088_96, -0.526_240_47, 32.733_013]),
        (4.0, 21.0, false, turned(5.0), [0.615_689_78, 0.173_891_25, 20.842_464]),
        (3.0, 33.0, true, (Drive::Displacement, 5.0), [0.577_303_78, -0.719_863_91, 32.366_222]),
    ] {
        let model = on_a_pole(Model { surface, ..all }, radius);
        let found =
            RodProblem { distance: a, drive, amount, ..tap(&model, 4.0, 33.0, 10.0) }.solve().unwrap();
        let found = [found.normal_force, found.tangential_force, found.contact_arc];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 5e-8, "ρ {radius}: {found} instead of {expected}");
        }
    }
}

#[test]
fn friction_on_a_thin_pole_is_that_on_an_edge_and_little_friction_is_none() {
    let of = |contact, radius| {
        outcomes(&setup(on_a_pole(rubber(contact), radius), Side::Contact), REFERENCE, &taps())
    };
    let near = |one: &[Outcome], other: &[Outcome], most: f64| {
        for (a, b) in one.iter().zip(other).filter(|(_, b)| b.strain.is_finite()) {
            assert!((a.strain / b.strain - 1.0).abs() < most && a.sticking == b.sticking, "{a:?} {b:?}");
        }
    };
    near(&of(Contact::Stick, 1e-6), &of(Contact::Stick, 0.0), 1e-5);
    near(&of(Contact::Coulomb(0.3), 1e-6), &of(Contact::Coulomb(0.3), 0.0), 1e-5);
    near(&of(Contact::Coulomb(1e-6), 4.0), &of(Contact::Frictionless, 4.0), 1e-5);
    near(&of(Contact::Coulomb(1e6), 4.0), &of(Contact::Stick, 4.0), 1e-12);
}

/// A sweep of a whisker that is, or is nearly, a cone against a pole of 4 mm.
fn lab(whisker: &str, contact: &str, place: Place) -> Table {
    let text = format!(
        "[whisker]\nD = 10\nd = 4\nL_a = 50\n{whisker}\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33, 45]\ntheta = [0.1, 1, 4, 8]\n\
         [model]\nsurface = true\nshear = true\nextension = true\npole_radius = 4\ncontact = {contact}\nmaterial = {{ hooke = 3.2 }}\n\
         [output]\nwrench = true\n"
    );
    sweep(&text, place).tuples
}

#[test]
fn friction_on_a_pole_of_built_whiskers_is_next_to_that_of_their_cone() {
    for contact in ["\"stick\"", "{ coulomb = 0.4 }", "{ coulomb = 5 }"] {
        let cone = lab("", contact, CPU);
        for shape in ["exponent = 1.00001", "curvature = 1e-7", "root = { k_theta = 1e7 }"] {
            let built = lab(shape, contact, CPU);
            for (one, other) in cone.rows.iter().zip(&built.rows) {
                assert_eq!(
                    (&one["status"], &one["contact_state"]),
                    (&other["status"], &other["contact_state"])
                );
                for column in
                    ["strain", "normal_force_N", "tangential_force_N", "contact_arc_mm", "base_moment_Nmm"]
                {
                    let [one, other] = [one, other].map(|row| number(row, column).expect("a value"));
                    assert!(
                        (one / other - 1.0).abs() < 1e-3,
                        "{shape}, {contact}, {column}: {other}, cone {one}"
                    );
                }
            }
        }
        for shape in [
            "exponent = 1.5",
            "exponent = 0.7",
            "curvature = -0.01",
            "root = { k_theta = 500, k_y = 20, k_x = 20 }",
        ] {
            let found = lab(shape, contact, CPU).rows;
            assert!(found.iter().all(|row| row["status"] != "not_converged"), "{shape}, {contact}");
        }
    }
}

#[test]
fn the_wrench_of_friction_on_a_pole_goes_through_the_contact() {
    for contact in ["\"stick\"", "{ coulomb = 0.4 }"] {
        let [exact, found] = [REFERENCE, CPU_F64].map(|place| lab("", contact, place));
        for (one, other) in exact.rows.iter().zip(&found.rows) {
            for column in ["base_moment_Nmm", "base_fx_N", "base_fy_N"] {
                let [one, other] = [one, other].map(|row| number(row, column).expect("a value"));
                assert!(
                    (one - other).abs() < 1e-6 * one.abs().max(1e-3),
                    "{contact}, {column}: {other}, reference {one}"
                );
            }
        }
    }
}
