//! The tables of a sweep: their columns, and the values of these for a setup.

mod swept;

use std::sync::LazyLock;

use super::fact::{Only, fact_in};
use super::format::TableFormat;
use super::heading::{CHANNEL, Heading};
use super::values::Field;
use crate::scene::{Drive, Property, Setup};
pub use swept::{AtDistance, AtDrive, TapRow};

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

    /// Its columns.
    pub fn heading(self) -> &'static Heading {
        &HEADINGS[self as usize]
    }
}

/// In place of the properties of the rig that may vary, each of which is a column. Its value is the number of the rig.
const PROPERTIES: &str = "*";

static HEADINGS: LazyLock<[Heading; 3]> = LazyLock::new(|| {
    let properties = Property::ALL.map(|property| property.about().column).join(" ");
    let heading = |table: Table, row, names: &[&str]| {
        let columns = names.join(" ").replace(PROPERTIES, &properties);
        Heading::new("sweep", table.name(), row, columns.leak())
    };
    let [drive, distance] = [
        "A row is a whisker at one drive, over all its distances.",
        "A row is a whisker at one distance, over all its drives.",
    ];
    [
        heading(Table::Tuples, "A row is one tap.", &TapRow::COLUMNS.map(|column| column.0)),
        heading(Table::Designs, drive, &AtDrive::COLUMNS.map(|column| column.0)),
        heading(Table::Distances, distance, &AtDistance::COLUMNS.map(|column| column.0)),
    ]
});

/// A column of rows made of `R`, by its name in the heading, and its value in a row; of the channels that of their place.
type Column<R> = (&'static str, fn(&R, usize) -> Field);

/// The columns that a table of one setup has, in their order.
pub struct Chosen<'s, R> {
    setup: &'s Setup,
    values: Vec<(fn(&R, usize) -> Field, usize, Option<Property>)>,
}

impl<'s, R> Chosen<'s, R> {
    fn new(table: Table, columns: &[Column<R>], setup: &'s Setup) -> Self {
        let mut values = Vec::new();
        for (name, read) in columns {
            let first = name.split('|').next().unwrap_or_default();
            match fact_in(table.name(), first).map_or(Only::Always, |fact| fact.only) {
                _ if *name == PROPERTIES => {
                    let varied = Property::ALL.into_iter().filter(|property| setup.varies(*property));
                    values.extend(varied.map(|property| (*read, 0, Some(property))));
                }
                Only::Channel => {
                    let channels = setup.channels.as_ref().filter(|_| *name == CHANNEL[0]);
                    values.extend((0..channels.map_or(0, |all| 2 * all.len())).map(|k| (*read, k, None)));
                }
                only if only.holds(first, setup) => values.push((*read, 0, None)),
                _ => {}
            }
        }
        Self { setup, values }
    }

    /// The values of `row`.
    pub fn fields(&self, row: &R) -> impl Iterator<Item = Field> {
        self.values.iter().map(move |(read, k, property)| match (property, read(row, *k), &self.setup.rigs) {
            (Some(property), Field::Count(rig), Some(rigs)) => rigs.value(rig, *property).into(),
            (_, field, _) => field,
        })
    }
}

/// Name of the drive with unit, for people.
pub fn drive_unit(drive: Drive) -> (&'static str, &'static str) {
    match drive {
        Drive::Angle => ("θ", "°"),
        Drive::Displacement => ("δ", " mm"),
    }
}
