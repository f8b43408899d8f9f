//! What a rig adds to the curve of its whisker, from an earlier calibration of it.

use vibrissa_learned::plan::Rig as Spread;

use crate::error::InputError;
use crate::estimator::learned::LearnedRecord;
use crate::locate::Calibration;
use crate::measure::{Rig, Unit};

/// What a rig adds, as a calibration before learned it; `gain` is that of runs where it has one run only.
///
/// # Errors
/// A calibration that was not learned, of another signal, or of a whisker that is driven another way.
pub fn like(calibration: &Calibration, rig: &Rig, gain: f64, label: &str) -> Result<Spread, InputError> {
    let fault = |message: &str, allowed: String| {
        Err(InputError::new(message).at(label, None).key("--like").allowed(allowed))
    };
    let signal = Unit::of_column(&calibration.signal).and_then(Unit::signal);
    if signal != Some(rig.setup.signal) {
        return fault("this calibration is of another signal", format!("one of {}", rig.setup.signal.word()));
    }
    if calibration.rig.setup.drive != rig.setup.drive {
        let allowed = format!("one with {}", rig.setup.drive.column());
        return fault("the whisker of this calibration is driven another way", allowed);
    }
    let Some(LearnedRecord { units, spread, runs, .. }) =
        calibration.sides.first().and_then(|side| side.learned.as_ref())
    else {
        return fault("this calibration was not learned", "a calibration.toml that holds learned".to_owned());
    };
    let [floor, relative, position, visit, of_runs, zero, _] = spread.map(f64::sqrt);
    let noise = floor * units[0];
    let [gain, zero] = if *runs > 1 { [of_runs, zero * units[0]] } else { [gain, noise] };
    Ok(Spread { noise, relative, position, visit, gain, zero })
}
