//! Properties of a whisker for which a shader has separate code.

use super::Rod;

/// Properties of a whisker for which shaders have separate code; a property that is off costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Shape {
    /// The resting whisker is curved.
    pub curved: bool,
    /// The whisker has a core or a bore.
    pub inner: bool,
    /// The diameter is a power of the distance from the tip.
    pub power: bool,
}

impl Shape {
    /// The properties of `rod`.
    pub fn of(rod: &Rod) -> Self {
        Self {
            curved: rod.curvature != [0.0; 2],
            inner: rod.pieces.iter().any(|piece| piece.inner != [0.0; 2]),
            power: rod.power.is_some(),
        }
    }
}
