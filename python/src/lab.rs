//! `vibrissa.calibrate`, `vibrissa.Locator` and `vibrissa.simulate`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use serde_json::json;
use vibrissa::calibrate::{self as lab, Options, coverage, output, report};
use vibrissa::error::{Error, InputError};
use vibrissa::estimator::{ALL, Estimator, named as estimator_named};
use vibrissa::export::{Export, Language};
use vibrissa::locate::{self, Calibration, Located, Sequence, locator::opener, stream};
use vibrissa::measure::{Data, Names, Rig, Unit};
use vibrissa::scene::{Column, Drive, RunOptions};
use vibrissa::simulate::{self as synthetic, Settings};
use vibrissa::sink::folder::hash_all;
use vibrissa::spec;

use crate::error::raise;
use crate::job::{self, Far};
use crate::search::named;
use crate::spec::Asked;
use crate::table::Table;
use crate::taps::bits;

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
#[allow(clippy::type_complexity)]
pub fn calibrate(
    py: Python<'_>,
    label: String,
    data: Vec<u8>,
    path: Option<PathBuf>,
    text: String,
    said: Said,
) -> PyResult<(Vec<(&'static str, Table)>, String, String)> {
    let start = std::time::Instant::now();
    let work = move |_: &AtomicBool, _: &mut dyn FnMut(Far)| {
        let columns = said.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
        let hash = hash_all(&mut data.as_slice()).map_err(|e| Error::Run(e.to_string()))?;
        let data = Data::parse_named(&label, &data, &columns)?;
        let drive = said.theta.map(|_| Drive::Angle).or(said.delta.map(|_| Drive::Displacement));
        let likely = data.drive.or(drive);
        let (rig, spec) = match path.is_none() && text.is_empty() {
            true if said.fit.is_empty() => Rig::of_data(&data, likely)?,
            true => {
                let error = InputError::new("there is no model to fit without a whisker").key("fit");
                return Err(error
                    .value(said.fit.join(","))
                    .allowed("whisker, gauge and model, or a spec")
                    .into());
            }
            false => {
                let asked = Asked::new(path, text, "calibrate")?;
                asked.read(|label, text, base| Rig::parse_with(label, text, base, likely))?
            }
        };
        let kind = rig.setup.drive;
        lab::same_drive(kind, drive)?;
        let options = Options {
            drive: said.theta.or(said.delta),
            group: lab::widths(&said.group)?,
            fit: report::named_parameters(&said.fit, kind)?,
            run: spec.run.clone(),
            hash: hash.clone(),
        };
        let found = lab::calibrate(&data, &rig, &options)?;
        let locator =
            locate::Locator::new(&found.calibration, "calibration.toml", None, &opener(&options.run))?;
        let covered = coverage::coverage(&found, &locator);
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let told = [&report::counts(&found, &data), &seconds, &report::result(&found, &rig, &covered)];
        let document = report::document(&spec, &hash, (&data, &hash), told);
        let tables = named(&output::tables(&found, &data, &locator)?)?;
        Ok((tables, found.calibration.to_text(), document.to_string()))
    };
    let (found, interrupt) = job::run(py, None, work, job::shown(None))?;
    interrupt.map_or(Ok(found), Err)
}

/// The estimator of this name.
fn estimator(name: Option<String>) -> Result<Option<&'static dyn Estimator>, Error> {
    let Some(name) = name else { return Ok(None) };
    let known = || ALL.map(|e| e.name()).join(", ");
    let wrong =
        || InputError::new("there is no such estimator").key("estimator").value(&name).allowed(known());
    estimator_named(&name).map(Some).ok_or_else(|| wrong().into())
}

/// Distances of readings of one calibrated whisker.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Locator {
    locator: Arc<locate::Locator>,
    calibration: Calibration,
    /// Zero readings among those that are answered one by one.
    sequence: Mutex<Sequence>,
    zero: Option<f64>,
}

