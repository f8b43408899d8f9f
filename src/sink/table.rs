//! The columns of a sweep's tables: name, meaning and value, each in one place; and what takes rows.

use serde_json::Value;

use super::rows::TableFormat;
use crate::estimate::Estimated;
use crate::evaluate::Outcome;
use crate::scene::{Convention, Direction, Drive, Setup, Tuple};
use crate::statistics::{DistanceRow, Figures};
use crate::status::Status;

/// A table that a sweep writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One row per tap.
    Tuples,
    /// One row per design and stroke: a direction of the pole and a drive.
    Designs,
    /// One row per design, distance and direction of the pole.
    Distances,
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// A number; not finite is missing.
    Number(f64),
    /// A count.
    Count(u64),
    /// One of a few words.
    Word(&'static str),
    /// Any text.
    Text(String),
    /// Status words.
    Status(Status),
}

impl From<Option<f64>> for Field {
    fn from(x: Option<f64>) -> Self {
        Self::Number(x.unwrap_or(f64::NAN))
    }
}

impl Table {
    /// All, in the order in which they are counted.
    pub const ALL: [Self; 3] = [Self::Tuples, Self::Designs, Self::Distances];

    /// What its rows are called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tuples => "tuples",
            Self::Designs => "designs",
            Self::Distances => "distances",
        }
    }

    /// File name.
    pub fn file(self, format: TableFormat) -> String {
        format!("{}.{}", self.name(), format.name())
    }

    /// Column names for `setup`.
    pub fn columns(self, setup: &Setup) -> Vec<&'static str> {
        match self {
            Self::Tuples => names(&TapRow::COLUMNS, setup),
            Self::Designs => names(&AtDrive::COLUMNS, setup),
            Self::Distances => names(&AtDistance::COLUMNS, setup),
        }
    }
}

/// What a column is called.
#[derive(Debug, Clone, Copy)]
pub enum Name {
    /// Always this.
    Is(&'static str),
    /// `theta_deg` or `delta_mm`, as the whisker is driven.
    Drive,
    /// A figure of K: its names without unit, and with the convention `elongation` in mm.
    K(&'static str, &'static str),
}

impl Name {
    /// The name for `setup`.
    pub fn of(self, setup: &Setup) -> &'static str {
        match self {
            Self::Is(name) => name,
            Self::Drive => setup.drive.column(),
            Self::K(plain, mm) => match setup.estimate.convention {
                Convention::Mean => plain,
                Convention::Elongation => mm,
            },
        }
    }
}

/// A column of a table whose rows are made of `R`: the one place that knows it. The unit is the end of its name (`_mm`, `_deg`, `_N`);
/// without one it has none.
pub struct Column<R> {
    /// What it is called.
    pub name: Name,
    /// What it says.
    pub meaning: &'static str,
    /// Which tables have it.
    pub only: Only,
    /// Its value in a row.
    pub read: fn(&R) -> Field,
}

/// Which tables have a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Only {
    /// All.
    Always,
    /// Where the spec, or its tuple file, says `tilt`.
    Tilt,
    /// Where it says `lean`.
    Lean,
    /// With a second gauge.
    Second,
}

impl Only {
    /// Whether tables of `setup` have it.
    pub fn holds(self, setup: &Setup) -> bool {
        match self {
            Self::Always => true,
            Self::Tilt => setup.directions.tilt,
            Self::Lean => setup.directions.lean,
            Self::Second => setup.gauge.second,
        }
    }

    /// When, in words; nothing of a column that is always there.
    pub fn when(self) -> &'static str {
        match self {
            Self::Always => "",
            Self::Tilt => "where tilt is said",
            Self::Lean => "where lean is said",
            Self::Second => "with a second gauge",
        }
    }
}

const fn column<R>(name: Name, meaning: &'static str, read: fn(&R) -> Field) -> Column<R> {
    Column { name, meaning, only: Only::Always, read }
}

/// A column that only some tables have.
const fn only<R>(only: Only, name: &'static str, meaning: &'static str, read: fn(&R) -> Field) -> Column<R> {
    Column { name: Name::Is(name), meaning, only, read }
}

/// Names of `columns` for `setup`, in order.
pub fn names<R>(columns: &[Column<R>], setup: &Setup) -> Vec<&'static str> {
    columns.iter().filter(|c| c.only.holds(setup)).map(|c| c.name.of(setup)).collect()
}

/// Values of those `columns` in `row` that tables of `setup` have, after what `out` holds.
pub fn fields<R>(columns: &[Column<R>], setup: &Setup, row: &R, out: &mut Vec<Field>) {
    out.extend(columns.iter().filter(|c| c.only.holds(setup)).map(|c| (c.read)(row)));
}

/// A row of tuples.csv: one tap.
#[derive(Debug, Clone, Copy)]
pub struct TapRow<'a> {
    /// Its whisker.
    pub design: &'a Tuple,
    /// Contact distance, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
    /// What the rod gives.
    pub tap: &'a Outcome,
    /// The distance read from it.
    pub estimated: &'a Estimated,
    /// Length by which K is multiplied, where it has a unit, mm.
    pub elongation: Option<f64>,
}

