//! Rows as columns of values: what a Parquet file is made of and read into, and what a program that calls this one takes instead of files.

use std::collections::TryReserveError;

use super::pack::{Packed, Packer, Unpacker};
use super::table::Field;
use crate::error::Error;
use crate::status::Status;

/// One column of some rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; NaN is missing.
    Numbers(Vec<f64>),
    /// Counts.
    Counts(Vec<u64>),
    /// Text.
    Words(Words),
}

/// A column of text, most of whose values are the same few.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Words {
    /// Place in `known` of each row.
    pub codes: Vec<u32>,
    /// What there is; empty text is missing.
    pub known: Vec<String>,
    /// The last status that was looked up, and its place.
    last: Option<(Status, u32)>,
}

impl Words {
    /// Takes one value.
    pub fn push(&mut self, word: &str) {
        let code = self.code(word);
        self.codes.push(code);
    }

    fn code(&mut self, word: &str) -> u32 {
        let place = self.known.iter().position(|known| known == word).unwrap_or_else(|| {
            self.known.push(word.to_owned());
            self.known.len() - 1
        });
        place as u32
    }

    fn push_status(&mut self, status: Status) {
        let code = match self.last {
            Some((last, code)) if last == status => code,
            _ => self.code(&status.to_string()),
        };
        self.last = Some((status, code));
        self.codes.push(code);
    }
}

impl Values {
    /// None yet, of the kind of `field`.
    fn of(field: &Field) -> Self {
        match field {
            Field::Number(_) => Self::Numbers(Vec::new()),
            Field::Count(_) => Self::Counts(Vec::new()),
            Field::Word(_) | Field::Text(_) | Field::Status(_) => Self::Words(Words::default()),
        }
    }

    /// None yet, of the kind that the column `name` of a sweep's table has.
    pub fn named(name: &str) -> Self {
        match name {
            "n" => Self::Counts(Vec::new()),
            "contact_state" | "status" => Self::Words(Words::default()),
            _ => Self::Numbers(Vec::new()),
        }
    }

    /// Rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(x) => x.len(),
            Self::Counts(n) => n.len(),
            Self::Words(w) => w.codes.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn push(&mut self, field: &Field) -> Result<(), Error> {
        match (self, field) {
            (Self::Numbers(all), Field::Number(x)) => all.push(if x.is_finite() { *x } else { f64::NAN }),
            (Self::Counts(all), Field::Count(n)) => all.push(*n),
            (Self::Words(all), Field::Word(word)) => all.push(word),
            (Self::Words(all), Field::Text(text)) => all.push(text),
            (Self::Words(all), Field::Status(status)) => all.push_status(*status),
            _ => return Err(Error::Run("a column of two kinds".into())),
        }
        Ok(())
    }

    fn reserve(&mut self, rows: usize) -> Result<(), TryReserveError> {
        match self {
            Self::Numbers(all) => all.try_reserve_exact(rows),
            Self::Counts(all) => all.try_reserve_exact(rows),
            Self::Words(all) => all.codes.try_reserve_exact(rows),
        }
    }

    /// Takes the rows `range` of `other`, which is of the same kind.
    fn extend(&mut self, other: &Self, range: std::ops::Range<usize>) -> Result<(), Error> {
        match (self, other) {
            (Self::Numbers(all), Self::Numbers(more)) => all.extend_from_slice(&more[range]),
            (Self::Counts(all), Self::Counts(more)) => all.extend_from_slice(&more[range]),
            (Self::Words(all), Self::Words(more)) => {
                let codes: Vec<u32> = more.known.iter().map(|word| all.code(word)).collect();
                all.codes.extend(more.codes[range].iter().map(|code| codes[*code as usize]));
            }
            _ => return Err(Error::Run("a column of two kinds".into())),
        }
        Ok(())
    }

    /// Leaves out the first `n` rows.
    fn skip(&mut self, n: usize) {
        match self {
            Self::Numbers(all) => drop(all.drain(..n)),
            Self::Counts(all) => drop(all.drain(..n)),
            Self::Words(all) => drop(all.codes.drain(..n)),
        }
    }
}

