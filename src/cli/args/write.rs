//! What helps to write a spec, and to cite a result.

use std::path::PathBuf;

use clap::Args as Flags;
use vibrissa::command::words;

/// What a new spec is for: word, meaning, help.
pub const GOALS: [(&str, Goal, &str); 4] = [
    ("tap", Goal::Tap, "the best tap angle of this whisker"),
    ("optimise", Goal::Optimise, "the best whisker and gauge near this one"),
    ("sweep", Goal::Sweep, "tables of every distance and tap angle"),
    ("calibrate", Goal::Calibrate, "a distance from measured strains"),
];
/// How a base is held.
pub const CLAMPS: [(&str, &str, &str); 4] = [
    ("rigid", "rigid", "as the theory has it: nothing gives way"),
    ("bonded", "bonded", "its face is bonded to a plate"),
    ("glued", "glued", "glued into a socket"),
    ("socket", "socket", "pushed into a smooth socket"),
];

/// What a new spec is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// One whisker, its best angle.
    Tap,
    /// A search.
    Optimise,
    /// Tables.
    Sweep,
    /// Measured data.
    Calibrate,
}

/// Write a first spec: five questions, or their answers as flags. Every line of it is commented.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa new mine.toml --whisker 10,4,80 --gauge 5,2,15 --clamp glued --distances 25,70 --for tap"
)]
pub struct New {
    /// The spec to write; its schema is written beside it, for editors
    #[arg(default_value = "whisker.toml")]
    pub spec: PathBuf,
    /// Base diameter, tip diameter and length, mm
    #[arg(long, value_name = "D,d,L_a")]
    pub whisker: Option<String>,
    /// Start of the gauge's grid from the clamp and its length, mm; standard deviation of one reading, microstrain
    #[arg(long, value_name = "x_ss,l,noise")]
    pub gauge: Option<String>,
    /// How the base is held
    #[arg(long, value_name = "NAME", value_parser = words(CLAMPS))]
    pub clamp: Option<&'static str>,
    /// Nearest and farthest distance of objects from the clamp, mm
    #[arg(long, value_name = "NEAR,FAR")]
    pub distances: Option<String>,
    /// What the spec is for
    #[arg(long = "for", value_name = "GOAL", value_parser = words(GOALS))]
    pub goal: Option<Goal>,
    /// Replace a spec that is there
    #[arg(long)]
    pub force: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

/// How to cite the program, the model and a result.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa cite results/prototypes")]
pub struct Cite {
    /// Folder of a result
    pub dir: PathBuf,
    /// Cite also a result whose files were changed since it was written
    #[arg(long)]
    pub force: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

/// The JSON Schema of specs, for editors.
#[derive(Debug, Flags)]
#[command(
    after_help = "An editor with TOML support (Taplo, Even Better TOML) reads a first line `#:schema ./spec.schema.json` in a spec.\n\
                  Example: vibrissa schema > spec.schema.json"
)]
pub struct Schema {}
