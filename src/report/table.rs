//! A table of a result, read back: columns of numbers or of words.

use std::collections::HashMap;
use std::path::Path;

use crate::error::{Error, InputError};
use crate::sink::columns::{self, Columns};
use crate::sink::folder::open_of_result;
use crate::sink::parquet;
use crate::text_file::{Limit, TextFile, refused};

/// Rows that are held in memory at most.
pub const MOST_ROWS: usize = 5_000_000;

/// A column.
#[derive(Debug, Clone)]
enum Values {
    /// NaN where a field is empty; and the first field that is no number: its line and text.
    Numbers(Vec<f64>, Option<(usize, String)>),
    /// Places in a list of words.
    Words(Vec<u32>, Vec<String>),
}

/// A table of a result.
#[derive(Debug, Clone)]
pub struct Table {
    /// File, as named to the user.
    pub file: String,
    /// Header.
    pub columns: Vec<String>,
    values: Vec<Values>,
    /// Rows.
    pub len: usize,
}

/// Takes the fields of one column.
struct Column {
    values: Values,
    known: HashMap<String, u32>,
    any: bool,
}

impl Column {
    fn push(&mut self, field: &str, line: usize) {
        match &mut self.values {
            Values::Numbers(numbers, bad) => {
                if field.is_empty() {
                    return numbers.push(f64::NAN);
                }
                match field.parse::<f64>() {
                    Ok(x) => {
                        numbers.push(if x.is_finite() { x } else { f64::NAN });
                        self.any = true;
                    }
                    Err(_) if self.any => {
                        numbers.push(f64::NAN);
                        bad.get_or_insert_with(|| (line, field.to_owned()));
                    }
                    // A column of words, of which the first were empty.
                    Err(_) => {
                        let empty = vec![0; numbers.len()];
                        self.known = HashMap::from([(String::new(), 0)]);
                        self.values = Values::Words(empty, vec![String::new()]);
                        self.push(field, line);
                    }
                }
            }
            Values::Words(places, words) => {
                let place = match self.known.get(field) {
                    Some(place) => *place,
                    None => {
                        words.push(field.to_owned());
                        self.known.insert(field.to_owned(), words.len() as u32 - 1);
                        words.len() as u32 - 1
                    }
                };
                places.push(place);
            }
        }
    }
}

/// The table `file` does not fit.
fn too_long(file: String) -> InputError {
    InputError::new(format!("the table has more than {MOST_ROWS} rows"))
        .at(file, None)
        .allowed("fewer: a sweep with `[output] top = N` keeps the best")
}

impl Table {
    /// Reads the file; `None` where there is none.
    ///
    /// # Errors
    /// A file that cannot be read or is no regular one, that is empty or ends within a row, or has more than [`MOST_ROWS`] rows.
    pub fn read(path: &Path) -> Result<Option<Self>, Error> {
        let Some(file) = open_of_result(path)? else { return Ok(None) };
        let name = path.display().to_string();
        Ok(Some(Self::parse(&name, TextFile::new(file, &name, "table", Limit::Lines))?))
    }

