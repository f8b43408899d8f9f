//! Figures and tables of a report, for every command.

use std::borrow::Cow;

use serde_json::{Value, json};

use super::quantity;
use super::source::Source;
use crate::error::Error;
use crate::figure::{Figure, Mark, Marker, Path};
use crate::sink::frame::Frame;

/// Most rows of a table in the page.
pub const SHOWN: usize = 1500;

/// Points of `rows` along `path`, with half bar lengths `error` and a `note` by row. Linked with the page's rows if it has all of them.
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

#[derive(Debug, Default)]
pub struct Content {
    pub answer: String,
    /// In page order.
    pub figures: Vec<Figure>,
    /// Tables of the page as JSON: file, number of rows, choice of the rows shown, whether they are linked with parallel coordinates and the front,
    /// columns, values, row indices in the file.
    pub tables: Vec<Value>,
    /// Names and values listed for the result.
    pub facts: Vec<(String, String)>,
    /// Notes: omissions and cautions.
    pub notes: Vec<String>,
}

impl Content {
    /// Adds `figure` unless it is empty.
    pub fn figure(&mut self, figure: Figure) {
        if !figure.is_empty() {
            self.figures.push(figure);
        }
    }

    /// Adds `rows` of `table`; `how` describes the choice.
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

    /// Adds the first rows of `table`.
    pub fn first(&mut self, table: &Frame, linked: bool) {
        self.table(table, (0..table.len().min(SHOWN)).collect(), "the first", linked);
    }

    /// Adds the first rows of those tables of these names that exist.
    pub fn first_rows(&mut self, source: &Source, names: &[&str]) -> Result<(), Error> {
        for name in names {
            if let Some(table) = source.maybe(name)? {
                self.first(&table, false);
            }
        }
        Ok(())
    }

    /// Adds a fact unless it is null.
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
