//! `vibrissa.calibrate` and `vibrissa.simulate`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::calibrate::{self as lab, Options, coverage, output, report, several};
use vibrissa::error::{Error, InputError};
use vibrissa::locate::locator::opener;
use vibrissa::measure::{Data, Names, Rig};
use vibrissa::scene::{Column, Drive, Spec};
use vibrissa::simulate::strokes::{self as stroked, Strokes};
use vibrissa::simulate::{self as synthetic, Settings};
use vibrissa::sink::folder::hash_all;
use vibrissa::sink::memory;
use vibrissa::spec;

use super::job;
use super::search::{Tables, named};
use super::spec::{KEYWORDS, UnreadSpec};
use super::table::Table;

/// What a user says of a calibration beside data and whisker.
#[derive(FromPyObject)]
pub struct Said {
    theta: Option<f64>,
    delta: Option<f64>,
    columns: Option<String>,
    group: Vec<f64>,
    fit: Vec<String>,
}

/// Calibrates from `data`, the bytes of a CSV file that `label` names: tables, calibration.toml, run.json. The whisker is that of the spec in
/// `path` with the sections of `text` over it; there need be none.
#[pyfunction]
#[pyo3(signature = (label, data, path, text, said))]
pub fn calibrate(
    py: Python<'_>,
    label: String,
    data: Vec<u8>,
    path: Option<PathBuf>,
    text: String,
    said: Said,
) -> PyResult<(Tables, String, String)> {
    let start = std::time::Instant::now();
    job::whole(py, None, None, move |_, _| {
        let columns = said.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
        let hash = hash_all(&mut data.as_slice()).map_err(|e| Error::Run(e.to_string()))?;
        let drive = said.theta.map(|_| Drive::Angle).or(said.delta.map(|_| Drive::Displacement));
        let asked = match path.is_none() && text.is_empty() {
            true => None,
            false => Some(UnreadSpec::new(path, text, "calibrate")?),
        };
        let options = |kind: Drive, spec: &Spec| -> Result<Options, Error> {
            lab::same_drive(kind, drive)?;
            Ok(Options {
                drive: said.theta.or(said.delta),
                group: lab::widths(&said.group)?,
                fit: report::named_parameters(&said.fit, kind)?,
                run: spec.run.clone(),
                hash: hash.clone(),
            })
        };
        if let Some(asked) = &asked {
            let read = |drive| Rig::parse_with(&asked.label, &asked.text, &asked.base, drive);
            if let Some((rig, spec)) = several::whisker(read, (&label, &data, &columns), drive)? {
                let found =
                    several::several((&label, &data, &columns), &rig, &options(rig.setup.drive, &spec)?)?;
                found.sensor.check(&opener(&spec.run))?;
                let seconds = json!({ "total": start.elapsed().as_secs_f64() });
                let told = [&found.counts(), &seconds, &found.result()];
                let document = report::document(&spec, &hash, (&found.data[0], &hash), told);
                let tables = named(&[("channels.csv", found.table()?)])?;
                return Ok((tables, found.sensor.to_text(), document.to_string()));
            }
        }
        let data = Data::parse_named(&label, &data, &columns)?;
        let likely = data.drive.or(drive);
        let (rig, spec) = match asked {
            None if said.fit.is_empty() => Rig::of_data(&data, likely)?,
            None => {
                let error = InputError::new("there is no model to fit without a whisker").key("fit");
                return Err(error
                    .value(said.fit.join(","))
                    .allowed("whisker, gauge and model, or a spec")
                    .into());
            }
            Some(asked) => asked.read(|label, text, base| Rig::parse_with(label, text, base, likely))?,
        };
        let options = options(rig.setup.drive, &spec)?;
        let found = lab::calibrate(&data, &rig, &options)?;
        let locator = found.calibration.opened(&opener(&options.run))?;
        let covered = coverage::coverage(&found);
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let told = [&report::counts(&found, &data), &seconds, &report::result(&found, &rig, &covered)];
        let document = report::document(&spec, &hash, (&data, &hash), told);
        let tables = named(&output::tables(&found, &data, &locator)?)?;
        Ok((tables, found.calibration.to_text(), document.to_string()))
    })
}

/// What a rig adds to the model.
#[derive(FromPyObject)]
pub struct Added {
    repeats: u64,
    noise: Option<f64>,
    seed: u64,
    zero_every: Option<u64>,
    drift: f64,
    outliers: f64,
    saturate: Option<f64>,
    hysteresis: f64,
    factor: f64,
    drive_offset: f64,
    a_offset: f64,
    signal: Option<String>,
}

