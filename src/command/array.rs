//! `vibrissa locate --array ARRAY.toml READINGS.csv`: readings of several whiskers as points in one frame.

use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Asked, Content, Context, Reply, estimator, folder, named, stem};
use crate::contour::array::{Mounted, answer};
use crate::contour::point::Noise;
use crate::error::{Error, InputError};
use crate::estimator::Estimator;
use crate::files::Array;
use crate::locate::{Calibration, SaidZero, free::Free, object::By, stream::Ask};
use crate::measure::Names;
use crate::sink::folder::{Question, hash};

/// Distances from readings.
#[derive(Debug, Default, Flags, Deserialize)]
#[serde(default)]
#[command(after_help = "Example: vibrissa locate calibration.toml readings.csv --out located")]
pub struct LocateRequest {
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
    #[serde(skip)]
    pub free: Option<Free>,
    /// Adds from_95_mm and to_95_mm, the interval that holds the distance with 95 %: σ holds 68 %, and twice σ less than 95 % where few runs
    /// and positions told what the readings of a new run are worth. Strokes tell it anyway
    #[arg(long, conflicts_with_all = ["strokes", "array"])]
    pub interval: bool,
    /// Answer by this instead of learned
    #[arg(long, value_parser = named(Estimator::WORDS), value_name = "NAME")]
    pub estimator: Option<String>,
    /// What the sensor shows without contact, in the unit of the signal, where no row with theta (delta) = 0 says it; readings
    /// must be in the state of the calibration: tared as its signal was, or with their zero (else there is a warning); X,Y of two signals
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    /// Standard deviation of the heading, degrees, in place of that in the file of the array.
    #[arg(skip)]
    pub angle_noise: Option<f64>,
    /// And of each coordinate of the base, mm.
    #[arg(skip)]
    pub base_noise: Option<f64>,
}

impl LocateRequest {
    /// Which readings are taps of one object, or of a stroke.
    pub fn by(&self) -> By<'_> {
        match &self.object {
            Some(column) => By::Column(column),
            None if self.same => By::Same,
            None if self.strokes => By::Strokes(self.free.unwrap_or_default()),
            None => By::Unsaid,
        }
    }
}

/// Answers readings of an array, which are the first file. Without any, of a result in memory: whether the array can answer, and its calibrations.
pub fn run(asked: &Asked<LocateRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let array = asked.array.as_deref().unwrap_or(Path::new(""));
    let misused = |value: String, message: &str| {
        let allowed = "vibrissa locate --array ARRAY.toml READINGS.csv";
        InputError::new(message).key("--array").value(value).allowed(allowed)
    };
    let readings = match (&asked.calibration, &asked.readings) {
        (Some(readings), None) => Some(readings),
        (None, said) if context.is_in_memory() => said.as_ref(),
        (None, _) => return Err(misused("nothing".to_owned(), "the readings are missing").into()),
        (Some(_), Some(other)) => {
            return Err(misused(other.display().to_string(), "the array names the calibrations").into());
        }
    };
    let options = context.prepared(&asked.common, None)?;
    let described = context.read(array, "array", Array::parse)?;
    let name = readings.map(PathBuf::as_path).unwrap_or(Path::new("")).display().to_string();
    let stem = stem(Path::new(&name), "readings");
    let out = folder(options.out.as_ref(), &stem, "locate");
    let names: Vec<&str> = described.mounts.iter().map(|m| m.name.as_str()).collect();
    if options.plan == Some(true) {
        let by = names.join(", ");
        return Ok(Reply::planned(out, |_| format!("would locate readings of {name} by {by}")));
    }
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let of_file = &described.noise;
    let noise = Noise::said(
        asked.angle_noise.unwrap_or(of_file.angle),
        asked.base_noise.unwrap_or(of_file.base),
        of_file.touch,
    )?;
    let by = estimator(asked.estimator.as_deref())?;
    let (mut whiskers, mut sums, mut kept) = (Vec::<Mounted>::new(), Vec::new(), Vec::new());
    for mount in &described.mounts {
        let (path, trust) = (&mount.calibration, options.force == Some(true));
        let missing = |e: InputError| InputError { key: e.key.or(Some("whisker.calibration".into())), ..e };
        let parse = |label: &str, text: &str, _: &Path| {
            Ok((Calibration::parse(label, text, trust)?, text.as_bytes().to_vec()))
        };
        let (calibration, bytes) = match path.is_dir() {
            true => (Calibration::read(path, trust)?, Vec::new()),
            false => context.read(path, "calibration", parse).map_err(missing)?,
        };
        let mut mounted = mount.open(&calibration, by, &options)?;
        mounted.locator.same_run = asked.same_run;
        whiskers.push(mounted);
        if readings.is_none() || !context.is_in_memory() {
            context.warn_all(&calibration.rig.warnings);
        }
        sums.push(calibration.checksum);
        kept.push((path.display().to_string(), Content::Bytes(bytes)));
    }
    let zero = SaidZero::of(asked.zero.as_ref(), whiskers.iter().map(|w| &w.locator))?;
    let known = |w: &Mounted| json!({ "name": w.name, "estimator": w.locator.estimator.word() });
    let known: Vec<Value> = whiskers.iter().map(known).collect();
    let Some(readings) = readings else {
        return Ok(Reply { kept, result: known.into(), ..Reply::default() });
    };
    let measured = context.data(readings)?;
    let warn = |text: &str| context.warn(text);
    let ask = Ask { zero, by: asked.by(), ..Ask::of_file(&name, &columns, &warn) };
    let (table, counted) = answer(&whiskers, measured.rows(), &ask, &noise)?;
    let digest = measured.rows().hash()?;
    let of = json!({
        "readings": digest, "array": format!("{described:?}"), "calibrations": sums, "columns": asked.columns, "zero": asked.zero,
        "estimator": asked.estimator, "same": asked.same, "object": asked.object, "same_run": asked.same_run,
    });
    let identity = hash(&of.to_string());
    let question = Question::new("locate", &stem, of);
    let mut destination = context.open(&out, question, &["located.csv"], options.force)?;
    destination.table(table)?;
    let counts = counted.described();
    let array = array.display().to_string();
    let of = json!({ "name": stem, "hash": identity });
    let body = json!({
        "array": { "file": array, "whiskers": known }, "readings": { "file": name, "hash": digest }, "warnings": context.told(),
    });
    let words = counted.combinations.told(|n| n.to_string());
    let text = format!("{} readings of {} whiskers located: {words}\n", counted.lines, whiskers.len());
    let result = json!({ "whiskers": names, "warnings": context.told() });
    Reply { text, counts, result, ..Reply::default() }.filed(destination, of, body)
}
