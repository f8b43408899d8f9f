//! A tap has the same bits alone and among others.

use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::{Clamp, Contact, Geometry, Material, Model, Side};
use vibrissa_rod::{Effects, Rod, Tap, solve};

const MODEL: Model = Model {
    geometry: Geometry::Exact,
    material: Material::Hooke(3.2),
    nu: 0.5,
    shear: false,
    extension: false,
    surface: false,
    pole_radius: 1.5,
    contact: Contact::Frictionless,
    indentation: false,
    distorting: false,
    clamp: Clamp::Rigid,
};

/// Contacts next to the gauge, under it and beyond it: they need different numbers of passes.
#[test]
fn neighbours_do_not_matter() {
    let rods: Vec<Rod> = (0..400)
        .map(|i| {
            let at = |step: usize, count: usize| (i * step % count) as f64 / count as f64;
            let taper = Taper::new(8.0 + 4.0 * at(7, 11), 2.0 + 8.0 * at(5, 13), 50.0);
            Rod::cone(&taper, [3.2, 0.5], taper.gauge(3.0 + 9.0 * at(11, 17), 2.0), None)
        })
        .collect();
    fn tap((i, rod): (usize, &Rod)) -> Tap<'_> {
        let [x1, x2] = rod.gauge;
        Tap {
            rod,
            a: x1 + (x2 - x1) * (0.1 + 0.3 * (i % 23) as f64),
            hub: 0.0,
            turn: (0.1 + 0.7 * (i % 29) as f64).to_radians(),
            lift: 0.0,
            ratio: 0.0,
            pole: MODEL.pole_radius,
            softer: 1.0,
            soft: [0.0; 2],
            skin: None,
            tilt: None,
            least: 1e-6,
        }
    }
    let taps: Vec<Tap<'_>> = rods.iter().enumerate().map(tap).collect();
    let effects = Effects::of(&MODEL, Side::Contact, false);
    for tolerance in [1e-5, 1e-8] {
        let together = solve(&taps, effects, tolerance, None);
        let bits = |x: f64| if x.is_nan() { 0 } else { x.to_bits() };
        for (tap, found) in taps.iter().zip(together) {
            let alone = solve(&[*tap], effects, tolerance, None)[0];
            assert_eq!(bits(alone.strain), bits(found.strain), "{tap:?}: {alone:?} {found:?}");
        }
    }
}
