//! Taps and strokes become points on an object, and points a curve (docs/contour.md).
//!
//! [`point`] makes a point of a tap, [`stroke`] points of a sweep,
//! [`curve`] a line, a circle or a smooth curve of points; [`trace`] does all of it for a file of readings.

pub mod array;
pub mod curve;
pub mod point;
pub mod stroke;
pub mod trace;
