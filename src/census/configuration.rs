//! The configurations that are verified without a spec: each effect alone, the eight of model §5, and others of their kind.

use std::sync::Arc;

use super::effect::FOIL;
use crate::scene::built::{Built, Inner, Profile, Root};
use crate::scene::{Clamp, Contact, Drive, Gauge, Geometry, Material, Model, Setup, Side, Signal, TERMS};

/// r₀ of the configurations with a hub, mm. Their random whiskers are scaled so that it is 0.03 to 3 distances.
pub const HUB: f64 = 10.0;

/// A model on a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Configuration {
    /// Name in the census.
    pub name: &'static str,
    /// What is computed.
    pub model: Model,
    /// Side of the gauge.
    pub side: Side,
    /// Whether the motor's axis lies [`HUB`] behind the clamp.
    pub hub: bool,
    /// What moves.
    pub drive: Drive,
    /// Whether poles are not upright, and a second gauge tells it.
    pub tilted: bool,
    /// Whether a foil is bonded to it.
    pub foil: bool,
    /// What it is beyond a cone clamped at its base whose strain is read.
    pub built: Shape,
}

/// What a whisker is beyond a cone clamped at its base, and what is read of it (model §7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// No more.
    Cone,
    /// On springs.
    Root,
    /// A power of the arc.
    Power,
    /// A blind hole.
    Hollow,
    /// A bonded core of another modulus.
    Cored,
    /// Bent at rest.
    Curved,
    /// Curved, on springs, and the moment on the root is read.
    Moment,
}

impl Shape {
    /// On whiskers of 10 mm and some MPa.
    fn built(self) -> Option<Arc<Built>> {
        let root = Root { k_theta: 500.0, k_y: 20.0, k_x: 20.0 };
        let inner = |modulus, diameter: Vec<[f64; 2]>| Some(Inner { modulus, diameter });
        let cone = Built::CONE;
        let built = match self {
            Self::Cone => return None,
            Self::Root => Built { root, ..cone },
            Self::Power => Built { profile: Profile::Power(2.0), ..cone },
            Self::Hollow => Built { inner: inner(0.0, vec![[0.0, 0.2], [5.0, 0.1]]), ..cone },
            Self::Cored => Built { inner: inner(6e4, vec![[0.0, 0.02], [1e3, 0.02]]), ..cone },
            Self::Curved => Built { curvature: [2e-3, -1e-5], ..cone },
            Self::Moment => Built { curvature: [-2e-3, 0.0], root, ..cone },
        };
        Some(Arc::new(built))
    }
}

const fn tap(name: &'static str, model: Model) -> Configuration {
    Configuration {
        name,
        model,
        side: Side::Contact,
        hub: false,
        drive: Drive::Angle,
        tilted: false,
        foil: false,
        built: Shape::Cone,
    }
}

const fn tilted(of: Configuration) -> Configuration {
    Configuration { tilted: true, ..of }
}

const fn far(of: Configuration) -> Configuration {
    Configuration { side: Side::Far, ..of }
}

const fn hub(of: Configuration) -> Configuration {
    Configuration { hub: true, ..of }
}

const fn passive(of: Configuration) -> Configuration {
    Configuration { drive: Drive::Displacement, ..of }
}

const fn foil(of: Configuration) -> Configuration {
    Configuration { foil: true, ..of }
}

const fn built(shape: Shape, of: Configuration) -> Configuration {
    Configuration { built: shape, ..of }
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
    let new = TERMS.iter().filter(|term| !CHOSEN.iter().any(|c| only(term.key, &c.model)));
    let alone = new.map(|term| tap(term.key, PLAIN.with(term.key)));
    CHOSEN.into_iter().chain(alone).collect()
}

