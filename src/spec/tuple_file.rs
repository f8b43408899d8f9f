//! Tuples listed in a CSV file.

use std::fs::File;
use std::path::Path;

use super::reader::{Document, Item, Result};
use super::table;
use crate::scene::listed::{Grouping, Listed, MOST_ROWS};
use crate::scene::{Column, Drive, Space, Tuple};

/// Size from which on a file is not held in memory, bytes: some 200 000 rows.
pub const LARGE: u64 = 8 << 20;

/// Reads the file named by `item`, relative to `base`, and warnings about it.
pub(super) fn read(item: &Item<'_>, drive: Drive, base: &Path) -> Result<(Space, Vec<String>)> {
    let columns = Column::ALL.map(|column| column.name(drive));
    let path = base.join(item.text()?);
    if path.metadata().is_ok_and(|m| m.is_file() && m.len() > LARGE)
        && let Some((listed, warning)) = large(&path, columns)
    {
        let listed = listed
            .ok_or_else(|| item.error("this file has too many rows").allowed(format!("{MOST_ROWS}")))?;
        return Ok((Space::File(listed), warning.into_iter().collect()));
    }
    let (label, text) = table::open(item, base, "tuple")?;
    let document = Document { file: &label, text: &text };
    let mut tuples = Vec::new();
    let warning =
        table::read(&document, columns, allowed, &mut |values, _| tuples.push(Tuple::from_array(values)))?;
    Ok((Space::List(tuples), warning.into_iter().collect()))
}

/// Checks the file at `path` row by row; `None` where something is wrong with it, which is said of the whole text.
/// Its rows, unless there are too many, and a warning about it.
fn large(path: &Path, columns: [&str; 7]) -> Option<(Option<Listed>, Option<String>)> {
    let (mut grouping, mut rows) = (Grouping::default(), 0);
    let mut row = |values, _| {
        rows += 1;
        if rows <= MOST_ROWS {
            grouping.push(&Tuple::from_array(values));
        }
    };
    let header = table::scan(File::open(path).ok()?, columns, allowed, &mut row).ok()?;
    let warning = header.warning(&path.display().to_string());
    let listed = (rows <= MOST_ROWS).then(|| Listed::new(path, header.places, grouping.finish()));
    Some((listed, warning))
}

fn allowed(column: &str) -> &'static str {
    match column {
        "theta_deg" => "a number in degrees, decimal point, no unit",
        _ => "a number in mm, decimal point, no unit",
    }
}
