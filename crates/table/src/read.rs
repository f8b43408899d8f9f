//! Tables that the program made, read back as [`Frame`]s: CSV, or Parquet.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::fact::{Kind, fact};
use super::frame::Frame;
use super::parquet;
use super::text_file::{Limit, TextFile, refused};
use super::values::Values;
use crate::error::{Error, InputError};

/// Rows that are held in memory at most.
pub const MOST_ROWS: usize = 5_000_000;

/// Takes the fields of one column of CSV. What a column that is not known holds shows at its end.
struct Column {
    values: Values,
    bad: Option<(usize, String)>,
}

impl Column {
    fn new(name: &str) -> Self {
        // Counts are read as numbers, which all of them are.
        let kind = match fact(name).map(|fact| fact.kind) {
            None | Some(Kind::Word) => Kind::Word,
            Some(Kind::Number | Kind::Count) => Kind::Number,
        };
        Self { values: Values::new(kind), bad: None }
    }

    fn push(&mut self, field: &str, line: usize) {
        match (&mut self.values, field.parse::<f64>()) {
            (Values::Words(words), _) => words.push(field),
            (Values::Numbers(numbers), Ok(x)) if x.is_finite() => numbers.push(x),
            (Values::Numbers(numbers), parsed) => {
                numbers.push(f64::NAN);
                if parsed.is_err() && !field.is_empty() {
                    self.bad.get_or_insert_with(|| (line, field.to_owned()));
                }
            }
            (Values::Counts(_), _) => {}
        }
    }

    /// Its values in the column `name`.
    fn end(self, name: &str) -> Values {
        match self.values {
            Values::Words(words) if fact(name).is_none() => words.typed(),
            values => values,
        }
    }
}

/// The table `file` does not fit.
fn too_long(file: &str) -> InputError {
    InputError::new(format!("the table has more than {MOST_ROWS} rows"))
        .at(file, None)
        .allowed("fewer: a sweep with `[output] top = N` keeps the best")
}

/// Rows of CSV, some at a time.
pub struct Rows<R> {
    file: String,
    names: Vec<String>,
    reader: csv::Reader<R>,
    record: csv::StringRecord,
}

impl<R: Read> Rows<R> {
    /// Of the table `text`, which is called `file`.
    ///
    /// # Errors
    /// Text that is empty or cannot be read.
    pub fn new(file: &str, text: R) -> Result<Self, InputError> {
        let mut reader = csv::ReaderBuilder::new().buffer_capacity(1 << 20).from_reader(text);
        let header = reader.headers().map_err(|e| unread(file, e, "this is not a table"))?.clone();
        if header.is_empty() || header.iter().all(str::is_empty) {
            return Err(InputError::new("the table is empty: it has no header").at(file, None));
        }
        let names = header.iter().map(str::to_owned).collect();
        Ok(Self { file: file.to_owned(), names, reader, record: csv::StringRecord::new() })
    }

    /// The table without rows.
    pub fn empty(&self) -> Frame {
        self.frame(self.names.iter().map(|name| Column::new(name)).collect())
    }

    fn frame(&self, columns: Vec<Column>) -> Frame {
        let bad = |(i, column): (usize, &Column)| column.bad.clone().map(|(line, text)| (i, line, text));
        let bad = columns.iter().enumerate().filter_map(bad).collect();
        let columns = columns.into_iter().zip(&self.names).map(|(column, name)| column.end(name)).collect();
        let names = self.names.iter().map(|name| Cow::Owned(name.clone())).collect();
        Frame { file: self.file.clone(), names, columns, bad }
    }

    /// The next rows, at most so many; `None` after the last.
    ///
    /// # Errors
    /// Text that cannot be read or ends within a row.
    pub fn next(&mut self, most: usize) -> Result<Option<Frame>, InputError> {
        let mut columns: Vec<Column> = self.names.iter().map(|name| Column::new(name)).collect();
        let mut rows = 0;
        while rows < most && self.read()? {
            let line = self.record.position().map_or(0, |p| p.line() as usize);
            columns.iter_mut().zip(&self.record).for_each(|(column, field)| column.push(field, line));
            rows += 1;
        }
        Ok((rows > 0).then(|| self.frame(columns)))
    }

    /// Reads a row; false after the last.
    fn read(&mut self) -> Result<bool, InputError> {
        self.reader.read_record(&mut self.record).map_err(|e| {
            let why = match e.kind() {
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!(
                        "this row has {len} fields, the header {expected_len}: the table is damaged or was not written to its end"
                    )
                }
                csv::ErrorKind::Utf8 { .. } => "this row is not UTF-8: the table is damaged".to_owned(),
                _ => return unread(&self.file, e, "the table cannot be read"),
            };
            InputError::new(why).at(self.file.clone(), e.position().map(|p| p.line() as usize))
        })
    }

    /// What is read.
    pub fn into_inner(self) -> R {
        self.reader.into_inner()
    }
}

/// The error `e` of reading `file`.
fn unread(file: &str, e: csv::Error, why: &str) -> InputError {
    let line = e.position().map(|p| p.line() as usize);
    let (why, io) = (format!("{why}: {e}"), e.is_io_error());
    let damaged = || InputError::new(why).at(file, line.filter(|_| !io));
    match e.into_kind() {
        csv::ErrorKind::Io(e) => refused(e).unwrap_or_else(|_| damaged()),
        _ => damaged(),
    }
}

/// Reads all of the CSV that is called `file`.
///
/// # Errors
/// As [`Rows`]; more than [`MOST_ROWS`] rows.
pub fn csv(file: &str, text: impl Read) -> Result<Frame, InputError> {
    let mut rows = Rows::new(file, text)?;
    let all = rows.next(MOST_ROWS)?.unwrap_or_else(|| rows.empty());
    match rows.next(1)? {
        Some(_) => Err(too_long(file)),
        None => Ok(all),
    }
}

/// Reads the table in `file`, which is at `path` and is CSV or, as its name says, Parquet.
pub fn table(path: &Path, file: File) -> Result<Frame, Error> {
    let name = path.display().to_string();
    if path.extension().is_none_or(|ending| ending != "parquet") {
        return Ok(csv(&name, TextFile::new(file, &name, "table", Limit::Lines))?);
    }
    let mut reader = parquet::Reader::new(path, file)?;
    let mut all = reader.frame();
    while let Some(group) = reader.next_group()? {
        if all.len() + group.len() > MOST_ROWS {
            return Err(too_long(&name).into());
        }
        all.extend(&group, 0..group.len())?;
    }
    Ok(all)
}
