//! What was asked: whisker, gauge, tap, model, and what to report. Plain data, already validated.
//!
//! `spec` builds a [`Scene`] from TOML; `plan` and everything after only read it. Lengths in mm, angles in
//! degrees, moduli in MPa, as written by the user; radians and dimensionless groups begin in `physics`.

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

/// Everything one sweep needs to know.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name of the spec (its file stem), from which the default output folder is named.
    pub name: String,
    /// Spec text as read, copied into `run.json`.
    pub text: String,
    /// The tuples to evaluate.
    pub space: Space,
    /// Distance of the motor's axis behind the clamp, r₀ ≥ 0, mm.
    pub hub: f64,
    /// Whether `[tap]` turns the base or moves the object.
    pub drive: Drive,
    /// The strain gauge, apart from its place (which is part of the tuple).
    pub gauge: Gauge,
    /// Which effects are computed.
    pub model: Model,
    /// How the material was fitted, where the spec names a stress–strain curve.
    pub material_fit: Option<MaterialFit>,
    /// How distance is estimated from strain.
    pub estimate: Estimate,
    /// Which tables are written.
    pub output: Output,
    /// `[run]`: options that the command line may override.
    pub run: RunOptions,
    /// Every value in force after defaults, in spec order: (dotted key, value as TOML, written by the user?).
    pub in_force: Vec<(String, String, bool)>,
    /// Files that it was read from: the spec, its tuple file, its curve.
    pub inputs: Vec<std::path::PathBuf>,
    /// Things worth telling that are no errors (ignored columns of a tuple or curve file).
    pub warnings: Vec<String>,
}
