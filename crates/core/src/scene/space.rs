//! The tuples of a sweep and their order. Row order is D, d, L_a, x_ss, l, properties of the rig, a, tilt, lean, drive nested, last fastest;
//! sampled axes are one factor in the place of the first. The index of a tuple is its identity on every backend.

use super::axis::Axis;
use super::layout::Layout;
use super::listed::Listed;
use super::model::Drive;
use super::property::Property;

/// Number of quantities that vary between tuples.
pub const COLUMNS: usize = 9;

/// Most taps of one design of a grid, which are held in memory together: some 160 bytes a tap.
pub const MOST_TAPS: u64 = 1 << 24;

words! {
    /// A quantity that varies between tuples, in row order, with its column in tuple files.
    #[derive(PartialOrd, Ord, Hash)]
    Column {
        /// Base diameter, mm.
        BaseDiameter = "D_mm",
        /// Tip diameter, mm.
        TipDiameter = "d_mm",
        /// Length, mm.
        Length = "L_a_mm",
        /// Gauge position, mm.
        GaugePosition = "x_ss_mm",
        /// Gauge grid length, mm.
        GridLength = "l_mm",
        /// Contact distance, mm.
        Distance = "a_mm",
        /// Tilt of the pole round the whisker's axis, degrees.
        Tilt = "tilt_deg",
        /// Lean of the pole along the whisker, degrees.
        Lean = "lean_deg",
        /// Tap angle, degrees, or displacement, mm.
        Drive = "theta_deg",
    }
}

impl Column {
    /// Column name in tuple files; tables of results call `d_mm` `d_tip_mm`, which databases do not confuse with `D_mm`.
    pub fn name(self, drive: Drive) -> &'static str {
        if self == Self::Drive { drive.column() } else { self.word() }
    }

    /// Its key in a spec: the name without the unit.
    pub fn key(self, drive: Drive) -> &'static str {
        self.name(drive).trim_end_matches("_mm").trim_end_matches("_deg")
    }
}

/// Direction of the pole (model §6); if both are zero the pole is upright, square to the plane of rotation.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Direction {
    /// β: turns pole and contact round the whisker's axis, |β| < 90 degrees.
    pub tilt: f64,
    /// γ: leans the pole along the whisker, |γ| < 90 degrees.
    pub lean: f64,
}

impl Direction {
    /// Square to the plane of rotation.
    pub const UPRIGHT: Self = Self { tilt: 0.0, lean: 0.0 };

    /// True if the pole is square to the plane of rotation.
    pub fn is_upright(self) -> bool {
        self == Self::UPRIGHT
    }
}

/// One tap: D, d, L_a, x_ss, l, a in mm, tilt and lean in degrees, and θ in degrees (or δ in mm), indexed by [`Column`].
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
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
    /// Tilt of the pole, degrees.
    pub tilt: f64,
    /// Lean of the pole, degrees.
    pub lean: f64,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
    /// Number of its rig in the setup; 0 if there is one rig.
    pub rig: u64,
}

#[allow(non_snake_case)]
impl Tuple {
    /// Values in [`Column`] order.
    pub fn to_array(self) -> [f64; COLUMNS] {
        let Self { D, d, L_a, x_ss, l, a, tilt, lean, drive, .. } = self;
        [D, d, L_a, x_ss, l, a, tilt, lean, drive]
    }

    /// From values in [`Column`] order, of the first rig.
    pub fn from_array([D, d, L_a, x_ss, l, a, tilt, lean, drive]: [f64; COLUMNS]) -> Self {
        Self { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig: 0 }
    }

    /// The tuple with this rig.
    pub fn of_rig(self, rig: u64) -> Self {
        Self { rig, ..self }
    }

    /// Direction of the pole.
    pub fn direction(&self) -> Direction {
        Direction { tilt: self.tilt, lean: self.lean }
    }

    /// The same whisker, tapped at a pole of this direction.
    pub fn towards(self, Direction { tilt, lean }: Direction) -> Self {
        Self { tilt, lean, ..self }
    }
}

