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

use vibrissa::census::configuration::all;
use vibrissa::physics::rod::RodProblem;
use vibrissa::physics::taper::Taper;
use vibrissa::scene::model::{Drive, Material, Model, Side};

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

/// Model and gauge side of a configuration of `verify`.
pub fn configuration(name: &str) -> (Model, Side) {
    let found = all().into_iter().find(|c| c.name == name);
    let setup = found.unwrap_or_else(|| panic!("unknown configuration {name}")).setup;
    (setup.model, setup.gauge.side)
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
