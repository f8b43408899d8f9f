//! CSV files of a spec: a header with known columns, then rows of finite numbers, separated and with decimals as in data files.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{Document, Item, Result};
use crate::design::MOST;
use crate::error::{InputError, nearest};
use crate::fields::{Decimals, separator};
use crate::sink::{Frame, LabCell, LabRow};
use crate::text_file::{LINE, Limit, TextFile, refused};

pub(super) fn open(item: &Item<'_>, base: &Path, what: &str, limit: Limit) -> Result<(String, String)> {
    let path = base.join(item.text()?);
    let text = TextFile::open(&path, what, limit).and_then(|mut file| file.text());
    Ok((path.display().to_string(), text.map_err(|e| named(item, e))?))
}

/// Keeps the place of an error in a line of the file that `item` names; else places it at `item`.
pub(super) fn named(item: &Item<'_>, error: InputError) -> InputError {
    if error.line.is_some() {
        return error;
    }
    InputError { allowed: error.allowed, ..item.error(error.message) }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a> {
    pub names: &'a [&'a str],
    /// Columns that may be missing; their values are then 0.
    pub spare: &'a [&'a str],
    pub allowed: fn(&str) -> &'static str,
}

impl<'a> Columns<'a> {
    pub const fn all(names: &'a [&'a str], allowed: fn(&str) -> &'static str) -> Self {
        Self { names, spare: &[], allowed }
    }

    fn required(&self, separator: &str) -> String {
        let required = self.names.iter().copied().filter(|name| !self.spare.contains(name));
        required.collect::<Vec<_>>().join(separator)
    }
}

/// A table. The place of a row is the byte where it starts or, in memory, its number from 0.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    Text(Document<'a>),
    File(&'a Path),
    Memory,
}

impl Source<'_> {
    pub fn placed(&self, error: InputError, place: usize) -> InputError {
        match self {
            Self::Text(document) => {
                let InputError { key, value, allowed, message, .. } = error;
                let span = line_span(document.text, place);
                let value = value.or_else(|| Some(document.excerpt(span.clone())));
                InputError { key, value, allowed, ..document.error(Some(span), message) }
            }
            // Read again up to this line: while its rows were read, it was not held.
            Self::File(path) => {
                let (mut bytes, most) = (Vec::new(), (place + LINE) as u64);
                let _ = File::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes));
                let (file, text) = (path.display().to_string(), String::from_utf8_lossy(&bytes));
                Source::Text(Document { file: &file, text: &text }).placed(error, place)
            }
            Self::Memory => {
                let value = format!("{} in row {place}", error.value.as_deref().unwrap_or_default());
                error.value(value)
            }
        }
    }

    pub fn whole(&self, error: InputError) -> InputError {
        match self {
            Self::Text(document) => error.at(document.file, None),
            Self::File(path) => error.at(path.display().to_string(), None),
            Self::Memory => error,
        }
    }

    pub fn words(&self, place: usize) -> String {
        match self {
            Self::Text(document) => format!("line {}", document.line(line_span(document.text, place).start)),
            _ => format!("row {place}"),
        }
    }
}

/// Rows of numbers, each with its place.
pub(super) type Rows<const N: usize> = Vec<([f64; N], usize)>;

/// The N `columns` of a text, in rows with their places; skips lines that start with `#`.
pub(super) fn read<'a, const N: usize>(
    document: Document<'_>,
    columns: Columns<'a>,
) -> Result<(Rows<N>, Header<'a>)> {
    let (mut rows, text) = (Vec::new(), document.text);
    let header = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#')).unwrap_or_default();
    let mut row = |row: &[f64], at| rows.push((std::array::from_fn(|k| row[k]), at));
    let header = scan(Source::Text(document), (text.as_bytes(), separator(header)), columns, &mut row)?;
    Ok((rows, header))
}

