//! Columns of every table that a command writes.

use super::layout::{Entry, Part};
use crate::sink::fact::Fact;
use crate::sink::heading::{HEADINGS, Heading, units};

pub const ABOUT: &str = "CSV in UTF-8 with one header and no comment lines; numbers in the shortest form that reads back the same. A value \
    that does not exist is empty, never 0. Read columns by name: new ones may be added before `status`. *if varied*: the column is there if the spec has an axis of it, or the tuple file has the column. `delta_mm` stands in place of `theta_deg` \
    with `drive = \"displacement\"`, K has the unit mm with `convention = \"elongation\"`. Sections (§) and equations are those of \
    docs/model.md.";

pub fn parts() -> Vec<Part> {
    let entry = |fact: &&Fact| {
        let meaning = match fact.only.when() {
            "" => fact.meaning.clone(),
            when => format!("{} ({when})", fact.meaning),
        };
        Entry { facts: vec![units(&fact.name)], meaning, name: fact.name.replace('|', " or ") }
    };
    let part = |table: &Heading| {
        let title = format!("{} ({})", table.file, table.command);
        Part::new(title, &table.row, &["column", "unit", "meaning"], table.columns.iter().map(entry))
    };
    HEADINGS.iter().map(part).collect()
}
