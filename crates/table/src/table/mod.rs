//! The columns of a sweep's tables: name, meaning and value, each in one place; and what takes rows.

mod swept;

use serde_json::Value;

use super::rows::TableFormat;
use crate::scene::{Convention, Drive, PROPERTIES, Property, Setup, Signal};
use crate::status::Status;
pub use swept::{AtDistance, AtDrive, LARGEST, TapRow};

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
        ["tuples", "designs", "distances"][self as usize]
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
    /// What is read: its names of a strain, and of another signal.
    Read(&'static str, &'static str),
    /// Of a channel its reading (0), or its K (1).
    Channel(usize, usize),
    /// A figure of K: its names without unit, and with the convention `elongation` in mm.
    K(&'static str, &'static str),
}

impl Name {
    /// The name for `setup`.
    pub fn of(self, setup: &Setup) -> &'static str {
        match self {
            Self::Is(name) => name,
            Self::Drive => setup.drive.column(),
            Self::Read(strain, other) => {
                if setup.signal == Signal::Strain {
                    strain
                } else {
                    other
                }
            }
            Self::Channel(k, which) => {
                setup.channels.as_ref().and_then(|all| all.names.get(k)).map_or("", |names| names[which])
            }
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
    /// Where it says either.
    Direction,
    /// With a second gauge.
    Second,
    /// Where the spec asks for the wrench.
    Wrench,
    /// With several channels.
    Several,
    /// With more channels than this.
    Channel(usize),
    /// Of whiskers that are more than a cone clamped at its base.
    Built,
    /// Of whiskers that are curved at rest.
    Curved,
    /// Where this property differs from design to design.
    Varies(Property),
}

impl Only {
    /// Whether tables of `setup` have it.
    pub fn holds(self, setup: &Setup) -> bool {
        match self {
            Self::Always => true,
            Self::Tilt => setup.directions.tilt,
            Self::Lean => setup.directions.lean,
            Self::Direction => setup.directions.tilt || setup.directions.lean,
            Self::Second => setup.gauge.second,
            Self::Wrench => setup.wrench,
            Self::Several => setup.channels.is_some(),
            Self::Channel(k) => setup.channels.as_ref().is_some_and(|all| all.len() > k),
            Self::Built => setup.built.is_some(),
            Self::Curved => setup.is_curved(),
            Self::Varies(property) => setup.varies(property),
        }
    }

    /// When, in words; nothing of a column that is always there.
    pub fn when(self) -> &'static str {
        match self {
            Self::Always => "",
            Self::Tilt => "if the spec has tilt",
            Self::Lean => "if the spec has lean",
            Self::Direction => "if the spec has tilt or lean",
            Self::Second => "with a second gauge",
            Self::Wrench => "with wrench = true",
            Self::Several => "with several channels",
            Self::Channel(_) => "one for each channel",
            Self::Built => "unless the whisker is a plain cone",
            Self::Curved => "if the whisker is curved at rest",
            Self::Varies(_) => "if varied",
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

impl<R> Clone for Column<R> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<R> Copy for Column<R> {}

/// `columns` with those of the properties that may vary after the five of a design; `rig` tells the rig of a row.
const fn with_properties<R, const N: usize, const M: usize>(
    columns: [Column<R>; N],
    rig: fn(&R) -> Field,
) -> [Column<R>; M] {
    const DESIGN: usize = 5;
    let mut all = [columns[0]; M];
    let mut k = 0;
    while k < M {
        all[k] = match k.checked_sub(DESIGN) {
            None => columns[k],
            Some(p) if p < PROPERTIES => {
                let property = Property::ALL[p];
                let about = property.about();
                only(Only::Varies(property), about.column, about.what, rig)
            }
            Some(_) => columns[k - PROPERTIES],
        };
        k += 1;
    }
    all
}

/// Names of `columns` for `setup`, in order.
pub fn names<R>(columns: &[Column<R>], setup: &Setup) -> Vec<&'static str> {
    columns.iter().filter(|c| c.only.holds(setup)).map(|c| c.name.of(setup)).collect()
}

/// Values of those `columns` in `row` that tables of `setup` have, after what `out` holds.
pub fn fields<R>(columns: &[Column<R>], setup: &Setup, row: &R, out: &mut Vec<Field>) {
    let value = |c: &Column<R>| match (c.only, (c.read)(row), &setup.rigs) {
        (Only::Varies(property), Field::Count(rig), Some(rigs)) => Field::Number(rigs.value(rig, property)),
        (_, field, _) => field,
    };
    out.extend(columns.iter().filter(|c| c.only.holds(setup)).map(value));
}

impl From<Field> for Value {
    fn from(field: Field) -> Self {
        match field {
            Field::Number(x) => x.into(),
            Field::Count(n) => n.into(),
            Field::Word("") => Self::Null,
            Field::Word(w) => w.into(),
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
    let units = [
        ("N_per_mm", "N/mm"),
        ("_per_mm", "1/mm"),
        ("_per_mm2", "1/mm²"),
        ("_Nmm_per_rad", "N mm/rad"),
        ("_MPa", "MPa"),
        ("_mm", "mm"),
        ("_deg", "deg"),
        ("_N", "N"),
    ];
    units.iter().find(|(end, _)| name.ends_with(end)).map_or("1", |(_, unit)| unit)
}
