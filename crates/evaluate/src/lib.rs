//! Outcomes of taps and their statuses ([`evaluate`]), strain over the distance at one drive ([`curve`]), rows of a design ([`statistics`]). Kernels
//! solve taps, or a [`evaluate::Source`] reads them; [`backend`] chooses the kernels, [`taps`] solves single taps.

use vibrissa_core::{design, error, estimate, physics, reduce, scene, status};
use vibrissa_kernel as kernel;

pub mod backend;
pub mod curve;
pub mod evaluate;
pub mod progress;
pub mod statistics;
pub mod taps;

/// Taps that are evaluated together.
pub const CHUNK: u64 = 1 << 17;