/// Bytes of a row of synthetic measurements while their table is made: its text, in a buffer that may be twice as large, its fields, its columns.
const BYTES_OF_ROW: u64 = 512;

impl Added {
    /// What it comes to for `rig`.
    fn settings(&self, rig: &Rig) -> Result<Settings, InputError> {
        let unit = synthetic::recorded(rig, self.signal.as_deref(), "signal")?;
        for (key, n) in [("repeats", Some(self.repeats)), ("zero_every", self.zero_every)] {
            if n == Some(0) {
                return Err(InputError::new("this number is too small").key(key).value(0).allowed("≥ 1"));
            }
        }
        let settings = Settings {
            repeats: self.repeats,
            noise: self.noise.or(rig.setup.gauge.noise_strain).unwrap_or(0.0),
            seed: self.seed,
            zero_every: self.zero_every,
            drift: self.drift,
            outliers: self.outliers,
            saturate: self.saturate,
            hysteresis: self.hysteresis,
            factor: self.factor,
            drive_offset: self.drive_offset,
            a_offset: self.a_offset,
            unit,
        };
        settings.check()?;
        Ok(settings)
    }
}

/// The spec that was `asked`, and its one whisker.
fn asked_rig(asked: &UnreadSpec) -> Result<(Spec, Rig), Error> {
    let spec = asked.read(spec::parse)?;
    let rig = Rig::of_spec(&spec, &asked.label)?;
    Ok((spec, rig))
}

/// What is stroked: the path of a file, or its text.
type Course = (Option<PathBuf>, String);

/// Synthetic strokes of the one whisker of a spec over an object: the table, run.json, what should be known.
#[pyfunction]
pub fn strokes(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
    course: Course,
    added: Added,
) -> PyResult<(Table, String, Vec<String>)> {
    job::whole(py, None, None, move |stop, _| {
        let start = std::time::Instant::now();
        let asked = UnreadSpec::new(path, text, "simulate")?;
        let (spec, rig) = asked_rig(&asked)?;
        if rig.setup.channels.is_some() {
            let several = InputError::new("a stroke is read by one signal").key("object");
            return Err(several.allowed("one signal in sensor").into());
        }
        let settings = added.settings(&rig)?;
        stroked::check(&rig, &settings)?;
        let course = match course {
            (Some(path), _) => Strokes::read(&path)?,
            (None, text) => Strokes::parse(&format!("object.{KEYWORDS}"), &text, Path::new(""))?,
        };
        let drives = spec.study.space.axis(Column::Drive).expect("a rig has axes");
        let (mut bytes, mut told) = (Vec::new(), Vec::new());
        let mut miss = |number, why| told.push(format!("start {number} makes no stroke: {why}"));
        let counts =
            stroked::simulate(&rig, &course, drives, &settings, &mut miss, &mut collected(&mut bytes, stop))?;
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let result = course.described(settings.described(rig.setup.drive));
        let run = synthetic::document(&spec, [&result, &counts.described(), &seconds]);
        Ok((Table::of_csv(&bytes)?, run.to_string(), told))
    })
}

/// Puts what is written into `bytes`, until that is to `stop`.
fn collected<'a>(
    bytes: &'a mut Vec<u8>,
    stop: &'a AtomicBool,
) -> impl FnMut(&[u8]) -> Result<(), Error> + 'a {
    |some| {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Run("interrupted".into()));
        }
        bytes.extend_from_slice(some);
        Ok(())
    }
}

/// Synthetic measurements of the one whisker of a spec: the table, and run.json.
#[pyfunction]
pub fn simulate(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
    added: Added,
) -> PyResult<(Table, String)> {
    job::whole(py, None, None, move |stop, _| {
        let start = std::time::Instant::now();
        let asked = UnreadSpec::new(path, text, "simulate")?;
        let (spec, rig) = asked_rig(&asked)?;
        let settings = added.settings(&rig)?;
        let layout = spec.study.space.layout().expect("a rig has axes");
        let room = memory::available().map_or(u64::MAX, |bytes| bytes / BYTES_OF_ROW);
        settings.rows(layout.len(), synthetic::MOST_ROWS.min(room))?;
        let taps = synthetic::SimulatedTaps { layout: &layout, directions: spec.study.setup.directions };
        let method = opener(&spec.run)(&rig.setup.model)?;
        let mut bytes = Vec::new();
        let counts = synthetic::simulate(&rig, taps, &settings, method, &mut collected(&mut bytes, stop))?;
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let told = [&settings.described(rig.setup.drive), &counts.described(), &seconds];
        Ok((Table::of_csv(&bytes)?, synthetic::document(&spec, told).to_string()))
    })
}
