//! Tables that the program made, read back as [`Frame`]s: CSV, or Parquet.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::heading::{Kind, fact};
use super::parquet;
use super::text_file::{Limit, TextFile, refused};
use crate::error::{Error, InputError};
use crate::{Frame, Values};

/// Largest number of rows read into memory.
pub const MOST_ROWS: usize = 5_000_000;

fn too_long(file: &str) -> InputError {
    let error = InputError::new(format!("the table has more than {MOST_ROWS} rows")).at(file, None);
    error.allowed("fewer: a sweep with `[output] top = N` keeps the best")
}

/// Reads CSV text; `file` is its name in errors. Errors: empty or unreadable text, an incomplete last row, or more than [`MOST_ROWS`] rows.
pub fn csv(file: &str, text: impl Read) -> Result<Frame, InputError> {
    let mut reader = csv::ReaderBuilder::new().buffer_capacity(1 << 20).from_reader(text);
    let header = reader.headers().map_err(|e| unread(file, e, "this is not a table"))?.clone();
    if header.is_empty() || header.iter().all(str::is_empty) {
        return Err(InputError::new("the table is empty: it has no header").at(file, None));
    }
    // Counts are read as numbers. The type of an unknown column is decided after its last row.
    let is_word = |name| fact(name).is_none_or(|fact| fact.kind == Kind::Word);
    let kind = |name| if is_word(name) { Kind::Word } else { Kind::Number };
    let mut columns: Vec<Values> = header.iter().map(|name| Values::new(kind(name))).collect();
    let mut bad: Vec<(usize, usize, String)> = Vec::new();
    let (mut record, mut rows) = (csv::StringRecord::new(), 0);
    while reader.read_record(&mut record).map_err(|e| damaged(file, e))? {
        if rows == MOST_ROWS {
            return Err(too_long(file));
        }
        rows += 1;
        for (at, (column, field)) in columns.iter_mut().zip(&record).enumerate() {
            match column {
                Values::Words(words) => words.push(field),
                Values::Numbers(numbers) => {
                    let parsed = field.parse::<f64>();
                    if parsed.is_err() && !field.is_empty() && bad.iter().all(|(column, ..)| *column != at) {
                        let line = record.position().map_or(0, |p| p.line() as usize);
                        bad.push((at, line, field.to_owned()));
                    }
                    numbers.push(parsed.ok().filter(|x| x.is_finite()).unwrap_or(f64::NAN));
                }
                Values::Counts(_) => {}
            }
        }
    }
    for (column, name) in columns.iter_mut().zip(&header) {
        if let (Values::Words(words), None) = (&mut *column, fact(name)) {
            *column = std::mem::take(words).typed();
        }
    }
    let names = header.iter().map(|name| Cow::Owned(name.to_owned())).collect();
    Ok(Frame { file: file.to_owned(), names, columns, bad })
}

fn damaged(file: &str, e: csv::Error) -> InputError {
    let why = match e.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let fields = format!("this row has {len} fields, the header {expected_len}");
            format!("{fields}: the table is damaged or was not written to its end")
        }
        csv::ErrorKind::Utf8 { .. } => "this row is not UTF-8: the table is damaged".to_owned(),
        _ => return unread(file, e, "the table cannot be read"),
    };
    InputError::new(why).at(file, e.position().map(|p| p.line() as usize))
}

fn unread(file: &str, e: csv::Error, why: &str) -> InputError {
    let line = e.position().map(|p| p.line() as usize);
    let (why, io) = (format!("{why}: {e}"), e.is_io_error());
    let damaged = || InputError::new(why).at(file, line.filter(|_| !io));
    match e.into_kind() {
        csv::ErrorKind::Io(e) => refused(e).unwrap_or_else(|_| damaged()),
        _ => damaged(),
    }
}

/// Reads the table at `path`: Parquet if the name ends so, else CSV.
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
