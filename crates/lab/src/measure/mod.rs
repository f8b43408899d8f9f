//! Measured taps: data files as a rig writes them, which column is what, units of the signal, the zero of the sensor, the whisker they belong
//! to, and which place of it touches ([`skin`]).
//!
//! Nothing here judges a row: a value that is missing stays missing (NaN), a line that cannot be understood is an error
//! with its number. What a row is worth is decided in `calibrate`.

pub mod columns;
pub mod counts;
pub mod file;
pub mod group;
pub mod header;
pub mod lag;
pub mod missing;
pub mod names;
pub mod rest;
pub mod rig;
pub mod runs;
pub mod skin;
pub mod thousands;
pub mod unit;
pub mod zero;

pub use file::{Data, Row};
pub use names::Names;
pub use rig::Rig;
pub use unit::Unit;
