//! What a report holds, whichever command it is of.

use std::borrow::Cow;

use serde_json::{Value, json};

use super::quantity;
use super::source::Source;
use crate::error::Error;
use crate::figure::{Figure, Mark, Marker, Path};
use crate::sink::frame::Frame;

/// Rows of a table in the page.
pub const SHOWN: usize = 1500;

/// Points of `rows` of `table` along `path`, with bars of these half lengths in y by row, and what `note` says of each row. They are linked with the rows
/// of the page if all of these are in it.
pub fn points_of(
    table: &Frame,
    (path, marker): (Path, Marker),
    rows: &[usize],
    error: &[f64],
    note: impl Fn(usize) -> String,
) -> Mark {
    Mark::Points {
        path,
        marker,
        error: rows.iter().filter_map(|r| error.get(*r).copied()).collect(),
        rows: if table.len() <= SHOWN { rows.to_vec() } else { Vec::new() },
        notes: rows.iter().map(|r| note(*r)).collect(),
    }
}

/// Figures and tables of a result.
#[derive(Debug, Default)]
pub struct Content {
    /// What the result says, in one sentence.
    pub answer: String,
    /// In the order of the page.
    pub figures: Vec<Figure>,
    /// Tables behind them as the page takes them: file, number of its rows, how those that are shown were chosen, whether these are the lines of the parallel
    /// coordinates and points of the front, columns, values, places of the rows in the file.
    pub tables: Vec<Value>,
    /// Figures of the result in a line each, name and value.
    pub facts: Vec<(String, String)>,
    /// What was left out, and what is to be minded.
    pub notes: Vec<String>,
}

impl Content {
    /// With `figure`, if it shows anything.
    pub fn figure(&mut self, figure: Figure) {
        if !figure.is_empty() {
            self.figures.push(figure);
        }
    }

    /// With the rows `rows` of `table`, chosen as `how` says.
    pub fn table(&mut self, table: &Frame, rows: Vec<usize>, how: &str, linked: bool) {
        let file = table.file.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        if rows.len() < table.len() {
            self.notes.push(format!(
                "{file}: {} of {} rows are in this page, {how}",
                rows.len(),
                table.len()
            ));
        }
        let column = |c: &Cow<'static, str>| {
            let axis = quantity::axis(c);
            json!({ "name": c, "label": axis.label, "unit": axis.unit })
        };
        let columns: Vec<Value> = table.names.iter().map(column).collect();
        let values: Vec<Value> =
            rows.iter().map(|r| (0..table.columns.len()).map(|c| table.json(c, *r)).collect()).collect();
        self.tables.push(json!({
            "file": file, "of": table.len(), "how": how, "linked": linked, "columns": columns, "rows": values, "at": rows,
        }));
    }

    /// With the first rows of `table`.
    pub fn first(&mut self, table: &Frame, linked: bool) {
        self.table(table, (0..table.len().min(SHOWN)).collect(), "the first", linked);
    }

    /// With the first rows of the tables of these names that the result has.
    pub fn first_rows(&mut self, source: &Source, names: &[&str]) -> Result<(), Error> {
        for name in names {
            if let Some(table) = source.maybe(name)? {
                self.first(&table, false);
            }
        }
        Ok(())
    }

    /// With a fact, if it is known.
    pub fn fact(&mut self, name: &str, value: &Value) {
        let text = match value {
            Value::Null => return,
            Value::String(text) => text.clone(),
            Value::Number(n) => n.as_f64().map_or(n.to_string(), crate::digits::short),
            other => other.to_string(),
        };
        self.facts.push((name.to_owned(), text));
    }
}
