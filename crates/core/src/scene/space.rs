//! The tuples of a sweep and their order: index ↔ tuple.
//!
//! Row order is D, d, L_a, x_ss, l, a, drive nested, last fastest. A set of sampled axes is one factor that
//! stands in the place of its first axis. The index of a tuple is its identity on every backend.

use super::axis::Axis;
use super::layout::Layout;
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

impl Space {
    /// Every combination of these axes, in [`Column`] order: one factor each; all sampled axes, which share their points, are one factor in
    /// the place of the first. `None` where they have more than 2^64 tuples.
    pub fn grid(axes: [Axis; 7]) -> Option<Self> {
        let mut factors: Vec<Factor> = Vec::new();
        let mut zip = None;
        for (column, axis) in Column::ALL.into_iter().zip(axes) {
            match (axis.points(), zip) {
                (Some(_), Some(place)) => {
                    let factor: &mut Factor = &mut factors[place];
                    factor.axes.push((column, axis));
                }
                (points, _) => {
                    zip = zip.or(points.map(|_| factors.len()));
                    factors.push(Factor { len: axis.len(), axes: vec![(column, axis)] });
                }
            }
        }
        factors.iter().try_fold(1u64, |n, f| n.checked_mul(f.len))?;
        Some(Self::Grid(factors))
    }

    /// Indices and tuples of a grid; `None` where the tuples are listed.
    pub fn layout(&self) -> Option<Layout> {
        match self {
            Self::Grid(factors) => Some(Layout::new(factors)),
            Self::List(_) | Self::File(_) => None,
        }
    }

    /// The axis of `column`; `None` where the tuples are listed.
    pub fn axis(&self, column: Column) -> Option<&Axis> {
        let Self::Grid(factors) = self else { return None };
        factors.iter().flat_map(|f| &f.axes).find(|(c, _)| *c == column).map(|(_, axis)| axis)
    }

    /// The one whisker of the space, with its first distance and drive.
    ///
    /// # Errors
    /// The column that has several values, and how many; or `None` where the tuples are listed.
    pub fn whisker(&self) -> Result<Tuple, Option<(Column, u64)>> {
        let Self::Grid(factors) = self else { return Err(None) };
        let mut values = [1.0; 7];
        for (column, axis) in factors.iter().flat_map(|f| &f.axes) {
            if *column < Column::Distance && axis.len() != 1 {
                return Err(Some((*column, axis.len())));
            }
            values[*column as usize] = axis.at(0);
        }
        Ok(Tuple::from_array(values))
    }
}
