//! Distances of readings of a sensor with several channels.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use vibrissa::error::Error;
use vibrissa::locate::{Located, Sensor, locator::opener, several, tare::doubt};
use vibrissa::scene::RunOptions;
use vibrissa::status::Status;

use super::error::{keywords, raise};
use super::job;
use super::locate::{Together, answered};
use super::table::Table;
use super::words::bits;

/// Distances of readings of a calibrated sensor with several channels.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Several {
    several: Arc<several::Several>,
}

#[pymethods]
impl Several {
    /// Of the `text` of a calibration that `label` names; `None` of one of a single signal.
    #[staticmethod]
    fn of(py: Python<'_>, label: &str, text: &str, trust: bool) -> PyResult<Option<Self>> {
        if !Sensor::is_text(text) {
            return Ok(None);
        }
        let made = || -> Result<Self, Error> {
            let sensor = Sensor::parse(label, text, trust)?;
            let several = several::Several::new(&sensor, label, &opener(&RunOptions::default()))?;
            Ok(Self { several: Arc::new(several) })
        };
        job::here(py, made)?.map(Some).map_err(|e| raise(py, e))
    }

    /// What should be known of the zeros of readings that are given above them.
    #[getter]
    fn doubts(&self) -> Vec<String> {
        let texts = self.several.locators.iter().filter_map(|locator| doubt(locator, None));
        texts.map(|text| keywords(&text.replace(", or --zero", " in a table"))).collect()
    }

    /// Readings above their zeros: drives (NaN where unknown) and a row of signals for each, in the units of the calibration. Distances, sigmas,
    /// status bits.
    #[allow(clippy::type_complexity)]
    fn many<'py>(
        &self,
        py: Python<'py>,
        drive: PyReadonlyArray1<'py, f64>,
        values: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let drives: Vec<f64> = drive.as_array().iter().copied().collect();
        let values: Vec<Vec<f64>> = values.as_array().rows().into_iter().map(|r| r.to_vec()).collect();
        let several = Arc::clone(&self.several);
        let all = job::whole(py, None, None, move |stop, _| {
            let shares = vec![0.0; several.locators.len()];
            let mut all = Vec::with_capacity(drives.len());
            for (drive, values) in drives.iter().zip(&values) {
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                let signal = |(l, value): (&vibrissa::locate::Locator, &f64)| {
                    l.unit.strain(*value, l.rig.setup.gauge.factor)
                };
                let signals: Vec<f64> = several.locators.iter().zip(values).map(signal).collect();
                all.push(match drive.is_finite() && several.locators[0].rests(*drive) {
                    true => Located::nothing(Status::NO_STRAIN),
                    false => several.locate(*drive, &signals, &shares),
                });
            }
            Ok(all)
        })?;
        let numbers =
            |of: fn(&Located) -> f64| PyArray1::from_vec(py, all.iter().map(of).collect()).into_any();
        let words = PyArray1::from_vec(py, all.iter().map(|l| bits(l.status)).collect());
        Ok((numbers(|l| l.distance), numbers(|l| l.sigma), words.into_any()))
    }

    /// Readings of a CSV table: located.csv, and what should be known of them.
    fn table(
        &self,
        py: Python<'_>,
        label: String,
        bytes: Vec<u8>,
        columns: Option<String>,
        together: Together,
        interval: bool,
    ) -> PyResult<(Table, Vec<String>)> {
        answered(
            py,
            (Arc::clone(&self.several), |s| s.into()),
            None,
            (label, bytes, columns),
            (together, interval),
        )
    }

    /// Columns of the channels.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.several.names.clone()
    }

    /// Column of the drive.
    #[getter]
    fn drive(&self) -> &'static str {
        self.several.locators[0].rig.setup.drive.column()
    }

    /// Standard deviation of one reading of each channel.
    #[getter]
    fn noise(&self) -> Vec<f64> {
        self.several.locators.iter().map(vibrissa::locate::Locator::noise).collect()
    }

    /// Signals expected of a tap at `a` mm by `drive`, on the side of `sign`; NaN where none is.
    fn expected(&self, py: Python<'_>, a: f64, drive: f64, sign: f64) -> PyResult<Vec<f64>> {
        job::here(py, || self.several.locators.iter().map(|l| l.expected(a, drive, sign)).collect())
    }
}
