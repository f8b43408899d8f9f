//! Values of a column, and a single value.

use std::borrow::Cow;
use std::collections::TryReserveError;
use std::ops::Range;

use serde_json::Value;

use super::heading::Kind;
use crate::error::Error;
use crate::status::Status;

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// Number; NaN or infinite is missing.
    Number(f64),
    /// Unsigned whole number.
    Count(u64),
    /// Text; empty is missing.
    Word(Cow<'static, str>),
    /// Status words.
    Status(Status),
}

macro_rules! fields {
    ($($from:ty: $x:ident => $to:expr;)*) => {$(
        impl From<$from> for Field {
            fn from($x: $from) -> Self {
                $to
            }
        }
    )*};
}
fields! {
    f64: x => Self::Number(x);
    Option<f64>: x => Self::Number(x.unwrap_or(f64::NAN));
    u64: n => Self::Count(n);
    usize: n => Self::Count(n as u64);
    &'static str: word => Self::Word(Cow::Borrowed(word));
    String: text => Self::Word(Cow::Owned(text));
    Status: status => Self::Status(status);
}

impl From<Field> for Value {
    fn from(field: Field) -> Self {
        match field {
            Field::Number(x) => x.into(),
            Field::Count(n) => n.into(),
            Field::Word(word) if word.is_empty() => Self::Null,
            Field::Word(word) => word.into_owned().into(),
            Field::Status(status) => status.to_string().into(),
        }
    }
}

/// Row values by column name; missing is null.
pub fn named(names: Vec<&str>, fields: impl IntoIterator<Item = Field>) -> Value {
    names.into_iter().map(str::to_owned).zip(fields.into_iter().map(Value::from)).collect()
}

/// The values of one column.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub enum Values {
    /// Numbers; NaN is missing.
    Numbers(Vec<f64>),
    /// Unsigned whole numbers.
    Counts(Vec<u64>),
    /// Text values.
    Words(Words),
}

/// A column of text that is stored as codes, for few distinct values.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Words {
    /// Index into `known` per row.
    pub codes: Vec<u32>,
    /// Distinct texts, possibly with repetitions; empty text is missing.
    pub known: Vec<String>,
    /// Cache of the last status and its code.
    #[serde(skip)]
    last: Option<(Status, u32)>,
}

/// Number of known words that are searched for a repetition; if most words differ, storing a copy is cheaper than searching all.
const FEW: usize = 32;

impl Words {
    /// Rows whose words are `known[code]` for each of `codes`.
    pub fn new(codes: Vec<u32>, known: Vec<String>) -> Self {
        Self { codes, known, ..Self::default() }
    }

    /// Appends one value.
    pub fn push(&mut self, word: &str) {
        let code = self.code(word);
        self.codes.push(code);
    }

    /// The word of a row.
    pub fn at(&self, row: usize) -> &str {
        &self.known[self.codes[row] as usize]
    }

    fn code(&mut self, word: &str) -> u32 {
        let place = self.known.iter().take(FEW).position(|known| known == word);
        place.unwrap_or_else(|| {
            self.known.push(word.to_owned());
            self.known.len() - 1
        }) as u32
    }

    /// Numbers or counts if every word converts without loss (007 would lose its zeros); else the words.
    pub fn typed(self) -> Values {
        let codes = || self.codes.iter().map(|code| *code as usize);
        if let Some(known) = self.known.iter().map(|word| number(word)).collect::<Option<Vec<f64>>>() {
            Values::Numbers(codes().map(|code| known[code]).collect())
        } else if let Some(known) = self.known.iter().map(|word| whole(word)).collect::<Option<Vec<u64>>>() {
            Values::Counts(codes().map(|code| known[code]).collect())
        } else {
            Values::Words(self)
        }
    }

    fn push_status(&mut self, status: Status) {
        let last = self.last.filter(|(last, _)| *last == status);
        let code = last.map_or_else(|| self.code(&status.to_string()), |(_, code)| code);
        self.last = Some((status, code));
        self.codes.push(code);
    }
}

/// A number that keeps everything in the word: fails for 007, and for an integer that f64 cannot hold.
fn number(word: &str) -> Option<f64> {
    if word.is_empty() {
        return Some(f64::NAN);
    }
    let padded = word.len() > 1 && word.starts_with('0') && word.bytes().all(|c| c.is_ascii_digit());
    let value: f64 = word.parse().ok().filter(|_| !padded)?;
    let lost = word.parse::<i128>().is_ok_and(|whole| value as i128 != whole);
    (!lost).then_some(value)
}

/// A 64-bit integer in its canonical form; negative ones keep their bits.
fn whole(word: &str) -> Option<u64> {
    let value: i64 = word.parse().ok()?;
    (value.to_string() == word).then_some(value.cast_unsigned())
}

fn mixed() -> Error {
    Error::Run("a column of two kinds".into())
}

impl Values {
    /// An empty column of this `kind`.
    pub fn new(kind: Kind) -> Self {
        match kind {
            Kind::Number => Self::Numbers(Vec::new()),
            Kind::Count => Self::Counts(Vec::new()),
            Kind::Word => Self::Words(Words::default()),
        }
    }

    /// Their type.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Numbers(_) => Kind::Number,
            Self::Counts(_) => Kind::Count,
            Self::Words(_) => Kind::Word,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(x) => x.len(),
            Self::Counts(n) => n.len(),
            Self::Words(w) => w.codes.len(),
        }
    }

    /// True before the first row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(super) fn push(&mut self, field: Field) -> Result<(), Error> {
        match (self, field) {
            (Self::Numbers(all), Field::Number(x)) => all.push(if x.is_finite() { x } else { f64::NAN }),
            (Self::Numbers(all), Field::Count(n)) => all.push(n as f64),
            (Self::Counts(all), Field::Count(n)) => all.push(n),
            (Self::Words(all), Field::Word(word)) => all.push(&word),
            (Self::Words(all), Field::Status(status)) => all.push_status(status),
            _ => return Err(mixed()),
        }
        Ok(())
    }

    pub(super) fn reserve(&mut self, rows: usize) -> Result<(), TryReserveError> {
        match self {
            Self::Numbers(all) => all.try_reserve_exact(rows),
            Self::Counts(all) => all.try_reserve_exact(rows),
            Self::Words(all) => all.codes.try_reserve_exact(rows),
        }
    }

    /// Appends the rows `range` of `other`, which has the same type.
    pub(super) fn extend(&mut self, other: &Self, range: Range<usize>) -> Result<(), Error> {
        match (self, other) {
            (Self::Numbers(all), Self::Numbers(more)) => all.extend_from_slice(&more[range]),
            (Self::Counts(all), Self::Counts(more)) => all.extend_from_slice(&more[range]),
            (Self::Words(all), Self::Words(more)) => {
                let mut places = vec![None; more.known.len()];
                for code in more.codes[range].iter().map(|code| *code as usize) {
                    let place = *places[code].get_or_insert_with(|| all.code(&more.known[code]));
                    all.codes.push(place);
                }
            }
            _ => return Err(mixed()),
        }
        Ok(())
    }
}
