//! The configurations that are verified without a spec: each effect alone, the eight of model §5, and others of their kind.

use std::sync::Arc;

use super::effect::FOIL;
use crate::scene::built::{Built, Inner, Profile, Root};
use crate::scene::{Clamp, Contact, Drive, Geometry, Material, Model, Setup, Side, Signal, TERMS};

/// r₀ of the configurations with a hub, mm. Their random whiskers are scaled so that it is 0.03 to 3 distances.
pub const HUB: f64 = 10.0;

/// A whisker on a rig, and its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Name in the census.
    pub name: &'static str,
    /// What its taps share.
    pub setup: Setup,
}

impl Configuration {
    /// With the gauge on the other side.
    fn far(mut self) -> Self {
        self.setup.gauge.side = Side::Far;
        self
    }

    /// Of a whisker of 10 mm and some MPa that is more than a cone clamped at its base (model §7).
    fn built(mut self, built: Built) -> Self {
        self.setup.built = Some(Arc::new(built));
        self
    }
}

/// A configuration of which words of the name say the rig: gauge on the far side, motor's axis [`HUB`] behind the clamp, an object that moves
/// (passive), poles that are not upright and a second gauge that tells it (tilted), a foil bonded to the whisker, and the moment on the root read in
/// place of a strain.
fn tap(name: &'static str, model: Model) -> Configuration {
    let mut setup = Setup { model, ..Setup::default() };
    for word in name.split('-') {
        match word {
            "far" => setup.gauge.side = Side::Far,
            "hub" => setup.hub = HUB,
            "passive" => setup.drive = Drive::Displacement,
            "tilted" => setup.gauge.second = true,
            "foil" => setup.gauge.foil = Some(FOIL),
            "moment" => setup.signal = Signal::Moment,
            _ => {}
        }
    }
    Configuration { name, setup }
}

const PLAIN: Model = Model::PLAIN;
const LINEAR: Model = Model { geometry: Geometry::Linear, ..PLAIN };
const LINEAR_SHEAR: Model = Model { shear: true, ..LINEAR };
const RUBBER: Material = Material::NeoHookean(3.2);
const MOONEY: Material = Material::MooneyRivlin([0.35, 0.15]);
const STIFFENING: Material = Material::Yeoh([0.5, -0.08, 0.02]);
const ALL_ON: Model = Model { surface: true, shear: true, extension: true, ..PLAIN };
const TIMOSHENKO: Model = Model { shear: true, extension: true, ..PLAIN };
const NEO: Model = Model { material: RUBBER, ..ALL_ON };
const MOONEY_COULOMB: Model = Model { contact: Contact::Coulomb(0.3), material: MOONEY, ..ALL_ON };
const MOONEY_COULOMB_POLE: Model = Model { pole_radius: 3.0, ..MOONEY_COULOMB };
const STICK: Model = Model { contact: Contact::Stick, ..NEO };
const POLE: Model = Model { surface: true, shear: true, pole_radius: 3.0, material: RUBBER, ..PLAIN };
const SOLID: Model =
    Model { clamp: Clamp::Bonded, indentation: true, distorting: true, pole_radius: 3.0, ..NEO };
const GLUED: Model = Model { clamp: Clamp::Glued, ..STICK };
const YEOH: Model = Model { material: STIFFENING, ..ALL_ON };

/// All, in the order of the census: the chosen ones, and every effect that a key switches by itself and none of them has alone.
pub fn all() -> Vec<Configuration> {
    let only = |key: &str, m: &Model| TERMS.iter().all(|t| (t.get)(m).is_on() == (t.key == key));
    let mut all = chosen();
    for term in TERMS.iter() {
        if !all.iter().any(|c| only(term.key, &c.setup.model)) {
            all.push(tap(term.key, PLAIN.with(term.key)));
        }
    }
    all
}

