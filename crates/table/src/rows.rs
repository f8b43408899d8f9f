//! Rows of a table on their way to its file or to memory, made away from it so that they can be made in parallel: text, or columns of values.

use super::columns::Columns;
use super::csv::Text;
use super::table::Field;
use crate::error::Error;

/// How tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TableFormat {
    /// Comma-separated text.
    #[default]
    Csv,
    /// Apache Parquet: the same columns, typed and compressed.
    Parquet,
}

impl TableFormat {
    /// All, by their words; these are also the endings of files.
    pub const WORDS: [(&'static str, Self); 2] = [("csv", Self::Csv), ("parquet", Self::Parquet)];

    /// Its word.
    pub fn name(self) -> &'static str {
        Self::WORDS[self as usize].0
    }

    /// Bytes of a table over those of the same as CSV, about: measured on `sweeps/million.toml`.
    pub fn share(self) -> f64 {
        match self {
            Self::Csv => 1.0,
            Self::Parquet => 0.25,
        }
    }

    /// What rows are on their way there.
    pub fn form(self) -> Form {
        match self {
            Self::Csv => Form::Text,
            Self::Parquet => Form::Columns,
        }
    }

    /// The one that is in force in a spec; CSV where a study has none.
    pub fn of(spec: &crate::scene::Spec) -> Self {
        let value = spec.in_force.iter().find(|(key, ..)| key == "output.format");
        let word = value.map_or("csv", |(_, value, _)| value.trim_matches('"'));
        Self::WORDS.iter().find(|(name, _)| *name == word).map_or(Self::Csv, |(_, format)| *format)
    }
}

/// What rows are on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Lines of CSV.
    Text,
    /// Columns of values.
    Columns,
}

/// Some rows.
#[allow(clippy::large_enum_variant, reason = "there are few at a time, and none lives long")]
pub enum Rows {
    /// As lines of CSV.
    Text(Text),
    /// As columns.
    Columns(Columns),
}

impl Rows {
    /// None yet.
    pub fn new(form: Form) -> Self {
        match form {
            Form::Text => Self::Text(Text::default()),
            Form::Columns => Self::Columns(Columns::default()),
        }
    }

    /// Takes one row; `fields` is left empty for the next.
    ///
    /// # Errors
    /// A row of another width.
    pub fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Error> {
        match self {
            Self::Text(text) => text.row(fields),
            Self::Columns(columns) => columns.row(fields),
        }
    }

    /// Takes what there is and leaves nothing.
    pub fn take(&mut self) -> Self {
        match self {
            Self::Text(text) => Self::Text(std::mem::take(text)),
            Self::Columns(columns) => Self::Columns(std::mem::take(columns)),
        }
    }
}
