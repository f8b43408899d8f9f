//! Formats of tables.

/// Format of written tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TableFormat {
    /// Comma-separated text.
    #[default]
    Csv,
    /// Apache Parquet: the same columns, typed and compressed.
    Parquet,
}

impl TableFormat {
    /// All formats by their words, which are also the file extensions.
    pub const WORDS: [(&'static str, Self); 2] = [("csv", Self::Csv), ("parquet", Self::Parquet)];

    /// The word of this format.
    pub fn name(self) -> &'static str {
        Self::WORDS[self as usize].0
    }

    /// Approximate size of a table relative to CSV, measured on `sweeps/million.toml`.
    pub fn share(self) -> f64 {
        match self {
            Self::Csv => 1.0,
            Self::Parquet => 0.25,
        }
    }

    /// The format with this word; CSV for any other word.
    pub fn named(word: &str) -> Self {
        Self::WORDS.iter().find(|(name, _)| *name == word).map_or(Self::Csv, |(_, format)| *format)
    }

    /// The format in force in a spec; CSV by default.
    pub fn of(spec: &crate::scene::Spec) -> Self {
        let value = spec.in_force.iter().find(|(key, ..)| key == "output.format");
        Self::named(value.map_or("csv", |(_, value, _)| value.trim_matches('"')))
    }
}
