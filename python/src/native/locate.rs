//! `vibrissa.Locator`.

use std::cell::RefCell;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use vibrissa::command;
use vibrissa::error::{Error, InputError};
use vibrissa::export::Export;
use vibrissa::locate::{
    Located, SaidZero, Sensor, Sequence, answers::Answers, locator::opener, object::By, stream::Ask, tare,
};
use vibrissa::measure::Names;
use vibrissa::scene::RunOptions;

use super::error::{keywords, raise};
use super::job;
use super::table::{FileGiven, Table};

type About =
    (Option<&'static str>, &'static str, Vec<String>, Option<f64>, Vec<f64>, Vec<String>, Vec<String>);

/// Distances of readings of a calibrated whisker.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Locator {
    answers: Arc<Answers>,
    /// State of single readings: their zero readings.
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
        same_run: bool,
    ) -> PyResult<Self> {
        let made = || -> Result<Self, Error> {
            if Sensor::is_text(text) {
                let own = "nothing: each channel has its own";
                command::of_one_signal(&[
                    ("zero", zero.is_some(), "rows with a drive of 0 in a table"),
                    ("estimator", estimator.is_some(), own),
                    ("same_run", same_run, own),
                ])?;
            }
            let asked = command::estimator(estimator.as_deref())?;
            let answers =
                Answers::open((label, text, trust), asked, same_run, &opener(&RunOptions::default()))?;
            let wrong = |why| InputError::new(why).key("zero").value(f64::NAN);
            let said = zero.map(|z| SaidZero::try_from(vec![z]).map_err(wrong)).transpose()?;
            let [zero, _] = SaidZero::of(said.as_ref(), answers.who().locators)?;
            let sequence = Sequence::new(&answers.who().locators[0], zero);
            Ok(Self { answers: Arc::new(answers), sequence: Mutex::new(sequence), zero })
        };
        job::here(py, made)?.map_err(|e| raise(py, e))
    }

    /// What never changes: the estimator, none of several channels, of which each has its own; columns of drive and signals; the only calibrated drive of
    /// one signal, if there is one; standard deviation of one reading of each channel; what should be known of the calibration, and of the zero of
    /// readings that are answered alone or, of several channels, above their zeros.
    #[getter]
    fn about(&self) -> About {
        let locators = self.answers.who().locators;
        let (first, noise) = (&locators[0], locators.iter().map(|locator| locator.noise).collect());
        let (drive, told) = (first.rig.setup.drive.column(), |text: &String| keywords(text));
        match &*self.answers {
            Answers::One(one) => {
                let zero = self.zero.map(|z| one.unit.strain(z, one.rig.setup.gauge.factor));
                let doubt = tare::doubt(one, tare::Tare::new(one, zero).at(0).map(|z| z.0));
                let warnings = one.rig.warnings.iter().map(told).collect();
                let doubts = doubt.iter().map(told).collect();
                let (name, signal) = (one.estimator.word(), one.unit.column().to_owned());
                (Some(name), drive, vec![signal], one.only_drive(), noise, warnings, doubts)
            }
            Answers::Several(several) => {
                let texts = several.locators.iter().filter_map(|locator| tare::doubt(locator, None));
                let doubts =
                    texts.map(|text| keywords(&text.replace(", or --zero", " in a table"))).collect();
                (None, drive, several.names.clone(), None, noise, Vec::new(), doubts)
            }
        }
    }

    /// What should be known of the zero of the readings that follow each other, told once; None before the first tap.
    fn told(&self) -> Option<Vec<String>> {
        let told = self.sequence.lock().unwrap_or_else(PoisonError::into_inner).told()?;
        Some(told.iter().map(|text| keywords(text)).collect())
    }

    /// One reading of one signal: distance, sigma, status bits. With `follow` zero readings before it count.
    #[pyo3(signature = (drive, value, follow, /))]
    fn one(&self, py: Python<'_>, drive: f64, value: f64, follow: bool) -> PyResult<(f64, f64, u16)> {
        let locator = self.answers.single().map_err(|e| raise(py, e.into()))?;
        let answer = || match follow {
            true => {
                let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
                sequence.answer(locator, drive, value)
            }
            false => Sequence::new(locator, self.zero).answer(locator, drive, value),
        };
        let Located { distance, sigma, status, .. } = job::here(py, answer)?;
        Ok((distance, sigma, status.bits()))
    }

    /// Readings in the order in which they were taken, a row of signals for each, of several channels above their zeros and with a drive of NaN where
    /// it is not known: distances, sigmas, status bits; what should be known of their zero.
    #[allow(clippy::type_complexity)]
    fn many<'py>(
        &self,
        py: Python<'py>,
        drive: PyReadonlyArray1<'py, f64>,
        values: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Vec<String>)> {
        let drives = drive.as_array().to_vec();
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        let (answers, zero) = (Arc::clone(&self.answers), self.zero);
        let (all, told) =
            job::whole(py, None, None, move |stop, _| Ok(answers.readings(zero, &drives, &values, stop)?))?;
        let numbers =
            |of: fn(&Located) -> f64| PyArray1::from_vec(py, all.iter().map(of).collect()).into_any();
        let words = PyArray1::from_vec(py, all.iter().map(|l| l.status.bits()).collect());
        let told = told.iter().map(|text| keywords(text)).collect();
        Ok((numbers(|l| l.distance), numbers(|l| l.sigma), words.into_any(), told))
    }

    /// Readings of a file or a table called `label`, and their columns, those that are told `together`: located.csv, and what should be known of them.
    fn table(
        &self,
        py: Python<'_>,
        label: String,
        readings: FileGiven<'_>,
        columns: Option<String>,
        together: Together,
        interval: bool,
    ) -> PyResult<(Table, Vec<String>)> {
        let (answers, zero, readings) = (Arc::clone(&self.answers), self.zero, readings.measured(py)?);
        job::whole(py, None, None, move |stop, _| {
            let columns = columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
            let (told, by) = (RefCell::new(Vec::new()), by(&together)?);
            let warn = |text: &str| told.borrow_mut().push(keywords(text));
            let ask = Ask { zero: [zero, None], by, interval, ..Ask::of_file(&label, &columns, &warn) };
            let located = answers.table(readings.rows(), &ask, stop)?;
            Ok((Table::new(located)?, told.into_inner()))
        })
    }

    /// Signals expected of a tap at `a` mm by `drive`, on the side of `sign`; NaN where none is.
    fn expected(&self, py: Python<'_>, a: f64, drive: f64, sign: f64) -> PyResult<Vec<f64>> {
        job::here(py, || self.answers.who().locators.iter().map(|l| l.expected(a, drive, sign)).collect())
    }

    /// What answers readings of one signal as one file of C.
    fn export(&self, py: Python<'_>) -> PyResult<String> {
        let made = || -> Result<String, Error> {
            let locator = self.answers.single()?;
            Ok(Export::new(locator, locator)?.text())
        };
        job::here(py, made)?.map_err(|e| raise(py, e))
    }
}

/// Readings that belong together: "same"; "strokes" with its free parameters; or "object" with its column.
type Together = Option<(String, Option<String>)>;

fn by(together: &Together) -> Result<By<'_>, InputError> {
    Ok(match together {
        None => By::Unsaid,
        Some((word, free)) if word == "strokes" => {
            let allowed = "zero, friction=SD, tilt=SD (degrees), joined by commas";
            let refused = |why: String| InputError::new(why).key("free").allowed(allowed);
            let free = free.as_deref().map(|free| free.parse().map_err(|why| refused(why).value(free)));
            By::Strokes(free.transpose()?.unwrap_or_default())
        }
        Some((_, column)) => column.as_deref().map_or(By::Same, By::Column),
    })
}
