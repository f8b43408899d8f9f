//! What was typed, and what runs it.

mod design;
mod rig;
mod write;

use clap::{Parser, Subcommand};

use vibrissa::command::bench::BenchRequest;
use vibrissa::command::calibrate::CalibrateRequest;
use vibrissa::command::chart::ChartRequest;
use vibrissa::command::contour::ContourRequest;
use vibrissa::command::explore::ExploreRequest;
use vibrissa::command::next::NextRequest;
use vibrissa::command::optimise::OptimiseRequest;
use vibrissa::command::plan::PlanRequest;
use vibrissa::command::report::ReportRequest;
use vibrissa::command::shape::ShapeRequest;
use vibrissa::command::simulate::SimulateRequest;
use vibrissa::command::sweep::SweepRequest;
use vibrissa::command::tap::TapRequest;
use vibrissa::command::taps::TapsRequest;
use vibrissa::command::verify::VerifyRequest;

use vibrissa::command::{self, Context, Reply};
use vibrissa::error::Error;
use vibrissa::spec;

use super::help::{Completions, Help, Man};
use super::{cite, cluster, devices, explain, help, locate, merge, new};
pub use design::{Cluster, Merge};
pub use rig::Locate;
pub use vibrissa::command::Common;
pub use write::{CLAMPS, Cite, GOALS, Goal, New, Schema};

/// Behind the help of the program.
const AFTER: &str = "A first sweep: vibrissa sweep sweeps/prototypes.toml\n\
    The reference: vibrissa help spec (every key), help columns (every table), help statuses (every word)\n\
    Exit codes: 0 done, 1 the run failed or was interrupted, 2 bad usage, bad spec or bad data";

/// Sweeps, optimises and calibrates tapered soft whisker sensors.
#[derive(Debug, Parser)]
#[command(name = "vibrissa", version, about, max_term_width = 100, arg_required_else_help = true)]
#[command(disable_help_subcommand = true)]
#[command(after_help = AFTER)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

/// One question each.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Evaluate a design space: K, its spread, bias and noise of the distance -> tuples, designs, distances tables
    Sweep(SweepRequest),
    /// Which taps a calibration needs for a wanted error, against an even grid -> plan.csv to fill in, plan_errors.csv, plan.svg
    Plan(PlanRequest),
    /// Calibrate a whisker from measured strains -> K table, estimators, best drive, calibration.toml
    Calibrate(CalibrateRequest),
    /// Distances from readings, with their uncertainty: a file, or stdin line by line
    Locate(Locate),
    /// Find rests and taps in a raw signal -> taps.csv, which calibrate reads, and a figure to check it
    Taps(TapsRequest),
    /// Which drive the next tap of an object should have, and what it brings -> next.csv, next.svg
    Next(NextRequest),
    /// Points on an object from taps and strokes at several base poses, and the curve through them -> points.csv, curve.csv, contour.svg
    Contour(ContourRequest),
    /// Synthetic measurements of one whisker from the exact model -> measurements.csv, or strokes over an object -> strokes.csv
    Simulate(SimulateRequest),
    /// Search geometry and tap angle -> best design, Pareto front, history
    Optimise(OptimiseRequest),
    /// Find the best tap angle of one whisker, and what limits it -> tap.csv
    Tap(TapRequest),
    /// Join the parts of a sweep (sweep --shard i/n) to the tables of the whole sweep
    Merge(Merge),
    /// Write the job scripts that run a sweep on a cluster
    Cluster(Cluster),
    /// Fit smooth functions to a spec's taps, for other programs -> chart.json
    Chart(ChartRequest),
    /// One page with sliders for whisker, gauge and tap -> explore.html, which needs no other file
    Explore(ExploreRequest),
    /// Check this machine: every backend against the f64 reference -> census of strain errors; exit code 1 where a bound is
    /// broken
    Verify(VerifyRequest),
    /// Speed against error of every kernel, backend and configuration -> tables, figures
    Bench(BenchRequest),
    /// Shapes of bent whiskers, section by section, from the exact model -> shape.csv, contacts.csv
    Shape(ShapeRequest),
    /// Figures (SVG, PNG, PDF) and one page, from the folder of a result
    Report(ReportRequest),
    /// List adapters, their limits and features, and which one `--backend auto` uses
    Devices(Common),
    /// Write a first spec, commented: five questions, or flags
    New(New),
    /// How to cite the program, the model and a result
    Cite(Cite),
    /// The JSON Schema of specs, by which editors complete and check them
    Schema(Schema),
    /// The help of a command, or the reference: spec (keys), columns (of tables), statuses
    Help(Help),
    /// A shell script that completes commands and flags
    Completions(Completions),
    /// The manual page, on stdout; or the pages of all commands, into a folder
    Man(Man),
}

impl Command {
    /// Runs it.
    pub fn run(&self, context: &Context<'_>) -> Result<Reply, Error> {
        match self {
            Self::Sweep(sweep) if sweep.explain => explained(sweep, context),
            Self::Sweep(sweep) => command::sweep::run(sweep, context),
            Self::Calibrate(calibrate) => command::calibrate::run(calibrate, context),
            Self::Locate(locate) => locate::run(locate, context),
            Self::Taps(taps) => command::taps::run(taps, context),
            Self::Next(next) => command::next::run(next, context),
            Self::Plan(plan) => command::plan::run(plan, context),
            Self::Contour(contour) => command::contour::run(contour, context),
            Self::Simulate(simulate) => command::simulate::run(simulate, context),
            Self::Optimise(optimise) => command::optimise::run(optimise, context),
            Self::Tap(tap) => command::tap::run(tap, context),
            Self::Chart(chart) => command::chart::run(chart, context),
            Self::Merge(merge) => merge::run(merge),
            Self::Cluster(cluster) => cluster::run(cluster),
            Self::Explore(explore) => command::explore::run(explore, context),
            Self::Verify(verify) => command::verify::run(verify, context),
            Self::Bench(bench) => command::bench::run(bench, context),
            Self::Shape(shape) => command::shape::run(shape, context),
            Self::Report(report) => command::report::run(report, context),
            Self::Devices(common) => devices::run(common),
            Self::New(new) => new::run(new),
            Self::Cite(cite) => cite::run(cite),
            Self::Schema(_) => Ok(Reply { text: vibrissa::reference::schema::text(), ..Default::default() }),
            Self::Completions(asked) => help::completions(asked),
            Self::Man(asked) => help::man(asked),
            // It prints as clap does.
            Self::Help(_) => Ok(Reply::default()),
        }
    }
}

/// What each effect of the spec's model changes (`sweep --explain`), whatever its `[run]` plans.
fn explained(asked: &SweepRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = spec::read(&asked.spec)?;
    let options = context.begun(&asked.common, &mut spec)?;
    explain::run(&spec, &options, &asked.leave_off)
}
