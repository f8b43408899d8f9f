//! Flags of every command.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use crate::scene::{BackendChoice, Precision, RunOptions};
use crate::sink::shard::Shard;
use clap::Args as Flags;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Deserialize;

/// Parser for one of a few words, with their help; the value is the word.
pub fn named<T, const N: usize>(all: [(&'static str, T, &'static str); N]) -> PossibleValuesParser {
    PossibleValuesParser::new(all.map(|(word, _, help)| PossibleValue::new(word).help(help)))
}

/// Like [`named`], but the value is the meaning of the word.
pub fn words<T, const N: usize>(all: [(&'static str, T, &'static str); N]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    named(all.map(|(word, _, help)| (word, (), help)))
        .map(move |said| all.iter().find(|(word, ..)| *word == said).expect("one of the words").1)
}

/// Parses a number; its range is checked where it is used, with the unit.
pub fn number(text: &str) -> Result<f64, &'static str> {
    text.parse().map_err(|_| "allowed: a number, as 0.5 or 1e-4")
}

pub fn whole<T: TryFrom<u64>>(
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|n| range.contains(n)).and_then(|n: u64| n.try_into().ok());
        let most = T::try_from(*range.end()).map_or(u64::from(u32::MAX), |_| *range.end());
        number.ok_or_else(|| format!("allowed: a whole number, {} … {most}", range.start()))
    }
}

/// Flags of every command. Each may also stand in the spec's [run] table; the command line wins.
#[derive(Debug, Clone, Default, Flags, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Options of every command, also in [run] of a spec")]
pub struct Common {
    /// Folder for the results [default: results/<name> for sweep, results/<name>-<command> for the others]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write also into a folder with another result (of another command or file, edited, or of over a minute with other values), an
    /// unfinished sweep, or other files. Removes only what its run.json lists, and names it; never an input or another file
    #[arg(long)]
    pub force: bool,
    /// Where to compute [default: auto: a hardware adapter where it pays, else the CPU kernels; gpu also uses a software adapter]
    #[arg(long, value_parser = words(BackendChoice::WORDS), value_name = "NAME")]
    #[serde(skip)]
    pub backend: Option<BackendChoice>,
    /// Use the adapter whose name contains this
    #[arg(long, value_name = "NAME", value_parser = adapter)]
    #[serde(skip)]
    pub adapter: Option<String>,
    /// Floating-point type of the fast kernels [default: f32]
    #[arg(long, value_parser = words(Precision::WORDS), value_name = "TYPE")]
    #[serde(skip)]
    pub precision: Option<Precision>,
    /// Bound on each row's strain error, relative to max(|strain|, 1e-3 of the peak) [default: 1e-5 with f32, 1e-8 with f64]
    #[arg(long, value_name = "E", value_parser = number)]
    pub tolerance: Option<f64>,
    /// CPU threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=4096))]
    pub threads: Option<u32>,
    /// Show what would run, with rows, bytes and seconds; run nothing
    #[arg(long)]
    pub plan: bool,
    /// No progress, no summary
    #[arg(long)]
    pub quiet: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

impl Common {
    pub fn over(&self, spec: &RunOptions) -> RunOptions {
        let flag = |typed: bool, spec: Option<bool>| if typed { Some(true) } else { spec };
        RunOptions {
            out: self.out.clone().or_else(|| spec.out.clone()),
            force: flag(self.force, spec.force),
            backend: self.backend.or(spec.backend),
            adapter: self.adapter.clone().or_else(|| spec.adapter.clone()),
            precision: self.precision.or(spec.precision),
            tolerance: self.tolerance.or(spec.tolerance),
            model_error: spec.model_error,
            threads: self.threads.map(|n| n as usize).or(spec.threads),
            plan: flag(self.plan, spec.plan),
            quiet: flag(self.quiet, spec.quiet),
            json: flag(self.json, spec.json),
        }
    }
}

/// Rejects the empty text, which is part of every adapter's name.
fn adapter(text: &str) -> Result<String, &'static str> {
    let named = Some(text.to_owned()).filter(|t| !t.trim().is_empty());
    named.ok_or("allowed: a part of an adapter's name; `vibrissa devices` lists them")
}

/// Parses a shard `i/n`, or `slurm` for the task of a Slurm array.
pub fn shard(text: &str) -> Result<Shard, String> {
    if text == "slurm" { Shard::of_slurm(|name| std::env::var(name).ok()) } else { text.parse() }
}
