//! The question: whisker, gauge, tap, model and outputs, as validated data in the user's mm, degrees and MPa. A [`Setup`] is shared by all
//! taps, a [`Study`] adds the [`Space`] of tuples and the tables wanted, a [`Spec`] is a study from a file.

use std::sync::Arc;

use crate::error::InputError;

/// An enum with a word for each variant, as specs and results have it.
#[macro_export]
macro_rules! words {
    ($(#[$of:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$of])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
        pub enum $name { $($(#[$doc])* #[serde(rename = $word)] $variant,)+ }

        impl $name {
            /// All, in order.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// All, with their words.
            pub const WORDS: [(&'static str, Self); [$($word),+].len()] =
                [$(($word, Self::$variant)),+];

            /// Its word.
            pub const fn word(self) -> &'static str {
                Self::WORDS[self as usize].0
            }
        }
    };
}

/// An enum with a word and a description for each variant, as flags have it.
#[macro_export]
macro_rules! choices {
    ($(#[$of:meta])* $name:ident { $($variant:ident = $word:literal, $about:literal;)+ }) => {
        $(#[$of])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Deserialize)]
        pub enum $name { $(#[doc = $about] #[serde(rename = $word)] $variant,)+ }

        impl $name {
            /// All, with their words and descriptions.
            pub const WORDS: [(&'static str, Self, &'static str); [$($word),+].len()] =
                [$(($word, Self::$variant, $about)),+];

            /// Its word.
            pub const fn word(self) -> &'static str {
                Self::WORDS[self as usize].0
            }
        }
    };
}

pub mod axis;
pub mod built;
pub mod channels;
mod interval;
mod layout;
pub mod listed;
pub mod material;
pub mod model;
pub mod property;
pub mod run;
pub mod sampler;
pub mod search;
pub mod space;
pub mod term;

pub use axis::Axis;
pub use built::Built;
pub use channels::Channels;
pub use channels::Signal;
pub use interval::Interval;
pub use layout::Layout;
pub use listed::Listed;
pub use material::{Material, MaterialFit};
pub use model::{
    Clamp, Contact, Convention, Drive, Estimate, Foil, Gauge, Geometry, Grip, Model, Side, TERMS, Theory,
};
pub use property::{PROPERTIES, Property, Rigs};
pub use run::{BackendChoice, Output, Per, Precision, RankBy, RunOptions};
pub use sampler::Sampler;
pub use search::{Budget, Calibrated, Limits, Measure, Objective, Quantity, Robust, Search, Variable};
pub use space::{COLUMNS, Column, Direction, Factor, Space, Tuple};
pub use term::{Amount, Term};

/// The rig that all taps share. Defaults: a gauge on the contact side, the exact frictionless Hooke rod, the paper's estimate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// Distance of the motor's axis behind the clamp, r₀ ≥ 0, mm.
    pub hub: f64,
    /// Turning base or moving object.
    pub drive: Drive,
    /// The strain gauge, apart from its place (which is part of the tuple).
    pub gauge: Gauge,
    /// Effects of the rod.
    pub model: Model,
    /// Estimate of the distance.
    pub estimate: Estimate,
    /// True for each of the columns `tilt_deg` and `lean_deg`, if it was asked for by name.
    pub directions: [bool; 2],
    /// The built whisker; `None` for a cone clamped at its base.
    pub built: Option<Arc<Built>>,
    /// Signal of the sensor; of several channels the strain, if one reads it, else the moment.
    pub signal: Signal,
    /// Several channels of the sensor.
    pub channels: Option<Arc<Channels>>,
    /// True if moments are read about the place where the base rests, not about the base, which springs of its root let move.
    pub fixed: bool,
    /// True if tables have the wrench on the base.
    pub wrench: bool,
    /// Properties that differ between tuples; `None` if all taps have the same rig.
    pub rigs: Option<Arc<Rigs>>,
}

impl Setup {
    /// The reason why poles must not tilt or lean (model §6, §8); `None` if they may.
    pub fn forbids(&self, leaning: [bool; 2]) -> Option<&'static str> {
        if leaning.contains(&true) {
            if self.gauge.foil.is_some() {
                return Some("a foil has been computed for upright edges only");
            }
            if let Some(why) = self.built.as_ref().and_then(|built| built.upright(self.model.surface)) {
                return Some(why);
            }
        }
        self.model.forbids(leaning)
    }

    /// True for a cone clamped at its base of which only the strain is asked.
    pub fn is_plain(&self) -> bool {
        self.built.is_none() && !self.asks_wrench()
    }

    /// True if `property` differs between tuples.
    pub fn varies(&self, property: Property) -> bool {
        self.rigs.as_ref().is_some_and(|rigs| rigs.properties.contains(&property))
    }

    /// True if whiskers are curved at rest.
    pub fn is_curved(&self) -> bool {
        let varies = [Property::Curvature, Property::CurvatureSlope].iter().any(|p| self.varies(*p));
        varies || self.built.as_ref().is_some_and(|built| !built.is_straight())
    }

    /// The wrench [M₀, F_x, F_y] on the base as the sensor shows it.
    pub fn felt(&self, wrench: [f64; 3]) -> [f64; 3] {
        self.carried().map_or(wrench, |root| root.about_rest(wrench))
    }

    /// The springs under the base, if moments are read about the place where it rests.
    pub fn carried(&self) -> Option<&built::Root> {
        self.built.as_ref().filter(|_| self.fixed).map(|built| &built.root)
    }

    /// True if readings have noise; `None` if it was not given.
    pub fn is_noisy(&self) -> Option<bool> {
        match &self.channels {
            Some(channels) => channels.covariance.is_some().then_some(true),
            None => self.gauge.noise_strain.map(|noise| noise > 0.0),
        }
    }

    /// True if the wrench on the base is needed.
    pub fn asks_wrench(&self) -> bool {
        self.wrench || self.signal != Signal::Strain || self.channels.is_some()
    }
}

macro_rules! with {
    ($($(#[$doc:meta])+ $name:ident($($value:ident: $of:ty)?) sets $($field:ident).+ = $to:expr;)+) => {
        impl Setup {$(
            $(#[$doc])+
            pub fn $name(mut self $(, $value: $of)?) -> Self {
                self.$($field).+ = $to;
                self
            }
        )+}
    };
}

with! {
    /// With this law of the material; moduli in MPa.
    material(material: Material) sets model.material = material;
    /// With contact on the whisker's surface, not on its centreline.
    surface() sets model.surface = true;
    /// With Timoshenko's shear deformation.
    shear() sets model.shear = true;
    /// With a centreline that stretches.
    extension() sets model.extension = true;
    /// With this behaviour of the contact; sticking and Coulomb friction need [`Self::extension`].
    contact(contact: Contact) sets model.contact = contact;
    /// With an object of this radius ρ, mm.
    pole_radius(radius: f64) sets model.pole_radius = radius;
    /// With the motor's axis so far behind the clamp, r₀, mm.
    hub(hub: f64) sets hub = hub;
    /// With the gauge on this side.
    side(side: Side) sets gauge.side = side;
    /// With this standard deviation of the gauge's noise, in strain.
    noise(strain: f64) sets gauge.noise_strain = Some(strain);
    /// By the closed forms of the paper.
    linear() sets model.geometry = Geometry::Linear;
}

/// The taps to evaluate and the tables to write.
#[derive(Debug, Clone, Default)]
pub struct Study {
    /// The common rig.
    pub setup: Setup,
    /// The tuples to evaluate.
    pub space: Space,
    /// The tables to write and their rows.
    pub output: Output,
}

impl Study {
    /// Column by which the best rows are listed: bias and noise together if the gauge is noisy, no rows are left out and none was asked for.
    pub fn listed_by(&self) -> RankBy {
        let noisy = self.setup.is_noisy() == Some(true);
        let free = self.output.top.is_none() && !self.output.by_said;
        if noisy && free { RankBy::TotalRms } else { self.output.by }
    }
}

/// A study and the file it came from.
#[derive(Debug, Clone, Default)]
pub struct Spec {
    /// Name of the spec (its file stem); it names the default output folder.
    pub name: String,
    /// Spec text as read, copied into `run.json`.
    pub text: String,
    /// The study that it asks for.
    pub study: Study,
    /// Fit of the material, if the spec names a stress–strain curve.
    pub material_fit: Option<MaterialFit>,
    /// `[run]`: options that the command line may override.
    pub run: RunOptions,
    /// Every value in force after defaults, in spec order: (dotted key, value as TOML, written by the user?).
    pub in_force: Vec<(String, String, bool)>,
    /// Files that it was read from: the spec, its tuple file, its curve.
    pub inputs: Vec<std::path::PathBuf>,
    /// Remarks that are not errors (ignored columns of a tuple or curve file).
    pub warnings: Vec<String>,
    /// Errors without a message, with the places where properties of the rig have several values.
    pub several: Vec<InputError>,
}

impl Spec {
    /// Refuses properties of several values, for a command that takes one rig.
    pub fn one_rig(&self) -> Result<(), InputError> {
        let Some(place) = self.several.first() else { return Ok(()) };
        let message = "only sweep takes several values here".to_owned();
        Err(InputError { message, ..place.clone() }.allowed("one number"))
    }

    /// A spec without a file.
    pub fn of(name: &str, study: Study) -> Self {
        Self { name: name.to_owned(), study, ..Self::default() }
    }
}
