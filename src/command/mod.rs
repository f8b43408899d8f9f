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
mod common;
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

pub use common::{Common, named, number, shard, whole, words};
pub use context::{Content, Context, Destination, HeldFile, Host, Show};

pub use reply::{Reply, grouped, in_force, listed, rough, where_and_why, with_model_error};

use std::path::{Path, PathBuf};

use clap::Subcommand;
use serde::Deserialize;

use crate::error::{Error, InputError};
use crate::estimator::Estimator;

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

pub fn estimators() -> [(&'static str, Estimator, &'static str); Estimator::ALL.len()] {
    Estimator::ALL.map(|e| (e.name(), e, e.help()))
}

pub fn estimator(said: Option<&str>) -> Result<Option<Estimator>, InputError> {
    meant(("estimator", "--estimator"), said, &estimators())
}

/// One question each, by its words on the command line or by Python's keywords.
#[derive(Debug, Subcommand, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Command {
    /// Evaluate a design space: K, its spread, bias and noise of the distance -> tuples, designs, distances tables
    Sweep(sweep::SweepRequest),
    /// Which taps a calibration needs for a wanted error, against an even grid -> plan.csv to fill in, plan_errors.csv, plan.svg
    Plan(plan::PlanRequest),
    /// Calibrate a whisker from measured strains -> K table, estimators, best drive, calibration.toml
    Calibrate(calibrate::CalibrateRequest),
    /// Find rests and taps in a raw signal -> taps.csv, which calibrate reads, and a figure to check it
    Taps(taps::TapsRequest),
    /// Which drive the next tap of an object should have, and what it brings -> next.csv, next.svg
    Next(next::NextRequest),
    /// Points on an object from taps and strokes at several base poses, and the curve through them -> points.csv, curve.csv, contour.svg
    Contour(contour::ContourRequest),
    /// Synthetic measurements of one whisker from the exact model -> measurements.csv, or strokes over an object -> strokes.csv
    Simulate(simulate::SimulateRequest),
    /// Search geometry and tap angle -> best design, Pareto front, history
    Optimise(optimise::OptimiseRequest),
    /// Find the best tap angle of one whisker, and what limits it -> tap.csv
    Tap(tap::TapRequest),
    /// Join the parts of a sweep (sweep --shard i/n) to the tables of the whole sweep
    #[serde(skip)]
    Merge(merge::MergeRequest),
    /// Write the job scripts that run a sweep on a cluster
    #[serde(skip)]
    Cluster(cluster::ClusterRequest),
    /// Fit smooth functions to a spec's taps, for other programs -> chart.json
    Chart(chart::ChartRequest),
    /// One page with sliders for whisker, gauge and tap -> explore.html, which needs no other file
    Explore(explore::ExploreRequest),
    /// Check this machine: every backend against the f64 reference -> census of strain errors; exit code 1 where a bound is
    /// broken
    Verify(verify::VerifyRequest),
    /// Speed against error of every kernel, backend and configuration -> tables, figures
    #[serde(skip)]
    Bench(bench::BenchRequest),
    /// Shapes of bent whiskers, section by section, from the exact model -> shape.csv, contacts.csv
    Shape(shape::ShapeRequest),
    /// Figures (SVG, PNG, PDF) and one page, from the folder of a result
    Report(report::ReportRequest),
    /// Readings of several whiskers as points in one frame: `locate --array`
    #[command(skip)]
    Array(array::LocateRequest),
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
