//! Tables in memory, column by column: what a program that calls this one takes instead of files.

use std::collections::TryReserveError;

use super::csv::Text;
use super::table::{Field, Sink};
use crate::error::Error;

/// Values of one column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>),
    /// Counts.
    Counts(Vec<i64>),
    /// Words, of which a column has few different ones: for each row the place of its word, −1 where there is none.
    Words {
        /// Places in `words`.
        codes: Vec<i32>,
        /// The different words, in order of first appearance.
        words: Vec<String>,
    },
}

/// Different words that a column may have.
const MOST_WORDS: usize = i32::MAX as usize;

impl Values {
    /// No values, of the kind that `field` is.
    fn like(field: &Field) -> Self {
        match field {
            Field::Number(_) => Self::Numbers(Vec::new()),
            Field::Count(_) => Self::Counts(Vec::new()),
            Field::Word(_) | Field::Text(_) | Field::Status(_) => {
                Self::Words { codes: Vec::new(), words: Vec::new() }
            }
        }
    }

    fn reserve(&mut self, rows: usize) -> Result<(), TryReserveError> {
        match self {
            Self::Numbers(all) => all.try_reserve_exact(rows),
            Self::Counts(all) => all.try_reserve_exact(rows),
            Self::Words { codes, .. } => codes.try_reserve_exact(rows),
        }
    }

    fn push(&mut self, field: &Field) -> Result<(), Error> {
        match (self, field) {
            (Self::Numbers(all), Field::Number(x)) => all.push(if x.is_finite() { *x } else { f64::NAN }),
            (Self::Counts(all), Field::Count(n)) => all.push(*n as i64),
            (Self::Words { codes, words }, Field::Word(word)) => codes.push(code(words, word)?),
            (Self::Words { codes, words }, Field::Text(text)) => codes.push(code(words, text)?),
            (Self::Words { codes, words }, Field::Status(status)) => {
                // Most rows are, and their word is seldom far.
                let place = match *status == crate::status::Status::OK {
                    true => code(words, "ok")?,
                    false => code(words, &status.to_string())?,
                };
                codes.push(place);
            }
            _ => return Err(Error::Run("a column holds values of two kinds".to_owned())),
        }
        Ok(())
    }

    fn append(&mut self, more: Self) -> Result<(), Error> {
        match (self, more) {
            (Self::Numbers(all), Self::Numbers(more)) => all.extend_from_slice(&more),
            (Self::Counts(all), Self::Counts(more)) => all.extend_from_slice(&more),
            (Self::Words { codes, words }, Self::Words { codes: more, words: theirs }) => {
                let places = theirs.iter().map(|word| code(words, word)).collect::<Result<Vec<_>, _>>()?;
                codes.extend(more.iter().map(|c| usize::try_from(*c).map_or(-1, |c| places[c])));
            }
            _ => return Err(Error::Run("a column holds values of two kinds".to_owned())),
        }
        Ok(())
    }
}

/// Place of `word` among `words`, after them if it is new; −1 for none.
fn code(words: &mut Vec<String>, word: &str) -> Result<i32, Error> {
    if word.is_empty() {
        return Ok(-1);
    }
    let place = words.iter().position(|known| known == word).unwrap_or_else(|| {
        words.push(word.to_owned());
        words.len() - 1
    });
    if place >= MOST_WORDS {
        return Err(Error::Run("a column has too many different words".to_owned()));
    }
    Ok(place as i32)
}

/// Columns of equal length, without their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns {
    /// One for each name.
    pub columns: Vec<Values>,
}

impl Columns {
    /// No rows, of the kinds of `row`, with room for `rows`.
    ///
    /// # Errors
    /// More rows than there is memory for.
    pub fn like(row: &[Field], rows: u64) -> Result<Self, Error> {
        let mut columns: Vec<Values> = row.iter().map(Values::like).collect();
        let large =
            || Error::Run(format!("a table of {rows:.1e} rows has no place in memory", rows = rows as f64));
        let n = usize::try_from(rows).map_err(|_| large())?;
        columns.iter_mut().try_for_each(|c| c.reserve(n)).map_err(|_| large())?;
        Ok(Self { columns })
    }

