//! Hard taps on every backend against the reference: contacts that stick, slide, roll and slip off, materials at their limit, paths that fold.

use super::*;
use vibrissa::scene::Drive;
use vibrissa::scene::sampler::Sampler;
use vibrissa::status::Status;

const POLES: [f64; 4] = [0.5, 2.0, 4.0, 10.0];

/// Taps at which contacts on poles roll and slide.
pub fn on_poles() -> Vec<Tuple> {
    grid(&[3.0, 4.0, 10.0, 11.0], &[9.0, 21.0, 33.0, 47.0], &[0.05, 1.0, 4.0, 15.0])
}

#[test]
fn contacts_that_slide() {
    let centreline = Model { extension: true, ..common::model(Material::Hooke(3.2)) };
    let (mut stuck, mut slid) = (0, 0);
    for (name, model) in [("centreline", centreline), ("rubber", rubber(Contact::Frictionless))] {
        // Every radius and every friction with each model, but not every pair.
        let pairs = (0..12).map(|k| (POLES[k / 3], [0.1, 0.4, 1.0][k % 3]));
        for (pole_radius, mu) in pairs.skip(usize::from(name == "rubber")).step_by(2) {
            let model = Model { contact: Contact::Coulomb(mu), pole_radius, ..model };
            let side = if pole_radius > 3.0 { Side::Far } else { Side::Contact };
            let exact = agree(&format!("{name}, ρ {pole_radius}, μ {mu}"), &setup(model, side), &on_poles());
            stuck += exact.iter().filter(|o| o.sticking).count();
            slid += exact.iter().filter(|o| !o.sticking && o.strain.is_finite()).count();
        }
    }
    assert!(stuck > 100 && slid > 100, "{stuck} roll, {slid} slide");
    // A hub and a pole: no row is left to double precision alone.
    let mut setup = setup(rubber(Contact::Frictionless), Side::Contact);
    let mooney = common::all_effects(Material::MooneyRivlin([0.35, 0.15]));
    (setup.model, setup.hub) = (Model { pole_radius: 20.0, ..mooney }, 12.2);
    let tuples = grid(&[2.0, 4.0, 7.0, 10.0, 12.0], &[21.0, 33.0, 48.0], &[1.0, 10.0, 20.0, 30.0]);
    agree_on(&[CPU, CPU_F64, GPU], "pole and hub", &setup, &tuples);
}

/// Random whiskers, most with a fine tip: D 8–12, d 2–10, contacts from 20 mm to the tip, 0.1–10°.
fn fine_tips(n: u32) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(11, dimension, index)) / 2f64.powi(32);
        let (wide, tip) = (8.0 + 4.0 * unit(0), 2.0 + 8.0 * unit(1) * unit(5));
        let (x_ss, l, a) = (3.0 + 9.0 * unit(2), 1.0 + 3.0 * unit(6), 20.0 + 30.0 * unit(3));
        Tuple::from_array([wide, tip, 50.0, x_ss, l, a, 0.0, 0.0, 0.1 + 9.9 * unit(4)])
    };
    (0..n).map(point).collect()
}

/// Next to a fine tip, the axial force bends it as much as the transverse force.
#[test]
fn contacts_that_stick() {
    let on_centreline =
        Model { contact: Contact::Stick, extension: true, ..common::model(Material::Hooke(3.2)) };
    let hooke = Model { contact: Contact::Stick, ..common::all_effects(Material::Hooke(3.2)) };
    let ends = grid(&[2.0, 4.0], &[36.0, 39.0, 42.0, 45.0, 48.0, 49.5], &[5.0, 7.5, 10.0]);
    for (name, model) in [("hooke", hooke), ("rubber", rubber(Contact::Stick)), ("centreline", on_centreline)]
    {
        let exact = agree(name, &setup(model, Side::Contact), &fine_tips(600));
        assert!(exact.iter().all(|o| o.strain.is_finite()), "{name}");
        agree(&format!("{name}, up to the tip"), &setup(model, Side::Contact), &ends);
    }
    for pole_radius in POLES {
        let mut setup = setup(Model { pole_radius, ..rubber(Contact::Stick) }, Side::Contact);
        let exact = agree(&format!("ρ {pole_radius}"), &setup, &on_poles());
        assert!(exact.iter().filter(|o| o.strain.is_finite()).count() > 40);
        if pole_radius < 1.0 || pole_radius == 4.0 {
            setup.hub = 10.0;
            agree(&format!("behind a hub, ρ {pole_radius}"), &setup, &on_poles());
            continue;
        }
        setup.drive = Drive::Displacement;
        let moved = |t: Tuple| Tuple { drive: t.a * t.drive.to_radians(), ..t };
        agree(
            &format!("moved, ρ {pole_radius}"),
            &setup,
            &on_poles().into_iter().map(moved).collect::<Vec<_>>(),
        );
    }
}

