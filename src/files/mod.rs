//! What users write and keep as TOML beside the [`spec`](crate::spec): a rig, a calibration, the values in force of a run.

mod calibration;
mod rig;
mod settle;

pub use settle::settle;
