//! The configurations that are verified without a spec: each effect alone, the eight of model §5, and others of their kind.

use std::path::Path;

use crate::error::InputError;
use crate::scene::{Drive, Scene};
use crate::spec;

/// r₀ of the configurations with a hub, mm. Their random whiskers are scaled so that it is 0.03 to 3 distances.
pub const HUB: f64 = 10.0;

/// A model on a rig. `model` and `side` are what a spec would say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Configuration {
    /// Name in the census.
    pub name: &'static str,
    /// Keys of `[model]`, one per line.
    pub model: &'static str,
    /// Side of the gauge.
    pub side: &'static str,
    /// Whether the motor's axis lies [`HUB`] behind the clamp.
    pub hub: bool,
    /// What moves.
    pub drive: Drive,
}

const fn tap(name: &'static str, model: &'static str) -> Configuration {
    Configuration { name, model, side: "contact", hub: false, drive: Drive::Angle }
}

const fn far(of: Configuration) -> Configuration {
    Configuration { side: "far", ..of }
}

const fn hub(of: Configuration) -> Configuration {
    Configuration { hub: true, ..of }
}

const fn passive(of: Configuration) -> Configuration {
    Configuration { drive: Drive::Displacement, ..of }
}

const LINEAR: &str = "geometry = \"linear\"";
const LINEAR_SHEAR: &str = "geometry = \"linear\"\nshear = true";
const NEO: &str = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
const MOONEY_COULOMB: &str = "surface = true\nshear = true\nextension = true\ncontact = { coulomb = 0.3 }\n\
                              material = { mooney-rivlin = [0.35, 0.15] }";
const STICK: &str = "surface = true\nshear = true\nextension = true\ncontact = \"stick\"\n\
                     material = { neo-hookean = 3.2 }";
const POLE: &str = "surface = true\nshear = true\npole_radius = 3.0\nmaterial = { neo-hookean = 3.2 }";
const YEOH: &str = "surface = true\nshear = true\nextension = true\nmaterial = { yeoh = [0.5, -0.08, 0.02] }";

/// All, in the order of the census.
pub const ALL: [Configuration; 34] = [
    tap("linear", LINEAR),
    tap("linear-shear", LINEAR_SHEAR),
    hub(tap("linear-hub", LINEAR_SHEAR)),
    passive(tap("linear-passive", LINEAR_SHEAR)),
    // Model §5.
    tap("hooke", ""),
    tap("surface", "surface = true"),
    tap("timoshenko", "shear = true\nextension = true"),
    tap("neo", NEO),
    tap("mooney-coulomb", MOONEY_COULOMB),
    tap("stick", STICK),
    far(tap("pole-far", POLE)),
    tap("yeoh", YEOH),
    // Each effect alone.
    tap("shear", "shear = true\nnu = 0.3"),
    tap("extension", "extension = true"),
    far(tap("extension-far", "extension = true")),
    tap("pole", "pole_radius = 3.0"),
    tap("coulomb", "extension = true\ncontact = { coulomb = 0.3 }"),
    tap("sticking", "extension = true\ncontact = \"stick\""),
    tap("neo-alone", "material = { neo-hookean = 3.2 }"),
    tap("mooney-alone", "material = { mooney-rivlin = [0.35, 0.15] }"),
    far(tap("yeoh-alone", "material = { yeoh = [0.5, -0.08, 0.02] }")),
    // Its tangent vanishes within the range of the gauge.
    tap("softening", "extension = true\nmaterial = { yeoh = [0.5, -0.3, 0.0] }"),
    // Friction at its limits: none, and more than any tap needs.
    tap("coulomb-zero", "surface = true\nextension = true\ncontact = { coulomb = 0.0 }"),
    tap("coulomb-huge", "surface = true\nextension = true\ncontact = { coulomb = 1000.0 }"),
    // Behind a hub.
    hub(tap("hooke-hub", "")),
    hub(tap("timoshenko-hub", "shear = true\nextension = true")),
    hub(tap("neo-hub", NEO)),
    hub(tap("mooney-coulomb-hub", MOONEY_COULOMB)),
    hub(tap("stick-hub", STICK)),
    // The object moves.
    passive(tap("hooke-passive", "")),
    passive(tap("neo-passive", NEO)),
    passive(tap("mooney-coulomb-passive", MOONEY_COULOMB)),
    passive(tap("stick-passive", STICK)),
    passive(far(tap("pole-far-passive", POLE))),
];

impl Configuration {
    /// The scene; its tuples are given apart.
    ///
    /// # Errors
    /// None for those of [`ALL`].
    pub fn scene(&self) -> Result<Scene, InputError> {
        let hub = if self.hub { HUB } else { 0.0 };
        let drive = match self.drive {
            Drive::Angle => "theta = 4",
            Drive::Displacement => "drive = \"displacement\"\ndelta = 2",
        };
        let text = format!(
            "[whisker]\nD = 10\nd = 4\nL_a = 50\nhub = {hub:?}\n[gauge]\nx_ss = 5\nl = 2\nside = \"{}\"\n\
             [tap]\na = 33\n{drive}\n[model]\n{}\n",
            self.side, self.model
        );
        spec::parse(&format!("{}.toml", self.name), &text, Path::new(""))
    }
}
