//! The tables of a sweep: their columns, and how values are read from rows.

mod swept;

use super::fact::{Fact, Only, property};
use super::format::TableFormat;
use super::heading::{CHANNEL, Heading, heading};
use super::values::Field;
use crate::scene::{Drive, Property, Setup};
pub use swept::{AtDistance, AtDrive, TapRow};

/// A table that a sweep writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Table {
    /// One row per tap.
    Tuples,
    /// One row per design and stroke: a direction of the pole and a drive.
    Designs,
    /// One row per design, distance and direction of the pole.
    Distances,
}

impl Table {
    /// All tables, in the order of their counts.
    pub const ALL: [Self; 3] = [Self::Tuples, Self::Designs, Self::Distances];

    /// Name of the table.
    pub fn name(self) -> &'static str {
        ["tuples", "designs", "distances"][self as usize]
    }

    /// Its file name.
    pub fn file(self, format: TableFormat) -> String {
        format!("{}.{}", self.name(), format.name())
    }

    /// Its definition, with columns.
    pub fn heading(self) -> &'static Heading {
        heading(self.name())
    }
}

/// Columns of the whisker.
pub const WHISKER: [&str; 5] = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm"];

/// Stands in `columns.csv` for the varying properties of the rig, one column each; the value read is the number of the rig.
const PROPERTIES: &str = "*";

/// Reads a value from a row `R`; the number is the channel.
type Read<R> = fn(&R, usize) -> Field;

type Column<R> = (&'static str, Read<R>);

/// The columns of a table for one setup, in order.
pub struct Chosen<'s, R> {
    setup: &'s Setup,
    values: Vec<(Read<R>, usize, Option<Property>)>,
}

impl<'s, R> Chosen<'s, R> {
    fn new(table: Table, columns: &[Column<R>], setup: &'s Setup) -> Self {
        let mut values = Vec::new();
        for Fact { name, only, .. } in table.heading().columns.iter().copied() {
            let own = if *only == Only::Varies { PROPERTIES } else { name };
            let (_, read) = columns.iter().find(|(name, _)| *name == own).expect("every column has a value");
            match only {
                Only::Channel => {
                    let channels = setup.channels.as_ref().filter(|_| name == CHANNEL[0]);
                    values
                        .extend((0..channels.map_or(0, |all| 2 * all.rows.len())).map(|k| (*read, k, None)));
                }
                only if only.holds(name, setup) => values.push((*read, 0, property(name))),
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

/// Symbol and unit of the drive, for readers.
pub fn drive_unit(drive: Drive) -> (&'static str, &'static str) {
    match drive {
        Drive::Angle => ("θ", "°"),
        Drive::Displacement => ("δ", " mm"),
    }
}
