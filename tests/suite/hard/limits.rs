//! Limits in which one model becomes another: of materials, friction and poles.

use super::*;
use crate::common::{all_effects, tap};
use vibrissa::physics::driven::Driven;
use vibrissa::physics::rod::RodProblem;

#[test]
fn neo_hookean_becomes_hooke_as_the_angle_vanishes() {
    let hooke = setup(common::all_effects(Material::Hooke(3.2)), Side::Contact);
    let neo = setup(rubber(Contact::Frictionless), Side::Contact);
    for place in ALL {
        let apart = |degrees: f64| {
            let tuples = grid(&[4.0, 10.0], &[21.0, 45.0], &[degrees]);
            let (a, b) = (outcomes(&hooke, place, &tuples), outcomes(&neo, place, &tuples));
            a.iter().zip(&b).map(|(a, b)| (a.deviation - b.deviation).abs()).collect::<Vec<_>>()
        };
        // The difference in K − 1 is of first order in the strain: a tenth at a tenth of the angle, also in f32.
        for (wide, narrow) in apart(0.1).iter().zip(apart(0.01)) {
            assert!(*wide > 1e-5 && *wide < 1e-2, "{place:?}: {wide}");
            assert!((wide / narrow / 10.0 - 1.0).abs() < 0.02, "{place:?}: {wide} {narrow}");
        }
    }
}

fn taps() -> Vec<Tuple> {
    grid(&[4.0, 7.0, 10.0], &[21.0, 33.0, 45.0], &[0.1, 2.0, 8.0])
}

#[test]
fn no_friction_is_frictionless_and_much_friction_sticks() {
    let with = |contact| setup(rubber(contact), Side::Contact);
    for place in ALL {
        let of = |contact| outcomes(&with(contact), place, &taps());
        let same = |one: &[Outcome], other: &[Outcome]| {
            for (a, b) in one.iter().zip(other) {
                assert_eq!(
                    (a.strain, a.normal_force, a.arc, a.status),
                    (b.strain, b.normal_force, b.arc, b.status)
                );
                assert!(a.strain.is_finite(), "{place:?}: {a:?}");
            }
        };
        let (free, none) = (of(Contact::Frictionless), of(Contact::Coulomb(0.0)));
        same(&free, &none);
        assert!(none.iter().all(|o| o.tangential_force == 0.0 && !o.sticking));
        let (stick, much) = (of(Contact::Stick), of(Contact::Coulomb(1e6)));
        same(&stick, &much);
        assert!(much.iter().all(|o| o.sticking));
        for (little, free) in of(Contact::Coulomb(1e-3)).iter().zip(&free) {
            let change = (little.strain / free.strain - 1.0).abs();
            assert!(change > 1e-6 && change < 1e-2, "{place:?}: {change}");
        }
    }
}

/// Sliding begins at the friction that sticking (rolling on a pole) needs.
#[test]
fn friction_just_above_what_sticking_needs_sticks_and_just_below_slides() {
    let (mut stuck, mut slid) = (0, 0);
    let taps = grid(&[4.0, 10.0], &[21.0, 45.0], &[0.1, 8.0]);
    for (tuple, pole_radius) in taps.into_iter().flat_map(|tuple| [(tuple, 0.0), (tuple, 4.0)]) {
        let of = |contact, place| {
            let model = Model { pole_radius, ..rubber(contact) };
            outcomes(&setup(model, Side::Contact), place, &[tuple])[0]
        };
        let stick = of(Contact::Stick, REFERENCE);
        let needed = stick.tangential_force.abs() / stick.normal_force;
        if needed <= 0.0 || !needed.is_finite() {
            continue;
        }
        for (share, place) in [0.8, 0.999, 1.001, 1.2].into_iter().flat_map(|s| ALL.map(|place| (s, place))) {
            let mu = needed * share;
            let found = of(Contact::Coulomb(mu), place);
            let said = format!("{place:?} {tuple:?} ρ {pole_radius} μ {mu}");
            assert_eq!(found.sticking, share > 1.0, "{said}");
            let most = if share > 1.0 { bound(place) } else { 1.0 - share };
            assert!((found.strain / stick.strain - 1.0).abs() <= most, "no jump: {said}");
            (stuck, slid) = if share > 1.0 { (stuck + 1, slid) } else { (stuck, slid + 1) };
            if share < 1.0 && pole_radius == 0.0 {
                let ratio = found.tangential_force / found.normal_force;
                assert!(
                    (ratio.abs() / mu - 1.0).abs() < 1e-6 && ratio * stick.tangential_force > 0.0,
                    "{said}"
                );
            }
        }
    }
    assert!(stuck > 70 && slid > 70, "{stuck} {slid}");
}

/// Forces and arc from a program that sums the skin's slip along the path in n steps and makes it zero (error 1/n², extrapolated):
/// D = 10, d = 4, L_a = 50 mm, E = 3.2 MPa, ν = 0.5; ρ, a, surface, drive, P, T, c.
#[test]
fn a_rolling_contact_does_not_slip() {
    let hooke = Material::Hooke(3.2);
    let all = Model { contact: Contact::Stick, ..all_effects(hooke) };
    let turned = |degrees: f64| Driven::Radians(degrees.to_radians());
    for (radius, a, surface, driven, expected) in [
        (3.0, 33.0, true, turned(10.0), [0.586_088_96, -0.526_240_47, 32.733_013]),
        (4.0, 21.0, false, turned(5.0), [0.615_689_78, 0.173_891_25, 20.842_464]),
        (3.0, 33.0, true, Driven::Millimetres(5.0), [0.577_303_78, -0.719_863_91, 32.366_222]),
    ] {
        let model = Model { surface, pole_radius: radius, ..all };
        let found = RodProblem { distance: a, driven, ..tap(&model, 4.0, 33.0, 10.0) }.solve().unwrap();
        let found = [found.normal_force, found.tangential_force, found.contact_arc];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 5e-8, "ρ {radius}: {found} instead of {expected}");
        }
    }
}

#[test]
fn friction_on_a_thin_pole_is_that_on_an_edge_and_little_friction_is_none() {
    let of = |contact, radius| {
        outcomes(
            &setup(Model { pole_radius: radius, ..rubber(contact) }, Side::Contact),
            REFERENCE,
            &super::agreeing::on_poles(),
        )
    };
    let near = |one: &[Outcome], other: &[Outcome], most: f64| {
        for (a, b) in one.iter().zip(other).filter(|(_, b)| b.strain.is_finite()) {
            assert!((a.strain / b.strain - 1.0).abs() < most && a.sticking == b.sticking, "{a:?} {b:?}");
        }
    };
    near(&of(Contact::Stick, 1e-6), &of(Contact::Stick, 0.0), 1e-5);
    near(&of(Contact::Coulomb(0.3), 1e-6), &of(Contact::Coulomb(0.3), 0.0), 1e-5);
    near(&of(Contact::Coulomb(1e-6), 4.0), &of(Contact::Frictionless, 4.0), 1e-5);
}
