//! What was typed.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args as Flags, Parser, Subcommand};
use vibrissa::export::Language;
use vibrissa::figure::Format;
use vibrissa::locate::estimator::{ALL, Estimator};
use vibrissa::scene::{BackendChoice, Precision, RunOptions};
use vibrissa::sink::shard::Shard;

use super::help::{Completions, Help, Man};

/// Behind the help of the program.
const AFTER: &str = "A first sweep: vibrissa sweep sweeps/prototypes.toml\n\
    The reference: vibrissa help spec (every key), help columns (every table), help statuses (every word)\n\
    Exit codes: 0 done, 1 the run failed or was interrupted, 2 bad usage, bad spec or bad data";

/// Sweeps, optimises and calibrates tapered soft whisker sensors.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100, arg_required_else_help = true)]
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
    Sweep(Sweep),
    /// Calibrate a whisker from measured strains -> K table, estimators, best drive, calibration.toml
    Calibrate(Calibrate),
    /// Distances from readings, with their uncertainty: a file, or stdin line by line
    Locate(Locate),
    /// Synthetic measurements of one whisker from the exact model -> measurements.csv
    Simulate(Simulate),
    /// Search geometry and tap angle -> best design, Pareto front, history
    Optimise(Optimise),
    /// Find the best tap angle of one whisker -> curve over the angle, the optimum, why
    Tap(Tap),
    /// Join the parts of a sweep (sweep --shard i/n) to the tables of the whole, byte for byte
    Merge(Merge),
    /// Write the job scripts that run a sweep on a cluster
    Cluster(Cluster),
    /// Solve a spec's taps into smooth functions that pages and robots can read -> chart.json
    Chart(Chart),
    /// One page in which sliders move whisker, gauge and tap -> explore.html, a file that needs nothing else
    Explore(Explore),
    /// Check this machine: every backend against the f64 reference -> census of strain errors; exit code 1 where a bound is
    /// broken
    Verify(Verify),
    /// Speed against error of every kernel, backend and configuration -> tables, figures
    Bench(Bench),
    /// Shapes of bent whiskers, section by section, from the exact model -> shape.csv, contacts.csv
    Shape(Shape),
    /// Figures (SVG, PNG, PDF) and one page to look at, from the folder of a result
    Report(Report),
    /// List adapters, their limits and features, and which one `--backend auto` takes
    Devices(Common),
    /// The help of a command, or the reference: spec (keys), columns (of tables), statuses
    Help(Help),
    /// A script for a shell, by which it completes commands and flags
    Completions(Completions),
    /// The manual page, on stdout; or the pages of all commands, into a folder
    Man(Man),
}

impl Command {
    /// Name as typed.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sweep(_) => "sweep",
            Self::Calibrate(_) => "calibrate",
            Self::Locate(_) => "locate",
            Self::Simulate(_) => "simulate",
            Self::Optimise(_) => "optimise",
            Self::Tap(_) => "tap",
            Self::Merge(_) => "merge",
            Self::Cluster(_) => "cluster",
            Self::Chart(_) => "chart",
            Self::Explore(_) => "explore",
            Self::Verify(_) => "verify",
            Self::Bench(_) => "bench",
            Self::Shape(_) => "shape",
            Self::Report(_) => "report",
            Self::Devices(_) => "devices",
            Self::Help(_) => "help",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
        }
    }

    /// The flags that every command that computes has.
    pub fn common(&self) -> Option<&Common> {
        match self {
            Self::Sweep(s) => Some(&s.common),
            Self::Calibrate(c) => Some(&c.common),
            Self::Locate(l) => Some(&l.common),
            Self::Simulate(s) => Some(&s.common),
            Self::Optimise(o) => Some(&o.common),
            Self::Tap(t) => Some(&t.common),
            Self::Merge(m) => Some(&m.common),
            Self::Cluster(c) => Some(&c.common),
            Self::Chart(c) => Some(&c.common),
            Self::Explore(e) => Some(&e.common),
            Self::Verify(v) => Some(&v.common),
            Self::Bench(b) => Some(&b.common),
            Self::Shape(s) => Some(&s.common),
            Self::Devices(c) => Some(c),
            Self::Report(_) | Self::Help(_) | Self::Completions(_) | Self::Man(_) => None,
        }
    }
}

