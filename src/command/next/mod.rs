//! `vibrissa next CAL.toml [READINGS.csv]`: the next tap of an object.

mod shown;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Common, Context, Measured, Reply, estimator, estimators, folder, named, number, stem};
use crate::error::{Error, InputError};
use crate::locate::next::{May, next};
use crate::locate::object::NAME;
use crate::locate::sequence::{SHIFT, shift_column};
use crate::locate::stream::Ask;
use crate::locate::table::Readings;
use crate::locate::{Locator, Reading, SaidZero, locator::opener};
use crate::measure::Names;
use crate::sink::folder::{Question, hash};
use crate::sink::heading::heading;
use crate::sink::lab::{LabCell, LabTable};
use crate::sink::run_json;
pub use shown::result;
use shown::{answer, drawn, table};

/// The next tap of an object.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa next calibration.toml taps.csv")]
pub struct NextRequest {
    /// calibration.toml as calibrate wrote it
    pub calibration: PathBuf,
    /// Taps of the object so far, as for locate; none: of its first tap
    pub readings: Option<PathBuf>,
    /// Answer by this instead of the estimator that won on distances left out; `learned` alone says what another tap brings
    #[arg(long, value_parser = named(estimators()), value_name = "NAME")]
    pub estimator: Option<String>,
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
    /// Flags of every command
    #[command(flatten)]
    #[serde(flatten)]
    pub common: Common,
}

/// Reads the taps so far and says which drive the next one should have.
///
/// # Errors
/// A calibration by another estimator than `learned`, readings that do not fit it, limits that are none, a file that fails.
pub fn run(asked: &NextRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    let calibration = context.calibration(&asked.calibration, options.force == Some(true))?;
    let label = asked.calibration.display().to_string();
    let by = estimator(asked.estimator.as_deref())?;
    let locator = Locator::new(&calibration, &label, by, &opener(&options))?;
    let drive = locator.rig.setup.drive;
    let within =
        ends("--within", "drives", asked.within.as_deref())?.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let shifts = ends("--shift", "places of the base", asked.shift.as_deref())?;
    let may = May { within, shifts, same_run: asked.same_run };
    let stem = stem(asked.readings.as_deref().unwrap_or(&asked.calibration), "taps");
    let out = folder(options.out.as_ref(), &stem, "next");
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |to| format!("would say the next tap in {to}")));
    }
    let warn = |text: &str| context.warn(text);
    let measured = asked.readings.as_deref().map(|path| context.data(path)).transpose()?;
    let rows = measured.as_ref().map(Measured::rows);
    let (taps, lines) = match (rows, asked.readings.as_deref()) {
        (Some(rows), Some(path)) => read(asked, &locator, rows, path, &warn)?,
        _ => Default::default(),
    };
    let found = next(&locator, &taps, may).map_err(|why| {
        let error = InputError::new(why).at(label.clone(), None).key("next");
        error.allowed("a calibration by learned, taps of one object, and drives that were calibrated")
    })?;
    if !found.left.is_empty() {
        let first: Vec<String> = found.left.iter().take(8).map(|k| lines[*k].to_string()).collect();
        let (left, taps, first) = (found.left.len(), taps.len(), first.join(", "));
        warn(&format!(
            "{left} of {taps} taps tell nothing here: of the other side, of a drive that was not calibrated, or without a distance or a number in {SHIFT} (lines {first})"
        ));
    }
    if shifts.is_some() && found.taps == 0 {
        warn("--shift is not looked at before the first tap, which tells where the object is");
    }
    let data = rows.map(LabTable::hash).transpose()?;
    let of = json!({ "calibration": calibration.checksum, "readings": data, "estimator": asked.estimator, "object": asked.object, "only": asked.only, "within": asked.within, "shift": asked.shift, "same_run": asked.same_run, "zero": SaidZero::json(asked.zero.as_ref()), "columns": asked.columns });
    let question = Question::new("next", &stem, of);
    let mut destination = context.open(&out, question, &["next.csv", "next.svg"], options.force)?;
    destination.table(table(&found, drive)?)?;
    destination.draw("next.svg", || Ok(drawn(&found, drive)))?;
    let (mut result, seconds) = (result(&found, drive, &lines), context.seconds());
    result["warnings"] = context.told().into();
    let counts = json!({ "taps": found.taps, "rows": found.tried.len() });
    let identity = hash(&format!("{}\n{data:?}\n{may:?}", calibration.checksum));
    let told = json!({ "calibration": { "file": label, "checksum": calibration.checksum }, "counts": counts, "seconds": seconds, "warnings": context.told(), "result": result });
    let document = run_json::document("next", json!({ "name": stem, "hash": identity }), told);
    let answer = answer(&found, drive, &lines);
    Reply { answer, counts, seconds, result, ..Reply::default() }.filed(destination, document, out, context)
}

