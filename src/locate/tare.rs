//! The zero of readings: what the sensor shows without contact, and what is known of that.

use super::Locator;
use crate::measure::zero::{TaredBy, Zero};

/// A zero of a calibration without zero readings is worth a word beyond so many standard deviations of a reading.
const SEEN: f64 = 4.0;

/// The zero of readings, line by line.
#[derive(Debug, Clone)]
pub enum Tare {
    /// Zero readings of a whole file, joined by straight lines in file order.
    File(Zero),
    /// The last run of zero readings of a stream, or what was said before: its mean, and the number of readings in it.
    Held(Option<(f64, usize)>),
}

impl Tare {
    /// Before the first reading: `said` by the user in strain, or the unit of the reading, else what the calibration fitted.
    pub fn new(locator: &Locator, said: Option<f64>) -> Self {
        let fitted = locator
            .tared
            .as_ref()
            .filter(|t| matches!(t.from, TaredBy::Fitted | TaredBy::Reference))
            .map(|t| t.value);
        Self::Held(said.or(fitted).map(|zero| (zero, usize::MAX)))
    }

    /// Zero at a place among the lines, and the variance that it brings, in units of a reading's; `None` where it is not known.
    pub fn at(&self, place: usize) -> Option<(f64, f64)> {
        match self {
            Self::File(zero) => {
                let share = |(run, w): (usize, f64)| w * w / zero.sizes().get(run).map_or(1.0, |n| *n as f64);
                (zero.count > 0).then(|| (zero.at(place), zero.weights(place).into_iter().map(share).sum()))
            }
            Self::Held(held) => {
                held.map(|(zero, n)| (zero, if n == usize::MAX { 0.0 } else { 1.0 / n as f64 }))
            }
        }
    }

    /// Takes a zero reading of a stream; `follows` another one.
    pub fn see(&mut self, value: f64, follows: bool) {
        if let Self::Held(held) = self {
            *held = Some(match *held {
                Some((mean, n)) if follows && n < usize::MAX - 1 => {
                    (mean + (value - mean) / (n + 1) as f64, n + 1)
                }
                _ => (value, 1),
            });
        }
    }
}

/// What a user should know where readings are not in the state of the calibration; `zero` is that of a tap.
pub fn doubt(locator: &Locator, zero: Option<f64>) -> Option<String> {
    let kind = locator.rig.setup.drive.column();
    let unit = locator.unit.common();
    match (&locator.tared, zero) {
        (Some(t), None) if matches!(t.from, TaredBy::Rows | TaredBy::Plateau) => Some(format!(
            "the zero of the calibration was read and subtracted ({:.4e} {unit}), that of these readings is not known and taken as 0: \
             if they are not tared, every distance is wrong. Give rows with {kind} = 0, or --zero",
            t.value
        )),
        (tared, Some(zero)) if tared.as_ref().is_none_or(|t| t.from == TaredBy::None) => {
            (zero.abs() > SEEN * locator.noise()).then(|| {
                format!(
                    "a zero of {zero:.4e} {unit} is subtracted from these readings, but no zero was read when the whisker was \
                     calibrated: where its signal was not tared, every distance is wrong"
                )
            })
        }
        (Some(t), Some(zero)) if t.from == TaredBy::Reference && zero != t.value => Some(format!(
            "the zero of the calibration is not known; with {zero:.4e} {unit} subtracted from these readings every distance is wrong"
        )),
        _ => None,
    }
}
