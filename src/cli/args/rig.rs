//! A rig and its readings.

use std::path::PathBuf;

use clap::Args as Flags;
use vibrissa::contour::curve::Kind;
use vibrissa::locate::SaidZero;
use vibrissa::locate::estimator::{ALL, Estimator};
use vibrissa::locate::free::Free;
use vibrissa::measure::skin::PLACES;
use vibrissa::record::Take;

use super::common::{Common, number, whole, words};

/// Calibrate a whisker from measured strains.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa calibrate examples/prototype-d10.csv --whisker examples/prototype-d10.toml"
)]
pub struct Calibrate {
    /// CSV (comma, semicolon or tab; decimal point or comma) with a_mm, theta_deg (or delta_mm) and one of strain, microstrain,
    /// bridge_mV_per_V, reading, moment_Nmm, force_N; rows with theta (delta) = 0 are zero readings, repeats are welcome, other columns are ignored
    pub data: PathBuf,
    /// Spec of the whisker: D, d, L_a, x_ss, l as one number each, and [model]; [tap] need not be there. Without it: the estimators
    /// learned and, with one drive, paper (with f falling as 1/a)
    #[arg(long, value_name = "SPEC")]
    pub whisker: Option<PathBuf>,
    /// Tap angle of every row, degrees, where no column says
    #[arg(long, value_name = "X", conflicts_with = "delta", value_parser = number)]
    pub theta: Option<f64>,
    /// Displacement of every row, mm, where no column says
    #[arg(long, value_name = "X", value_parser = number)]
    pub delta: Option<f64>,
    /// Column that names the run of each row: rows between which the rig was not set up anew have one zero and one gain
    /// [default: run, session, date or pass]
    #[arg(long, value_name = "COLUMN")]
    pub run: Option<String>,
    /// Columns under other names: a=dist,theta=ang_deg,reading=ch3 (a, theta, delta, strain, microstrain, bridge, reading, run, t, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    /// Distances (mm) and drives within this of each other are one: one width, or two with a comma between; 0: only equal ones
    /// [default: from the gaps of the data]
    #[arg(long, value_name = "WIDTH", value_delimiter = ',', allow_negative_numbers = true, value_parser = number)]
    pub group: Vec<f64>,
    /// Fit these too, comma between: a_offset, hub, nu, mu, C01/C10, c0, k_theta
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fit: Vec<String>,
    /// Write what answers readings as a program for a robot too: locate.c, C99 in float and double, needs <math.h> only
    #[arg(long, value_name = "LANGUAGE", value_parser = ["c"])]
    pub export: Option<String>,
    /// Estimator that is exported [default: learned]
    #[arg(long, value_parser = words(ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME", requires = "export")]
    pub estimator: Option<&'static dyn Estimator>,
    #[command(flatten)]
    pub common: Common,
}

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
    #[arg(long, value_parser = words(ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME")]
    pub estimator: Option<&'static dyn Estimator>,
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

/// Taps out of a raw signal.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa taps raw.csv --columns t=Zeit,reading=Kanal --theta 4 --a 25")]
pub struct Taps {
    /// CSV with t_s and the signal (strain, microstrain, bridge_mV_per_V, reading …) of each sample; perhaps theta_deg or delta_mm, a_mm, run
    pub raw: PathBuf,
    /// What of a contact is read
    #[arg(long, value_parser = words(TAKES), value_name = "WHAT", default_value = "auto")]
    pub take: Take,
    /// Distance of all taps, or of each in the order of time, mm
    #[arg(long, value_name = "MM,…", value_delimiter = ',', value_parser = number)]
    pub a: Option<Vec<f64>>,
    /// Drive of all taps, or of each, degrees, where the record has none
    #[arg(long, value_name = "DEG,…", value_delimiter = ',', value_parser = number, conflicts_with = "delta")]
    pub theta: Option<Vec<f64>>,
    /// The same, mm
    #[arg(long, value_name = "MM,…", value_delimiter = ',', value_parser = number)]
    pub delta: Option<Vec<f64>>,
    /// Columns under other names: t=Zeit,reading=ch3 (t, theta, delta, strain, microstrain, bridge, reading, a, run, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    #[command(flatten)]
    pub common: Common,
}

