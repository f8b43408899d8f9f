//! The quantities a tap depends on, scaled by its contact distance, and the variables over which it is smooth.

use crate::physics::chebyshev::{placed, scaled};

/// Number of axes of a chart.
pub const AXES: usize = 5;

/// Largest number of orders over the drive in lanes.
pub const ORDERS: usize = 12;

/// Width over a of the narrow gauge that represents a point.
pub const POINT: f64 = 1e-3;

/// Smallest x/a of a point: the middle of its gauge where that begins at the clamp.
pub const FIRST_PLACE: f64 = 0.5 * POINT;

vibrissa_core::words! {
    /// Scaled quantities of a tap, by their names in a chart's file, in the order of a series: the first is the outermost.
    Quantity {
        /// θ, rad, or δ/a.
        Drive = "drive",
        /// A length of the rig over a, r₀/a or ρ/a; one value where a is one number.
        Length = "length_over_a",
        /// D/a.
        Base = "D_over_a",
        /// Taper τa.
        Taper = "tau_a",
        /// x/a of a point of the skin.
        Place = "x_over_a",
    }
}

/// The variable y(q) over which a quantity q is expanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Map {
    /// y = q.
    Linear,
    /// y = q².
    Square,
    /// (1 − q)^(−1/2): the rod stiffens, and the lever of a gauge shrinks, with powers of 1 − q.
    Root,
    /// 1/(1 − q).
    Inverse,
    /// q^(1/4): with a soft contact K − 1 has a part proportional to drive^(−1/3).
    Fourth,
}

impl Map {
    /// y(q).
    pub fn of(self, q: f64) -> f64 {
        match self {
            Self::Linear => q,
            Self::Square => q * q,
            Self::Root => 1.0 / (1.0 - q).sqrt(),
            Self::Inverse => 1.0 / (1.0 - q),
            Self::Fourth => q.max(0.0).sqrt().sqrt(),
        }
    }

    /// q(y); of squares the one that is not negative.
    pub fn back(self, y: f64) -> f64 {
        match self {
            Self::Linear => y,
            Self::Square => y.max(0.0).sqrt(),
            Self::Root => 1.0 - 1.0 / (y * y),
            Self::Inverse => 1.0 - 1.0 / y,
            Self::Fourth => y.powi(4),
        }
    }
}

/// A quantity, its range and its variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Smallest and largest q.
    pub range: [f64; 2],
    /// The variable.
    pub map: Map,
    /// True if cuts must not shorten it.
    pub whole: bool,
}

impl Axis {
    /// Range of the variable.
    pub fn ends(&self) -> [f64; 2] {
        self.range.map(|q| self.map.of(q))
    }

    /// q at x ∈ [−1, 1].
    pub fn at(&self, x: f64) -> f64 {
        self.map.back(placed(self.ends(), x)).clamp(self.range[0], self.range[1])
    }

    /// Place of q in [−1, 1]; 0 where the axis is a point.
    pub fn place(&self, q: f64) -> f64 {
        scaled(self.ends(), self.map.of(q))
    }

    /// True if it has one value only.
    pub fn is_point(&self) -> bool {
        let [lo, hi] = self.range;
        hi - lo <= 1e-12 * hi.abs().max(lo.abs())
    }
}
