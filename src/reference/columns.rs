//! Columns of every table that a command writes.

use super::layout::{Entry, Part};
use crate::calibrate::output::{BESIDE, K_TABLE, ROWS};
use crate::census::{bench, verify};
use crate::command::{next, plan};
use crate::contour::{array, write as contour};
use crate::locate::{ALONG, LOCATED, TOGETHER};
use crate::optimise::write as optimise;
use crate::record::output as record;
use crate::simulate::{self, strokes};
use crate::sink::fact::Only;
use crate::sink::heading::{Heading, units};
use crate::sink::table::Table;
use crate::{shape, tap};

/// Before the tables.
pub const ABOUT: &str = "CSV in UTF-8 with one header and no comment lines; numbers in the shortest form that reads back the same. A value \
    that does not exist is empty, never 0. Read columns by name: new ones may be added before `status`. *if varied*: the column is there if the spec has an axis of it, or the tuple file has the column. `delta_mm` stands in place of `theta_deg` \
    with `drive = \"displacement\"`, K has the unit mm with `convention = \"elongation\"`. Sections (§) and equations are those of \
    docs/model.md.";

/// A table, and a column of it.
pub type Described = (Heading, Vec<(&'static str, Only, String)>);

/// All tables, each with its columns: name (`this|that`), when there is one, what it says.
pub fn tables() -> Vec<Described> {
    let [taps, drives, distances] = Table::ALL.map(|table| *table.heading());
    // What a calibration has more stands before the status.
    let calibrated = |heading: Heading, row, more: &[&str]| {
        let columns = heading.columns.replace(" status", &format!(" {} status", more.join(" ")));
        Heading { command: "calibrate", row, columns: columns.leak(), ..heading }
    };
    let at_drive = calibrated(drives, "A row is one drive of one side, over its distances.", BESIDE[0]);
    let at_distance = calibrated(distances, "A row is one distance of one side, over its drives.", BESIDE[1]);
    let all = [
        taps,
        drives,
        distances,
        optimise::front(),
        at_drive,
        at_distance,
        optimise::HISTORY,
        optimise::SENSITIVITY,
        tap::TABLE,
        K_TABLE,
        ROWS,
        LOCATED,
        TOGETHER,
        ALONG,
        array::ARRAY,
        plan::PLAN,
        plan::PLAN_ERRORS,
        next::NEXT,
        record::TAPS,
        record::READINGS,
        contour::POINTS,
        contour::CURVE,
        simulate::MEASUREMENTS,
        strokes::TABLE,
        shape::SHAPE,
        shape::CONTACTS,
        verify::TABLE,
        bench::TABLE,
    ];
    let described = |heading: Heading| {
        let columns = heading.facts().map(|(name, fact)| (name, fact.only, fact.meaning.clone())).collect();
        (heading, columns)
    };
    all.into_iter().map(described).collect()
}

/// One part for each table.
pub fn parts() -> Vec<Part> {
    let entry = |(name, only, meaning): (&str, Only, String)| {
        let meaning = match only.when() {
            "" => meaning,
            when => format!("{meaning} ({when})"),
        };
        Entry { facts: vec![units(name)], meaning, name: name.replace('|', " or ") }
    };
    let part = |(heading, columns): Described| {
        let title = format!("{} ({})", heading.file(), heading.command);
        Part::new(title, heading.row, &["column", "unit", "meaning"], columns.into_iter().map(entry))
    };
    tables().into_iter().map(part).collect()
}