/// A row of designs.csv: a design at one stroke (direction of the pole and drive), over its distances.
#[derive(Debug, Clone, Copy)]
pub struct AtDrive<'a> {
    /// The whisker.
    pub design: &'a Tuple,
    /// Direction of the pole.
    pub direction: Direction,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
    /// Its statistics.
    pub row: Figures,
    /// Unit of K.
    pub unit: f64,
}

/// A row of distances.csv: a design at one distance and direction of the pole, over its drives.
#[derive(Debug, Clone, Copy)]
pub struct AtDistance<'a> {
    /// The whisker.
    pub design: &'a Tuple,
    /// Contact distance, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Its statistics.
    pub row: &'a DistanceRow,
    /// Unit of K.
    pub unit: f64,
}

use Field::{Count, Number, Word};
use Name::{Drive as DriveName, Is, K};

const DIAMETER: &str = "base diameter D";
const TIP: &str = "tip diameter d";
const LENGTH: &str = "length L_a";
const PLACE: &str = "place of the gauge's near end x_ss";
const GRID: &str = "length of the gauge's grid l";
const DISTANCE: &str = "contact distance a";
const TILT: &str = "tilt β of the object's edge round the whisker's axis (§6)";
const LEAN: &str = "lean γ of the object's edge along the whisker (§6)";
const AZIMUTH: &str = "azimuth φ of the plane in which the whisker bends, from that of rotation (§6)";
const DRIVE: &str = "tap angle θ, or displacement δ of the object";
const COUNTED: &str = "taps that count (§4.5)";
const MEAN: &str = "mean of K over the taps that count (22)";
const SPREAD: &str = "sample standard deviation of K, n − 1 (22)";
const WORDS: &str = "ok, or words joined by +";

/// Mean of K in the unit of the table, from that of K − 1.
fn mean(mean: Option<f64>, unit: f64) -> Field {
    mean.map(|m| (1.0 + m) * unit).into()
}

/// Its standard deviation.
fn sd(sd: Option<f64>, unit: f64) -> Field {
    sd.map(|s| s * unit).into()
}

impl TapRow<'_> {
    /// Columns of tuples.csv.
    pub const COLUMNS: [Column<Self>; 24] = [
        column(Is("D_mm"), DIAMETER, |r| Number(r.design.D)),
        column(Is("d_mm"), TIP, |r| Number(r.design.d)),
        column(Is("L_a_mm"), LENGTH, |r| Number(r.design.L_a)),
        column(Is("x_ss_mm"), PLACE, |r| Number(r.design.x_ss)),
        column(Is("l_mm"), GRID, |r| Number(r.design.l)),
        column(Is("a_mm"), DISTANCE, |r| Number(r.a)),
        only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
        only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
        column(DriveName, DRIVE, |r| Number(r.drive)),
        column(Is("strain"), "mean strain over the grid, tension positive (§1)", |r| Number(r.tap.strain)),
        column(Is("strain_linear"), "the same of the estimator's theory, ±θ f (20)", |r| {
            Number(r.tap.strain_linear)
        }),
        column(
            K("K", "K_mm"),
            "strain_linear/strain (20); of two gauges θ f cos β̂/√(ε₁² + ε₂²), tan β̂ = ε₂/ε₁ (§6)",
            |r| Number((1.0 + r.tap.deviation) * r.elongation.unwrap_or(1.0)),
        ),
        column(Is("K_deviation"), "K − 1 at full relative precision (21); empty where K has a unit", |r| {
            Number(if r.elongation.is_some() { f64::NAN } else { r.tap.deviation })
        }),
        column(Is("distance_mm"), "estimated distance â (23); by the model itself (25)", |r| {
            Number(r.estimated.distance)
        }),
        column(Is("error_mm"), "bias: â − a", |r| Number(r.estimated.distance - r.a)),
        column(Is("sigma_mm"), "standard deviation of â by the noise of the gauge (24), (26)", |r| {
            Number(r.estimated.sigma)
        }),
        column(Is("normal_force_N"), "contact force across the whisker P (§3.1)", |r| {
            Number(r.tap.normal_force)
        }),
        column(Is("tangential_force_N"), "contact force along the whisker T (§3.1)", |r| {
            Number(r.tap.tangential_force)
        }),
        column(Is("contact_arc_mm"), "arc length of the contact c (§3.2)", |r| Number(r.tap.arc)),
        column(Is("contact_state"), "slide or stick (§3.5)", |r| {
            let state = if r.tap.sticking { "stick" } else { "slide" };
            Word(if r.tap.arc.is_finite() { state } else { "" })
        }),
        only(Only::Second, "strain_2", "strain of the second gauge, 90° round the whisker (§6)", |r| {
            Number(r.tap.strain_2)
        }),
        only(Only::Second, "bending_azimuth_deg", AZIMUTH, |r| Number(r.tap.azimuth.to_degrees())),
        only(Only::Second, "slide_mm", "slide λ of the contact along the object's edge (§6)", |r| {
            Number(r.tap.slide)
        }),
        column(Is("status"), WORDS, |r| Field::Status(r.tap.status | r.estimated.status)),
    ];
}