/// What of a contact is read, in words.
const TAKES: [(&str, Take, &str); 3] = [
    ("auto", Take::Auto, "A plateau where there is one, else the peak"),
    ("plateau", Take::Plateau, "Plateaus alone"),
    ("peak", Take::Peak, "Peaks alone"),
];

/// The next tap of an object.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa next calibration.toml taps.csv")]
pub struct Next {
    /// calibration.toml as calibrate wrote it
    pub calibration: PathBuf,
    /// Taps of the object so far, as for locate; none: of its first tap
    pub readings: Option<PathBuf>,
    /// The column that names the object [default: object, where the file has it]
    #[arg(long, value_name = "COLUMN", requires = "readings")]
    pub object: Option<String>,
    /// Of several objects this one
    #[arg(long, value_name = "WORD", requires = "readings")]
    pub only: Option<String>,
    /// Least and largest drive that the motor may do, degrees or mm [default: the calibrated ones]
    #[arg(long, value_name = "LO,HI", value_delimiter = ',', value_parser = number, allow_hyphen_values = true)]
    pub within: Option<Vec<f64>>,
    /// The base may move along the whisker: by how much nearer to the object than where its distance is told from, mm [default: it stays]
    #[arg(long, value_name = "LO,HI", value_delimiter = ',', value_parser = number, allow_hyphen_values = true)]
    pub shift: Option<Vec<f64>>,
    /// The taps are of a run of the calibration, whose zero and gain are known
    #[arg(long)]
    pub same_run: bool,
    /// What the sensor shows without contact, where no row with theta (delta) = 0 says it: where neither does, and the signal of the
    /// calibration was tared, there is a warning
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    #[command(flatten)]
    pub common: Common,
}

/// The taps of a calibration.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa plan examples/prototype-d10.toml --error 0.25 --out plan")]
pub struct Plan {
    /// Spec of the whisker; its [tap] says how far the rig may go: distances between the least and the largest, and these drives
    pub spec: PathBuf,
    /// Root mean square error of a distance that is wanted, mm: of one tap, in another run, over the distances and drives of the spec
    #[arg(long, value_name = "MM", value_parser = number)]
    pub error: f64,
    /// Noise, and how positions and runs differ, as this calibration of the same rig learned them
    #[arg(long, value_name = "CAL")]
    pub like: Option<PathBuf>,
    /// Most positions [default: as many as help]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(2..=25))]
    pub positions: Option<usize>,
    /// Runs: the rig is set up anew for each
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<usize>(1..=8))]
    pub runs: usize,
    /// How well a position is set, mm, one standard deviation
    #[arg(long, value_name = "MM", default_value_t = 0.05, value_parser = number, conflicts_with = "like")]
    pub place: f64,
    /// By how much the gain differs between runs, as a share, one standard deviation; as --like says where that has several runs
    #[arg(long, value_name = "SHARE", default_value_t = 0.003, value_parser = number)]
    pub gain: f64,
    /// Noise that goes with the signal, as a share of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.001, value_parser = number, conflicts_with = "like")]
    pub relative: f64,
    /// Of the order of the taps
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    pub common: Common,
}

