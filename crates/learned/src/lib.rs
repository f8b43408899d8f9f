//! One statistical model of a calibration.
//!
//! A row is a reading y of a tap at the distance a by the drive u, or of the sensor at rest:
//!
//! y = z₀ + z_r + w(t) + m(a, u) [β + h(ln a, ln u) + g_r] + ∂y/∂ln a [c(a) + c_r(a)] + ∂m/∂u u₀ + ∂m/∂a a₀ + e
//!
//! m is the curve of the whisker where it is known, else a power law, and 0 at rest; h is a smooth deviation, c the error of a
//! position and c_r of one visit of it; z_r and g_r are zero and gain of a run, w a drift of the zero, e noise of which a part goes with
//! m. All but the learned numbers ([`hyper`]) is linear and normal: [`columns`]. The learned numbers follow restricted likelihood and
//! priors ([`evidence`], Patterson and Thompson 1971), found by [`newton`] and averaged over by [`fit`].

mod average;
pub mod base;
pub mod columns;
pub mod curve;
pub mod evidence;
pub mod fit;
pub mod hyper;
pub mod invert;
pub mod joint;
pub mod labels;
pub mod least;
pub mod newton;
pub mod plan;
pub mod rows;
pub mod start;
pub mod suspects;
pub mod tails;

#[cfg(test)]
mod tests;
