//! CSV files that a spec names: a header with known columns, then rows of finite numbers, separated and with decimals as in data files.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::reader::{Document, Item, Result};
use crate::design::MOST;
use crate::error::InputError;
use crate::fields::{Decimals, separator};
use crate::sink::frame::Frame;
use crate::sink::lab::{LabCell, LabRow};
use crate::text_file::{LINE, Limit, TextFile, refused};

/// Name and text of the file that `item` names, relative to `base`; `what` says what the file is.
pub(super) fn open(item: &Item<'_>, base: &Path, what: &str, limit: Limit) -> Result<(String, String)> {
    let path = base.join(item.text()?);
    let text = TextFile::open(&path, what, limit).and_then(TextFile::text).map_err(|e| named(item, e))?;
    Ok((path.display().to_string(), text))
}

/// What is wrong with the file that `item` names: of its lines, or of the file as a whole, where `item` stands.
pub(super) fn named(item: &Item<'_>, error: InputError) -> InputError {
    if error.line.is_some() {
        return error;
    }
    InputError { allowed: error.allowed, ..item.error(error.message) }
}

/// Columns of a table by name, each with a value for each row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a, const N: usize> {
    pub names: [&'a str; N],
    /// Those that a table may lack: zero in all of its rows.
    pub spare: &'a [&'a str],
}

impl<'a, const N: usize> Columns<'a, N> {
    /// None of which a table may lack.
    pub fn all(names: [&'a str; N]) -> Self {
        Self { names, spare: &[] }
    }

    /// Those that a table must have, separated.
    fn required(&self, separator: &str) -> String {
        let required: Vec<&str> = self.names.into_iter().filter(|name| !self.spare.contains(name)).collect();
        required.join(separator)
    }
}

/// Reads `columns`, whose values `allowed` describes, and hands each row and the byte where it starts to `row`. Lines
/// that start with `#` are skipped. What its first line says.
pub(super) fn read<const N: usize>(
    document: &Document<'_>,
    columns: Columns<'_, N>,
    allowed: fn(&str) -> &'static str,
    row: &mut dyn FnMut([f64; N], usize),
) -> Result<Header<N>> {
    let header = document.text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#'));
    let reader = separated(document.text.as_bytes(), separator(header.unwrap_or_default()));
    scan(reader, columns, allowed, row).map_err(|trouble| match trouble {
        Trouble::Line(InputError { key, value, allowed, message, .. }, start) => {
            let span = line_span(document.text, start as usize);
            let value = value.or_else(|| Some(document.excerpt(span.clone())));
            InputError { key, value, allowed, ..document.error(Some(span), message) }
        }
        other => other.of_file(document.file, columns),
    })
}

/// Records of a text whose fields have `separator` between them.
pub(super) fn separated<R: Read>(text: R, separator: char) -> csv::Reader<R> {
    let mut reader = csv::ReaderBuilder::new();
    reader.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
    reader.delimiter(separator as u8).from_reader(text)
}

/// What the first line of a table says.
pub(super) struct Header<const N: usize> {
    /// Places of the columns asked for.
    pub places: [Option<usize>; N],
    ignored: Vec<String>,
}

impl<const N: usize> Header<N> {
    /// That columns of `file` were ignored, if some were.
    pub fn warning(&self, file: &str) -> Option<String> {
        let ignored = self.ignored.join(", ");
        (!ignored.is_empty()).then(|| format!("{file}: ignored columns {ignored}"))
    }
}

/// Why a table cannot be read.
pub(super) enum Trouble {
    Csv(csv::Error),
    Empty,
    /// What is wrong in the line at or after a byte, without its place.
    Line(InputError, u64),
}

impl Trouble {
    /// The error, of the `file` as a whole.
    fn of_file<const N: usize>(self, file: &str, columns: Columns<'_, N>) -> InputError {
        match self {
            Self::Csv(e) => {
                let why = format!("this is not a CSV file: {e}");
                let refusal = match e.into_kind() {
                    csv::ErrorKind::Io(e) => refused(e).ok(),
                    _ => None,
                };
                refusal.unwrap_or_else(|| InputError::new(why).at(file, None))
            }
            Self::Empty => {
                let error = InputError::new("this file is empty; its first line must name the columns");
                error.at(file, None).allowed(columns.required(","))
            }
            Self::Line(error, _) => error.at(file, None),
        }
    }

