//! How good the kernels are.

use std::path::PathBuf;

use clap::Args as Flags;
use vibrissa::command::{Common, number, whole};

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
