//! Taps and strokes become points on an object, and points a curve (docs/contour.md).
//!
//! [`truth`] has where a whisker stands; [`point`] makes a point of a tap, [`stroke`] points of a sweep,
//! [`curve`] a line, a circle or a smooth curve of points; [`traced`] is all of it for a file of readings, and what is told of that.

pub mod array;
pub mod curve;
pub mod point;
pub mod stroke;
pub mod trace;
pub mod traced;
pub mod truth;
pub mod write;
