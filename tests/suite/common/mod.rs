//! The models of the reference cases, and helpers of several tests.

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

use vibrissa::census::cases::all;
use vibrissa::physics::driven::Driven;
use vibrissa::physics::rod::RodProblem;
use vibrissa::physics::taper::Taper;
use vibrissa::scene::model::{Material, Model, Side};

pub fn model(material: Material) -> Model {
    Model { material, ..Model::PLAIN }
}

pub fn all_effects(material: Material) -> Model {
    Model { surface: true, shear: true, extension: true, ..model(material) }
}

pub const CONFIGURATIONS: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

pub fn configuration(name: &str) -> (Model, Side) {
    let found = all().into_iter().find(|c| c.name == name);
    let setup = found.unwrap_or_else(|| panic!("unknown configuration {name}")).setup;
    (setup.model, setup.gauge.side)
}

pub fn tap<'a>(model: &'a Model, d: f64, distance: f64, degrees: f64) -> RodProblem<'a> {
    let taper = Taper::new(10.0, d, 50.0);
    RodProblem {
        taper,
        gauge: taper.gauge(5.0, 2.0),
        side: Side::Contact,
        distance,
        hub: 0.0,
        driven: Driven::Radians(degrees.to_radians()),
        foil: None,
        body: None,
        model,
    }
}