    /// Adds the rows of `more`.
    ///
    /// # Errors
    /// Columns of other kinds.
    pub fn append(&mut self, more: Self) -> Result<(), Error> {
        if self.columns.is_empty() {
            self.columns = more.columns;
            return Ok(());
        }
        self.columns.iter_mut().zip(more.columns).try_for_each(|(all, more)| all.append(more))
    }
}

impl Sink for Columns {
    type Error = Error;

    fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Error> {
        if self.columns.is_empty() {
            self.columns = fields.iter().map(Values::like).collect();
        }
        self.columns.iter_mut().zip(fields.drain(..)).try_for_each(|(column, field)| column.push(&field))
    }
}

/// What rows become.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Form {
    /// Text of a CSV file.
    #[default]
    Text,
    /// Columns in memory.
    Columns,
}

/// Rows on their way to a table, gathered away from it so that it can be done in parallel.
pub enum Rows {
    /// As text.
    Text(Box<Text>),
    /// As columns.
    Columns(Columns),
}

/// Rows that are ready.
#[derive(Debug)]
pub enum Block {
    /// Lines of a CSV file.
    Text(Vec<u8>),
    /// Columns.
    Columns(Columns),
}

impl Rows {
    /// No rows yet.
    pub fn new(form: Form) -> Self {
        match form {
            Form::Text => Self::Text(Box::default()),
            Form::Columns => Self::Columns(Columns::default()),
        }
    }

    /// One row; `fields` is left empty for the next.
    ///
    /// # Errors
    /// None of rows of one table.
    pub fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Error> {
        match self {
            Self::Text(text) => text.row(fields).map_err(|e| Error::Run(e.to_string())),
            Self::Columns(columns) => columns.row(fields),
        }
    }

    /// Bytes of text so far, apart from what is still held back; of columns none wait for a file.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Columns(_) => 0,
        }
    }

    /// The rows so far.
    pub fn into_block(self) -> Block {
        match self {
            Self::Text(text) => Block::Text(text.into_bytes()),
            Self::Columns(columns) => Block::Columns(columns),
        }
    }

    /// The rows so far; more of the same form may follow.
    pub fn take(&mut self) -> Block {
        let form = match self {
            Self::Text(_) => Form::Text,
            Self::Columns(_) => Form::Columns,
        };
        std::mem::replace(self, Self::new(form)).into_block()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::Status;

    #[test]
    fn rows_of_parts_are_the_rows_of_one() {
        let rows =
            [(1.5, "slide", Status::OK), (f64::INFINITY, "", Status::NO_ROOT), (2.0, "stick", Status::OK)];
        let fields = |(x, word, status)| {
            vec![Field::Number(x), Field::Count(7), Field::Word(word), Field::Status(status)]
        };
        let (mut whole, mut parts) = (Columns::default(), Columns::like(&fields(rows[0]), 3).unwrap());
        for row in rows {
            let mut part = Columns::default();
            whole.row(&mut fields(row)).unwrap();
            part.row(&mut fields(row)).unwrap();
            parts.append(part).unwrap();
        }
        let Values::Numbers(x) = &parts.columns[0] else { panic!("numbers") };
        assert!(x[0] == 1.5 && x[1].is_nan() && x[2] == 2.0);
        assert_eq!(parts.columns[1..], whole.columns[1..]);
        let words = |codes: [i32; 3], words: [&str; 2]| Values::Words {
            codes: codes.to_vec(),
            words: words.map(str::to_owned).to_vec(),
        };
        assert_eq!(parts.columns[2], words([0, -1, 1], ["slide", "stick"]));
        assert_eq!(parts.columns[3], words([0, 1, 0], ["ok", "no_root"]));
        assert!(whole.append(Columns { columns: vec![Values::Counts(vec![1])] }).is_err());
    }
}
