//! What answers readings: a calibration of one signal, of two gauges or of several channels, opened.

use std::sync::atomic::{AtomicBool, Ordering};

use super::stream::{self, UNRECORDED};
use super::tare::{Tare, doubt};
use super::{Answerer, Ask, Calibration, Located, Locator, Objects, Sensor, Several};
use crate::error::{Error, InputError};
use crate::estimator::{Estimator, Opener};
use crate::sink::{Frame, LabTable};
use crate::status::Status;

pub enum Answers {
    One(Box<Locator>),
    Several(Several),
}

impl Answers {
    /// Opens the `text` of a calibration named `label`; `trust` accepts one that was edited by hand. Each of several channels has its own estimator.
    pub fn open(
        (label, text, trust): (&str, &str, bool),
        estimator: Option<Estimator>,
        same_run: bool,
        open: Opener<'_>,
    ) -> Result<Self, Error> {
        if Sensor::is_text(text) {
            return Ok(Self::Several(Several::new(&Sensor::parse(label, text, trust)?, label, open)?));
        }
        let mut locator = Locator::new(&Calibration::parse(label, text, trust)?, label, estimator, open)?;
        locator.same_run = same_run;
        Ok(Self::One(Box::new(locator)))
    }

    pub fn who(&self) -> Answerer<'_> {
        match self {
            Self::One(locator) => (&**locator).into(),
            Self::Several(all) => Answerer { locators: &all.locators, several: Some(all) },
        }
    }

    pub fn single(&self) -> Result<&Locator, InputError> {
        match self {
            Self::One(locator) if locator.is_twofold() => {
                let error = InputError::new("the calibration is of two signals, and a reading of one");
                Err(error.key("value").allowed("a table with both signals: locate(table, calibration)"))
            }
            Self::One(locator) => Ok(locator),
            Self::Several(several) => {
                let error = InputError::new("the calibration is of several channels").key("calibration");
                let error = error.value(several.names.join(", "));
                Err(error.allowed("locate, table, expected; a calibration of one signal"))
            }
        }
    }

    /// Answers readings in the order in which they were taken, a row of `values` each, and says what is doubtful of their zero. Several channels are above their zeros.
    pub fn readings(
        &self,
        zero: Option<f64>,
        drives: &[f64],
        values: &[f64],
        stop: &AtomicBool,
    ) -> Result<(Vec<Located>, Option<String>), InputError> {
        let rows = drives.iter().zip(values.chunks(self.who().locators.len()));
        let rows = rows.enumerate().take_while(|(i, _)| i % 64 != 0 || !stop.load(Ordering::Relaxed));
        let rows = rows.map(|(_, row)| row);
        if let Self::Several(several) = self {
            let signal = |(l, value): (&Locator, &f64)| l.unit.strain(*value, l.rig.setup.gauge.factor);
            let one = |(drive, values): (&f64, &[f64])| {
                let signals: Vec<f64> = several.locators.iter().zip(values).map(signal).collect();
                let located = match drive.is_finite() && several.locators[0].rests(*drive) {
                    true => Err(Status::NO_STRAIN),
                    false => several.locate(*drive, &signals, &vec![0.0; signals.len()]),
                };
                located.unwrap_or_else(Located::nothing)
            };
            return Ok((rows.map(one).collect(), None));
        }
        let locator = self.single()?;
        let mut sequence = Sequence::new(locator, zero);
        let all = rows.map(|(drive, values)| sequence.answer(locator, *drive, values[0])).collect();
        Ok((all, sequence.told().flatten()))
    }

    /// The table of the answers to `rows`, up to `stop`.
    pub fn table(&self, rows: LabTable<'_>, ask: &Ask<'_>, stop: &AtomicBool) -> Result<Frame, Error> {
        Objects::can(self.who(), ask.by)?;
        let (zeros, _) = stream::zeros(self.who(), rows.into(), ask)?;
        let mut located = Frame::default();
        let mut write = |some: &Frame, _: bool| {
            if located.names.is_empty() {
                located = some.like();
            }
            located.extend(some, 0..some.len())
        };
        stream::answer(self.who(), rows.into(), ask, Some(zeros), stop, &mut write)?;
        Ok(located)
    }
}

/// Readings in the order in which they were taken: zero readings among them serve those after them.
#[derive(Debug, Clone)]
pub struct Sequence {
    tare: Tare,
    follows: bool,
    /// What should be known of the zero of the first tap, after it.
    doubt: Option<Option<String>>,
}

impl Sequence {
    /// Of readings for `locator`, above `zero` if it is known, both in the unit of the calibration.
    pub fn new(locator: &Locator, zero: Option<f64>) -> Self {
        let signal = |z| locator.unit.strain(z, locator.rig.setup.gauge.factor);
        let tare = Tare::new(locator, zero.map(signal));
        Self { tare, follows: false, doubt: None }
    }

    /// What a user should know of the zero of the taps so far, told once; `None` before the first tap.
    pub fn told(&mut self) -> Option<Option<String>> {
        self.doubt.as_mut().map(Option::take)
    }

    /// The distance of the next reading: a `value` in the unit of the calibration at a `drive`, degrees or mm.
    pub fn answer(&mut self, locator: &Locator, drive: f64, value: f64) -> Located {
        let signal = locator.unit.strain(value, locator.rig.setup.gauge.factor);
        let finite = drive.is_finite() && signal.is_finite();
        let rests = finite && locator.rests(drive);
        let follows = std::mem::replace(&mut self.follows, rests);
        if rests {
            let _ = self.tare.see(locator, signal, follows);
            return Located::nothing(Status::NO_STRAIN);
        }
        if !finite {
            return Located::nothing(Status::BAD_INPUT);
        }
        let drive = if locator.drive_recorded { drive } else { UNRECORDED };
        let known = self.tare.at(0);
        self.doubt.get_or_insert_with(|| doubt(locator, known.map(|z| z.0)));
        let (zero, share) = known.unwrap_or((0.0, 0.0));
        locator.locate_above(drive, signal, zero, share)
    }
}
