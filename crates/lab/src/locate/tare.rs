//! The zero of readings: what the sensor shows without contact, and what is known of that.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Locator;
use crate::error::InputError;
use crate::fields::{number, plain};
use crate::measure::{TaredBy, Zero};

/// A zero of a calibration without zero readings is worth a word beyond so many standard deviations of a reading.
const SEEN: f64 = 4.0;

/// A zero reading is off the others beyond this share of a usual signal.
const OFF: f64 = 0.1;
/// And beyond so many standard deviations of a reading.
const CERTAIN: f64 = 8.0;

#[derive(Debug, Clone)]
pub enum Tare {
    /// Zero readings of a whole file, joined by straight lines in file order.
    File(Zero),
    /// The last run of zero readings of a stream, or what was said before.
    Held(Option<Held>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    mean: f64,
    /// Its variance in units of a reading's.
    share: f64,
    /// Readings in it; 0 for what was said before.
    n: usize,
    /// The last reading, where it was far off: it counts when the next one is like it.
    aside: Option<f64>,
}

impl Held {
    fn of(readings: &[f64]) -> Self {
        let n = readings.len();
        Self { mean: readings.iter().sum::<f64>() / n as f64, share: 1.0 / n as f64, n, aside: None }
    }
}

impl Tare {
    /// Before the first reading: what the user `said`, else what the calibration fitted. It brings no variance: an error of it is in the fit as well.
    pub fn new(locator: &Locator, said: Option<f64>) -> Self {
        let fitted = (locator.zero.from == TaredBy::Fitted).then_some(locator.zero.value);
        Self::said(said.or(fitted))
    }

    pub fn said(zero: Option<f64>) -> Self {
        Self::Held(zero.map(|mean| Held { mean, share: 0.0, n: 0, aside: None }))
    }

    /// Zero at a place among the lines, and the variance that it brings, in units of a reading's; `None` where it is not known.
    pub fn at(&self, place: usize) -> Option<(f64, f64)> {
        match self {
            Self::File(zero) => {
                let share = |(_, weight, share): (usize, f64, f64)| weight * weight * share;
                (zero.count > 0).then(|| (zero.at(place), zero.weights(place).into_iter().map(share).sum()))
            }
            Self::Held(held) => held.map(|h| (h.mean, h.share)),
        }
    }

    /// Takes a zero reading of a stream; `follows` another one. The zero that it is far off, if it is set aside for that.
    pub fn see(&mut self, locator: &Locator, value: f64, follows: bool) -> Option<f64> {
        let Self::Held(held) = self else { return None };
        let Some(before) = held.filter(|h| h.n > 0) else {
            *held = Some(Held::of(&[value]));
            return None;
        };
        let value = locator.beside(before.mean, value);
        let limit = (OFF * locator.size()).max(CERTAIN * locator.noise);
        let near = |x: f64| (value - x).abs() <= limit;
        let n = before.n + 1;
        let now = match before.aside {
            _ if near(before.mean) && follows => {
                let mean = before.mean + (value - before.mean) / n as f64;
                Held { mean, share: 1.0 / n as f64, n, aside: None }
            }
            _ if near(before.mean) => Held::of(&[value]),
            Some(other) if near(other) => Held::of(&[other, value]),
            _ => Held { aside: Some(value), ..before },
        };
        *held = Some(now);
        now.aside.map(|_| now.mean)
    }
}

/// What a user should know where readings are not in the state of the calibration; `zero` is that of a tap.
pub fn doubt(locator: &Locator, zero: Option<f64>) -> Option<String> {
    let kind = locator.rig.setup.drive.column();
    let unit = locator.unit.common();
    let tared = &locator.zero;
    match (tared.from, zero) {
        (TaredBy::Rows | TaredBy::Plateau, None) => Some(format!(
            "the zero of the calibration was read and subtracted ({:.4e} {unit}), that of these readings is not known and taken as 0: \
             if they are not tared, every distance is wrong. Give rows with {kind} {}, or --zero",
            tared.value,
            tared.until.map_or("= 0".to_owned(), |u| format!("≤ {u}"))
        )),
        (TaredBy::None, None) if tared.error == 0.0 => Some(
            "no zero was read when the whisker was calibrated, and its data could not tell a constant offset from a tap: where these \
             readings are not in the same state, every distance is wrong"
                .to_owned(),
        ),
        (TaredBy::None, Some(zero)) if zero.abs() > SEEN * locator.noise => Some(format!(
            "a zero of {zero:.4e} {unit} is subtracted from these readings, but no zero was read when the whisker was calibrated: where \
             its signal was not tared, every distance is wrong"
        )),
        _ => None,
    }
}

/// One finite number, or two, in the unit of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "Vec<f64>")]
pub enum SaidZero {
    One(f64),
    Two(f64, f64),
}

impl TryFrom<Vec<f64>> for SaidZero {
    type Error = &'static str;

    fn try_from(values: Vec<f64>) -> Result<Self, Self::Error> {
        match values[..] {
            [x] if x.is_finite() => Ok(Self::One(x)),
            [x, y] if x.is_finite() && y.is_finite() => Ok(Self::Two(x, y)),
            _ => Err("this is no zero of such a signal"),
        }
    }
}

impl SaidZero {
    /// The zero of each signal of `locators`, as many as there are.
    pub fn of<'l>(
        zero: Option<&Self>,
        locators: impl IntoIterator<Item = &'l Locator>,
    ) -> Result<[Option<f64>; 2], InputError> {
        let (values, said) = match zero {
            None => return Ok([None; 2]),
            Some(Self::One(x)) => ([Some(*x), None], plain(*x)),
            Some(Self::Two(x, y)) => ([Some(*x), Some(*y)], format!("{},{}", plain(*x), plain(*y))),
        };
        let (message, allowed) = match locators.into_iter().any(Locator::is_twofold) {
            two if two == values[1].is_some() => return Ok(values),
            false => ("the calibration is of one signal", "one number, with a decimal point"),
            true => ("the calibration is of two signals, each with its zero", "two numbers: X,Y"),
        };
        Err(InputError::new(message).key("--zero").value(said).allowed(allowed))
    }
}

impl FromStr for SaidZero {
    type Err = &'static str;

    fn from_str(said: &str) -> Result<Self, Self::Err> {
        let values: Option<Vec<f64>> = said.split(',').map(number).collect();
        let said = values.and_then(|values| Self::try_from(values).ok());
        said.ok_or("a number, or one for each of two signals: X,Y")
    }
}
