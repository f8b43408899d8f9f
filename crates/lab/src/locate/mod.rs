//! From a reading to a distance, with its uncertainty and a warning where it should not be trusted.
//!
//! A [`Calibration`] is what a file holds, a [`Locator`] is what answers. Every [`Estimator`] answers in the same terms
//! ([`Found`]); they stand in [`estimator`].
//!
//! ```no_run
//! let locator = vibrissa_lab::locate::Locator::open("results/rig/calibration.toml")?;
//! let tap = locator.locate(4.0, 1.23e-3); // tap angle in degrees, strain
//! println!("{:.2} ± {:.2} mm, {}", tap.distance, tap.sigma, tap.status);
//! # Ok::<(), vibrissa_core::error::Error>(())
//! ```

pub mod answers;
pub mod calibration;
pub mod free;
mod lines;
pub mod locator;
pub mod next;
pub mod object;
pub mod pair;
mod pairs;
mod rows;
pub mod several;
pub mod stream;
pub mod strokes;
pub mod tare;
pub mod tared;

pub use self::{answers::Sequence, calibration::Calibration, pair::Spatial, stream::Ask, tare::SaidZero};
pub use crate::estimator::{self, Estimator, Found, Parameter};
pub(crate) use calibration::Opened;
pub use locator::{Located, Locator, opener};
pub use object::{By, Objects};
pub use rows::{Answerer, Reading};
pub use several::{Sensor, Several};
pub use tared::{AnsweredRow, Readings};
