//! What is asked, as a spec: the text of keywords, a file, or a file with keywords over it.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use toml::Table;
use vibrissa::contour::point;
use vibrissa::error::{Error, InputError};
use vibrissa::measure::names;
use vibrissa::text_file::{Limit, TextFile};
use vibrissa::{files, spec};

use super::error;

/// A spec before it is read.
#[derive(Debug, Clone)]
pub struct UnreadSpec {
    /// Name in messages; its stem names the result. Ends with [`KEYWORDS`] where its lines are none that the user can look at.
    pub label: String,
    /// Text of the spec.
    pub text: String,
    /// Where its relative paths begin.
    pub base: PathBuf,
}

/// End of the name of what is no file: errors in it have no place.
pub const KEYWORDS: &str = "keywords";

impl UnreadSpec {
    /// The file at `path`, if one is named, and `text`, whose sections go before those of the file; `name` says what asks.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn new(path: Option<PathBuf>, text: String, name: &str) -> Result<Self, Error> {
        let Some(path) = path else {
            return Ok(Self { label: format!("{name}.{KEYWORDS}"), text, base: PathBuf::new() });
        };
        let base = path.parent().unwrap_or(Path::new("")).to_owned();
        let of_file = TextFile::open(&path, "spec", Limit::Whole)?.text()?;
        let whole = of_file.parse::<Table>().ok().filter(|_| !text.is_empty());
        let Some(mut whole) = whole else {
            // Alone, or no TOML, which is told with its line.
            return Ok(Self { label: path.display().to_string(), text: of_file, base });
        };
        let over: Table = text.parse().map_err(|e: toml::de::Error| Error::Run(e.to_string()))?;
        for (section, keys) in over {
            match (whole.get_mut(&section), keys) {
                (Some(toml::Value::Table(old)), toml::Value::Table(new)) => old.extend(new),
                (_, keys) => {
                    whole.insert(section, keys);
                }
            }
        }
        let text = toml::to_string(&whole).map_err(|e| Error::Run(e.to_string()))?;
        Ok(Self { label: path.with_extension(KEYWORDS).display().to_string(), text, base })
    }

    /// Reads it by `read`, one of the library's readers.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read<T>(&self, read: impl FnOnce(&str, &str, &Path) -> Result<T, InputError>) -> Result<T, Error> {
        Ok(read(&self.label, &self.text, &self.base)?)
    }
}

/// Unit of every key of a spec under its dotted name, and of those of an array's whiskers as `array.x`; empty where it has none.
#[pyfunction]
pub fn units() -> Vec<(String, &'static str)> {
    let of_array = files::ARRAY_UNITS.map(|(key, unit)| (format!("array.{key}"), unit));
    spec::keys::units().chain(of_array).collect()
}

/// Columns of measurements that are read as numbers.
#[pyfunction]
pub fn read_columns() -> Vec<&'static str> {
    names::names().chain(point::NEEDED).chain(point::MORE).collect()
}

/// As [`UnreadSpec::new`], as a function of Python raises.
///
/// # Errors
/// A file that cannot be read.
pub fn asked(py: Python<'_>, path: Option<PathBuf>, text: String, name: &str) -> PyResult<UnreadSpec> {
    UnreadSpec::new(path, text, name).map_err(|e| error::raise(py, e))
}
