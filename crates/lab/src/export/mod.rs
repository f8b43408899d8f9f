//! A calibration as one C file without dependencies that answers as `locate` does: a table of drive × reading → distance and σ for every estimator.
//! Its error against `locate` is measured between the nodes of the table and written into the file.

mod c;
mod grid;

use crate::error::{Error, InputError};
use crate::locate::{Calibration, Locator};
pub use grid::Off;
use grid::Side;

/// Name of the file.
pub const FILE: &str = "locate.c";

const LARGEST: Off = Off { distance: 1e-3, sigma: 0.02, rest: [0.25, 0.5] };

/// Calibration ready for export.
pub struct Export<'a> {
    locator: &'a Locator,
    calibration: &'a Calibration,
    sides: Vec<Side<'a>>,
    /// Largest differences to `locate` at double precision.
    pub off: Off,
}

impl<'a> Export<'a> {
    /// Export of `locator`, which was opened from `calibration`.
    ///
    /// # Errors
    /// A calibration of two signals; an estimator that is not smooth enough, or has no answer at some drive.
    pub fn new(locator: &'a Locator, calibration: &'a Calibration) -> Result<Self, Error> {
        if locator.is_twofold() {
            let message = "the file answers one signal, and this calibration is of two: distance and tilt take the model itself";
            let error = InputError::new(message).key("--export").value("a calibration with [second]");
            return Err(error.allowed("a calibration of one gauge (no second = true in [gauge])").into());
        }
        let refused = |e: InputError| {
            let message = format!("{} cannot be written as a table: {}", locator.estimator.name(), e.message);
            let error = InputError { message, ..e }.key("--export").value(locator.estimator.name());
            error.allowed("another estimator (--estimator), or the program itself (vibrissa locate)")
        };
        let length = if locator.rig.known { locator.rig.design.tuple.L_a } else { 0.0 };
        let mut export = Self { locator, calibration, sides: Vec::new(), off: Off::default() };
        for of in &locator.sides {
            let (side, off) = Side::new(locator, of, length).map_err(refused)?;
            export.sides.push(side);
            export.off = export.off.or(off);
        }
        match export.off.is_within(LARGEST) {
            true => Ok(export),
            false => Err(refused(InputError::new(format!("it would be off by up to {}", export.off))).into()),
        }
    }
}
