//! TOML files besides the [`spec`](crate::spec): rigs, calibrations, arrays, strokes, values in force of a run.

mod array;
mod calibration;
mod rig;
mod sensor;
mod strokes;

pub use array::{Array, Mount};
pub use sensor::settle;

use crate::error::InputError;
use crate::spec::Item;

/// Sense of rotation of the whisker of `table`: 1 (counterclockwise, default) or −1.
fn sense(table: &Item<'_>) -> Result<f64, InputError> {
    table.or("sense", 1.0, |sense| match sense.ranged()? {
        value if value.abs() == 1.0 => Ok(value),
        _ => sense.wrong("this value is out of range"),
    })
}