#[test]
fn softening_materials_end_with_a_status() {
    let materials = [
        (Material::Yeoh([0.5, -0.5, 0.0]), "falling", &FAST[..]),
        (Material::Yeoh([0.5, -0.1, 0.0]), "falling late", &FAST[..2]),
        (Material::Yeoh([0.5, -0.3, 0.1]), "falling, then rising", &FAST[..2]),
        (Material::MooneyRivlin([0.9, -0.35]), "negative C01", &FAST[..3]),
    ];
    let tuples = grid(&[7.0, 10.0], &[10.0, 25.0], &[1.0, 5.0, 15.0, 45.0]);
    // A device compiles a kernel for each material: it gets two of them.
    for (material, name, places) in materials {
        let model = common::all_effects(material);
        let exact = agree_on(places, name, &setup(model, Side::Contact), &tuples);
        let ended = exact.iter().filter(|o| o.status.has(Status::MATERIAL_LIMIT)).count();
        let solved = exact.iter().filter(|o| o.strain.is_finite()).count();
        println!("{name}: {ended} at the limit, {solved} solved of {}", exact.len());
        assert!(ended >= 2 && solved >= 8, "{name}: {ended} at the limit, {solved} solved");
    }
}

#[test]
fn displaced_thin_tips_keep_their_branch() {
    let model = common::model(Material::Hooke(3.2));
    for (pole_radius, side) in [(5.0, Side::Contact), (5.0, Side::Far), (0.0, Side::Contact)] {
        let mut setup = setup(Model { surface: true, pole_radius, ..model }, side);
        setup.drive = Drive::Displacement;
        let tuples = grid(&[0.5, 1.0], &[40.0, 45.0, 50.0], &[2.0, 6.0, 9.0, 9.2, 9.6, 10.0, 10.5, 11.0]);
        let exact = agree("displaced tip", &setup, &tuples);
        assert!(exact.iter().filter(|o| o.status == Status::OK).count() >= 24);
    }
}

/// A thin whisker on a hub slides off a thick pole at 33.7°: near there, the two branches of the folded path are close.
#[test]
fn paths_that_fold_back_keep_their_half() {
    let model = common::model(Material::Hooke(3.2));
    let mut setup = setup(Model { surface: true, extension: true, pole_radius: 8.0, ..model }, Side::Contact);
    setup.hub = 5.0;
    let lengths = [
        10.970913519796717,
        0.5826661027360472,
        52.51128110154998,
        3.6543682417427013,
        3.6966029327322354,
        40.33939612297147,
    ];
    let [wide, tip, length, x_ss, l, a] = lengths;
    let whisker = Tuple::from_array([wide, tip, length, x_ss, l, a, 0.0, 0.0, 0.0]);
    let tuples: Vec<Tuple> =
        [20.0, 30.0, 33.34, 33.38, 33.42635, 33.5, 33.5935].map(|drive| Tuple { drive, ..whisker }).to_vec();
    let exact = agree("fold", &setup, &tuples);
    assert!(exact.windows(2).skip(2).all(|w| w[1].strain < w[0].strain && w[0].strain < 0.039));
}