#[pymethods]
impl Locator {
    /// Of the `text` of a calibration that `label` names.
    #[new]
    fn new(
        py: Python<'_>,
        label: &str,
        text: &str,
        estimator: Option<String>,
        zero: Option<f64>,
        trust: bool,
    ) -> PyResult<Self> {
        let made = || -> Result<Self, Error> {
            let asked = self::estimator(estimator)?;
            let calibration = Calibration::parse(label, text, trust)?;
            let locator = locate::Locator::new(&calibration, label, asked, &opener(&RunOptions::default()))?;
            if let Some(bad) =
                zero.filter(|z| !locator.unit.strain(*z, locator.rig.setup.gauge.factor).is_finite())
            {
                let error = InputError::new("this is no zero of such a signal").key("zero").value(bad);
                return Err(error.allowed("a number in the unit of the signal").into());
            }
            let sequence = Mutex::new(Sequence::new(&locator, zero));
            Ok(Self { locator: Arc::new(locator), calibration, sequence, zero })
        };
        made().map_err(|e| raise(py, e))
    }

    /// One reading: distance, sigma, status bits. With `follow` zero readings before it count.
    #[pyo3(signature = (drive, value, follow, /))]
    fn one(&self, drive: f64, value: f64, follow: bool) -> (f64, f64, u16) {
        let Located { distance, sigma, status } = match follow {
            true => {
                let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
                sequence.answer(&self.locator, drive, value)
            }
            false => Sequence::new(&self.locator, self.zero).answer(&self.locator, drive, value),
        };
        (distance, sigma, bits(status))
    }

    /// Readings in the order in which they were taken: distances, sigmas, status bits.
    #[allow(clippy::type_complexity)]
    fn many<'py>(
        &self,
        py: Python<'py>,
        drive: PyReadonlyArray1<'py, f64>,
        value: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (drives, values): (Vec<f64>, Vec<f64>) =
            (drive.as_array().iter().copied().collect(), value.as_array().iter().copied().collect());
        drop((drive, value));
        let (locator, mut sequence) = (Arc::clone(&self.locator), Sequence::new(&self.locator, self.zero));
        let work = move |stop: &AtomicBool, _: &mut dyn FnMut(Far)| {
            let n = drives.len();
            let (mut a, mut sigma, mut status) = (vec![0.0; n], vec![0.0; n], vec![0; n]);
            for (i, (drive, value)) in drives.iter().zip(&values).enumerate() {
                if i % 1024 == 0 && stop.load(Ordering::Relaxed) {
                    break;
                }
                let found = sequence.answer(&locator, *drive, *value);
                (a[i], sigma[i], status[i]) = (found.distance, found.sigma, bits(found.status));
            }
            Ok((a, sigma, status))
        };
        let ((a, sigma, status), interrupt) = job::run(py, None, work, job::shown(None))?;
        interrupt.map_or(Ok(()), Err)?;
        let numbers = |all| PyArray1::from_vec(py, all).into_any();
        Ok((numbers(a), numbers(sigma), PyArray1::from_vec(py, status).into_any()))
    }

    /// Readings of a CSV table: located.csv, and what should be known of them.
    fn table(
        &self,
        py: Python<'_>,
        label: String,
        bytes: Vec<u8>,
        columns: Option<String>,
    ) -> PyResult<(Table, Vec<String>)> {
        let (locator, said_zero) = (Arc::clone(&self.locator), self.zero);
        let work = move |stop: &AtomicBool, _: &mut dyn FnMut(Far)| {
            let columns = columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
            let warnings = Mutex::new(Vec::new());
            let warn =
                |text: &str| warnings.lock().unwrap_or_else(PoisonError::into_inner).push(text.to_owned());
            let ask = stream::Ask {
                columns: &columns,
                zero: said_zero,
                label: Some(&label),
                keep: true,
                warn: &warn,
            };
            let (zero, _) = stream::zeros(&locator, bytes.as_slice(), &ask)?;
            let mut out = Vec::new();
            let mut write = |some: &[u8], _: bool| {
                out.extend_from_slice(some);
                Ok(())
            };
            stream::answer(&locator, bytes.as_slice(), &ask, Some(zero), stop, &mut write)?;
            let table = Table::of_csv(&out)?;
            Ok((table, warnings.into_inner().unwrap_or_else(PoisonError::into_inner)))
        };
        let (found, interrupt) = job::run(py, None, work, job::shown(None))?;
        interrupt.map_or(Ok(found), Err)
    }

    /// Name of the estimator in use.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.locator.estimator.name()
    }

    /// Column of the signal: strain, microstrain, bridge_mV_per_V or reading.
    #[getter]
    fn signal(&self) -> &'static str {
        self.locator.unit.column()
    }

    /// Column of the drive.
    #[getter]
    fn drive(&self) -> &'static str {
        self.locator.rig.setup.drive.column()
    }

    /// The only calibrated drive, if there is one.
    #[getter]
    fn only_drive(&self) -> Option<f64> {
        self.locator.only_drive()
    }

    /// Standard deviation of one reading.
    #[getter]
    fn noise(&self) -> f64 {
        self.locator.noise()
    }

    /// Signal expected of a tap at `a` mm by `drive`, on the side of `sign`; NaN where none is.
    fn expected(&self, a: f64, drive: f64, sign: f64) -> f64 {
        self.locator.expected(a, drive, sign)
    }

    /// What answers readings as one file of C or Python.
    fn export(&self, py: Python<'_>, language: &str) -> PyResult<String> {
        let words = || Language::ALL.map(|l| l.0).join(", ");
        let found = Language::ALL.into_iter().find(|l| l.0 == language);
        let wrong =
            || InputError::new("there is no such language").key("language").value(language).allowed(words());
        let made = || -> Result<String, Error> {
            let language = found.ok_or_else(wrong)?.1;
            Ok(Export::new(&self.locator, &self.calibration)?.text(language))
        };
        made().map_err(|e| raise(py, e))
    }
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
    signal: String,
}

