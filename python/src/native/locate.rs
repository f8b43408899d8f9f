//! `vibrissa.Locator`.

use std::cell::RefCell;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use vibrissa::command::estimator as named;
use vibrissa::error::{Error, InputError};
use vibrissa::export::Export;
use vibrissa::locate::free::Free;
use vibrissa::locate::object::{By, Objects, UnlocatedTap};
use vibrissa::locate::{self, Answerer, Calibration, Located, Sequence, locator::opener, next, stream, tare};
use vibrissa::measure::Names;
use vibrissa::scene::RunOptions;

use super::error::{keywords, raise};
use super::job;
use super::table::Table;
use super::words::bits;

/// What is told while work goes on, with keywords in place of flags.
#[derive(Default)]
pub struct Warnings(RefCell<Vec<String>>);

impl Warnings {
    /// One more.
    pub fn push(&self, text: &str) {
        self.0.borrow_mut().push(keywords(text));
    }

    /// All of it, in its order.
    pub fn into_texts(self) -> Vec<String> {
        self.0.into_inner()
    }
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
        same_run: bool,
    ) -> PyResult<Self> {
        let made = || -> Result<Self, Error> {
            let asked = named(estimator.as_deref())?;
            let calibration = Calibration::parse(label, text, trust)?;
            let mut locator =
                locate::Locator::new(&calibration, label, asked, &opener(&RunOptions::default()))?;
            locator.same_run = same_run;
            if let Some(bad) =
                zero.filter(|z| !locator.unit.strain(*z, locator.rig.setup.gauge.factor).is_finite())
            {
                let error = InputError::new("this is no zero of such a signal").key("zero").value(bad);
                return Err(error.allowed("a number in the unit of the signal").into());
            }
            if let Some(z) = zero.filter(|_| locator.is_twofold()) {
                let error =
                    InputError::new("the calibration is of two signals, each with its zero").key("zero");
                return Err(error.value(z).allowed("rows of the table with a drive of 0").into());
            }
            let sequence = Mutex::new(Sequence::new(&locator, zero));
            Ok(Self { locator: Arc::new(locator), calibration, sequence, zero })
        };
        job::here(py, made)?.map_err(|e| raise(py, e))
    }

    /// What should be known of the zero of readings that are answered alone.
    #[getter]
    fn doubt(&self) -> Option<String> {
        let tare = tare::Tare::new(
            &self.locator,
            self.zero.map(|z| self.locator.unit.strain(z, self.locator.rig.setup.gauge.factor)),
        );
        tare::doubt(&self.locator, tare.at(0).map(|z| z.0)).map(|text| keywords(&text))
    }

    /// What should be known of the zero of the readings that follow each other, told once; None before the first tap.
    fn told(&self) -> Option<Vec<String>> {
        let told = self.sequence.lock().unwrap_or_else(PoisonError::into_inner).told()?;
        Some(told.iter().map(|text| keywords(text)).collect())
    }

    /// One reading: distance, sigma, status bits. With `follow` zero readings before it count.
    #[pyo3(signature = (drive, value, follow, /))]
    fn one(&self, py: Python<'_>, drive: f64, value: f64, follow: bool) -> PyResult<(f64, f64, u16)> {
        self.single(py)?;
        let answer = || match follow {
            true => {
                let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
                sequence.answer(&self.locator, drive, value)
            }
            false => Sequence::new(&self.locator, self.zero).answer(&self.locator, drive, value),
        };
        let Located { distance, sigma, status, .. } = job::here(py, answer)?;
        Ok((distance, sigma, bits(status)))
    }

    /// What the taps among these readings (drives, values, shifts of the base) of one object tell, and the next one: taps, distance, sigma and another
    /// distance so far; best drive and shift, the sigma that it brings and the least that any number of taps does; status bits; drives and shifts
    /// that were tried, their sigmas and status bits; what should be known of the zero.
    #[allow(clippy::type_complexity)]
    fn next(
        &self,
        py: Python<'_>,
        readings: [PyReadonlyArray1<'_, f64>; 3],
        within: [f64; 2],
        shifts: Option<[f64; 2]>,
        same_run: bool,
    ) -> PyResult<(usize, [f64; 3], [f64; 4], u16, Vec<([f64; 3], u16)>, Vec<String>)> {
        self.single(py)?;
        let [drives, values, places] = readings.map(|column| column.as_array().to_vec());
        let work = || -> Result<(next::Next, Vec<String>), Error> {
            let mut sequence = Sequence::new(&self.locator, self.zero);
            let read = drives.iter().zip(&values).zip(&places);
            let taps = read.filter_map(|((drive, value), shift)| {
                let tap = sequence.read(&self.locator, *drive, *value).ok()?;
                Some(UnlocatedTap { shift: *shift, ..tap })
            });
            let taps: Vec<UnlocatedTap> = taps.collect();
            let may = next::May { within, shifts, same_run: same_run || self.locator.same_run };
            let found = next::next(&self.locator, &taps, may).map_err(|why| {
                InputError::new(why)
                    .key("readings")
                    .allowed("a calibration by learned, taps of one object, and drives that were calibrated")
            })?;
            Ok((found, sequence.told().flatten().iter().map(|text| keywords(text)).collect()))
        };
        let (found, told) = job::here(py, work)?.map_err(|e| raise(py, e))?;
        let best = found.best.map(|k| &found.tried[k]);
        let [drive, shift, sigma] = best.map_or([f64::NAN; 3], |b| [b.drive, b.shift, b.sigma]);
        let now = if found.taps > 0 { found.now } else { [f64::NAN, found.now[1]] };
        let tried = found.tried.iter().map(|t| ([t.drive, t.shift, t.sigma], bits(t.status))).collect();
        Ok((
            found.taps,
            [now[0], now[1], found.near.unwrap_or(f64::NAN)],
            [drive, shift, sigma, found.floor.unwrap_or(f64::NAN)],
            bits(found.status),
            tried,
            told,
        ))
    }

    /// Readings in the order in which they were taken: distances, sigmas, status bits; what should be known of their zero.
    #[allow(clippy::type_complexity)]
    fn many<'py>(
        &self,
        py: Python<'py>,
        drive: PyReadonlyArray1<'py, f64>,
        value: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Vec<String>)> {
        self.single(py)?;
        let (drives, values): (Vec<f64>, Vec<f64>) =
            (drive.as_array().iter().copied().collect(), value.as_array().iter().copied().collect());
        drop((drive, value));
        let (locator, mut sequence) = (Arc::clone(&self.locator), Sequence::new(&self.locator, self.zero));
        let (a, sigma, status, told) = job::whole(py, None, None, move |stop, _| {
            let n = drives.len();
            let (mut a, mut sigma, mut status) = (vec![0.0; n], vec![0.0; n], vec![0; n]);
            for (i, (drive, value)) in drives.iter().zip(&values).enumerate() {
                if i % 1024 == 0 && stop.load(Ordering::Relaxed) {
                    break;
                }
                let found = sequence.answer(&locator, *drive, *value);
                (a[i], sigma[i], status[i]) = (found.distance, found.sigma, bits(found.status));
            }
            let told: Vec<String> = sequence.told().flatten().iter().map(|text| keywords(text)).collect();
            Ok((a, sigma, status, told))
        })?;
        let numbers = |all| PyArray1::from_vec(py, all).into_any();
        Ok((numbers(a), numbers(sigma), PyArray1::from_vec(py, status).into_any(), told))
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
        let locator = Arc::clone(&self.locator);
        answered(py, (locator, |l| l.into()), self.zero, (label, bytes, columns), (together, interval))
    }

    /// Name of the estimator in use.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.locator.estimator.name()
    }

    /// What should be known of the calibration.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.calibration.rig.warnings.iter().map(|text| keywords(text)).collect()
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
    fn expected(&self, py: Python<'_>, a: f64, drive: f64, sign: f64) -> PyResult<f64> {
        job::here(py, || self.locator.expected(a, drive, sign))
    }

    /// What answers readings as one file of C.
    fn export(&self, py: Python<'_>) -> PyResult<String> {
        let made = || Export::new(&self.locator, &self.calibration).map(|export| export.text());
        job::here(py, made)?.map_err(|e| raise(py, e))
    }
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

