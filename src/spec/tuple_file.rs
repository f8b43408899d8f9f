//! Tuples listed in a CSV file.

use std::path::Path;

use super::reader::{Document, Item, Result};
use super::table;
use crate::scene::{Column, Drive, Space, Tuple};

/// Reads the file named by `item`, relative to `base`, and warnings about it.
pub(super) fn read(item: &Item<'_>, drive: Drive, base: &Path) -> Result<(Space, Vec<String>)> {
    let (label, text) = table::open(item, base, "tuple")?;
    let document = Document { file: &label, text: &text };
    let mut tuples = Vec::new();
    let columns = Column::ALL.map(|column| column.name(drive));
    let warning =
        table::read(&document, columns, allowed, &mut |values, _| tuples.push(Tuple::from_array(values)))?;
    Ok((Space::List(tuples), warning.into_iter().collect()))
}

fn allowed(column: &str) -> &'static str {
    match column {
        "theta_deg" => "a number in degrees, decimal point, no unit",
        _ => "a number in mm, decimal point, no unit",
    }
}
