//! `vibrissa.Array`.

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use vibrissa::command::estimator as named;
use vibrissa::contour::array::{Mounted, answer};
use vibrissa::contour::point::Noise;
use vibrissa::error::{Error, InputError};
use vibrissa::files;
use vibrissa::locate::{Calibration, SaidZero, stream::Ask};
use vibrissa::measure::Names;
use vibrissa::scene::RunOptions;

use super::column::RowsGiven;
use super::error::keywords;
use super::job;
use super::locate::{Together, by};
use super::table::Table;

/// Points of readings of several calibrated whiskers, in one frame.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Array {
    whiskers: Arc<Vec<Mounted>>,
    noise: Noise,
    zero: [Option<f64>; 2],
    calibrations: Vec<(String, String)>,
    warnings: Vec<String>,
}

#[pymethods]
impl Array {
    /// Of the `text` of a file that `label` names, whose calibrations are relative to `folder`; where one of them is `known`, its name and
    /// text are taken in place of its file. `noise` (of angle and base) goes before what the text says.
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        label: String,
        text: String,
        folder: PathBuf,
        known: Vec<Option<(String, String)>>,
        noise: (Option<f64>, Option<f64>),
        estimator: Option<String>,
        zero: Option<Vec<f64>>,
        trust: bool,
    ) -> PyResult<Self> {
        job::whole(py, None, None, move |_, _| {
            let asked = named(estimator.as_deref())?;
            let zero = zero.and_then(SaidZero::new);
            let array = files::Array::parse(&label, &text, &folder)?;
            let said = Noise::said(
                noise.0.unwrap_or(array.noise.angle),
                noise.1.unwrap_or(array.noise.base),
                array.noise.touch,
            )?;
            let (mut whiskers, mut calibrations, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
            let mut known = known.into_iter();
            for mut mount in array.mounts {
                let (name, text) = match known.next().flatten() {
                    Some(known) => known,
                    None => {
                        let path = &mount.calibration;
                        let missing = |e: InputError| InputError {
                            key: e.key.or(Some("whisker.calibration".into())),
                            ..e
                        };
                        (path.display().to_string(), Calibration::load(path).map_err(missing)?)
                    }
                };
                mount.calibration = PathBuf::from(&name);
                let calibration = Calibration::parse(&name, &text, trust)?;
                whiskers.push(mount.open(&calibration, asked, &RunOptions::default())?);
                warnings.extend(calibration.rig.warnings.iter().map(|text| keywords(text)));
                calibrations.push((name, text));
            }
            let zero = SaidZero::of(zero.as_ref(), whiskers.iter().map(|w| &w.locator))?;
            Ok(Self { whiskers: Arc::new(whiskers), noise: said, zero, calibrations, warnings })
        })
    }

    /// Readings of a file or a table called `label`: located.csv, and what should be known of them.
    fn locate(
        &self,
        py: Python<'_>,
        label: String,
        readings: RowsGiven<'_>,
        columns: Option<String>,
        together: Together,
    ) -> PyResult<(Table, Vec<String>)> {
        let (whiskers, noise, zero) = (Arc::clone(&self.whiskers), self.noise, self.zero);
        let readings = readings.measured(py)?;
        job::whole(py, None, None, move |_, _| {
            let columns = columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
            let told = RefCell::new(Vec::new());
            let warn = |text: &str| told.borrow_mut().push(keywords(text));
            let ask = Ask { zero, by: by(&together)?, ..Ask::of_file(&label, &columns, &warn) };
            let answered = answer(&whiskers, readings.rows(), &ask, &noise)?;
            Ok::<_, Error>((Table::new(answered.table)?, told.into_inner()))
        })
    }

    /// Of each whisker its name, its estimator, and name and text of its calibration.
    #[getter]
    fn whiskers(&self) -> Vec<(String, &'static str, (String, String))> {
        let of =
            |(w, c): (&Mounted, &(String, String))| (w.name.clone(), w.locator.estimator.name(), c.clone());
        self.whiskers.iter().zip(&self.calibrations).map(of).collect()
    }

    /// What should be known of the calibrations.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }
}