/// One nested loop of a grid: an axis, or several sampled axes that run together.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// The quantities and their axes; all axes have `len` points.
    pub axes: Vec<(Column, Axis)>,
    /// Properties of the rig and their axes, also of `len` points.
    pub properties: Vec<(Property, Axis)>,
    /// Number of points.
    pub len: u64,
}

/// The tuples to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub enum Space {
    /// Crossed factors, ordered by their first column; distance, tilt, lean and drive are separate unless sampled with another column.
    Grid(Vec<Factor>),
    /// Tuples as listed by the user, in their order.
    List(Listed),
}

impl Default for Space {
    fn default() -> Self {
        Self::List(Listed::default())
    }
}

#[allow(non_snake_case)]
impl Space {
    /// Every combination of these axes, D, d, L_a, x_ss, l, a and the drive, with upright poles, as [`Self::with`].
    pub fn grid([D, d, L_a, x_ss, l, a, drive]: [Axis; 7]) -> Option<Self> {
        Self::with([D, d, L_a, x_ss, l, a, 0.0.into(), 0.0.into(), drive], Vec::new())
    }

    /// Every combination of these axes, in [`Column`] order, with `properties` of the rig between the design's axes and a; sampled axes share one
    /// factor in the place of the first. `None` beyond 2^64 tuples.
    pub fn with(axes: [Axis; COLUMNS], properties: Vec<(Property, Axis)>) -> Option<Self> {
        let mut columns = Column::ALL.into_iter().zip(axes).map(|(column, axis)| (Ok(column), axis));
        let design: Vec<_> = columns.by_ref().take(Column::Distance as usize).collect();
        let properties = properties.into_iter().map(|(property, axis)| (Err(property), axis));
        let mut factors: Vec<Factor> = Vec::new();
        let mut zip = None;
        for (quantity, axis) in design.into_iter().chain(properties).chain(columns) {
            let place = match (axis.points(), zip) {
                (Some(_), Some(place)) => place,
                (points, _) => {
                    zip = zip.or(points.map(|_| factors.len()));
                    factors.push(Factor { len: axis.len(), axes: Vec::new(), properties: Vec::new() });
                    factors.len() - 1
                }
            };
            match quantity {
                Ok(column) => factors[place].axes.push((column, axis)),
                Err(property) => factors[place].properties.push((property, axis)),
            }
        }
        factors.iter().try_fold(1u64, |n, f| n.checked_mul(f.len))?;
        Some(Self::Grid(factors))
    }

    /// Indices and tuples of a grid; `None` if the tuples are listed.
    pub fn layout(&self) -> Option<Layout> {
        match self {
            Self::Grid(factors) => Some(Layout::new(factors)),
            Self::List(_) => None,
        }
    }

    /// The number of tuples, and the tuple of each index.
    pub fn tuples(&self) -> (u64, Box<dyn Fn(u64) -> Tuple + '_>) {
        match self {
            Self::Grid(factors) => {
                let layout = Layout::new(factors);
                (layout.len(), Box::new(move |i| layout.tuple(i)))
            }
            Self::List(listed) => (listed.len() as u64, Box::new(|i| listed.tuple(i as usize))),
        }
    }

    /// The axis of `column`; `None` if the tuples are listed.
    pub fn axis(&self, column: Column) -> Option<&Axis> {
        let Self::Grid(factors) = self else { return None };
        factors.iter().flat_map(|f| &f.axes).find(|(c, _)| *c == column).map(|(_, axis)| axis)
    }

    /// The one whisker of the space, with its first distance, direction and drive.
    /// Errors: the column with several values, and their number; `None` if the tuples are listed.
    pub fn whisker(&self) -> Result<Tuple, Option<(Column, u64)>> {
        let Self::Grid(factors) = self else { return Err(None) };
        let mut values = [1.0; COLUMNS];
        for (column, axis) in factors.iter().flat_map(|f| &f.axes) {
            if *column < Column::Distance && axis.len() != 1 {
                return Err(Some((*column, axis.len())));
            }
            values[*column as usize] = axis.at(0);
        }
        Ok(Tuple::from_array(values))
    }
}