impl AtDrive<'_> {
    /// Columns of designs.csv.
    pub const COLUMNS: [Column<Self>; 19] = [
        column(Is("D_mm"), DIAMETER, |r| Number(r.design.D)),
        column(Is("d_mm"), TIP, |r| Number(r.design.d)),
        column(Is("L_a_mm"), LENGTH, |r| Number(r.design.L_a)),
        column(Is("x_ss_mm"), PLACE, |r| Number(r.design.x_ss)),
        column(Is("l_mm"), GRID, |r| Number(r.design.l)),
        only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
        only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
        column(DriveName, DRIVE, |r| Number(r.drive)),
        column(Is("n"), COUNTED, |r| Count(r.row.n)),
        column(K("K_mean", "K_mean_mm"), MEAN, |r| mean(r.row.mean, r.unit)),
        column(K("K_sd", "K_sd_mm"), SPREAD, |r| sd(r.row.sd, r.unit)),
        column(Is("error_rms_mm"), "bias: root mean square of â − a (§4.3)", |r| r.row.error_rms.into()),
        column(Is("error_max_mm"), "bias: largest |â − a|", |r| r.row.error_max.into()),
        column(Is("error_mean_mm"), "bias: mean of â − a", |r| r.row.error_mean.into()),
        column(Is("noise_rms_mm"), "noise: root mean square of sigma_mm (§4.4)", |r| r.row.noise_rms.into()),
        column(Is("total_rms_mm"), "bias (error_rms_mm) and noise in quadrature (§4.4)", |r| {
            r.row.total_rms().into()
        }),
        column(Is("strain_max"), "largest |strain|; of two gauges √(ε₁² + ε₂²)", |r| {
            r.row.strain_max.into()
        }),
        column(Is("force_max_N"), "largest contact force P", |r| r.row.force_max.into()),
        column(Is("status"), WORDS, |r| Field::Status(r.row.status)),
    ];
}

impl AtDistance<'_> {
    /// Columns of distances.csv.
    pub const COLUMNS: [Column<Self>; 12] = [
        column(Is("D_mm"), DIAMETER, |r| Number(r.design.D)),
        column(Is("d_mm"), TIP, |r| Number(r.design.d)),
        column(Is("L_a_mm"), LENGTH, |r| Number(r.design.L_a)),
        column(Is("x_ss_mm"), PLACE, |r| Number(r.design.x_ss)),
        column(Is("l_mm"), GRID, |r| Number(r.design.l)),
        column(Is("a_mm"), DISTANCE, |r| Number(r.a)),
        only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
        only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
        column(Is("n"), COUNTED, |r| Count(r.row.deviation.n)),
        column(K("K_mean", "K_mean_mm"), MEAN, |r| mean(r.row.deviation.mean(), r.unit)),
        column(K("K_sd", "K_sd_mm"), SPREAD, |r| sd(r.row.deviation.sd(), r.unit)),
        column(Is("status"), WORDS, |r| Field::Status(r.row.status)),
    ];
}

/// What takes the rows of a table, one after the other.
pub trait Sink {
    /// Why a row cannot be taken.
    type Error;

    /// Takes one row and leaves `fields` empty for the next.
    fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Self::Error>;
}

/// Rows as JSON objects: missing is null.
pub struct Objects<'a> {
    names: &'a [&'static str],
    /// The rows so far.
    pub rows: Vec<Value>,
}

impl<'a> Objects<'a> {
    /// Of rows whose columns have these names.
    pub fn new(names: &'a [&'static str]) -> Self {
        Self { names, rows: Vec::new() }
    }
}

impl Sink for Objects<'_> {
    type Error = std::convert::Infallible;

    fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Self::Error> {
        let names = self.names.iter().map(|name| (*name).to_owned());
        self.rows.push(names.zip(fields.drain(..).map(Value::from)).collect());
        Ok(())
    }
}

impl From<Field> for Value {
    fn from(field: Field) -> Self {
        match field {
            Number(x) if x.is_finite() => x.into(),
            Number(_) => Self::Null,
            Count(n) => n.into(),
            Word("") => Self::Null,
            Word(w) => w.into(),
            Field::Text(t) if t.is_empty() => Self::Null,
            Field::Text(t) => t.into(),
            Field::Status(s) => s.to_string().into(),
        }
    }
}

/// Name of the drive with unit, for people.
pub fn drive_unit(drive: Drive) -> (&'static str, &'static str) {
    match drive {
        Drive::Angle => ("θ", "°"),
        Drive::Displacement => ("δ", " mm"),
    }
}

/// The unit that the end of a column's name says; `1` of a number or a word without one.
pub fn unit(name: &str) -> &'static str {
    let units = [("_mm", "mm"), ("_deg", "deg"), ("_N", "N")];
    units.iter().find(|(end, _)| name.ends_with(end)).map_or("1", |(_, unit)| unit)
}
