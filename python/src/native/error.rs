//! Errors of the library as exceptions of `vibrissa._errors`.

use std::path::Path;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use vibrissa::error::{Error, InputError};

use super::spec::KEYWORDS;

/// Where exceptions are defined: in Python, so that they have attributes and bases there.
const HOME: &str = "vibrissa._errors";

pub fn raise(py: Python<'_>, error: Error) -> PyErr {
    match error {
        Error::Input(e) => input(py, &e),
        other => run(py, &other.to_string()),
    }
}

/// `RunError`: what was asked is right, but could not be done.
pub fn run(py: Python<'_>, message: &str) -> PyErr {
    let made = || py.import(HOME)?.getattr("RunError")?.call1((keywords(message),));
    made().map_or_else(|e| e, PyErr::from_value)
}

/// `InputError`, with key, value and what is allowed.
pub fn input(py: Python<'_>, e: &InputError) -> PyErr {
    let made = || {
        let fields = PyDict::new(py);
        fields.set_item("key", e.key.as_deref().map(keywords))?;
        fields.set_item("value", &e.value)?;
        fields.set_item("allowed", e.allowed.as_deref().map(keywords))?;
        let file = e.file.as_deref().filter(|f| Path::new(f).extension().is_none_or(|end| end != KEYWORDS));
        fields.set_item("file", file)?;
        fields.set_item("line", e.line.filter(|_| file.is_some()))?;
        py.import(HOME)?.getattr("InputError")?.call((keywords(&e.message),), Some(&fields))
    };
    made().map_or_else(|e| e, PyErr::from_value)
}

/// `text` with flags of the command line as keywords: `--zero-every` is `zero_every` here.
pub fn keywords(text: &str) -> String {
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(part.len());
        let (flag, rest) = part.split_at(end);
        if flag.is_empty() {
            out += "--";
        }
        out += &flag.replace('-', "_");
        out += rest;
    }
    out
}