/// Gives each row of any reader of a text with fields between `separator`, with its place, to `row`; `source` places errors.
pub(super) fn scan<'a>(
    source: Source<'_>,
    (text, separator): (impl Read, char),
    columns: Columns<'a>,
    row: &mut dyn FnMut(&[f64], usize),
) -> Result<Header<'a>> {
    let failed = |e: csv::Error| {
        let why = format!("this is not a CSV file: {e}");
        let refusal = match e.into_kind() {
            csv::ErrorKind::Io(e) => refused(e).ok(),
            _ => None,
        };
        refusal.unwrap_or_else(|| source.whole(InputError::new(why)))
    };
    let mut reader = csv::ReaderBuilder::new();
    reader.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
    let mut reader = reader.delimiter(separator as u8).from_reader(text);
    let mut record = csv::StringRecord::new();
    if !reader.read_record(&mut record).map_err(failed)? {
        let error = InputError::new("this file is empty; its first line must name the columns");
        return Err(source.whole(error).allowed(columns.required(",")));
    }
    let names: Vec<String> = record.iter().map(str::to_owned).collect();
    let start = |record: &csv::StringRecord| record.position().map_or(0, csv::Position::byte) as usize;
    let mut header = Header::new(columns, &names).map_err(|e| source.placed(e, start(&record)))?;
    while reader.read_record(&mut record).map_err(failed)? {
        if record.len() != names.len() {
            let message =
                format!("this line has {} fields, but the header has {}", record.len(), names.len());
            let error = InputError { key: names.get(record.len()).cloned(), ..InputError::new(message) };
            return Err(source.placed(error, start(&record)));
        }
        let values = header.row(|place| LabCell::Text(record[place].into()));
        row(values.map_err(|e| source.placed(e, start(&record)))?, start(&record));
    }
    Ok(header)
}

pub(super) fn of_frame<'a>(
    frame: &Frame,
    columns: Columns<'a>,
    row: &mut dyn FnMut(&[f64], usize),
) -> Result<Header<'a>> {
    let names: Vec<String> = frame.names.iter().map(|name| name.to_string()).collect();
    let mut header = Header::new(columns, &names).map_err(|e| e.value(names.join(",")))?;
    for at in 0..frame.len() {
        let cells = LabRow::Of(frame, at).cells(',');
        let values = header.row(|place| cells[place].clone());
        row(values.map_err(|e| Source::Memory.placed(e, at))?, at);
    }
    Ok(header)
}

pub(super) struct Header<'a> {
    columns: Columns<'a>,
    pub places: Vec<Option<usize>>,
    values: Vec<f64>,
    ignored: Vec<String>,
    decimals: Decimals,
}

impl<'a> Header<'a> {
    fn new(columns: Columns<'a>, names: &[String]) -> Result<Self> {
        let mut places = vec![None; columns.names.len()];
        let is_other = |name: &&String| !columns.names.contains(&name.as_str());
        let ignored: Vec<String> = names.iter().filter(is_other).cloned().collect();
        for (place, &column) in places.iter_mut().zip(columns.names) {
            let mut found = names.iter().enumerate().filter(|(_, name)| *name == column).map(|(i, _)| i);
            *place = found.next();
            let message = if place.is_none() && !columns.spare.contains(&column) {
                let extra: Vec<&str> = ignored.iter().map(|name| name.as_str()).collect();
                let similar = nearest(column, &extra).map(|name| format!("; is {name} meant?"));
                format!("column {column} is missing{}", similar.unwrap_or_default())
            } else if found.next().is_some() {
                format!("column {column} appears twice")
            } else {
                continue;
            };
            let allowed = format!("each of {} once, in any order", columns.required(", "));
            return Err(InputError::new(message).key(column).allowed(allowed));
        }
        let (values, decimals) = (vec![0.0; places.len()], Decimals::default());
        Ok(Self { columns, places, values, ignored, decimals })
    }

    /// The numbers of a row; 0 for missing columns.
    fn row<'c>(&mut self, cell: impl Fn(usize) -> LabCell<'c>) -> Result<&[f64]> {
        for ((value, place), column) in self.values.iter_mut().zip(&self.places).zip(self.columns.names) {
            let Some(place) = *place else { continue };
            *value = number(&cell(place), &mut self.decimals, column, (self.columns.allowed)(column))?;
        }
        Ok(&self.values)
    }

    pub fn warning(&self, file: &str) -> Option<String> {
        let ignored = self.ignored.join(", ");
        (!ignored.is_empty()).then(|| format!("{file}: ignored columns {ignored}"))
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
