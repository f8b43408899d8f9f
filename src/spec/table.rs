//! CSV files that a spec names: a header with known columns, then rows of finite numbers.

use std::path::Path;

use super::reader::{Document, Item, Result};
use super::{load, schema};
use crate::error::InputError;

/// Name and text of the file that `item` names, relative to `base`; `what` says what the file is.
pub(super) fn open(item: &Item<'_>, base: &Path, what: &str) -> Result<(String, String)> {
    let path = base.join(item.text()?);
    let label = path.display().to_string();
    match load(&path, what) {
        Ok(text) => Ok((label, text)),
        Err(e) if e.line.is_none() => Err(item.error(e.message)),
        Err(e) => Err(InputError { file: Some(label), ..e }),
    }
}

/// Reads `columns`, whose values `allowed` describes, and hands each row and the byte where it starts to `row`. Lines
/// that start with `#` are skipped. A warning where other columns were ignored.
pub(super) fn read<const N: usize>(
    document: &Document<'_>,
    columns: [&str; N],
    allowed: fn(&str) -> &'static str,
    row: &mut dyn FnMut([f64; N], usize),
) -> Result<Option<String>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(document.text.as_bytes());
    let mut record = csv::StringRecord::new();
    let mut next = |record: &mut csv::StringRecord| {
        reader
            .read_record(record)
            .map_err(|e| InputError::new(format!("this is no CSV file: {e}")).at(document.file, None))
    };

    if !next(&mut record)? {
        let error = document.error(None, "this file is empty; its first line must name the columns");
        return Err(error.allowed(columns.join(",")));
    }
    let names: Vec<String> = record.iter().map(str::to_owned).collect();
    let places = places(&columns, &names).map_err(|e| e.on(document, &record))?;
    let ignored: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| !columns.contains(name)).collect();

    while next(&mut record)? {
        if record.len() != names.len() {
            let message =
                format!("this line has {} fields, but the header has {}", record.len(), names.len());
            let fault = Fault { column: names.get(record.len()).cloned(), message, ..Fault::default() };
            return Err(fault.on(document, &record));
        }
        let mut values = [0.0; N];
        for ((value, &place), column) in values.iter_mut().zip(&places).zip(columns) {
            *value = number(&record[place], column, allowed(column)).map_err(|e| e.on(document, &record))?;
        }
        row(values, record.position().map_or(0, |p| p.byte() as usize));
    }
    let warning = || format!("{}: ignored columns {}", document.file, ignored.join(", "));
    Ok((!ignored.is_empty()).then(warning))
}

/// What is wrong in a line, before its place is known.
#[derive(Debug, Default)]
struct Fault {
    column: Option<String>,
    value: Option<String>,
    message: String,
    allowed: Option<String>,
}

impl Fault {
    /// The error, at the line of `record`.
    fn on(self, document: &Document<'_>, record: &csv::StringRecord) -> InputError {
        let start = record.position().map_or(0, |p| p.byte() as usize);
        let span = line_span(document.text, start);
        let value = self.value.unwrap_or_else(|| document.excerpt(span.clone()));
        let error = document.error(Some(span), self.message);
        InputError { key: self.column, value: Some(value), allowed: self.allowed, ..error }
    }
}

/// The first line at or after byte `start` that is neither blank nor a comment.
pub(super) fn line_span(text: &str, start: usize) -> std::ops::Range<usize> {
    let mut begin = start;
    for line in text.get(start..).unwrap_or_default().split_inclusive('\n') {
        let content = line.trim_end_matches(['\r', '\n']);
        if !content.is_empty() && !content.starts_with('#') {
            return begin..begin + content.len();
        }
        begin += line.len();
    }
    begin..begin
}

/// Place of each column in the header.
fn places<const N: usize>(columns: &[&str; N], names: &[String]) -> std::result::Result<[usize; N], Fault> {
    let mut places = [0; N];
    for (place, &column) in places.iter_mut().zip(columns) {
        let mut found = names.iter().enumerate().filter(|(_, name)| *name == column).map(|(i, _)| i);
        let fault = |message: String| Fault {
            column: Some(column.to_owned()),
            message,
            allowed: Some(format!("each of {} once, in any order", columns.join(", "))),
            ..Fault::default()
        };
        *place = found.next().ok_or_else(|| {
            let extra: Vec<&str> =
                names.iter().map(String::as_str).filter(|name| !columns.contains(name)).collect();
            let similar = schema::nearest(column, &extra).map(|name| format!("; is {name} meant?"));
            fault(format!("column {column} is missing{}", similar.unwrap_or_default()))
        })?;
        if found.next().is_some() {
            return Err(fault(format!("column {column} appears twice")));
        }
    }
    Ok(places)
}

/// A finite number of `column`.
fn number(field: &str, column: &str, allowed: &str) -> std::result::Result<f64, Fault> {
    match field.parse() {
        Ok(value) if f64::is_finite(value) => Ok(value),
        _ => Err(Fault {
            column: Some(column.to_owned()),
            value: Some(if field.is_empty() { "(empty)".to_owned() } else { field.to_owned() }),
            message: "this is not a finite number".to_owned(),
            allowed: Some(allowed.to_owned()),
        }),
    }
}
