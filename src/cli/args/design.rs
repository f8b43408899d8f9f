//! Which whisker, which gauge, which tap.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args as Flags;
use vibrissa::sink::shard::Shard;

use super::common::{Common, number, whole};

/// Evaluate a design space.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa sweep sweeps/prototypes.toml")]
pub struct Sweep {
    /// The spec: whisker, gauge, tap, model (TOML; mm, degrees, MPa, N)
    pub spec: PathBuf,
    /// Show what each effect of the model changes, in % of strain, and which could be left off; write nothing
    #[arg(long, conflicts_with_all = ["plan", "out", "force"])]
    pub explain: bool,
    /// With --explain: relative changes of strain at which effects could be left off, separated by commas [default: 1e-4,1e-3,1e-2]
    #[arg(long, value_name = "E", value_delimiter = ',', requires = "explain", value_parser = number)]
    pub leave_off: Vec<f64>,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the spec's space: measured
    /// against the full model; run.json has the effects, their size and the time saved (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with = "explain", value_parser = number)]
    pub model_error: Option<f64>,
    /// Run only part i of n, of whole designs, into <out>/shard-i-of-n; `vibrissa merge` joins the parts. `slurm`: read the part from the
    /// Slurm array task
    #[arg(long, value_name = "i/n", value_parser = shard, conflicts_with = "explain")]
    pub shard: Option<Shard>,
    /// Seconds between states on the disk, from which the same command continues if the run is stopped or killed
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = seconds)]
    pub keep_every: Duration,
    #[command(flatten)]
    pub common: Common,
}

/// Parts of a sweep.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa merge results/million")]
pub struct Merge {
    /// Folders shard-i-of-n, or the folder that holds them; the result goes there too unless --out says otherwise
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

/// Jobs for a cluster.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa cluster slurm sweeps/million.toml --shards 64")]
pub struct Cluster {
    /// Which batch system
    #[arg(value_parser = ["slurm"])]
    pub system: String,
    /// The spec of the sweep
    pub spec: PathBuf,
    /// Number of parts; each is a task of the array
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000))]
    pub shards: u32,
    /// Most tasks that run at the same time [default: no limit]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=u64::MAX))]
    pub at_a_time: Option<u32>,
    #[command(flatten)]
    pub common: Common,
}

/// Search for the best design.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa optimise sweeps/design.toml")]
pub struct Optimise {
    /// The spec: whisker, gauge, tap, model, and [optimise] with objective, variables and limits
    pub spec: PathBuf,
    /// Run search i of n, with the seed of the spec + i − 1 and the whole budget, into <out>/shard-i-of-n; `vibrissa merge` joins them to the
    /// best design and one front. `slurm`: read i from the Slurm array task
    #[arg(long, value_name = "i/n", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the ranges of the variables: measured
    /// against the full model; run.json has the effects, their size and the time saved (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub model_error: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

/// Find the best tap angle.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa tap sweeps/best-tap.toml")]
pub struct Tap {
    /// The spec of one whisker; the interval is that of [tap] theta (0.1 to 10 degrees if left out)
    pub spec: PathBuf,
    /// What to minimise: total_rms_mm, or K_sd
    #[arg(long, value_enum, value_name = "WORD", default_value = "distance")]
    pub objective: TapObjective,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the interval of the drive: measured
    /// against the full model; run.json has the effects, their size and the time saved (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub model_error: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

/// Words of `tap --objective`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum TapObjective {
    /// total_rms_mm: bias and noise of the distance
    Distance,
    /// K_sd: the spread of K
    Sd,
}

/// Charts of a spec's model over its ranges.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa chart sweeps/practical.toml")]
pub struct Chart {
    /// The spec: ranges of whisker, gauge and drive, its distances (one chart each, 64 at most), its model
    pub spec: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

/// A part, or that of a task of a Slurm array.
fn shard(text: &str) -> Result<Shard, String> {
    if text == "slurm" { Shard::of_slurm(|name| std::env::var(name).ok()) } else { text.parse() }
}

/// Seconds, from none to a day.
fn seconds(text: &str) -> Result<Duration, &'static str> {
    let seconds = text.parse().ok().filter(|s| (0.0..=86400.0).contains(s));
    seconds.map(Duration::from_secs_f64).ok_or("allowed: 0 … 86400 s")
}
