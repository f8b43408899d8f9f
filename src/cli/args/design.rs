//! Sweeps in parts.

use std::path::PathBuf;

use clap::Args as Flags;
use vibrissa::command::{Common, whole};

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
