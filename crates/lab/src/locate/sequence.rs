//! Readings one by one, as numbers: what a robot or an array of them asks.

use super::stream::UNRECORDED;
use super::tare::{Tare, doubt};
use super::{Located, Locator};
use crate::error::{InputError, nearest};
use crate::status::Status;

/// Readings in the order in which they were taken: zero readings among them serve those after them.
#[derive(Debug, Clone)]
pub struct Sequence {
    tare: Tare,
    follows: bool,
    /// Whether there was a tap, and what should be known of its zero.
    asked: bool,
    doubt: Option<String>,
}

impl Sequence {
    /// Of readings for `locator`, above `zero` if it is known, both in the unit of the calibration.
    pub fn new(locator: &Locator, zero: Option<f64>) -> Self {
        let signal = |z| locator.unit.strain(z, locator.rig.setup.gauge.factor);
        let tare = Tare::new(locator, zero.map(signal));
        Self { tare, follows: false, asked: false, doubt: None }
    }

    /// What a user should know of the zero of the taps so far, told once; `None` before the first tap.
    pub fn told(&mut self) -> Option<Option<String>> {
        self.asked.then(|| self.doubt.take())
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
        if !std::mem::replace(&mut self.asked, true) {
            self.doubt = doubt(locator, known.map(|z| z.0));
        }
        let (zero, share) = known.unwrap_or((0.0, 0.0));
        locator.locate_above(drive, signal, zero, share)
    }
}

/// The column that says how much nearer to the object the base stood, mm.
pub const SHIFT: &str = "shift_mm";

/// Place of the column [`SHIFT`] among `names`.
pub fn shift_column(names: &[String]) -> Result<Option<usize>, InputError> {
    let found = names.iter().position(|n| n == SHIFT);
    let parts = |n: &str| n.to_lowercase().split('_').map(str::to_owned).collect::<Vec<_>>();
    let known = |part: &String| ["base", "shift", "mm", "cm", "m"].contains(&part.as_str());
    let like = |n: &&String| {
        let parts = parts(n);
        nearest(n, &[SHIFT]).is_some() || parts.iter().all(known) && parts.iter().any(|part| part == "shift")
    };
    match names.iter().find(like).filter(|_| found.is_none()) {
        Some(name) => {
            let error = InputError::new(
                "this is nearly the column of the shift of the base, and would not be looked at",
            );
            Err(error.key(name).allowed(format!("{SHIFT}, in mm; or a name unlike it")))
        }
        None => Ok(found),
    }
}
