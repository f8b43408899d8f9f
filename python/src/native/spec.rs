//! A spec from keywords, from a file, or from a file with overriding keywords.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use toml::Table;
use vibrissa::command::{Content, HeldFile};
use vibrissa::contour::point;
use vibrissa::error::Error;
use vibrissa::measure::names;
use vibrissa::spec;
use vibrissa::text_file::{Limit, TextFile};

use super::error;
use super::table::{FileGiven, frame};

/// File extension of texts that are not files: errors in them have no place.
pub const KEYWORDS: &str = "keywords";

/// A spec before parsing: the file at `path` if given, with the sections of `text` overriding it; `name` is the caller. The result's name ends with
/// [`KEYWORDS`] if the user has no file with its lines.
pub fn unread(path: Option<PathBuf>, text: &str, name: &str) -> Result<HeldFile, Error> {
    let held = |name, text: String, base| HeldFile { name, content: Content::Bytes(text.into_bytes()), base };
    let Some(path) = path else {
        return Ok(held(format!("{name}.{KEYWORDS}").into(), text.to_owned(), PathBuf::new()));
    };
    let base = path.parent().unwrap_or(Path::new("")).to_owned();
    let of_file = TextFile::open(&path, "spec", Limit::Whole)?.text()?;
    let whole = of_file.parse::<Table>().ok().filter(|_| !text.is_empty());
    let Some(mut whole) = whole else {
        return Ok(held(path, of_file, base));
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
    Ok(held(path.with_extension(KEYWORDS), text, base))
}

/// Unit of every key of a spec under its dotted name, and of those of an array's whiskers as `array.x`; empty where it has none.
#[pyfunction]
pub fn units() -> Vec<(String, &'static str)> {
    spec::keys::units().collect()
}

/// The law that fits a measured curve: its coefficients and their error (MPa), the ends of its strains, and how many points there are.
#[pyfunction]
pub fn fit_material(py: Python<'_>, data: FileGiven<'_>) -> PyResult<([f64; 3], f64, [f64; 2], usize)> {
    let fit = match data {
        FileGiven::Table(table) => spec::material_of_curve(&frame(py, "data", table)?),
        FileGiven::Text(path) => spec::material_of_file(Path::new(&path)),
    };
    let fit = fit.map_err(|e| error::raise(py, e.into()))?;
    Ok((fit.coefficients, fit.rms, fit.range, fit.points))
}

/// Columns of measurements that are read as numbers.
#[pyfunction]
pub fn read_columns() -> Vec<&'static str> {
    names::names().chain(point::NEEDED).chain(point::MORE).collect()
}
