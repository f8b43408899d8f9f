//! TOML files besides the [`spec`](crate::spec): rigs, calibrations, arrays, strokes, values in force of a run.

mod calibration;
mod rig;
mod sensor;
mod strokes;

pub use sensor::settle;
pub use strokes::{Array, Mount};
