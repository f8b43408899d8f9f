//! A table of named columns, each of one type: output of commands, contents of files, and tables for Python.

use std::borrow::Cow;
use std::ops::Range;

use super::heading::kind;
use super::values::{Field, Values};
use crate::error::{Error, InputError};

const BUFFER: usize = 1 << 13;

/// Named columns of equal length.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Its file, as shown to the user.
    pub file: String,
    /// Column names.
    pub names: Vec<Cow<'static, str>>,
    /// Column values.
    pub columns: Vec<Values>,
    /// Column, line and text of the first non-numeric field of each column of numbers.
    pub(super) bad: Vec<(usize, usize, String)>,
}

impl Frame {
    /// An empty table; each column has the type that its name has in most tables.
    pub fn of(file: &str, names: impl IntoIterator<Item = impl Into<Cow<'static, str>>>) -> Self {
        let names: Vec<Cow<'static, str>> = names.into_iter().map(Into::into).collect();
        let columns = names.iter().map(|name| Values::new(kind(name))).collect();
        Self { file: file.to_owned(), names, columns, bad: Vec::new() }
    }

    /// Adds a column.
    pub fn add(&mut self, name: impl Into<Cow<'static, str>>, values: Values) {
        self.names.push(name.into());
        self.columns.push(values);
    }

