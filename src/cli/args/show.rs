//! What there is to look at, and how good it is.

use std::path::PathBuf;

use clap::Args as Flags;
use vibrissa::figure::Format;

use super::common::{Common, number, whole, words};

/// One page with sliders: strain, K, its spread and the error budget by the exact model. It needs no network.
#[derive(Debug, Flags)]
#[command(
    after_help = "Here --out names a file, not a folder [default: explore.html]. Example: vibrissa explore sweeps/prototypes.toml"
)]
pub struct Explore {
    /// The spec: its ranges of whisker, gauge, drive and distances become those of the sliders (a single number gets a range around it)
    pub spec: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

/// Shapes of bent whiskers.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa shape sweeps/tapping.toml && vibrissa report results/tapping-shape"
)]
pub struct Shape {
    /// The spec: whiskers, distances and drives (10 000 taps at most), an exact model
    pub spec: PathBuf,
    /// Sections from the clamp to the contact
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = whole::<u32>(3..=10_001))]
    pub nodes: u32,
    #[command(flatten)]
    pub common: Common,
}

/// Figures and a page of a result.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa sweep sweeps/prototypes.toml && vibrissa report results/prototypes"
)]
pub struct Report {
    /// Folder of a result of sweep, optimise, tap, calibrate, locate, bench, verify or shape
    pub dir: PathBuf,
    /// Folder for the report [default: DIR/report]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Formats of the figures, separated by commas; the page has its own
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', default_value = "svg,png,pdf", value_parser = words(Format::WORDS))]
    pub figures: Vec<Format>,
    /// Width of a column of the paper, mm; figures with several panels are two columns wide
    #[arg(long, value_name = "MM", default_value_t = 88.0, value_parser = number)]
    pub width: f64,
    /// Size of all text in the figures, pt
    #[arg(long, value_name = "PT", default_value_t = 8.0, value_parser = number)]
    pub font_size: f64,
    /// TrueType font file of the figures [default: DejaVu Sans, built in]
    #[arg(long, value_name = "FILE")]
    pub font: Option<PathBuf>,
    /// Draw also a result that was changed since it was written; write also over another report or beside other files
    #[arg(long)]
    pub force: bool,
    /// List the figures that would be drawn; write nothing
    #[arg(long)]
    pub plan: bool,
    /// No notes, no summary
    #[arg(long)]
    pub quiet: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Compare every backend with the reference. Ctrl-C keeps the lines so far.
#[derive(Debug, Flags)]
pub struct Verify {
    /// A spec, from which the taps are taken [default: built-in configurations and hard cases]
    pub spec: Option<PathBuf>,
    /// Few taps of few configurations: seconds instead of half a minute
    #[arg(long)]
    pub quick: bool,
    /// Random taps: of the spec [default: 1000; with --quick 100], or of each built-in configuration beside its hard
    /// cases [default: 24; with --quick 4]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000))]
    pub samples: Option<u32>,
    /// Seed of the random taps
    #[arg(long, value_name = "S", default_value_t = 1, allow_hyphen_values = true, value_parser = whole::<u64>(0..=u64::MAX))]
    pub seed: u64,
    /// Largest strain error that passes, relative as --tolerance is [default: the tolerance with f32, twice the tolerance with f64]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub bound: Option<f64>,
    /// Print a line for every built-in configuration on every backend, not only for those that break a bound
    #[arg(long)]
    pub all: bool,
    #[command(flatten)]
    pub common: Common,
}

/// Measure speed against error. Without --backend or --precision: everything that this machine has, at several tolerances. Ctrl-C
/// keeps what was measured.
#[derive(Debug, Flags)]
pub struct Bench {
    /// Few configurations, few taps: seconds instead of minutes; software adapters only with --backend gpu or --adapter
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    pub common: Common,
}
