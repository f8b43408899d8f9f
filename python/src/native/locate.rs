//! `vibrissa.Locator`.

use std::cell::RefCell;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use vibrissa::command;
use vibrissa::error::{Error, InputError};
use vibrissa::export::Export;
use vibrissa::locate::free::Free;
use vibrissa::locate::object::{By, Objects, UnlocatedTap};
use vibrissa::locate::{
    self, Answerer, Calibration, Located, Sensor, Sequence, locator::opener, next, stream, stream::Ask, tare,
};
use vibrissa::measure::Names;
use vibrissa::scene::RunOptions;
use vibrissa::sink::frame::Frame;
use vibrissa::status::Status;

use super::column::RowsGiven;
use super::error::{keywords, raise};
use super::job;
use super::table::Table;
use super::words::bits;

/// What answers readings: of one signal, or of several channels.
enum Answers {
    One(Box<locate::Locator>, Box<Calibration>),
    Several(locate::Several),
}

/// Distances of readings of a calibrated whisker.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Locator {
    answers: Arc<Answers>,
    /// Zero readings among those that are answered one by one; of one signal.
    sequence: Mutex<Option<Sequence>>,
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
        let open = opener(&RunOptions::default());
        let made = || -> Result<Self, Error> {
            if Sensor::is_text(text) {
                let zeros = "rows with a drive of 0 in a table";
                let own = "nothing: each channel has its own";
                command::of_one_signal(&[
                    ("zero", zero.is_some(), zeros),
                    ("estimator", estimator.is_some(), own),
                    ("same_run", same_run, own),
                ])?;
                let several = locate::Several::new(&Sensor::parse(label, text, trust)?, label, &open)?;
                let answers = Arc::new(Answers::Several(several));
                return Ok(Self { answers, sequence: Mutex::new(None), zero });
            }
            let asked = command::estimator(estimator.as_deref())?;
            let calibration = Calibration::parse(label, text, trust)?;
            let mut locator = locate::Locator::new(&calibration, label, asked, &open)?;
            locator.same_run = same_run;
            let (unit, factor) = (locator.unit, locator.rig.setup.gauge.factor);
            if let Some(bad) = zero.filter(|z| !unit.strain(*z, factor).is_finite()) {
                let error = InputError::new("this is no zero of such a signal").key("zero").value(bad);
                return Err(error.allowed("a number in the unit of the signal").into());
            }
            if let Some(z) = zero.filter(|_| locator.is_twofold()) {
                let error =
                    InputError::new("the calibration is of two signals, each with its zero").key("zero");
                return Err(error.value(z).allowed("rows of the table with a drive of 0").into());
            }
            let sequence = Mutex::new(Some(Sequence::new(&locator, zero)));
            Ok(Self {
                answers: Arc::new(Answers::One(Box::new(locator), Box::new(calibration))),
                sequence,
                zero,
            })
        };
        job::here(py, made)?.map_err(|e| raise(py, e))
    }

    /// What should be known of the zero of readings that are answered alone or, of several channels, above their zeros.
    #[getter]
    fn doubts(&self) -> Vec<String> {
        match &*self.answers {
            Answers::One(locator, _) => {
                let zero = self.zero.map(|z| locator.unit.strain(z, locator.rig.setup.gauge.factor));
                let tare = tare::Tare::new(locator, zero);
                tare::doubt(locator, tare.at(0).map(|z| z.0))
                    .map(|text| keywords(&text))
                    .into_iter()
                    .collect()
            }
            Answers::Several(several) => {
                let texts = several.locators.iter().filter_map(|locator| tare::doubt(locator, None));
                texts.map(|text| keywords(&text.replace(", or --zero", " in a table"))).collect()
            }
        }
    }

    /// What should be known of the zero of the readings that follow each other, told once; None before the first tap.
    fn told(&self) -> Option<Vec<String>> {
        let told = self.sequence.lock().unwrap_or_else(PoisonError::into_inner).as_mut()?.told()?;
        Some(told.iter().map(|text| keywords(text)).collect())
    }

    /// One reading of one signal: distance, sigma, status bits. With `follow` zero readings before it count.
    #[pyo3(signature = (drive, value, follow, /))]
    fn one(&self, py: Python<'_>, drive: f64, value: f64, follow: bool) -> PyResult<(f64, f64, u16)> {
        let locator = self.single(py)?;
        let answer = || {
            let mut kept = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
            match kept.as_mut().filter(|_| follow) {
                Some(sequence) => sequence.answer(locator, drive, value),
                None => Sequence::new(locator, self.zero).answer(locator, drive, value),
            }
        };
        let Located { distance, sigma, status, .. } = job::here(py, answer)?;
        Ok((distance, sigma, bits(status)))
    }

    /// What the taps among these readings (drives, values, shifts of the base) of one object tell, and the next one, as `vibrissa next` says it in
    /// JSON; status bits; drives and shifts that were tried, their sigmas and status bits; what should be known of the zero.
    #[allow(clippy::type_complexity)]
    fn next(
        &self,
        py: Python<'_>,
        readings: [PyReadonlyArray1<'_, f64>; 3],
        within: [f64; 2],
        shifts: Option<[f64; 2]>,
        same_run: bool,
    ) -> PyResult<(String, u16, Vec<([f64; 3], u16)>, Vec<String>)> {
        let locator = self.single(py)?;
        let [drives, values, places] = readings.map(|column| column.as_array().to_vec());
        let work = || -> Result<(next::Next, Vec<String>), Error> {
            let mut sequence = Sequence::new(locator, self.zero);
            let read = drives.iter().zip(&values).zip(&places);
            let taps = read.filter_map(|((drive, value), shift)| {
                let tap = sequence.read(locator, *drive, *value).ok()?;
                Some(UnlocatedTap { shift: *shift, ..tap })
            });
            let taps: Vec<UnlocatedTap> = taps.collect();
            let may = next::May { within, shifts, same_run: same_run || locator.same_run };
            let found = next::next(locator, &taps, may).map_err(|why| {
                InputError::new(why)
                    .key("readings")
                    .allowed("a calibration by learned, taps of one object, and drives that were calibrated")
            })?;
            Ok((found, sequence.told().flatten().iter().map(|text| keywords(text)).collect()))
        };
        let (found, told) = job::here(py, work)?.map_err(|e| raise(py, e))?;
        let lines: Vec<usize> = (1..=drives.len()).collect();
        let said = command::next::result(&found, locator.rig.setup.drive, &lines).to_string();
        let tried = found.tried.iter().map(|t| ([t.drive, t.shift, t.sigma], bits(t.status))).collect();
        Ok((said, bits(found.status), tried, told))
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
        if let Answers::One(..) = &*self.answers {
            self.single(py)?;
        }
        let (drives, width) = (drive.as_array().to_vec(), values.as_array().ncols());
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        let (answers, zero) = (Arc::clone(&self.answers), self.zero);
        let (all, told) = job::whole(py, None, None, move |stop, _| {
            let mut all = Vec::with_capacity(drives.len());
            let mut sequence = match &*answers {
                Answers::One(locator, _) => Some(Sequence::new(locator, zero)),
                Answers::Several(_) => None,
            };
            for (i, (drive, values)) in drives.iter().zip(values.chunks(width)).enumerate() {
                if i % 64 == 0 && stop.load(Ordering::Relaxed) {
                    break;
                }
                all.push(match (&*answers, &mut sequence) {
                    (Answers::One(locator, _), Some(sequence)) => sequence.answer(locator, *drive, values[0]),
                    (Answers::Several(several), _) => of_channels(several, *drive, values),
                    (Answers::One(..), None) => unreachable!("one signal has a sequence"),
                });
            }
            let told = sequence.iter_mut().filter_map(Sequence::told).flatten();
            Ok((all, told.map(|text| keywords(&text)).collect()))
        })?;
        let numbers =
            |of: fn(&Located) -> f64| PyArray1::from_vec(py, all.iter().map(of).collect()).into_any();
        let words = PyArray1::from_vec(py, all.iter().map(|l| bits(l.status)).collect());
        Ok((numbers(|l| l.distance), numbers(|l| l.sigma), words.into_any(), told))
    }

    /// Readings of a file or a table called `label`, and their columns, those that are told `together`: located.csv, and what should be known of them.
    fn table(
        &self,
        py: Python<'_>,
        label: String,
        readings: RowsGiven<'_>,
        columns: Option<String>,
        together: Together,
        interval: bool,
    ) -> PyResult<(Table, Vec<String>)> {
        let (answers, zero, readings) = (Arc::clone(&self.answers), self.zero, readings.measured(py)?);
        job::whole(py, None, None, move |stop, _| {
            let columns = columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
            let (told, by) = (RefCell::new(Vec::new()), by(&together)?);
            let warn = |text: &str| told.borrow_mut().push(keywords(text));
            let who = || match &*answers {
                Answers::One(locator, _) => Answerer::One(locator),
                Answers::Several(several) => Answerer::Several(several),
            };
            Objects::can(who(), by)?;
            let ask = Ask { zero: [zero, None], by, interval, ..Ask::of_file(&label, &columns, &warn) };
            let (zeros, _) = stream::zeros(who(), readings.rows(), &ask)?;
            let mut located: Option<Frame> = None;
            let mut write = |some: &Frame, _: bool| match &mut located {
                Some(all) => all.extend(some, 0..some.len()),
                None => {
                    located = Some(some.clone());
                    Ok(())
                }
            };
            stream::answer(who(), readings.rows(), &ask, Some(zeros), stop, &mut write)?;
            Ok((Table::new(located.unwrap_or_default())?, told.into_inner()))
        })
    }

    /// Name of the estimator in use; None of several channels, of which each has its own.
    #[getter]
    fn estimator(&self) -> Option<&'static str> {
        match &*self.answers {
            Answers::One(locator, _) => Some(locator.estimator.name()),
            Answers::Several(_) => None,
        }
    }

    /// What should be known of the calibration.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        match &*self.answers {
            Answers::One(_, calibration) => {
                calibration.rig.warnings.iter().map(|text| keywords(text)).collect()
            }
            Answers::Several(_) => Vec::new(),
        }
    }

    /// Columns of the signals.
    #[getter]
    fn channels(&self) -> Vec<String> {
        match &*self.answers {
            Answers::One(locator, _) => vec![locator.unit.column().to_owned()],
            Answers::Several(several) => several.names.clone(),
        }
    }

    /// Column of the drive.
    #[getter]
    fn drive(&self) -> &'static str {
        self.locators()[0].rig.setup.drive.column()
    }

    /// The only calibrated drive of one signal, if there is one.
    #[getter]
    fn only_drive(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        Ok(self.single(py)?.only_drive())
    }

    /// Standard deviation of one reading of each channel.
    #[getter]
    fn noise(&self) -> Vec<f64> {
        self.locators().iter().map(locate::Locator::noise).collect()
    }

    /// Signals expected of a tap at `a` mm by `drive`, on the side of `sign`; NaN where none is.
    fn expected(&self, py: Python<'_>, a: f64, drive: f64, sign: f64) -> PyResult<Vec<f64>> {
        job::here(py, || self.locators().iter().map(|l| l.expected(a, drive, sign)).collect())
    }

    /// What answers readings of one signal as one file of C.
    fn export(&self, py: Python<'_>) -> PyResult<String> {
        let Answers::One(locator, calibration) = &*self.answers else { return Err(self.several(py)) };
        let made = || Export::new(locator, calibration).map(|export| export.text());
        job::here(py, made)?.map_err(|e| raise(py, e))
    }
}