    /// Reserves memory for `rows` rows.
    pub fn reserve(&mut self, rows: u64) -> Result<(), Error> {
        let large = || Error::Run(format!("a table of {rows} rows has no place in memory"));
        let n = usize::try_from(rows).map_err(|_| large())?;
        self.columns.iter_mut().try_for_each(|column| column.reserve(n)).map_err(|_| large())
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Values::len)
    }

    /// True before the first row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The same columns without rows.
    pub fn like(&self) -> Self {
        let columns = self.columns.iter().map(|values| Values::new(values.kind())).collect();
        Self { file: self.file.clone(), names: self.names.clone(), columns, bad: Vec::new() }
    }

    /// Appends one row.
    pub fn row(&mut self, fields: impl IntoIterator<Item = Field>) -> Result<(), Error> {
        let (mut fields, wide) = (fields.into_iter(), || Error::Run("a row of another width".into()));
        self.columns.iter_mut().try_for_each(|c| c.push(fields.next().ok_or_else(wide)?))?;
        fields.next().map_or(Ok(()), |_| Err(wide()))
    }

    /// Appends the rows `range` of `other`, which has the same columns.
    pub fn extend(&mut self, other: &Self, range: Range<usize>) -> Result<(), Error> {
        if self.columns.len() != other.columns.len() {
            return Err(Error::Run("rows of another width".into()));
        }
        self.columns.iter_mut().zip(&other.columns).try_for_each(|(a, b)| a.extend(b, range.clone()))
    }

    /// The whole table as CSV: UTF-8, LF, shortest round-trip numbers, empty where a value is missing.
    pub fn csv(&self) -> Result<Vec<u8>, Error> {
        Ok([self.header()?, self.lines()?].concat())
    }

    /// The header line of CSV.
    pub fn header(&self) -> Result<Vec<u8>, Error> {
        written(|text| text.write_record(self.names.iter().map(|name| name.as_bytes())))
    }

    /// The rows as lines of CSV.
    pub fn lines(&self) -> Result<Vec<u8>, Error> {
        let mut number = ryu::Buffer::new();
        written(|text| {
            for row in 0..self.len() {
                for column in &self.columns {
                    match column {
                        Values::Numbers(x) if x[row].is_finite() => {
                            let digits = number.format_finite(x[row]);
                            text.write_field(digits.strip_suffix(".0").unwrap_or(digits))?;
                        }
                        Values::Numbers(_) => text.write_field("")?,
                        Values::Counts(n) => text.write_field(n[row].to_string())?,
                        Values::Words(words) => text.write_field(words.at(row))?,
                    }
                }
                text.write_record(None::<&[u8]>)?;
            }
            Ok(())
        })
    }

    /// Index of the column `name`.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|one| one == name)
    }

    /// True if this column exists and has a number in it.
    pub fn has(&self, name: &str) -> bool {
        self.place(name).is_some_and(|i| match &self.columns[i] {
            Values::Numbers(x) => x.iter().any(|x| x.is_finite()),
            Values::Counts(n) => !n.is_empty(),
            Values::Words(_) => false,
        })
    }

    /// The first of `names` that is a column, if any.
    pub fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|n| self.place(n).is_some())
    }

    /// Like [`Self::first`]; an error if no column has one of these names.
    pub fn one_of(&self, names: &[&'static str]) -> Result<&'static str, InputError> {
        self.first(names).ok_or_else(|| self.lacks(names[0]))
    }

    fn lacks(&self, column: &str) -> InputError {
        let allowed =
            "a table as this version writes it: run its command again where an earlier one wrote it";
        let error = InputError::new("the table lacks this column").at(self.file.clone(), None);
        error.key(column).allowed(allowed)
    }

    /// A column of numbers; NaN is missing.
    pub fn numbers(&self, name: &str) -> Result<&[f64], InputError> {
        let place = self.place(name).ok_or_else(|| self.lacks(name))?;
        if let Some((_, line, text)) = self.bad.iter().find(|(column, ..)| *column == place) {
            return Err(self.damaged(name, *line, text));
        }
        match &self.columns[place] {
            Values::Numbers(numbers) => Ok(numbers),
            Values::Counts(_) => Err(self.lacks(name)),
            Values::Words(words) => {
                let is_bad = |(_, word): &(usize, &str)| !word.is_empty() && word.parse::<f64>().is_err();
                let rows = (2..).zip((0..words.codes.len()).map(|row| words.at(row)));
                let (line, word) = rows.clone().find(is_bad).or(rows.clone().next()).unwrap_or((2, ""));
                Err(self.damaged(name, line, word))
            }
        }
    }

    fn damaged(&self, name: &str, line: usize, text: &str) -> InputError {
        InputError::new("this is not a number").at(self.file.clone(), Some(line)).key(name).value(text)
    }

    /// A number; NaN if it or the column is missing.
    pub fn number(&self, name: &str, row: usize) -> f64 {
        match self.place(name).map(|i| &self.columns[i]) {
            Some(Values::Numbers(numbers)) => numbers[row],
            Some(Values::Counts(counts)) => counts[row] as f64,
            Some(Values::Words(words)) => words.at(row).parse().unwrap_or(f64::NAN),
            None => f64::NAN,
        }
    }

    /// A field as text; empty if the column does not exist.
    pub fn word(&self, name: &str, row: usize) -> String {
        match self.place(name).map(|i| &self.columns[i]) {
            Some(Values::Words(words)) => words.at(row).to_owned(),
            Some(Values::Numbers(numbers)) if numbers[row].is_finite() => numbers[row].to_string(),
            Some(Values::Counts(counts)) => counts[row].to_string(),
            _ => String::new(),
        }
    }

    /// Rows for which `keep` is true.
    pub fn rows(&self, keep: impl Fn(usize) -> bool) -> Vec<usize> {
        (0..self.len()).filter(|r| keep(*r)).collect()
    }

    /// A field as JSON; missing is null.
    pub fn json(&self, column: usize, row: usize) -> serde_json::Value {
        match &self.columns[column] {
            Values::Numbers(numbers) => numbers[row].into(),
            Values::Counts(counts) => counts[row].into(),
            Values::Words(words) => words.at(row).into(),
        }
    }
}

fn written(write: impl FnOnce(&mut csv::Writer<Vec<u8>>) -> csv::Result<()>) -> Result<Vec<u8>, Error> {
    let mut builder = csv::WriterBuilder::new();
    let builder = builder.buffer_capacity(BUFFER).terminator(csv::Terminator::Any(b'\n'));
    let mut text = builder.from_writer(vec![]);
    write(&mut text).map_err(|e| Error::Run(e.to_string()))?;
    text.into_inner().map_err(|e| Error::Run(e.to_string()))
}
