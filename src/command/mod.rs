//! Commands. A request is one struct, which clap reads from flags and serde from Python's keywords; `run` answers it in a [`Context`] with a
//! [`Reply`]. The program and the Python package only fill in the request, and print or pass on the reply.

// The comments of flags are terminal help: plain text, where [model] is a section and <out> a folder.
#![allow(rustdoc::broken_intra_doc_links, rustdoc::invalid_html_tags)]

mod apart;
pub mod array;
pub mod bench;
pub mod calibrate;
pub mod chart;
pub mod cluster;
mod context;
pub mod contour;
mod explain;
pub mod explore;
pub mod merge;
pub mod next;
pub mod optimise;
pub mod plan;
mod reply;
pub mod report;
pub mod shape;
pub mod simulate;
pub mod sweep;
pub mod tap;
pub mod taps;
pub mod verify;

use std::ops::{Deref, RangeInclusive};
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args as Flags, Subcommand};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer};

use crate::error::{Error, InputError};
use crate::estimator::Estimator;
use crate::scene::{BackendChoice, Precision, RunOptions};
use crate::sink::shard::Shard;

pub use context::{Content, Context, Destination, HeldFile, Host, Show};

pub use reply::{Reply, grouped, in_force, listed, rough, where_and_why, with_model_error};