/// Evaluate a design space.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa sweep sweeps/prototypes.toml")]
pub struct Sweep {
    /// The spec: whisker, gauge, tap, model (TOML; mm, degrees, MPa, N)
    pub spec: PathBuf,
    /// Say what each effect of the model changes, in % of strain, and which could be left off; write nothing
    #[arg(long, conflicts_with_all = ["plan", "out", "force"])]
    pub explain: bool,
    /// With --explain: judge at these relative changes of strain, comma between [default: 1e-4,1e-3,1e-2]
    #[arg(long, value_name = "E", value_delimiter = ',', requires = "explain")]
    pub leave_off: Vec<f64>,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the spec's space: measured
    /// against the full model, told in run.json with what it saves (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with = "explain")]
    pub model_error: Option<f64>,
    /// Do part i of n alone, of whole designs, into <out>/shard-i-of-n; `vibrissa merge` joins them. `slurm`: the part that this task of a
    /// Slurm array is
    #[arg(long, value_name = "i/n", value_parser = shard, conflicts_with = "explain")]
    pub shard: Option<Shard>,
    /// Make what is complete durable this often, so that the same command goes on from there if the run is stopped or killed
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = seconds)]
    pub keep_every: Duration,
    #[command(flatten)]
    pub common: Common,
}

/// Calibrate a whisker from measured strains.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa calibrate examples/prototype-d10.csv --whisker examples/prototype-d10.toml"
)]
pub struct Calibrate {
    /// CSV (comma, semicolon or tab; decimal point or comma) with a_mm, theta_deg (or delta_mm) and one of strain, microstrain,
    /// bridge_mV_per_V, reading; rows with theta (delta) = 0 are zero readings, repeats are welcome, other columns are ignored
    pub data: PathBuf,
    /// Spec of the whisker: D, d, L_a, x_ss, l as one number each, and [model]; [tap] need not be there. Without it: the estimators
    /// curve, table and, with one drive, paper (with f falling as 1/a)
    #[arg(long, value_name = "SPEC")]
    pub whisker: Option<PathBuf>,
    /// Tap angle of every row, degrees, where no column says
    #[arg(long, value_name = "X", conflicts_with = "delta")]
    pub theta: Option<f64>,
    /// Displacement of every row, mm, where no column says
    #[arg(long, value_name = "X")]
    pub delta: Option<f64>,
    /// Columns under other names: a=dist,theta=ang_deg,reading=ch3 (a, theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    /// Distances (mm) and drives within this of each other are one: one width, or two with a comma between; 0: only equal ones
    /// [default: from the gaps of the data]
    #[arg(long, value_name = "WIDTH", value_delimiter = ',', allow_negative_numbers = true)]
    pub group: Vec<f64>,
    /// Fit these too, comma between: a_offset, hub, nu, mu, C01/C10
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fit: Vec<String>,
    /// Write what answers readings as a program of one file for a robot too, comma between
    #[arg(long, value_name = "LANGUAGES", value_delimiter = ',', value_parser = words(Language::ALL))]
    pub export: Vec<Language>,
    /// Estimator that is exported [default: the one that won on distances left out]
    #[arg(long, value_parser = words(ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME", requires = "export")]
    pub estimator: Option<&'static dyn Estimator>,
    #[command(flatten)]
    pub common: Common,
}

/// Distances from readings.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa locate calibration.toml readings.csv --out located")]
pub struct Locate {
    /// calibration.toml as calibrate wrote it (--force takes one that was edited by hand)
    pub calibration: PathBuf,
    /// CSV (comma, semicolon or tab; decimal point or comma) with theta_deg (or delta_mm) and strain (or microstrain,
    /// bridge_mV_per_V, reading); rows with theta (delta) = 0 are zero readings. stdin if left out or -, where the header may be
    /// missing (drive, signal in the unit of the calibration) and every line is answered at once on stdout
    pub readings: Option<PathBuf>,
    /// Answer by this instead of the one that won on distances left out
    #[arg(long, value_parser = words(ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME")]
    pub estimator: Option<&'static dyn Estimator>,
    /// What the sensor shows without contact, in the unit of the signal, where no row with theta (delta) = 0 says it; readings
    /// must be in the state of the calibration: tared as its signal was, or with their zero
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub zero: Option<f64>,
    /// Columns under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    #[command(flatten)]
    pub common: Common,
}