fn chosen() -> Vec<Configuration> {
    let root = Root { k_theta: 500.0, k_y: 20.0, k_x: 20.0 };
    let inner =
        |modulus, diameter: Vec<[f64; 2]>| Built { inner: Some(Inner { modulus, diameter }), ..Built::CONE };
    let curved = Built { curvature: [2e-3, -1e-5], ..Built::CONE };
    vec![
        tap("linear", LINEAR),
        tap("linear-shear", LINEAR_SHEAR),
        tap("linear-hub", LINEAR_SHEAR),
        tap("linear-passive", LINEAR_SHEAR),
        // Model §5.
        tap("hooke", PLAIN),
        tap("surface", Model { surface: true, ..PLAIN }),
        tap("timoshenko", TIMOSHENKO),
        tap("neo", NEO),
        tap("mooney-coulomb", MOONEY_COULOMB),
        tap("stick", STICK),
        tap("pole-far", POLE),
        tap("yeoh", YEOH),
        // Each effect alone.
        tap("shear", Model { shear: true, nu: 0.3, ..PLAIN }),
        tap("extension", Model { extension: true, ..PLAIN }),
        tap("extension-far", Model { extension: true, ..PLAIN }),
        tap("pole", Model { pole_radius: 3.0, ..PLAIN }),
        tap("coulomb", Model { extension: true, contact: Contact::Coulomb(0.3), ..PLAIN }),
        tap("sticking", Model { extension: true, contact: Contact::Stick, ..PLAIN }),
        // A contact that rubs on a pole rolls, or slides.
        tap("rolling", Model { pole_radius: 3.0, ..STICK }),
        tap(
            "coulomb-pole",
            Model { pole_radius: 3.0, extension: true, contact: Contact::Coulomb(0.3), ..PLAIN },
        ),
        tap("mooney-coulomb-pole-far-hub", MOONEY_COULOMB_POLE),
        tap("mooney-coulomb-pole-passive", MOONEY_COULOMB_POLE),
        tap("neo-alone", Model { material: RUBBER, ..PLAIN }),
        tap("mooney-alone", Model { material: MOONEY, ..PLAIN }),
        tap("yeoh-alone", Model { material: STIFFENING, ..PLAIN }).far(),
        // Its tangent vanishes within the range of the gauge.
        tap("softening", Model { extension: true, material: Material::Yeoh([0.5, -0.3, 0.0]), ..PLAIN }),
        // Friction at its limits: none, and more than any tap needs.
        tap(
            "coulomb-zero",
            Model { surface: true, extension: true, contact: Contact::Coulomb(0.0), ..PLAIN },
        ),
        tap(
            "coulomb-huge",
            Model { surface: true, extension: true, contact: Contact::Coulomb(1000.0), ..PLAIN },
        ),
        // Behind a hub.
        tap("hooke-hub", PLAIN),
        tap("timoshenko-hub", TIMOSHENKO),
        tap("neo-hub", NEO),
        tap("mooney-coulomb-hub", MOONEY_COULOMB),
        tap("stick-hub", STICK),
        // The object moves.
        tap("hooke-passive", PLAIN),
        tap("neo-passive", NEO),
        tap("mooney-coulomb-passive", MOONEY_COULOMB),
        tap("stick-passive", STICK),
        tap("pole-far-passive", POLE),
        // Model §6.
        tap("linear-tilted", LINEAR),
        tap("hooke-tilted", PLAIN),
        tap("timoshenko-tilted", TIMOSHENKO),
        tap("neo-tilted", NEO),
        tap("pole-far-tilted", POLE),
        tap("sticking-tilted", Model { extension: true, contact: Contact::Stick, ..PLAIN }),
        tap("neo-hub-tilted", NEO),
        tap("neo-passive-tilted", NEO),
        // Model §7.
        tap("root", TIMOSHENKO).built(Built { root, ..Built::CONE }),
        tap("power", TIMOSHENKO).far().built(Built { profile: Profile::Power(2.0), ..Built::CONE }),
        tap("hollow", ALL_ON).built(inner(0.0, vec![[0.0, 0.2], [5.0, 0.1]])),
        tap("cored", TIMOSHENKO).built(inner(6e4, vec![[0.0, 0.02], [1e3, 0.02]])),
        tap("curved", TIMOSHENKO).built(curved.clone()),
        tap("curved-neo-passive", Model { material: RUBBER, ..TIMOSHENKO }).built(curved.clone()),
        tap("moment", PLAIN).built(Built { curvature: [-2e-3, 0.0], root, ..Built::CONE }),
        // Model §8.
        tap("solid", SOLID),
        tap("solid-far-hub", SOLID),
        tap("solid-passive", SOLID),
        tap("foil", PLAIN),
        tap("solid-foil-far", SOLID),
        tap("glued-stick", GLUED),
        tap("socket-tilted", Model { clamp: Clamp::Socket, ..NEO }),
    ]
}

/// Those of a quick run: the closed forms, the plain rod, rubber with every effect and a contact that sticks, a hub, an object that moves, poles that are not upright.
pub const QUICK: [&str; 7] =
    ["linear", "hooke", "stick", "hooke-hub", "hooke-passive", "hooke-tilted", "cored"];
