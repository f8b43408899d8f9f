//! Formats of tables.

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

    /// The one of this word; CSV where there is none.
    pub fn named(word: &str) -> Self {
        Self::WORDS.iter().find(|(name, _)| *name == word).map_or(Self::Csv, |(_, format)| *format)
    }

    /// The one that is in force in a spec; CSV where a study has none.
    pub fn of(spec: &crate::scene::Spec) -> Self {
        let value = spec.in_force.iter().find(|(key, ..)| key == "output.format");
        Self::named(value.map_or("csv", |(_, value, _)| value.trim_matches('"')))
    }
}