/// Synthetic measurements of the one whisker of a spec: the table, and run.json.
#[pyfunction]
pub fn simulate(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
    added: Added,
) -> PyResult<(Table, String)> {
    let work = move |stop: &AtomicBool, _: &mut dyn FnMut(Far)| {
        let start = std::time::Instant::now();
        let asked = Asked::new(path, text, "simulate")?;
        let spec = asked.read(spec::parse)?;
        let rig = Rig::of_spec(&spec, &asked.label)?;
        let unit = Unit::of_column(&added.signal).ok_or_else(|| {
            let known = Unit::ALL.map(Unit::column).join(", ");
            InputError::new("there is no such signal").key("signal").value(&added.signal).allowed(known)
        })?;
        for (key, n) in [("repeats", Some(added.repeats)), ("zero_every", added.zero_every)] {
            if n == Some(0) {
                return Err(InputError::new("this number is too small")
                    .key(key)
                    .value(0)
                    .allowed("≥ 1")
                    .into());
            }
        }
        let settings = Settings {
            repeats: added.repeats,
            noise: added.noise.or(rig.setup.gauge.noise_strain).unwrap_or(0.0),
            seed: added.seed,
            zero_every: added.zero_every,
            drift: added.drift,
            outliers: added.outliers,
            saturate: added.saturate,
            hysteresis: added.hysteresis,
            factor: added.factor,
            drive_offset: added.drive_offset,
            a_offset: added.a_offset,
            unit,
        };
        settings.check()?;
        let axes =
            [Column::Distance, Column::Drive].map(|c| spec.study.space.axis(c).expect("a rig has axes"));
        let method = opener(&spec.run)(&rig.setup.model)?;
        let mut bytes = Vec::new();
        let counts = synthetic::simulate(&rig, axes, &settings, method, &mut |some| {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Run("interrupted".into()));
            }
            bytes.extend_from_slice(some);
            Ok(())
        })?;
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let told = [&settings.described(rig.setup.drive), &counts.described(), &seconds];
        Ok((Table::of_csv(&bytes)?, synthetic::document(&spec, told).to_string()))
    };
    let (found, interrupt) = job::run(py, None, work, job::shown(None))?;
    interrupt.map_or(Ok(found), Err)
}
