//! Coulomb friction between its limits, and where it takes over.

use super::*;
use vibrissa::status::Status;

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
        // Little friction is next to none, and not it.
        for (little, free) in of(Contact::Coulomb(1e-3)).iter().zip(&free) {
            let change = (little.strain / free.strain - 1.0).abs();
            assert!(change > 1e-6 && change < 1e-2, "{place:?}: {change}");
        }
    }
}

/// What a contact needs to stick, or to roll on a pole, is what sets it sliding.
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

#[test]
fn sliding_on_rubber_agrees() {
    let tuples = grid(&[2.5, 4.0, 8.0], &[12.0, 25.0, 40.0, 48.0], &[0.1, 3.0, 9.0]);
    for mu in [0.05, 0.3, 1.0, 3.0] {
        let exact = agree(&format!("μ = {mu}"), &setup(rubber(Contact::Coulomb(mu)), Side::Contact), &tuples);
        assert!(exact.iter().filter(|o| !o.status.has(Status::NOT_CONVERGED)).count() > 20);
    }
}
