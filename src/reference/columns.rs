//! Columns of every table that a command writes.

use super::layout::{Entry, Part};
use super::tables::{AT_DISTANCE, AT_DRIVE, OTHERS, Told};
use crate::scene::Drive;
use crate::sink::table::{AtDistance, AtDrive, Column, Name, Only, TapRow};

/// Before the tables.
pub const ABOUT: &str = "CSV in UTF-8 with one header and no comment lines; numbers in the shortest form that reads back the same. A value \
    that does not exist is empty, never 0. Read columns by name: new ones may be added before `status`. *if varied*: the column is there if the spec has an axis of it, or the tuple file has the column. `delta_mm` stands in place of `theta_deg` \
    with `drive = \"displacement\"`, K has the unit mm with `convention = \"elongation\"`. Sections (§) and equations are those of \
    docs/model.md.";

/// A table that a command writes.
#[derive(Debug)]
pub struct Written {
    /// The command.
    pub command: &'static str,
    /// The file.
    pub file: &'static str,
    /// What a row is.
    pub row: &'static str,
    /// Its columns, in order.
    pub columns: Vec<Described>,
}

/// A column and what it says.
#[derive(Debug)]
pub struct Described {
    /// Its name; `this or that` where it is called one or the other.
    pub name: String,
    /// What it says.
    pub meaning: &'static str,
    /// Which tables have it.
    pub only: Only,
}

/// All tables.
pub fn tables() -> Vec<Written> {
    let written = |command, file, row, columns| Written { command, file, row, columns };
    let [taps, drives, distances] = [of(&TapRow::COLUMNS), of(&AtDrive::COLUMNS), of(&AtDistance::COLUMNS)];
    let mut all = vec![
        written("sweep", "tuples.csv", "A row is one tap.", taps),
        written("sweep", "designs.csv", "A row is a whisker at one drive, over all its distances.", drives),
        written(
            "sweep",
            "distances.csv",
            "A row is a whisker at one distance, over all its drives.",
            distances,
        ),
        written("optimise", "pareto.csv", "A row is a design of the trade-off front.", of(&AtDrive::COLUMNS)),
        written(
            "calibrate",
            "designs.csv",
            "A row is one drive of one side, over its distances.",
            beside(of(&AtDrive::COLUMNS), AT_DRIVE),
        ),
        written(
            "calibrate",
            "distances.csv",
            "A row is one distance of one side, over its drives.",
            beside(of(&AtDistance::COLUMNS), AT_DISTANCE),
        ),
    ];
    all.extend(OTHERS.iter().map(|t| {
        let columns = t.before.iter().chain(t.columns).map(|c| told(t.command, c));
        written(t.command, t.file, t.row, columns.collect())
    }));
    all
}

/// Columns of located.csv that two gauges have.
const OF_TWO: [&str; 9] =
    ["tilt_deg", "sigma_tilt_deg", "corr", "x_mm", "y_mm", "z_mm", "sigma_x_mm", "sigma_y_mm", "sigma_z_mm"];

fn told(command: &str, (name, meaning): &Told) -> Described {
    // What these have only where the spec says so.
    let asked = ["simulate", "shape"].contains(&command);
    let only = match *name {
        name if command == "locate" && OF_TWO.contains(&name) => Only::Second,
        "tilt_deg" if asked => Only::Tilt,
        "lean_deg" if asked => Only::Lean,
        name if asked && name.ends_with("z_mm") => Only::Direction,
        "diameter_mm" => Only::Built,
        name if asked && name.starts_with("strain_2") => Only::Second,
        _ => Only::Always,
    };
    Described { name: (*name).to_owned(), meaning, only }
}

/// The columns of a table of a sweep.
fn of<R>(columns: &[Column<R>]) -> Vec<Described> {
    let name = |name: Name| match name {
        Name::Is(name) => name.to_owned(),
        Name::Drive => [Drive::Angle, Drive::Displacement].map(Drive::column).join(" or "),
        Name::Channel(_, which) => {
            ["signal_moment … or channel_1 …", "K_moment … or K_1 …"][which].to_owned()
        }
        Name::Read(strain, other) => format!("{strain} or {other}"),
        Name::K(plain, mm) => format!("{plain} or {mm}"),
    };
    // The first channel stands for all.
    let first = |c: &&Column<R>| !matches!(c.only, Only::Channel(1..));
    let described = |c: &Column<R>| Described { name: name(c.name), meaning: c.meaning, only: c.only };
    columns.iter().filter(first).map(described).collect()
}

/// `columns` with `more` before the last of them, the status.
fn beside(mut columns: Vec<Described>, more: &[Told]) -> Vec<Described> {
    let status = columns.len() - 1;
    columns.splice(status..status, more.iter().map(|c| told("", c)));
    columns
}

/// One part for each table.
pub fn parts() -> Vec<Part> {
    let entry = |c: Described| {
        let meaning = match c.only.when() {
            "" => c.meaning.to_owned(),
            when => format!("{} ({when})", c.meaning),
        };
        Entry { facts: vec![unit(&c.name)], meaning, name: c.name }
    };
    let part = |t: Written| {
        let title = format!("{} ({})", t.file, t.command);
        Part::new(title, t.row, &["column", "unit", "meaning"], t.columns.into_iter().map(entry))
    };
    tables().into_iter().map(part).collect()
}

/// Units by what names say.
const UNITS: [(&str, &str); 15] = [
    ("_Nmm_per_rad", "N mm/rad"),
    ("_N_per_mm", "N/mm"),
    ("_per_mm2", "1/mm²"),
    ("_per_mm", "1/mm"),
    ("_Nmm", "N mm"),
    ("_MPa", "MPa"),
    ("_mm", "mm"),
    ("_deg", "degrees"),
    ("_N", "N"),
    ("seconds", "s"),
    ("seconds_median", "s"),
    ("ns_per_tap", "ns"),
    ("ns_per_tap_median", "ns"),
    ("taps_per_second", "1/s"),
    ("mV_per_V", "mV/V"),
];

/// The unit that the end of a name says; those of `this or that`; empty where it has none.
pub fn unit(name: &str) -> String {
    let of = |name: &str| UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit);
    let mut units: Vec<&str> = name.split(" or ").map(|n| of(n).unwrap_or("none")).collect();
    units.dedup();
    match units.as_slice() {
        ["none"] => String::new(),
        units => units.join(" or "),
    }
}