/// Parts of a sweep.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa merge results/million")]
pub struct Merge {
    /// Folders shard-i-of-n, or the folder that holds them, where the whole goes too unless --out says otherwise
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
    /// Parts, each a task of the array
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub shards: u32,
    /// Tasks that run at a time [default: as many as the cluster gives]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub at_a_time: Option<u32>,
    #[command(flatten)]
    pub common: Common,
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

/// One page in which sliders move a whisker: strain, K, its spread and the error budget, of the exact model. It needs no network.
#[derive(Debug, Flags)]
#[command(
    after_help = "Here --out names a file, not a folder [default: explore.html]. Example: vibrissa explore sweeps/prototypes.toml"
)]
pub struct Explore {
    /// The spec: ranges of whisker, gauge, drive and distances, which are those of the sliders (around a single number: a range), its model
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
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = clap::value_parser!(u32).range(3..=10_001))]
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
    /// Formats of the figures, comma between; the page draws its own
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', default_value = "svg,png,pdf", value_parser = words(Format::WORDS))]
    pub figures: Vec<Format>,
    /// Width of a column of the paper, mm; figures with several panels are two columns wide
    #[arg(long, value_name = "MM", default_value_t = 88.0)]
    pub width: f64,
    /// Size of all text in the figures, pt
    #[arg(long, value_name = "PT", default_value_t = 8.0)]
    pub font_size: f64,
    /// TrueType font file of the figures [default: DejaVu Sans, built in]
    #[arg(long, value_name = "FILE")]
    pub font: Option<PathBuf>,
    /// Draw also what was changed since it was written; write also where another report or other files lie
    #[arg(long)]
    pub force: bool,
    /// Say which figures would be drawn; write nothing
    #[arg(long)]
    pub plan: bool,
    /// No notes, no summary
    #[arg(long)]
    pub quiet: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Synthetic measurements from the exact model.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa simulate examples/prototype-d10.toml --repeats 3 --zero-every 11")]
pub struct Simulate {
    /// The spec: one whisker, its distances and drives, its model
    pub spec: PathBuf,
    /// Taps of each distance and drive
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub repeats: u64,
    /// Standard deviation of one reading, in strain [default: gauge.noise_strain of the spec, else 0]
    #[arg(long, value_name = "E")]
    pub noise: Option<f64>,
    /// Seed of everything random
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// A zero reading before every N taps, and one at the end
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub zero_every: Option<u64>,
    /// Drift of the zero per row, in strain
    #[arg(long, value_name = "E", default_value_t = 0.0, allow_negative_numbers = true)]
    pub drift: f64,
    /// Share of taps that are wrong: another distance label, or a signal off by 20 to 100 %
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub outliers: f64,
    /// |strain| at which the sensor stops
    #[arg(long, value_name = "E")]
    pub saturate: Option<f64>,
    /// Share of the last tap's strain that is still there
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub hysteresis: f64,
    /// Signal per strain
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true)]
    pub factor: f64,
    /// Tap by this much more than the label says, degrees or mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true)]
    pub drive_offset: f64,
    /// Tap this much farther out than the label says, mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true)]
    pub a_offset: f64,
    /// What is recorded: strain, microstrain, bridge_mV_per_V or reading [default: strain]
    #[arg(long, value_name = "NAME")]
    pub signal: Option<String>,
    #[command(flatten)]
    pub common: Common,
}

