//! The command line.

use std::path::PathBuf;

use clap::{Args as Flags, Parser, Subcommand};
pub use vibrissa::command::Common;
use vibrissa::command::{self, Context, Reply, words};
use vibrissa::error::Error;
use vibrissa::locate::SaidZero;
use vibrissa::locate::estimator::Estimator;
use vibrissa::locate::free::Free;

use super::cite::Cite;
use super::help::{Completions, Help, Man};
use super::new::New;
use super::{cite, devices, help, locate, new};

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
    #[command(flatten)]
    Library(command::Command),
    /// Distances from readings, with their uncertainty: a file, or stdin line by line
    // Before taps.
    #[command(display_order = 3)]
    Locate(Locate),
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
    pub fn run(&self, context: &Context<'_>) -> Result<Reply, Error> {
        match self {
            Self::Library(command) => command.run(context),
            Self::Locate(locate) => locate::run(locate, context),
            Self::Devices(common) => devices::run(common),
            Self::New(new) => new::run(new),
            Self::Cite(cite) => cite::run(cite),
            Self::Schema(_) => Ok(Reply { text: vibrissa::reference::schema::text(), ..Default::default() }),
            Self::Completions(asked) => help::completions(asked),
            Self::Man(asked) => help::man(asked),
            // Handled before, with clap's output.
            Self::Help(_) => Ok(Reply::default()),
        }
    }
}

/// The JSON Schema of specs, for editors.
#[derive(Debug, Flags)]
#[command(
    after_help = "An editor with TOML support (Taplo, Even Better TOML) reads a first line `#:schema ./spec.schema.json` in a spec.\n\
                  Example: vibrissa schema > spec.schema.json"
)]
pub struct Schema {}

/// Distances from readings.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa locate calibration.toml readings.csv --out located")]
pub struct Locate {
    /// calibration.toml as calibrate wrote it (--force takes one that was edited by hand); with --array, the file of readings
    #[arg(required_unless_present = "array")]
    pub calibration: Option<PathBuf>,
    /// CSV (comma, semicolon or tab; decimal point or comma) with theta_deg (or delta_mm) and strain (or microstrain,
    /// bridge_mV_per_V, reading); rows with theta (delta) = 0 are zero readings. stdin if left out or -, where the header may be
    /// missing (drive, signal in the unit of the calibration) and every line is answered at once on stdout
    pub readings: Option<PathBuf>,
    /// Several whiskers: [[whisker]] name, calibration, x, y, z, heading (TOML; mm, degrees) of each; the readings then have a column
    /// whisker, and contact_deg where the motor was not at 0 at first touch -> points in one frame (docs/contour.md)
    #[arg(long, value_name = "ARRAY")]
    pub array: Option<PathBuf>,
    /// Readings are of a run of the calibration, whose zero and gain are known: without it they are of another one, and σ says so
    #[arg(long)]
    pub same_run: bool,
    /// All readings are taps of one object: after each, the distance that all so far tell together
    #[arg(long, conflicts_with = "object")]
    pub same: bool,
    /// Readings with the same word in this column are taps of one object [default: object, where a file has it]
    #[arg(long, value_name = "COLUMN")]
    pub object: Option<String>,
    /// Readings are recorded along strokes at growing drive, of which each is told as one curve: where the whisker touched, and the
    /// distance. A column stroke numbers them; else one begins where the drive grows again
    #[arg(long, conflicts_with_all = ["same", "object", "array"])]
    pub strokes: bool,
    /// What a stroke leaves free, so that its interval has all that it may be: zero (that of the sensor, wherever it is), friction=SD of the
    /// object (about that of the whisker's spec), tilt=SD of its edge in degrees; joined by commas
    #[arg(long, requires = "strokes", value_name = "WORDS")]
    pub free: Option<Free>,
    /// Adds from_95_mm and to_95_mm, the interval that holds the distance with 95 %: σ holds 68 %, and twice σ less than 95 % where few runs
    /// and positions told what the readings of a new run are worth. Strokes tell it anyway
    #[arg(long, conflicts_with_all = ["strokes", "array"])]
    pub interval: bool,
    /// Answer by this instead of learned
    #[arg(long, value_parser = words(Estimator::ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME")]
    pub estimator: Option<Estimator>,
    /// What the sensor shows without contact, in the unit of the signal, where no row with theta (delta) = 0 says it; readings
    /// must be in the state of the calibration: tared as its signal was, or with their zero (else there is a warning); X,Y of two signals
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    #[command(flatten)]
    pub common: Common,
}