pub fn stem(path: &Path, usual: &str) -> String {
    path.file_stem().map_or_else(|| usual.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Output folder: typed or from the spec, else `results/<name>` for a sweep and `results/<name>-<command>` for others.
pub fn folder(out: Option<&PathBuf>, name: &str, command: &str) -> PathBuf {
    let folder = if command == "sweep" { name.to_owned() } else { format!("{name}-{command}") };
    out.cloned().unwrap_or_else(|| Path::new("results").join(folder))
}

/// Refuses options for single signals: key, true if given, allowed.
pub fn of_one_signal(options: &[(&str, bool, &str)]) -> Result<(), InputError> {
    match options.iter().find(|(_, said, _)| *said) {
        Some((key, _, allowed)) => {
            let error = InputError::new("this is said of one signal, and the sensor has several channels");
            Err(error.key(*key).allowed(*allowed))
        }
        None => Ok(()),
    }
}

/// The value of the word `said` for `key` in `words`; `what` names the kind of word.
pub fn meant<T: Copy>(
    (what, key): (&str, &str),
    said: Option<&str>,
    words: &[(&'static str, T, &'static str)],
) -> Result<Option<T>, InputError> {
    let Some(said) = said else { return Ok(None) };
    let found = words.iter().find(|(word, ..)| *word == said).map(|(_, value, _)| *value);
    let wrong = || {
        let known: Vec<&str> = words.iter().map(|(word, ..)| *word).collect();
        InputError::new(format!("there is no such {what}")).key(key).value(said).allowed(known.join(", "))
    };
    found.map(Some).ok_or_else(wrong)
}

pub fn estimator(said: Option<&str>) -> Result<Option<Estimator>, InputError> {
    meant(("estimator", "--estimator"), said, &Estimator::WORDS)
}

/// One question each, by its words on the command line or by Python's keywords.
#[derive(Debug, Subcommand, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Command {
    /// Evaluate a design space: K, its spread, bias and noise of the distance -> tuples, designs, distances tables
    Sweep(Asked<sweep::SweepRequest>),
    /// Which taps a calibration needs for a wanted error, against an even grid -> plan.csv to fill in, plan_errors.csv, plan.svg
    Plan(Asked<plan::PlanRequest>),
    /// Calibrate a whisker from measured strains -> K table, estimators, best drive, calibration.toml
    Calibrate(Asked<calibrate::CalibrateRequest>),
    /// Find rests and taps in a raw signal -> taps.csv, which calibrate reads, and a figure to check it
    Taps(Asked<taps::TapsRequest>),
    /// Which drive the next tap of an object should have, and what it brings -> next.csv, next.svg
    Next(Asked<next::NextRequest>),
    /// Points on an object from taps and strokes at several base poses, and the curve through them -> points.csv, curve.csv, contour.svg
    Contour(Asked<contour::ContourRequest>),
    /// Synthetic measurements of one whisker from the exact model -> measurements.csv, or strokes over an object -> strokes.csv
    Simulate(Asked<simulate::SimulateRequest>),
    /// Search geometry and tap angle -> best design, Pareto front, history
    Optimise(Asked<optimise::OptimiseRequest>),
    /// Find the best tap angle of one whisker, and what limits it -> tap.csv
    Tap(Asked<tap::TapRequest>),
    /// Join the parts of a sweep (sweep --shard i/n) to the tables of the whole sweep
    #[serde(skip)]
    Merge(Asked<merge::MergeRequest>),
    /// Write the job scripts that run a sweep on a cluster
    #[serde(skip)]
    Cluster(Asked<cluster::ClusterRequest>),
    /// Fit smooth functions to a spec's taps, for other programs -> chart.json
    Chart(Asked<chart::ChartRequest>),
    /// One page with sliders for whisker, gauge and tap -> explore.html, which needs no other file
    Explore(Asked<explore::ExploreRequest>),
    /// Check this machine: every backend against the f64 reference -> census of strain errors; exit code 1 where a bound is
    /// broken
    Verify(Asked<verify::VerifyRequest>),
    /// Speed against error of every kernel, backend and configuration -> tables, figures
    #[serde(skip)]
    Bench(Asked<bench::BenchRequest>),
    /// Shapes of bent whiskers, section by section, from the exact model -> shape.csv, contacts.csv
    Shape(Asked<shape::ShapeRequest>),
    /// Figures (SVG, PNG, PDF) and one page, from the folder of a result
    Report(Asked<report::ReportRequest>),
    /// Readings of several whiskers as points in one frame: `locate --array`
    #[command(skip)]
    Array(Asked<array::LocateRequest>),
}

impl Command {
    pub fn run(&self, context: &Context<'_>) -> Result<Reply, Error> {
        let done = match self {
            Self::Sweep(asked) => sweep::run(asked, context),
            Self::Plan(asked) => plan::run(asked, context),
            Self::Calibrate(asked) => calibrate::run(asked, context),
            Self::Taps(asked) => taps::run(asked, context),
            Self::Next(asked) => next::run(asked, context),
            Self::Contour(asked) => contour::run(asked, context),
            Self::Simulate(asked) => simulate::run(asked, context),
            Self::Optimise(asked) => optimise::run(asked, context),
            Self::Tap(asked) => tap::run(asked, context),
            Self::Merge(asked) => merge::run(asked, context),
            Self::Cluster(asked) => cluster::run(asked, context),
            Self::Chart(asked) => chart::run(asked, context),
            Self::Explore(asked) => explore::run(asked, context),
            Self::Verify(asked) => verify::run(asked, context),
            Self::Bench(asked) => bench::run(asked, context),
            Self::Shape(asked) => shape::run(asked, context),
            Self::Report(asked) => report::run(asked, context),
            Self::Array(asked) => array::run(asked, context),
        };
        done.map_err(|e| context.placed(e))
    }
}

pub fn run(command: &str, request: &str, context: &Context<'_>) -> Result<Reply, Error> {
    let read: Result<Command, _> = toml::from_str(&format!("[{command}]\n{request}"));
    read.map_err(|e| Error::Run(e.to_string()))?.run(context)
}

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

/// A request, and the options of every command.
#[derive(Debug, Flags)]
pub struct Asked<T: Flags> {
    #[command(flatten)]
    of: T,
    #[command(flatten)]
    pub common: Common,
}

impl<'de, T: Flags + DeserializeOwned> Deserialize<'de> for Asked<T> {
    fn deserialize<D: Deserializer<'de>>(said: D) -> Result<Self, D::Error> {
        // From a table, an error names its key.
        let said = toml::Table::deserialize(said)?;
        let of = said.clone().try_into().map_err(D::Error::custom)?;
        Ok(Self { of, common: said.try_into().map_err(D::Error::custom)? })
    }
}

impl<T: Flags> Deref for Asked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.of
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