    /// Reads the text of a table that is called `file`.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn parse(file: &str, text: impl std::io::Read) -> Result<Self, InputError> {
        let file = file.to_owned();
        let damaged = |why: String, line| InputError::new(why).at(file.clone(), line);
        let mut reader = csv::ReaderBuilder::new().buffer_capacity(1 << 20).from_reader(text);
        let unread = |e: csv::Error, why: &str| {
            let why = format!("{why}: {e}");
            match e.into_kind() {
                csv::ErrorKind::Io(e) => refused(e).unwrap_or_else(|_| damaged(why, None)),
                _ => damaged(why, None),
            }
        };
        let header = reader.headers().map_err(|e| unread(e, "this is not a table"))?.clone();
        if header.is_empty() || header.iter().all(str::is_empty) {
            return Err(damaged("the table is empty: it has no header".to_owned(), None));
        }
        let new = || Column { values: Values::Numbers(Vec::new(), None), known: HashMap::new(), any: false };
        let mut columns: Vec<Column> = header.iter().map(|_| new()).collect();
        let (mut record, mut len) = (csv::StringRecord::new(), 0);
        loop {
            match reader.read_record(&mut record) {
                Ok(false) => break,
                Ok(true) => {}
                Err(e) if e.is_io_error() => return Err(unread(e, "the table cannot be read")),
                Err(e) => {
                    let line = e.position().map(|p| p.line() as usize);
                    let why = match e.kind() {
                        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                            format!(
                                "this row has {len} fields, the header {expected_len}: the table is damaged or was not written to its end"
                            )
                        }
                        csv::ErrorKind::Utf8 { .. } => {
                            "this row is not UTF-8: the table is damaged".to_owned()
                        }
                        _ => format!("the table cannot be read: {e}"),
                    };
                    return Err(damaged(why, line));
                }
            }
            let line = record.position().map_or(0, |p| p.line() as usize);
            columns.iter_mut().zip(&record).for_each(|(column, field)| column.push(field, line));
            len += 1;
            if len > MOST_ROWS {
                return Err(too_long(file));
            }
        }
        let columns_read = header.iter().map(str::to_owned).collect();
        Ok(Self { file, columns: columns_read, values: columns.into_iter().map(|c| c.values).collect(), len })
    }

    /// Reads the Parquet file of a table; `None` where there is none.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn read_parquet(path: &Path) -> Result<Option<Self>, Error> {
        let Some(file) = open_of_result(path)? else { return Ok(None) };
        let mut reader = parquet::Reader::new(path, file)?;
        let (columns, mut rows) = (reader.columns(), Columns::default());
        while let Some(group) = reader.next_group()? {
            if rows.len() + group.len() > MOST_ROWS {
                return Err(too_long(path.display().to_string()).into());
            }
            match rows.0.is_empty() {
                true => rows = group,
                false => rows.extend(&group, 0..group.len())?,
            }
        }
        let len = rows.len();
        let values = |column| match column {
            columns::Values::Numbers(numbers) => Values::Numbers(numbers, None),
            columns::Values::Counts(counts) => {
                Values::Numbers(counts.into_iter().map(|n| n as f64).collect(), None)
            }
            columns::Values::Words(words) => Values::Words(words.codes, words.known),
        };
        let mut values: Vec<Values> = rows.0.into_iter().map(values).collect();
        values.resize_with(columns.len(), || Values::Numbers(Vec::new(), None));
        Ok(Some(Self { file: path.display().to_string(), columns, values, len }))
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    /// Whether there is such a column with a number in it.
    pub fn has(&self, name: &str) -> bool {
        let numbers =
            |i: usize| matches!(&self.values[i], Values::Numbers(x, _) if x.iter().any(|x| x.is_finite()));
        self.place(name).is_some_and(numbers)
    }

    /// The first of `names` that is a column.
    pub fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|n| self.place(n).is_some())
    }

    /// The first of `names` that is a column.
    ///
    /// # Errors
    /// None is: the first is missed.
    pub fn one_of(&self, names: &[&'static str]) -> Result<&'static str, InputError> {
        self.first(names).ok_or_else(|| self.lacks(names[0]))
    }

    fn lacks(&self, column: &str) -> InputError {
        InputError::new("the table lacks this column").at(self.file.clone(), None).key(column)
    }

    /// A column of numbers, NaN where one is missing.
    ///
    /// # Errors
    /// A column that is not there, or a field of it that is no number.
    pub fn numbers(&self, name: &str) -> Result<&[f64], InputError> {
        let place = self.place(name).ok_or_else(|| self.lacks(name))?;
        let damaged = |line: usize, text: &str| {
            InputError::new("this is not a number").at(self.file.clone(), Some(line)).key(name).value(text)
        };
        match &self.values[place] {
            Values::Numbers(numbers, None) => Ok(numbers),
            Values::Numbers(_, Some((line, text))) => Err(damaged(*line, text)),
            Values::Words(places, words) => {
                let row = places.iter().position(|p| *p > 0).unwrap_or(0);
                Err(damaged(row + 2, places.get(row).map_or("", |p| &words[*p as usize])))
            }
        }
    }

    /// A number, NaN where there is none or no such column.
    pub fn number(&self, name: &str, row: usize) -> f64 {
        match self.place(name).map(|i| &self.values[i]) {
            Some(Values::Numbers(numbers, _)) => numbers[row],
            _ => f64::NAN,
        }
    }

    /// A field as text; empty where there is no such column.
    pub fn word(&self, name: &str, row: usize) -> String {
        match self.place(name).map(|i| &self.values[i]) {
            Some(Values::Words(places, words)) => words[places[row] as usize].clone(),
            Some(Values::Numbers(numbers, _)) if numbers[row].is_finite() => numbers[row].to_string(),
            _ => String::new(),
        }
    }

    /// Rows for which `keep` says so.
    pub fn rows(&self, keep: impl Fn(usize) -> bool) -> Vec<usize> {
        (0..self.len).filter(|r| keep(*r)).collect()
    }

    /// A field as JSON; missing is null.
    pub fn json(&self, column: usize, row: usize) -> serde_json::Value {
        match &self.values[column] {
            Values::Numbers(numbers, _) => numbers[row].into(),
            Values::Words(places, words) => words[places[row] as usize].as_str().into(),
        }
    }
}

/// The different values of `numbers`, ascending.
pub fn distinct(numbers: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut seen = std::collections::HashSet::new();
    let mut values: Vec<f64> =
        numbers.into_iter().filter(|x| x.is_finite() && seen.insert((x + 0.0).to_bits())).collect();
    values.sort_by(f64::total_cmp);
    values
}
