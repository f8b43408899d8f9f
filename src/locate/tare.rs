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
    /// The last run of zero readings of a stream, or what was said before: its mean, its variance in units of a reading's, and the number of
    /// readings in it.
    Held(Option<(f64, f64, usize)>),
}

impl Tare {
    /// Before the first reading: `said` by the user in strain, or the unit of the reading, else what the calibration fitted.
    pub fn new(locator: &Locator, said: Option<f64>) -> Self {
        let fitted =
            locator.tared.as_ref().filter(|t| matches!(t.from, TaredBy::Fitted | TaredBy::Reference));
        let share = |error: f64| if error > 0.0 { (error / locator.noise()).powi(2) } else { 0.0 };
        let known = said.map(|zero| (zero, 0.0)).or(fitted.map(|t| (t.value, share(t.error))));
        Self::Held(known.map(|(zero, share)| (zero, share, 0)))
    }

    /// Zero at a place among the lines, and the variance that it brings, in units of a reading's; `None` where it is not known.
    pub fn at(&self, place: usize) -> Option<(f64, f64)> {
        match self {
            Self::File(zero) => {
                let share = |(run, w): (usize, f64)| w * w / zero.sizes().get(run).map_or(1.0, |n| *n as f64);
                (zero.count > 0).then(|| (zero.at(place), zero.weights(place).into_iter().map(share).sum()))
            }
            Self::Held(held) => held.map(|(zero, share, _)| (zero, share)),
        }
    }

    /// Takes a zero reading of a stream; `follows` another one.
    pub fn see(&mut self, value: f64, follows: bool) {
        if let Self::Held(held) = self {
            *held = Some(match *held {
                Some((mean, _, n)) if follows && n > 0 => {
                    (mean + (value - mean) / (n + 1) as f64, 1.0 / (n + 1) as f64, n + 1)
                }
                _ => (value, 1.0, 1),
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
             if they are not tared, every distance is wrong. Give rows with {kind} {}, or --zero",
            t.value,
            t.until.map_or("= 0".to_owned(), |u| format!("≤ {u}"))
        )),
        (None, None) => Some(
            "the calibration does not say whether its signal was tared: if these readings are not in the same state, every distance is wrong"
                .to_owned(),
        ),
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