/// Rows as columns; of no width before the first row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Columns(pub Vec<Values>);

impl Columns {
    /// None yet, of the table of a sweep that has columns of these names.
    pub fn of(names: &[impl AsRef<str>]) -> Self {
        Self(names.iter().map(|name| Values::named(name.as_ref())).collect())
    }

    /// As [`Self::of`], with room for so many rows.
    ///
    /// # Errors
    /// More rows than there is memory for.
    pub fn with_room(names: &[impl AsRef<str>], rows: u64) -> Result<Self, Error> {
        let large = || Error::Run(format!("a table of {rows} rows has no place in memory"));
        let (n, mut all) = (usize::try_from(rows).map_err(|_| large())?, Self::of(names));
        all.0.iter_mut().try_for_each(|column| column.reserve(n)).map_err(|_| large())?;
        Ok(all)
    }

    /// Takes what there is and leaves nothing, of the same columns.
    pub fn take(&mut self) -> Self {
        let (all, n) = (self.clone(), self.len());
        self.skip(n);
        all
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.0.first().map_or(0, Values::len)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.0.len()
    }

    /// Takes one row; `fields` is left empty for the next.
    ///
    /// # Errors
    /// A row of another width or with other kinds of values.
    pub fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Error> {
        if self.0.is_empty() {
            self.0 = fields.iter().map(Values::of).collect();
        }
        if self.0.len() != fields.len() {
            return Err(Error::Run("a row of another width".into()));
        }
        self.0.iter_mut().zip(fields.iter()).try_for_each(|(column, field)| column.push(field))?;
        fields.clear();
        Ok(())
    }

    /// None, of the same kinds of columns.
    pub fn like(&self) -> Self {
        let empty = |values: &Values| match values {
            Values::Numbers(_) => Values::Numbers(Vec::new()),
            Values::Counts(_) => Values::Counts(Vec::new()),
            Values::Words(_) => Values::Words(Words::default()),
        };
        Self(self.0.iter().map(empty).collect())
    }

    /// Whether `other` has the same kinds of columns.
    pub fn is_like(&self, other: &Self) -> bool {
        let kinds = |columns: &Self| columns.0.iter().map(std::mem::discriminant).collect::<Vec<_>>();
        kinds(self) == kinds(other)
    }

    /// Takes the rows `range` of `other`.
    ///
    /// # Errors
    /// Other columns.
    pub fn extend(&mut self, other: &Self, range: std::ops::Range<usize>) -> Result<(), Error> {
        if self.0.len() != other.0.len() {
            return Err(Error::Run("rows of another width".into()));
        }
        self.0.iter_mut().zip(&other.0).try_for_each(|(a, b)| a.extend(b, range.clone()))
    }

    /// Leaves out the first `n` rows.
    pub fn skip(&mut self, n: usize) {
        self.0.iter_mut().for_each(|column| column.skip(n));
    }
}

impl Packed for Values {
    fn pack(&self, to: &mut Packer<'_>) {
        match self {
            Self::Numbers(x) => {
                0u8.pack(to);
                x.pack(to);
            }
            Self::Counts(n) => {
                1u8.pack(to);
                n.pack(to);
            }
            Self::Words(w) => {
                2u8.pack(to);
                w.known.pack(to);
                w.codes.pack(to);
            }
        }
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        Some(match from.take::<u8>()? {
            0 => Self::Numbers(from.take()?),
            1 => Self::Counts(from.take()?),
            2 => {
                let (known, codes): (Vec<String>, Vec<u32>) = from.take()?;
                let fits = codes.iter().all(|code| (*code as usize) < known.len());
                Self::Words(fits.then_some(Words { known, codes, last: None })?)
            }
            _ => return None,
        })
    }
}

impl Packed for Columns {
    fn pack(&self, to: &mut Packer<'_>) {
        self.0.pack(to);
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let columns: Vec<Values> = from.take()?;
        columns.iter().all(|c| c.len() == columns[0].len()).then_some(Self(columns))
    }
}
