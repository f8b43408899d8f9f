//! What was asked: whisker, gauge, tap, model, and what to report. Plain data, already validated.
//!
//! A [`Setup`] is what all taps share, a [`Study`] adds the [`Space`] of tuples and the tables wanted, a [`Spec`] is a study that came
//! from a file, with what that file said beside it. Lengths in mm, angles in degrees, moduli in MPa, as written by the user; radians
//! and dimensionless groups begin in `physics`.

pub mod axis;
pub mod even;
pub mod listed;
pub mod model;
pub mod run;
pub mod sampler;
pub mod search;
pub mod space;

pub use axis::Axis;
pub use listed::Listed;
pub use model::{
    Contact, Convention, Drive, Estimate, Gauge, Geometry, Material, MaterialFit, Model, Side, Theory,
};
pub use run::{BackendChoice, Output, Per, Precision, RankBy, RunOptions, TableFormat, Written};
pub use search::Search;
pub use space::{Column, Factor, Space, Tuple};

/// What all taps share: the rig without its whiskers. Every default is that of a spec: a gauge on the contact side, the exact
/// frictionless Hooke rod with every effect off, the paper's estimate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// Distance of the motor's axis behind the clamp, r₀ ≥ 0, mm.
    pub hub: f64,
    /// Whether the base turns or the object moves.
    pub drive: Drive,
    /// The strain gauge, apart from its place (which is part of the tuple).
    pub gauge: Gauge,
    /// Which effects are computed.
    pub model: Model,
    /// How distance is estimated from strain.
    pub estimate: Estimate,
}

/// What is to be evaluated and reported.
#[derive(Debug, Clone)]
pub struct Study {
    /// What all taps share.
    pub setup: Setup,
    /// The tuples to evaluate.
    pub space: Space,
    /// Which tables are written, and which of their rows.
    pub output: Output,
}

/// What a file said.
#[derive(Debug, Clone)]
pub struct Spec {
    /// Name of the spec (its file stem), from which the default output folder is named.
    pub name: String,
    /// Spec text as read, copied into `run.json`.
    pub text: String,
    /// What it asks for.
    pub study: Study,
    /// How the material was fitted, where the spec names a stress–strain curve.
    pub material_fit: Option<MaterialFit>,
    /// `[run]`: options that the command line may override.
    pub run: RunOptions,
    /// Every value in force after defaults, in spec order: (dotted key, value as TOML, written by the user?).
    pub in_force: Vec<(String, String, bool)>,
    /// Files that it was read from: the spec, its tuple file, its curve.
    pub inputs: Vec<std::path::PathBuf>,
    /// Things worth telling that are no errors (ignored columns of a tuple or curve file).
    pub warnings: Vec<String>,
}

impl Spec {
    /// A study that no file asked for.
    pub fn of(name: &str, study: Study) -> Self {
        Self {
            name: name.to_owned(),
            text: String::new(),
            study,
            material_fit: None,
            run: RunOptions::default(),
            in_force: Vec::new(),
            inputs: Vec::new(),
            warnings: Vec::new(),
        }
    }
}
