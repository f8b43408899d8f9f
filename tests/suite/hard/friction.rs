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

#[test]
fn friction_just_above_what_sticking_needs_sticks_and_just_below_slides() {
    let (mut stuck, mut slid) = (0, 0);
    for tuple in grid(&[4.0, 10.0], &[21.0, 45.0], &[0.1, 8.0]) {
        let tuples = [tuple];
        let stick = outcomes(&setup(rubber(Contact::Stick), Side::Contact), REFERENCE, &tuples)[0];
        let needed = stick.tangential_force.abs() / stick.normal_force;
        if needed <= 0.0 || !needed.is_finite() {
            continue;
        }
        for (side, margin) in [(1.0, 1e-3), (-1.0, 1e-3), (1.0, 0.2), (-1.0, 0.2)] {
            let mu = needed * (1.0 + side * margin);
            let setup = setup(rubber(Contact::Coulomb(mu)), Side::Contact);
            for place in ALL {
                let found = outcomes(&setup, place, &tuples)[0];
                assert_eq!(found.sticking, side > 0.0, "{place:?} {tuple:?} μ {mu}");
                if found.sticking {
                    stuck += 1;
                    assert!((found.strain / stick.strain - 1.0).abs() <= bound(place));
                } else {
                    slid += 1;
                    let ratio = found.tangential_force / found.normal_force;
                    assert!((ratio.abs() / mu - 1.0).abs() < 1e-6 && ratio * stick.tangential_force > 0.0);
                    // The slid solution leaves the sticking one continuously.
                    assert!((found.strain / stick.strain - 1.0).abs() < margin, "{place:?} {tuple:?} μ {mu}");
                }
            }
        }
    }
    assert!(stuck > 50 && slid > 50, "{stuck} {slid}");
}

#[test]
fn sliding_on_rubber_agrees() {
    let tuples = grid(&[2.5, 4.0, 8.0], &[12.0, 25.0, 40.0, 48.0], &[0.1, 3.0, 9.0]);
    for mu in [0.05, 0.3, 1.0, 3.0] {
        let exact = agree(&format!("μ = {mu}"), &setup(rubber(Contact::Coulomb(mu)), Side::Contact), &tuples);
        assert!(exact.iter().filter(|o| !o.status.has(Status::NOT_CONVERGED)).count() > 20);
    }
}