    /// The error in the file at `path`, of which no text is held: the line at fault is looked up.
    pub fn in_file<const N: usize>(self, path: &Path, columns: Columns<'_, N>) -> InputError {
        let label = path.display().to_string();
        match self {
            Self::Line(error, start) => {
                let (line, text) =
                    line_at(path, start).map_or((None, String::new()), |(n, text)| (Some(n), text));
                InputError { value: error.value.or(Some(text)), ..error }.at(label, line)
            }
            other => other.of_file(&label, columns),
        }
    }
}

/// Number and text of the first line at or after byte `start` that is neither blank nor a comment.
pub(super) fn line_at(path: &Path, start: u64) -> std::io::Result<(usize, String)> {
    let mut reader = BufReader::new(File::open(path)?);
    let (mut line, mut text) = (1, Vec::new());
    let mut before = (&mut reader).take(start);
    loop {
        let block = before.fill_buf()?;
        line += block.iter().filter(|b| **b == b'\n').count();
        match block.len() {
            0 => break,
            n => before.consume(n),
        }
    }
    loop {
        text.clear();
        let read = (&mut reader).take(LINE as u64).read_until(b'\n', &mut text)?;
        let content = String::from_utf8_lossy(text.trim_ascii_end());
        if read == 0 || !content.is_empty() && !content.starts_with('#') {
            return Ok((line, content.into_owned()));
        }
        line += 1;
    }
}

/// As [`read`], from any reader; the text need not be held.
pub(super) fn scan<const N: usize>(
    mut reader: csv::Reader<impl Read>,
    columns: Columns<'_, N>,
    allowed: fn(&str) -> &'static str,
    row: &mut dyn FnMut([f64; N], usize),
) -> std::result::Result<Header<N>, Trouble> {
    let mut decimals = Decimals::default();
    let mut record = csv::StringRecord::new();
    if !reader.read_record(&mut record).map_err(Trouble::Csv)? {
        return Err(Trouble::Empty);
    }
    let names: Vec<String> = record.iter().map(str::to_owned).collect();
    let start = |record: &csv::StringRecord| record.position().map_or(0, csv::Position::byte);
    let places = places(&columns, &names).map_err(|e| Trouble::Line(e, start(&record)))?;
    let ignored = names.iter().filter(|name| !columns.names.contains(&name.as_str())).cloned().collect();

    while reader.read_record(&mut record).map_err(Trouble::Csv)? {
        if record.len() != names.len() {
            let message =
                format!("this line has {} fields, but the header has {}", record.len(), names.len());
            let error = InputError { key: names.get(record.len()).cloned(), ..InputError::new(message) };
            return Err(Trouble::Line(error, start(&record)));
        }
        let mut values = [0.0; N];
        for ((value, place), column) in values.iter_mut().zip(places).zip(columns.names) {
            let Some(place) = place else { continue };
            let cell = LabCell::Text(record[place].into());
            *value = number(&cell, &mut decimals, column, allowed(column))
                .map_err(|e| Trouble::Line(e, start(&record)))?;
        }
        row(values, start(&record) as usize);
    }
    Ok(Header { places, ignored })
}

/// As [`read`], of a table in memory; a row is handed on with its place, from 0.
///
/// # Errors
/// A column that is missing or twice there; a field that is no number, whose row the value says.
pub(super) fn of_frame<const N: usize>(
    frame: &Frame,
    columns: Columns<'_, N>,
    allowed: fn(&str) -> &'static str,
    row: &mut dyn FnMut([f64; N], usize),
) -> Result<Header<N>> {
    let names: Vec<String> = frame.names.iter().map(|name| name.to_string()).collect();
    let places = places(&columns, &names).map_err(|e| e.value(names.join(",")))?;
    let ignored = names.iter().filter(|name| !columns.names.contains(&name.as_str())).cloned().collect();
    let mut decimals = Decimals::default();
    for at in 0..frame.len() {
        let (cells, mut values) = (LabRow::Of(frame, at).cells(','), [0.0; N]);
        for ((value, place), column) in values.iter_mut().zip(places).zip(columns.names) {
            let Some(place) = place else { continue };
            let in_row = |e: InputError| {
                let value = format!("{} in row {at}", e.value.as_deref().unwrap_or_default());
                e.value(value)
            };
            *value = number(&cells[place], &mut decimals, column, allowed(column)).map_err(in_row)?;
        }
        row(values, at);
    }
    Ok(Header { places, ignored })
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
fn places<const N: usize>(columns: &Columns<'_, N>, names: &[String]) -> Result<[Option<usize>; N]> {
    let mut places = [None; N];
    for (place, column) in places.iter_mut().zip(columns.names) {
        let mut found = names.iter().enumerate().filter(|(_, name)| *name == column).map(|(i, _)| i);
        let fault = |message: String| {
            let allowed = format!("each of {} once, in any order", columns.required(", "));
            InputError::new(message).key(column).allowed(allowed)
        };
        *place = found.next();
        if place.is_none() && !columns.spare.contains(&column) {
            let extra: Vec<&str> =
                names.iter().map(String::as_str).filter(|name| !columns.names.contains(name)).collect();
            let similar = crate::error::nearest(column, &extra).map(|name| format!("; is {name} meant?"));
            return Err(fault(format!("column {column} is missing{}", similar.unwrap_or_default())));
        }
        if found.next().is_some() {
            return Err(fault(format!("column {column} appears twice")));
        }
    }
    Ok(places)
}

fn number(field: &LabCell<'_>, decimals: &mut Decimals, column: &str, allowed: &str) -> Result<f64> {
    let message = match decimals.number(field) {
        Some(value) if value.abs() <= MOST => return Ok(value),
        Some(value) if value.is_finite() => "no quantity of a whisker is this large",
        None if decimals.refuses(field) => decimals.wrong(field),
        _ => "this is not a finite number",
    };
    let value = if field.is_empty() { "(empty)".into() } else { field.text() };
    Err(InputError::new(message).key(column).value(value).allowed(allowed))
}
