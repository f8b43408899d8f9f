//! Sticking contacts next to fine tips: the force along the tip bends it as much as the force across.

use super::*;
use vibrissa::scene::sampler::Sampler;

/// Random whiskers, most of them with a fine tip, D 8–12, d 2–10, contacts from 20 mm to the tip, 0.1–10°.
fn random(n: u32) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(11, dimension, index)) / 2f64.powi(32);
        let (wide, tip) = (8.0 + 4.0 * unit(0), 2.0 + 8.0 * unit(1) * unit(5));
        let (x_ss, l, a) = (3.0 + 9.0 * unit(2), 1.0 + 3.0 * unit(6), 20.0 + 30.0 * unit(3));
        Tuple::from_array([wide, tip, 50.0, x_ss, l, a, 0.0, 0.0, 0.1 + 9.9 * unit(4)])
    };
    (0..n).map(point).collect()
}

#[test]
fn every_sticking_tap_of_the_reference_is_solved() {
    let mut on_centreline = common::model(Material::Hooke(3.2));
    (on_centreline.contact, on_centreline.extension) = (Contact::Stick, true);
    let hooke = Model { contact: Contact::Stick, ..common::all_effects(Material::Hooke(3.2)) };
    let tuples = random(1200);
    for (name, model) in
        [("hooke", hooke), ("neo-hookean", rubber(Contact::Stick)), ("on the centreline", on_centreline)]
    {
        let exact = agree(name, &setup(model, Side::Contact), &tuples);
        assert!(exact.iter().all(|o| o.strain.is_finite()), "{name}");
    }
}

#[test]
fn fine_tips_stick_up_to_their_end() {
    let tuples = grid(&[2.0, 4.0], &[36.0, 39.0, 42.0, 45.0, 48.0, 49.5], &[5.0, 7.5, 10.0]);
    for material in [Material::Hooke(3.2), Material::NeoHookean(3.2)] {
        let model = Model { contact: Contact::Stick, ..common::all_effects(material) };
        agree(&format!("{material:?}"), &setup(model, Side::Contact), &tuples);
    }
}

#[test]
fn hubs_at_large_angles_slide() {
    let mut setup = setup(rubber(Contact::Frictionless), Side::Contact);
    let tuples = grid(&[2.5, 4.0, 8.0], &[20.0, 35.0, 45.0], &[10.0, 15.0, 20.0]);
    for hub in [3.0, 20.0, 60.0] {
        setup.hub = hub;
        agree(&format!("hub {hub} mm"), &setup, &tuples);
    }
}