/// The taps of one object in a file.
fn read(
    asked: &NextRequest,
    locator: &Locator,
    table: LabTable<'_>,
    path: &Path,
    warn: &dyn Fn(&str),
) -> Result<(Vec<Reading>, Vec<usize>), Error> {
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let zero = SaidZero::of(asked.zero.as_ref(), [locator])?;
    let label = path.display().to_string();
    let ask = Ask { zero, ..Ask::of_file(&label, &columns, warn) };
    let readings = Readings::of(locator, table, &ask, heading("located"))?;
    let place = match &asked.object {
        Some(column) => Some(readings.column(column).ok_or_else(|| {
            let error = InputError::new("there is no such column").at(label.clone(), Some(1));
            error.key("--object").value(column).allowed(readings.names.join(", "))
        })?),
        None => readings.column(NAME),
    };
    let word = |fields: &[LabCell<'_>]| {
        place.and_then(|k| fields.get(k)).map(LabCell::to_string).unwrap_or_default()
    };
    shift_column(&readings.names)?;
    let shifts = readings.numbers(SHIFT)?;
    let mut all = Vec::new();
    for (k, row) in readings.rows.iter().enumerate() {
        let object = word(&row.fields);
        // A row without an object is of none, where others have one.
        let named = place.is_none() || !object.is_empty();
        if let Some(tap) = row.tap.as_ref().filter(|_| named) {
            let shift = shifts.as_ref().map_or(0.0, |all| all[k]);
            all.push((Reading { shift, ..tap.clone() }, object));
        }
    }
    let taps = || all.iter();
    let objects: BTreeSet<String> = taps().map(|tap| tap.1.clone()).collect();
    let only = match &asked.only {
        Some(only) if !objects.contains(only) => {
            let error = InputError::new("no tap is of this object").at(label.clone(), None).key("--only");
            return Err(error.value(only).allowed(shown(&objects)).into());
        }
        None if objects.len() > 1 => {
            let error = InputError::new("these are taps of several objects").at(label.clone(), None);
            let error = error.key(asked.object.as_deref().unwrap_or(NAME)).value(shown(&objects));
            return Err(error.allowed("--only WORD: one of them").into());
        }
        only => only.clone(),
    };
    let own = taps().filter(|tap| only.as_ref().is_none_or(|only| tap.1 == *only));
    let (taps, lines): (Vec<Reading>, Vec<usize>) = own.map(|(tap, _)| (tap.clone(), tap.line)).unzip();
    if taps.is_empty() {
        warn(&format!("{label}: no row is a tap; this is about the first one"));
    }
    Ok((taps, lines))
}

fn shown(objects: &BTreeSet<String>) -> String {
    let first: Vec<&str> = objects.iter().take(8).map(String::as_str).collect();
    first.join(", ") + if objects.len() > 8 { ", …" } else { "" }
}

/// The two ends of what a flag says.
fn ends(key: &str, what: &str, said: Option<&[f64]>) -> Result<Option<[f64; 2]>, InputError> {
    match said {
        None => Ok(None),
        Some(&[lo, hi]) if lo <= hi => Ok(Some([lo, hi])),
        Some(other) => {
            let said: Vec<String> = other.iter().map(f64::to_string).collect();
            let error = InputError::new(format!("these are no ends of {what}")).key(key);
            Err(error.value(said.join(",")).allowed("LO,HI with LO ≤ HI"))
        }
    }
}
