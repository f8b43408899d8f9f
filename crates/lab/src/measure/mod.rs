//! Measured taps: data files of a rig, their columns and units, the sensor's zero, and the whisker with its contact point ([`rig`]).
//!
//! Rows are not judged here: a missing value stays NaN, a line that cannot be read is an error with its number. `calibrate` judges rows.

pub mod columns;
pub mod counts;
pub mod file;
pub mod group;
pub mod header;
pub mod missing;
pub mod names;
pub mod rig;
pub mod time;
pub mod unit;
pub mod zero;

pub use self::{group::Groups, names::Names, time::Lag, unit::Unit};
pub use file::{Data, Row};
pub use rig::{Rig, Skin};
pub use zero::{Tared, TaredBy, Zero};