impl Locator {
    fn locators(&self) -> &[locate::Locator] {
        match &*self.answers {
            Answers::One(locator, _) => std::slice::from_ref(&**locator),
            Answers::Several(several) => &several.locators,
        }
    }

    /// What answers one value, where a reading is one.
    fn single(&self, py: Python<'_>) -> PyResult<&locate::Locator> {
        let Answers::One(locator, _) = &*self.answers else { return Err(self.several(py)) };
        if !locator.is_twofold() {
            return Ok(locator);
        }
        let error = InputError::new("the calibration is of two signals, and a reading of one").key("value");
        let allowed = "a table with both signals: locate(table, calibration)";
        Err(raise(py, error.allowed(allowed).into()))
    }

    /// The error where one signal is needed and there are several.
    fn several(&self, py: Python<'_>) -> PyErr {
        let error = InputError::new("the calibration is of several channels").key("calibration");
        let error = error.value(self.channels().join(", "));
        raise(py, error.allowed("locate, table, expected; a calibration of one signal").into())
    }
}

/// The distance of one reading of several channels, in the units of the calibration.
fn of_channels(several: &locate::Several, drive: f64, values: &[f64]) -> Located {
    if drive.is_finite() && several.locators[0].rests(drive) {
        return Located::nothing(Status::NO_STRAIN);
    }
    let signal = |(l, value): (&locate::Locator, &f64)| l.unit.strain(*value, l.rig.setup.gauge.factor);
    let signals: Vec<f64> = several.locators.iter().zip(values).map(signal).collect();
    several.locate(drive, &signals, &vec![0.0; signals.len()])
}

/// Which readings of a table are told together: "same", "strokes" and what they leave free, or "object" and its column.
pub type Together = Option<(String, Option<String>)>;

/// The same in the words of the library.
pub fn by(together: &Together) -> Result<By<'_>, InputError> {
    Ok(match together {
        Some((word, free)) if word == "strokes" => {
            let parsed = free.as_deref().map(str::parse::<Free>).transpose();
            let refused = |why: String| {
                let error = InputError::new(why).key("free").value(free.clone().unwrap_or_default());
                error.allowed("zero, friction=SD, tilt=SD (degrees), joined by commas")
            };
            By::Strokes(parsed.map_err(refused)?.unwrap_or_default())
        }
        Some((_, Some(column))) => By::Column(column),
        Some(_) => By::Same,
        None => By::Unsaid,
    })
}
