//! Tuples listed in a CSV file.

use std::fs::File;
use std::path::Path;

use super::reader::{Document, Item, Result};
use super::space::Read;
use super::table::{self, Columns, Header};
use super::units::Rows;
use crate::scene::listed::{Grouping, Listed, MOST_ROWS, reader};
use crate::scene::{COLUMNS, Column, DirectionColumns, Drive, Space, Tuple};

/// Columns that a file may lack: its poles are then upright.
const SPARE: [&str; 2] = ["tilt_deg", "lean_deg"];

/// Size from which on a file is not held in memory, bytes: some 200 000 rows.
pub const LARGE: u64 = 8 << 20;

/// Reads the file named by `item`, relative to `base`, and warnings about it.
pub(super) fn read<'a>(item: &Item<'a>, drive: Drive, base: &Path) -> Result<Read<'a>> {
    let names = Column::ALL.map(|column| column.name(drive));
    let columns = Columns { names, spare: &SPARE };
    let path = base.join(item.text()?);
    if path.metadata().is_ok_and(|m| m.is_file() && m.len() > LARGE)
        && let Some((listed, directions, seen, warnings)) = large(&path, columns, drive)
    {
        let listed = listed
            .ok_or_else(|| item.error("this file has too many rows").allowed(format!("{MOST_ROWS}")))?;
        let leaning = seen.map(|seen| seen.then(|| item.clone()));
        return Ok(Read { space: Space::File(listed), directions, leaning, warnings });
    }
    let (label, text) = table::open(item, base, "tuple")?;
    let document = Document { file: &label, text: &text };
    let (mut tuples, mut rows, mut seen) = (Vec::new(), Rows::new(drive), [false; 2]);
    let header = table::read(&document, columns, allowed, &mut |values, start| {
        let tuple = Tuple::from_array(values);
        rows.take(&tuple, start);
        seen = leaning(seen, &tuple);
        tuples.push(tuple);
    })?;
    let doubts = rows.doubts(&label, |start| Some(document.line(table::line_span(&text, start).start)));
    let warnings = header.warning(&label).into_iter().chain(doubts).collect();
    let leaning = seen.map(|seen| seen.then(|| item.clone()));
    Ok(Read { space: Space::List(tuples), directions: directions(&header), leaning, warnings })
}

/// Rows of a large file, unless there are too many, which columns of the pole's direction it has, whether poles tilt and lean, and warnings
/// about it.
type Large = (Option<Listed>, DirectionColumns, [bool; 2], Vec<String>);

/// Checks the file at `path` row by row; `None` where something is wrong with it, which is said of the whole text.
fn large(path: &Path, columns: Columns<'_, COLUMNS>, drive: Drive) -> Option<Large> {
    let (mut grouping, mut rows, mut doubted) = (Grouping::default(), 0, Rows::new(drive));
    let mut seen = [false; 2];
    let mut row = |values, start| {
        let tuple = Tuple::from_array(values);
        rows += 1;
        doubted.take(&tuple, start);
        seen = leaning(seen, &tuple);
        if rows <= MOST_ROWS {
            grouping.push(&tuple);
        }
    };
    let header = table::scan(reader(File::open(path).ok()?), columns, allowed, &mut row).ok()?;
    let label = path.display().to_string();
    // The text is not held, in which the line would be counted.
    let warnings = header.warning(&label).into_iter().chain(doubted.doubts(&label, |_| None)).collect();
    // A pool of its own: how many threads the program takes, the rest of the spec may say.
    let grouped = match rayon::ThreadPoolBuilder::new().build() {
        Ok(pool) => pool.install(|| grouping.finish()),
        Err(_) => grouping.finish(),
    };
    let listed = (rows <= MOST_ROWS).then(|| Listed::new(path, header.places, grouped));
    Some((listed, directions(&header), seen, warnings))
}

/// Whether poles tilt, and lean, in the rows so far.
fn leaning([tilt, lean]: [bool; 2], t: &Tuple) -> [bool; 2] {
    [tilt || t.tilt != 0.0, lean || t.lean != 0.0]
}

/// Which columns of the pole's direction a file has.
fn directions(header: &Header<COLUMNS>) -> DirectionColumns {
    let [tilt, lean] = [Column::Tilt, Column::Lean].map(|c| header.places[c as usize].is_some());
    DirectionColumns { tilt, lean }
}

fn allowed(column: &str) -> &'static str {
    match column {
        _ if column.ends_with("_deg") => "a number in degrees, no unit",
        _ => "a number in mm, no unit",
    }
}