/// The contour of an object.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa contour poses.csv --calibration calibration.toml --out traced")]
pub struct Contour {
    /// CSV with base_x_mm, base_y_mm (the motor's axis) and heading_deg (the undeflected whisker at first touch, counterclockwise from +x);
    /// where needed sense (1: turns counterclockwise, the default; -1), contact_deg (motor's angle at first touch, added to the
    /// heading), stroke (its number, in the rows of one sweep), base_z_mm; then as for locate: theta_deg (since first touch) or
    /// delta_mm, and strain, microstrain, bridge_mV_per_V or reading; rows with theta (delta) = 0 are zero readings
    pub data: PathBuf,
    /// calibration.toml of the whisker, as calibrate wrote it (--force takes one that was edited by hand)
    #[arg(long, value_name = "CAL")]
    pub calibration: PathBuf,
    /// Distances by this instead of the estimator that won on distances left out
    #[arg(long, value_parser = words(ALL.map(|e| (e.name(), e, e.help()))), value_name = "NAME")]
    pub estimator: Option<&'static dyn Estimator>,
    /// Standard deviation of the heading at first touch, degrees: moves a point across the whisker
    #[arg(long, value_name = "DEG", default_value_t = 0.1, value_parser = number)]
    pub angle_noise: f64,
    /// Standard deviation of each coordinate of the base, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = number)]
    pub base_noise: f64,
    /// Standard deviation of the motor's angle at which a touch is noticed, degrees; a stroke finds its touch itself, and takes this as
    /// what is known before [default: 0 for a tap, 0.5 for a stroke]
    #[arg(long, value_name = "DEG", value_parser = number)]
    pub touch_noise: Option<f64>,
    /// Which place of the whisker touches [default: as the calibration's model has it]
    #[arg(long, value_parser = words(PLACES), value_name = "PLACE")]
    pub contact: Option<bool>,
    /// Take each row as a tap, whatever its stroke
    #[arg(long)]
    pub taps: bool,
    /// Draw this curve [default: the one that tells best where points lie that were left out, the simplest of equals]
    #[arg(long, value_parser = words(Kind::WORDS), value_name = "KIND")]
    pub curve: Option<Kind>,
    /// The object as it was simulated (simulate --object): tells how far from it the points are, and draws it
    #[arg(long, value_name = "OBJECT")]
    pub truth: Option<PathBuf>,
    /// What the sensor shows without contact, in the unit of the signal, where no row with theta (delta) = 0 says it (where neither does,
    /// and the signal of the calibration was tared, there is a warning); X,Y of two signals
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns of readings under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    #[command(flatten)]
    pub common: Common,
}

/// Synthetic measurements from the exact model.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa simulate examples/prototype-d10.toml --repeats 3 --zero-every 11")]
pub struct Simulate {
    /// The spec: one whisker, its distances and drives, its model
    pub spec: PathBuf,
    /// Taps of each distance and drive
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(1..=u64::MAX))]
    pub repeats: u64,
    /// Standard deviation of one reading, in strain [default: gauge.noise_strain of the spec, else 0]
    #[arg(long, value_name = "E", value_parser = number)]
    pub noise: Option<f64>,
    /// Seed of everything random
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    pub seed: u64,
    /// A zero reading before every N taps, and one at the end
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=u64::MAX))]
    pub zero_every: Option<u64>,
    /// Drift of the zero per row, in strain
    #[arg(long, value_name = "E", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub drift: f64,
    /// Share of taps that are wrong: another distance label, or a signal off by 20 to 100 %
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = number)]
    pub outliers: f64,
    /// |strain| at which the sensor stops
    #[arg(long, value_name = "E", value_parser = number)]
    pub saturate: Option<f64>,
    /// Share of the last tap's strain that is still there
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = number)]
    pub hysteresis: f64,
    /// Signal per strain
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = number)]
    pub factor: f64,
    /// Tap by this much more than the label says, degrees or mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub drive_offset: f64,
    /// Tap this much farther out than the label says, mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub a_offset: f64,
    /// Strokes over the object of this file, from its starts, in place of taps at labelled distances; the drives of the spec are the angles
    /// after first touch at which they are read -> strokes.csv (docs/contour.md)
    #[arg(long, value_name = "OBJECT")]
    pub object: Option<PathBuf>,
    /// What is recorded: strain, microstrain, bridge_mV_per_V, reading, moment_Nmm or force_N [default: the signal of the spec]
    #[arg(long, value_name = "NAME")]
    pub signal: Option<String>,
    #[command(flatten)]
    pub common: Common,
}
