//! Rows as a lab records them: lines of text, or rows of a table in memory.

use std::borrow::Cow;
use std::fmt;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::io::{BufReader, Read};

use super::fields::{fields, number, plain, separator};
use super::heading::Kind;
use crate::error::Error;
use crate::{Field, Frame, Values, hash};

/// A source of rows.
#[derive(Debug, Clone, Copy)]
pub enum LabTable<'a, R = &'a [u8]> {
    /// The text of a file or a stream.
    Text(R),
    /// A table in memory. Its header counts as line 1; rows start at line 2.
    Frame(&'a Frame),
}

/// A source whose text is read step by step.
pub type LabStream<'a> = LabTable<'a, BufReader<Box<dyn Read + 'a>>>;

impl<'a> LabStream<'a> {
    /// Text read from `input`.
    pub fn of(input: impl Read + 'a) -> Self {
        Self::Text(BufReader::with_capacity(1 << 16, Box::new(input)))
    }
}

impl<'a> From<LabTable<'a>> for LabStream<'a> {
    fn from(table: LabTable<'a>) -> Self {
        match table {
            LabTable::Text(bytes) => Self::of(bytes),
            LabTable::Frame(frame) => Self::Frame(frame),
        }
    }
}

impl LabTable<'_> {
    /// SHA-256 of the text; for a table in memory, of its CSV.
    pub fn hash(self) -> Result<String, Error> {
        Ok(match self {
            Self::Text(bytes) => hash(bytes),
            Self::Frame(frame) => hash(&frame.csv()?),
        })
    }
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub enum LabRow<'a> {
    /// A line of text.
    Line(&'a str),
    /// A row of a table.
    Of(&'a Frame, usize),
}

impl<'a> LabRow<'a> {
    /// The separator of its fields.
    pub fn separator(self) -> char {
        if let Self::Line(line) = self { separator(line) } else { ',' }
    }

    /// The fields; in a line they are separated by `separator`.
    pub fn cells(self, separator: char) -> Vec<LabCell<'a>> {
        match self {
            Self::Line(line) => fields(line, separator).into_iter().map(LabCell::Text).collect(),
            Self::Of(frame, row) => frame.columns.iter().map(|values| LabCell::of(values, row)).collect(),
        }
    }

    /// A 64-bit hash of the row.
    pub fn fingerprint(self) -> u64 {
        BuildHasherDefault::<DefaultHasher>::default().hash_one(self.to_string())
    }

    /// True for a line of white space only.
    pub fn is_blank(self) -> bool {
        matches!(self, Self::Line(line) if line.trim().is_empty())
    }
}

impl fmt::Display for LabRow<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cells = |row: &Self| row.cells(',').iter().map(LabCell::text).collect::<Vec<_>>().join(",");
        if let Self::Line(line) = self { f.write_str(line) } else { f.write_str(&cells(self)) }
    }
}

/// One field of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum LabCell<'a> {
    /// Text, trimmed.
    Text(Cow<'a, str>),
    /// A number of a table in memory; NaN is missing.
    Number(f64),
}

impl<'a> LabCell<'a> {
    /// A field without text.
    pub const EMPTY: Self = Self::Text(Cow::Borrowed(""));

    fn of(values: &'a Values, row: usize) -> Self {
        match values {
            Values::Numbers(x) => Self::Number(x[row]),
            Values::Counts(n) => Self::Number(n[row] as f64),
            Values::Words(words) => Self::Text(words.at(row).trim().into()),
        }
    }

    /// Its value as text.
    pub fn text(&self) -> Cow<'_, str> {
        match self {
            Self::Text(text) => Cow::Borrowed(text),
            Self::Number(x) if x.is_nan() => Cow::Borrowed(""),
            Self::Number(x) => plain(*x).into(),
        }
    }

    /// Its value as a number; NaN if missing or not finite; `None` for words.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Text(text) => number(text),
            Self::Number(x) => Some(if x.is_finite() { *x } else { f64::NAN }),
        }
    }

    /// True for empty text or NaN.
    pub fn is_empty(&self) -> bool {
        self.text().is_empty()
    }

    /// The same field, owning its text.
    pub fn into_owned(self) -> LabCell<'static> {
        match self {
            Self::Text(text) => LabCell::Text(text.into_owned().into()),
            Self::Number(x) => LabCell::Number(x),
        }
    }

    /// Converts to a field for a column of this `kind`; text gets a decimal point.
    pub fn field(&self, kind: Kind) -> Field {
        match self {
            Self::Number(x) if kind == Kind::Number => Field::Number(*x),
            Self::Text(text) if text.contains(',') && self.number().is_some_and(f64::is_finite) => {
                text.replacen(',', ".", 1).into()
            }
            _ => self.text().into_owned().into(),
        }
    }
}
