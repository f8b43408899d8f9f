//! CSV files that a spec names: a header with known columns, then rows of finite numbers, separated and with decimals as in data files.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::check::MOST;
use super::reader::{Document, Item, Result};
use crate::error::InputError;
use crate::measure::text::{Decimals, separator};
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
    /// All.
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
        Trouble::Line(fault, record) => fault.on(document, &record),
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
    Line(Fault, csv::StringRecord),
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
            Self::Line(fault, _) => fault.at(file, None, String::new()),
        }
    }

    /// The error in the file at `path`, of which no text is held: the line at fault is looked up.
    pub fn in_file<const N: usize>(self, path: &Path, columns: Columns<'_, N>) -> InputError {
        let label = path.display().to_string();
        match self {
            Self::Line(fault, record) => {
                let start = record.position().map_or(0, csv::Position::byte);
                match line_at(path, start) {
                    Ok((line, text)) => fault.at(&label, Some(line), text),
                    Err(_) => fault.at(&label, None, String::new()),
                }
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
    let places = places(&columns, &names).map_err(|e| Trouble::Line(e, record.clone()))?;
    let ignored = names.iter().filter(|name| !columns.names.contains(&name.as_str())).cloned().collect();

    while reader.read_record(&mut record).map_err(Trouble::Csv)? {
        if record.len() != names.len() {
            let message =
                format!("this line has {} fields, but the header has {}", record.len(), names.len());
            let fault = Fault { column: names.get(record.len()).cloned(), message, ..Fault::default() };
            return Err(Trouble::Line(fault, record));
        }
        let mut values = [0.0; N];
        for ((value, place), column) in values.iter_mut().zip(places).zip(columns.names) {
            let Some(place) = place else { continue };
            *value = number(&record[place], &mut decimals, column, allowed(column))
                .map_err(|e| Trouble::Line(e, record.clone()))?;
        }
        row(values, record.position().map_or(0, |p| p.byte() as usize));
    }
    Ok(Header { places, ignored })
}

/// What is wrong in a line, before its place is known.
#[derive(Debug, Default)]
pub(super) struct Fault {
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

    /// The error, at a `line` with this `text`.
    fn at(self, file: &str, line: Option<usize>, text: String) -> InputError {
        let error = InputError::new(self.message).value(self.value.unwrap_or(text)).at(file, line);
        InputError { key: self.column, allowed: self.allowed, ..error }
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
fn places<const N: usize>(
    columns: &Columns<'_, N>,
    names: &[String],
) -> std::result::Result<[Option<usize>; N], Fault> {
    let mut places = [None; N];
    for (place, column) in places.iter_mut().zip(columns.names) {
        let mut found = names.iter().enumerate().filter(|(_, name)| *name == column).map(|(i, _)| i);
        let fault = |message: String| Fault {
            column: Some(column.to_owned()),
            message,
            allowed: Some(format!("each of {} once, in any order", columns.required(", "))),
            ..Fault::default()
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

/// A finite number of `column`.
fn number(
    field: &str,
    decimals: &mut Decimals,
    column: &str,
    allowed: &str,
) -> std::result::Result<f64, Fault> {
    let message = match decimals.number(field) {
        Some(value) if value.abs() <= MOST => return Ok(value),
        Some(value) if value.is_finite() => "no quantity of a whisker is this large",
        None if decimals.refuses(field) => decimals.wrong(field),
        _ => "this is not a finite number",
    };
    Err(Fault {
        column: Some(column.to_owned()),
        value: Some(if field.is_empty() { "(empty)".to_owned() } else { field.to_owned() }),
        message: message.to_owned(),
        allowed: Some(allowed.to_owned()),
    })
}