const CHOSEN: [Configuration; 60] = [
    tap("linear", LINEAR),
    tap("linear-shear", LINEAR_SHEAR),
    hub(tap("linear-hub", LINEAR_SHEAR)),
    passive(tap("linear-passive", LINEAR_SHEAR)),
    // Model §5.
    tap("hooke", PLAIN),
    tap("surface", Model { surface: true, ..PLAIN }),
    tap("timoshenko", TIMOSHENKO),
    tap("neo", NEO),
    tap("mooney-coulomb", MOONEY_COULOMB),
    tap("stick", STICK),
    far(tap("pole-far", POLE)),
    tap("yeoh", YEOH),
    // Each effect alone.
    tap("shear", Model { shear: true, nu: 0.3, ..PLAIN }),
    tap("extension", Model { extension: true, ..PLAIN }),
    far(tap("extension-far", Model { extension: true, ..PLAIN })),
    tap("pole", Model { pole_radius: 3.0, ..PLAIN }),
    tap("coulomb", Model { extension: true, contact: Contact::Coulomb(0.3), ..PLAIN }),
    tap("sticking", Model { extension: true, contact: Contact::Stick, ..PLAIN }),
    // A contact that rubs on a pole rolls, or slides.
    tap("rolling", Model { pole_radius: 3.0, ..STICK }),
    tap("coulomb-pole", Model { pole_radius: 3.0, extension: true, contact: Contact::Coulomb(0.3), ..PLAIN }),
    hub(far(tap("mooney-coulomb-pole-far-hub", MOONEY_COULOMB_POLE))),
    passive(tap("mooney-coulomb-pole-passive", MOONEY_COULOMB_POLE)),
    tap("neo-alone", Model { material: RUBBER, ..PLAIN }),
    tap("mooney-alone", Model { material: MOONEY, ..PLAIN }),
    far(tap("yeoh-alone", Model { material: STIFFENING, ..PLAIN })),
    // Its tangent vanishes within the range of the gauge.
    tap("softening", Model { extension: true, material: Material::Yeoh([0.5, -0.3, 0.0]), ..PLAIN }),
    // Friction at its limits: none, and more than any tap needs.
    tap("coulomb-zero", Model { surface: true, extension: true, contact: Contact::Coulomb(0.0), ..PLAIN }),
    tap("coulomb-huge", Model { surface: true, extension: true, contact: Contact::Coulomb(1000.0), ..PLAIN }),
    // Behind a hub.
    hub(tap("hooke-hub", PLAIN)),
    hub(tap("timoshenko-hub", TIMOSHENKO)),
    hub(tap("neo-hub", NEO)),
    hub(tap("mooney-coulomb-hub", MOONEY_COULOMB)),
    hub(tap("stick-hub", STICK)),
    // The object moves.
    passive(tap("hooke-passive", PLAIN)),
    passive(tap("neo-passive", NEO)),
    passive(tap("mooney-coulomb-passive", MOONEY_COULOMB)),
    passive(tap("stick-passive", STICK)),
    passive(far(tap("pole-far-passive", POLE))),
    // Model §6.
    tilted(tap("linear-tilted", LINEAR)),
    tilted(tap("hooke-tilted", PLAIN)),
    tilted(tap("timoshenko-tilted", TIMOSHENKO)),
    tilted(tap("neo-tilted", NEO)),
    tilted(far(tap("pole-far-tilted", POLE))),
    tilted(tap("sticking-tilted", Model { extension: true, contact: Contact::Stick, ..PLAIN })),
    tilted(hub(tap("neo-hub-tilted", NEO))),
    tilted(passive(tap("neo-passive-tilted", NEO))),
    // Model §7.
    built(Shape::Root, tap("root", TIMOSHENKO)),
    built(Shape::Power, far(tap("power", TIMOSHENKO))),
    built(Shape::Hollow, tap("hollow", ALL_ON)),
    built(Shape::Cored, tap("cored", TIMOSHENKO)),
    built(Shape::Curved, tap("curved", TIMOSHENKO)),
    built(Shape::Curved, passive(tap("curved-neo-passive", Model { material: RUBBER, ..TIMOSHENKO }))),
    built(Shape::Moment, tap("moment", PLAIN)),
    // Model §8.
    tap("solid", SOLID),
    hub(far(tap("solid-far-hub", SOLID))),
    passive(tap("solid-passive", SOLID)),
    foil(tap("foil", PLAIN)),
    foil(far(tap("solid-foil-far", SOLID))),
    tap("glued-stick", GLUED),
    tilted(tap("socket-tilted", Model { clamp: Clamp::Socket, ..NEO })),
];

/// Those of a quick run: the closed forms, the plain rod, rubber with every effect and a contact that sticks, a hub, an object that moves, poles that are not upright.
pub const QUICK: [&str; 7] =
    ["linear", "hooke", "stick", "hooke-hub", "hooke-passive", "hooke-tilted", "cored"];

impl Configuration {
    /// What its taps share.
    pub fn setup(&self) -> Setup {
        let foil = self.foil.then_some(FOIL);
        Setup {
            hub: if self.hub { HUB } else { 0.0 },
            drive: self.drive,
            gauge: Gauge { side: self.side, second: self.tilted, foil, ..Gauge::default() },
            model: self.model,
            built: self.built.built(),
            signal: if self.built == Shape::Moment { Signal::Moment } else { Signal::Strain },
            ..Setup::default()
        }
    }
}
