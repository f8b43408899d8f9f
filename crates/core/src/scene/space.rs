//! The tuples of a sweep and their order: index ↔ tuple.
//!
//! Row order is D, d, L_a, x_ss, l, a, drive nested, last fastest. A set of sampled axes is one factor that
//! stands in the place of its first axis. The index of a tuple is its identity on every backend.

use super::axis::Axis;
use super::listed::Listed;
use super::model::Drive;

/// Distances, and drives, that one design may have: each keeps its running statistics in memory.
pub const AXIS_LIMIT: u64 = 1 << 22;

/// A quantity that varies from tuple to tuple, in row order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Column {
    /// Base diameter, mm.
    BaseDiameter,
    /// Tip diameter, mm.
    TipDiameter,
    /// Length, mm.
    Length,
    /// Gauge position, mm.
    GaugePosition,
    /// Gauge grid length, mm.
    GridLength,
    /// Contact distance, mm.
    Distance,
    /// Tap angle, degrees, or displacement, mm.
    Drive,
}

impl Column {
    /// All seven, in row order.
    pub const ALL: [Self; 7] = [
        Self::BaseDiameter,
        Self::TipDiameter,
        Self::Length,
        Self::GaugePosition,
        Self::GridLength,
        Self::Distance,
        Self::Drive,
    ];

    /// Column name in every table.
    pub fn name(self, drive: Drive) -> &'static str {
        match self {
            Self::BaseDiameter => "D_mm",
            Self::TipDiameter => "d_mm",
            Self::Length => "L_a_mm",
            Self::GaugePosition => "x_ss_mm",
            Self::GridLength => "l_mm",
            Self::Distance => "a_mm",
            Self::Drive => drive.column(),
        }
    }
}

/// One tap: D, d, L_a, x_ss, l, a in mm and θ in degrees (or δ in mm), indexed by [`Column`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(non_snake_case)]
pub struct Tuple {
    /// Base diameter, mm.
    pub D: f64,
    /// Tip diameter, mm.
    pub d: f64,
    /// Length, mm.
    pub L_a: f64,
    /// Gauge position, mm.
    pub x_ss: f64,
    /// Grid length, mm.
    pub l: f64,
    /// Contact distance, mm.
    pub a: f64,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
}

#[allow(non_snake_case)]
impl Tuple {
    /// Values in [`Column`] order.
    pub fn to_array(self) -> [f64; 7] {
        [self.D, self.d, self.L_a, self.x_ss, self.l, self.a, self.drive]
    }

    /// From values in [`Column`] order.
    pub fn from_array([D, d, L_a, x_ss, l, a, drive]: [f64; 7]) -> Self {
        Self { D, d, L_a, x_ss, l, a, drive }
    }
}

/// One nested loop of a grid: an axis, or several sampled axes that run together.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// The quantities and their axes; all axes have `len` points.
    pub axes: Vec<(Column, Axis)>,
    /// Number of points.
    pub len: u64,
}

/// The tuples to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub enum Space {
    /// Crossed factors, ordered by their first column. The distance is a factor of its own; so is the drive,
    /// unless it is sampled together with another column.
    Grid(Vec<Factor>),
    /// Tuples as listed by the user, in file order.
    List(Vec<Tuple>),
    /// The same, left in their file because they are many.
    File(Listed),
}
