//! What is asked, as a spec: the text of keywords, a file, or a file with keywords over it.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use toml::Table;
use vibrissa::error::{Error, InputError};
use vibrissa::spec;

use crate::error;

/// A spec before it is read.
#[derive(Debug, Clone)]
pub struct Asked {
    /// Name in messages; its stem names the result.
    pub label: String,
    /// Text of the spec.
    pub text: String,
    /// Where its relative paths begin.
    pub base: PathBuf,
    /// Whether lines of the text are lines of a file that the user can look at.
    pub file: bool,
}

impl Asked {
    /// The file at `path`, if one is named, and `text`, whose sections go before those of the file; `name` says what asks.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn new(path: Option<PathBuf>, text: String, name: &str) -> Result<Self, Error> {
        let Some(path) = path else {
            return Ok(Self { label: name.to_owned(), text, base: PathBuf::new(), file: false });
        };
        let (label, base) = (path.display().to_string(), path.parent().unwrap_or(Path::new("")).to_owned());
        let of_file = match std::fs::read_to_string(&path) {
            Ok(of_file) => of_file,
            // Its reader knows best what to say of it.
            Err(e) => return Err(spec::read(&path).map_or_else(Error::from, |_| Error::io(&path, e))),
        };
        if text.is_empty() {
            return Ok(Self { label, text: of_file, base, file: true });
        }
        let broken = |e: &toml::de::Error| Error::Run(e.to_string());
        let over: Table = text.parse().map_err(|e| broken(&e))?;
        let Ok(mut whole) = of_file.parse::<Table>() else {
            // No TOML: told with its line.
            return Ok(Self { label, text: of_file, base, file: true });
        };
        for (section, keys) in over {
            match (whole.get_mut(&section), keys) {
                (Some(toml::Value::Table(old)), toml::Value::Table(new)) => old.extend(new),
                (_, keys) => {
                    whole.insert(section, keys);
                }
            }
        }
        let text = toml::to_string(&whole).map_err(|e| Error::Run(e.to_string()))?;
        Ok(Self { label, text, base, file: false })
    }

    /// Reads it by `read`, one of the library's readers. An error of keywords has no line.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read<T>(&self, read: impl FnOnce(&str, &str, &Path) -> Result<T, InputError>) -> Result<T, Error> {
        read(&self.label, &self.text, &self.base).map_err(|e| {
            match self.file || e.file.as_ref() != Some(&self.label) {
                true => e.into(),
                false => InputError { file: None, line: None, snippet: None, ..e }.into(),
            }
        })
    }
}

/// As [`Asked::new`], as a function of Python raises.
///
/// # Errors
/// A file that cannot be read.
pub fn asked(py: Python<'_>, path: Option<PathBuf>, text: String, name: &str) -> PyResult<Asked> {
    Asked::new(path, text, name).map_err(|e| error::raise(py, e))
}