/// Search for the best design.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa optimise sweeps/design.toml")]
pub struct Optimise {
    /// The spec: whisker, gauge, tap, model, and what to search for in [optimise]
    pub spec: PathBuf,
    /// Search i of n, with the seed of the spec + i − 1 and the whole budget, into <out>/shard-i-of-n; `vibrissa merge` joins them to the best
    /// design and one front. `slurm`: the number that this task of a Slurm array has
    #[arg(long, value_name = "i/n", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Go on with a search that was stopped (Ctrl-C, budget, crash), exactly where it was; without this a search that would
    /// discard the work of an unfinished one asks for --force
    #[arg(long)]
    pub resume: bool,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the ranges of the variables: measured
    /// against the full model, told in run.json with what it saves (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub model_error: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

/// Compare every backend with the reference. Ctrl-C keeps the lines so far.
#[derive(Debug, Flags)]
pub struct Verify {
    /// A spec, of whose space and model taps are verified [default: built-in configurations and hard cases]
    pub spec: Option<PathBuf>,
    /// Few taps of few configurations: seconds instead of half a minute
    #[arg(long)]
    pub quick: bool,
    /// Random taps: of the spec [default: 1000; with --quick 100], or of each built-in configuration beside its hard
    /// cases [default: 24; with --quick 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: Option<u32>,
    /// Seed of the random taps
    #[arg(long, value_name = "S", default_value_t = 1, allow_hyphen_values = true)]
    pub seed: u64,
    /// Largest strain error that passes, relative as --tolerance is [default: the tolerance with f32, twice the tolerance with f64]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub bound: Option<f64>,
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

/// Find the best tap angle.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa tap sweeps/best-tap.toml")]
pub struct Tap {
    /// The spec of one whisker; the interval is that of [tap] theta (0.1 to 10 degrees if left out)
    pub spec: PathBuf,
    /// What to make small: total_rms_mm, or K_sd
    #[arg(long, value_enum, value_name = "WORD", default_value = "distance")]
    pub objective: TapObjective,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the interval of the drive: measured
    /// against the full model, told in run.json with what it saves (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
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

/// One of a few words, each with what to say of it.
fn words<T, const N: usize>(all: [(&'static str, T, &'static str); N]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.map(|(word, _, help)| PossibleValue::new(word).help(help)))
        .map(move |said| all.iter().find(|(word, ..)| *word == said).expect("one of the words").1)
}

/// Flags of every command. Each may also stand in the spec's [run] table; the command line wins.
#[derive(Debug, Clone, Flags)]
#[command(next_help_heading = "Options of every command, also in [run] of a spec")]
pub struct Common {
    /// Folder for the results [default: results/<name> for sweep, results/<name>-<command> for the others]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write also where another result lies (of another command or file, an edited one, one of over a minute with other values), an
    /// unfinished search, or other files. Removes only what its run.json lists, and says what; never an input, never a file of yours
    #[arg(long)]
    pub force: bool,
    /// Where to compute [default: auto: a hardware adapter, else a software one, else the CPU kernels]
    #[arg(long, value_parser = words(BackendChoice::WORDS), value_name = "NAME")]
    pub backend: Option<BackendChoice>,
    /// Take the adapter whose name contains this
    #[arg(long, value_name = "NAME", value_parser = adapter)]
    pub adapter: Option<String>,
    /// Floating-point type of the fast kernels [default: f32]
    #[arg(long, value_parser = words(Precision::WORDS), value_name = "TYPE")]
    pub precision: Option<Precision>,
    /// Bound on each row's strain error, relative to max(|strain|, 1e-3 of the peak) [default: 1e-5 with f32, 1e-8 with f64]
    #[arg(long, value_name = "E")]
    pub tolerance: Option<f64>,
    /// CPU threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Say what would run, how many tuples, bytes, seconds; run nothing
    #[arg(long)]
    pub plan: bool,
    /// No progress, no summary
    #[arg(long)]
    pub quiet: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
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

/// Part of a name: nothing is part of every name, and would take any adapter.
fn adapter(text: &str) -> Result<String, &'static str> {
    let named = Some(text.to_owned()).filter(|t| !t.trim().is_empty());
    named.ok_or("allowed: a part of an adapter's name; `vibrissa devices` lists them")
}

impl Common {
    /// The spec's options with those of the command line on top.
    pub fn over(&self, spec: &RunOptions) -> RunOptions {
        let flag = |typed: bool, spec: Option<bool>| if typed { Some(true) } else { spec };
        RunOptions {
            out: self.out.clone().or_else(|| spec.out.clone()),
            force: flag(self.force, spec.force),
            backend: self.backend.or(spec.backend),
            adapter: self.adapter.clone().or_else(|| spec.adapter.clone()),
            precision: self.precision.or(spec.precision),
            tolerance: self.tolerance.or(spec.tolerance),
            tolerance_at: spec.tolerance_at.clone().filter(|_| self.tolerance.is_none()),
            threads: self.threads.map(|n| n as usize).or(spec.threads),
            plan: flag(self.plan, spec.plan),
            quiet: flag(self.quiet, spec.quiet),
            json: flag(self.json, spec.json),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        super::Args::command().debug_assert();
    }
}
