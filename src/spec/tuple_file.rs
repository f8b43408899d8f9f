//! Tuples listed in a CSV file.

use std::fs::File;
use std::path::Path;

use super::reader::{Document, Item, Result};
use super::table;
use super::units::Rows;
use crate::scene::listed::{Grouping, Listed, MOST_ROWS};
use crate::scene::{Column, Drive, Space, Tuple};

/// Size from which on a file is not held in memory, bytes: some 200 000 rows.
pub const LARGE: u64 = 8 << 20;

/// Reads the file named by `item`, relative to `base`, and warnings about it.
pub(super) fn read(item: &Item<'_>, drive: Drive, base: &Path) -> Result<(Space, Vec<String>)> {
    let columns = Column::ALL.map(|column| column.name(drive));
    let path = base.join(item.text()?);
    if path.metadata().is_ok_and(|m| m.is_file() && m.len() > LARGE)
        && let Some((listed, warnings)) = large(&path, columns, drive)
    {
        let listed = listed
            .ok_or_else(|| item.error("this file has too many rows").allowed(format!("{MOST_ROWS}")))?;
        return Ok((Space::File(listed), warnings));
    }
    let (label, text) = table::open(item, base, "tuple")?;
    let document = Document { file: &label, text: &text };
    let (mut tuples, mut rows) = (Vec::new(), Rows::new(drive));
    let warning = table::read(&document, columns, allowed, &mut |values, start| {
        let tuple = Tuple::from_array(values);
        rows.take(&tuple, start);
        tuples.push(tuple);
    })?;
    let doubts = rows.doubts(&label, |start| Some(document.line(table::line_span(&text, start).start)));
    Ok((Space::List(tuples), warning.into_iter().chain(doubts).collect()))
}

/// Checks the file at `path` row by row; `None` where something is wrong with it, which is said of the whole text.
/// Its rows, unless there are too many, and warnings about it.
fn large(path: &Path, columns: [&str; 7], drive: Drive) -> Option<(Option<Listed>, Vec<String>)> {
    let (mut grouping, mut rows, mut doubted) = (Grouping::default(), 0, Rows::new(drive));
    let mut row = |values, start| {
        let tuple = Tuple::from_array(values);
        rows += 1;
        doubted.take(&tuple, start);
        if rows <= MOST_ROWS {
            grouping.push(&tuple);
        }
    };
    let header = table::scan(File::open(path).ok()?, columns, allowed, &mut row).ok()?;
    let label = path.display().to_string();
    // The text is not held, in which the line would be counted.
    let warnings = header.warning(&label).into_iter().chain(doubted.doubts(&label, |_| None)).collect();
    let listed = (rows <= MOST_ROWS).then(|| Listed::new(path, header.places, grouping.finish()));
    Some((listed, warnings))
}

fn allowed(column: &str) -> &'static str {
    match column {
        "theta_deg" => "a number in degrees, decimal point, no unit",
        _ => "a number in mm, decimal point, no unit",
    }
}
