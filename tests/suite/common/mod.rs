//! The models of the reference cases, and what several test programs need.

/// The folder of the project.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

pub mod cases;
pub mod keys;
pub mod measuring;
pub mod pool;
pub mod program;
pub mod quadrature;
pub mod random;
pub mod recount;
pub mod scan;
pub mod schema;
pub mod searching;
pub mod specs;
pub mod sweeping;
pub mod world;

use vibrissa::physics::rod::RodProblem;
use vibrissa::physics::taper::Taper;
use vibrissa::scene::model::{Contact, Drive, Material, Model, Side};

/// Every effect off.
pub fn model(material: Material) -> Model {
    Model { material, ..Model::PLAIN }
}

/// Surface, shear and extension on.
pub fn all_effects(material: Material) -> Model {
    Model { surface: true, shear: true, extension: true, ..model(material) }
}

/// The models of the reference cases.
pub const CONFIGURATIONS: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

/// Model and gauge side of a configuration of model §5.
pub fn configuration(name: &str) -> (Model, Side) {
    let (hooke, neo) = (Material::Hooke(3.2), Material::NeoHookean(3.2));
    let model = match name {
        "hooke" => model(hooke),
        "surface" => Model { surface: true, ..model(hooke) },
        "timoshenko" => Model { shear: true, extension: true, ..model(hooke) },
        "neo" => all_effects(neo),
        "mooney-coulomb" => {
            Model { contact: Contact::Coulomb(0.3), ..all_effects(Material::MooneyRivlin([0.35, 0.15])) }
        }
        "stick" => Model { contact: Contact::Stick, ..all_effects(neo) },
        "pole-far" => Model { extension: false, pole_radius: 3.0, ..all_effects(neo) },
        "yeoh" => all_effects(Material::Yeoh([0.5, -0.08, 0.02])),
        _ => panic!("unknown configuration {name}"),
    };
    (model, if name == "pole-far" { Side::Far } else { Side::Contact })
}

/// A tap of a whisker with D = 10 mm and L_a = 50 mm.
pub fn tap<'a>(model: &'a Model, d: f64, distance: f64, degrees: f64) -> RodProblem<'a> {
    let taper = Taper::new(10.0, d, 50.0);
    RodProblem {
        taper,
        gauge: taper.gauge(5.0, 2.0),
        side: Side::Contact,
        distance,
        hub: 0.0,
        drive: Drive::Angle,
        amount: degrees.to_radians(),
        foil: None,
        body: None,
        model,
    }
}