/// Readings of a CSV table, its name, bytes and columns, by `who` of what answers, those that are told `together`: located.csv, and what should be
/// known of them.
pub fn answered<T: Send + Sync + 'static>(
    py: Python<'_>,
    (of, who): (Arc<T>, fn(&T) -> Answerer<'_>),
    zero: Option<f64>,
    (label, bytes, columns): (String, Vec<u8>, Option<String>),
    (together, interval): (Together, bool),
) -> PyResult<(Table, Vec<String>)> {
    job::whole(py, None, None, move |stop, _| {
        let columns = columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
        let told = Warnings::default();
        let warn = |text: &str| told.push(text);
        let by = by(&together)?;
        Objects::can(who(&of), by)?;
        let ask = stream::Ask {
            columns: &columns,
            zero: [zero, None],
            label: Some(&label),
            keep: true,
            by,
            interval,
            warn: &warn,
        };
        let (zeros, _) = stream::zeros(who(&of), bytes.as_slice(), &ask)?;
        let mut out = Vec::new();
        let mut write = |some: &[u8], _: bool| {
            out.extend_from_slice(some);
            Ok(())
        };
        stream::answer(who(&of), bytes.as_slice(), &ask, Some(zeros), stop, &mut write)?;
        Ok((Table::of_csv(&out)?, told.into_texts()))
    })
}

impl Locator {
    /// Refuses to answer one value where a reading has two.
    fn single(&self, py: Python<'_>) -> PyResult<()> {
        if !self.locator.is_twofold() {
            return Ok(());
        }
        let error = InputError::new("the calibration is of two signals, and a reading of one").key("value");
        let allowed = "a table with both signals: locate(table, calibration)";
        Err(raise(py, error.allowed(allowed).into()))
    }
}
