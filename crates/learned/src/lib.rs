//! One statistical model of a calibration.
//!
//! A row is a reading y at the distance a and drive u, or without contact:
//!
//! y = z₀ + z_r + w(t) + m(a, u) [β + h(ln a, ln u) + g_r] + ∂y/∂ln a [c(a) + c_r(a)] + ∂m/∂u u₀ + ∂m/∂a a₀ + e
//!
//! m is the curve of the whisker if known, else a power law, and 0 without contact; h is a smooth deviation, c the error of a position, c_r that of
//! one visit; z_r and g_r are zero and gain of a run, w is a drift of the zero, e noise, in part proportional to m. Except for the learned numbers
//! (`evidence::Hyper`) the model is linear and normal: [`columns`]. Those have a restricted likelihood with priors (`evidence`, Patterson and Thompson
//! 1971), whose peaks `peaks` finds and averages over.

pub mod base;
pub mod columns;
pub mod curve;
mod evidence;
pub mod fit;
pub mod invert;
pub mod joint;
pub mod least;
mod peaks;
pub mod plan;
pub mod rows;
pub mod suspects;
