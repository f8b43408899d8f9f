//! The physics, pure: f64, no files, no devices. Units mm, N, MPa, radians.

pub mod body;
pub mod chebyshev;
mod cumulative;
pub mod driven;
pub mod fit;
pub mod flexure;
pub mod inverse;
pub mod linear;
pub mod nodes;
pub mod number;
pub mod pole;
pub mod real;
pub mod rod;
pub mod section;
pub mod solid;
pub mod taper;
