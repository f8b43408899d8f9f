//! What users write and keep as TOML beside the [`spec`](crate::spec): a rig, a calibration, the values in force of a run.

mod array;
mod calibration;
mod model_error;
mod rig;
mod sensor;
mod strokes;

pub use array::{Array, Mount, UNITS as ARRAY_UNITS};
pub use model_error::{model_error, settle_model_error};
pub use sensor::settle;
