//! Errors of the library as exceptions of `vibrissa._errors`.

use std::path::Path;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use vibrissa::error::Error;

use super::spec::KEYWORDS;

const HOME: &str = "vibrissa._errors";

pub fn raise(py: Python<'_>, error: Error) -> PyErr {
    let Error::Input(e) = error else { return run(py, &error.to_string()) };
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

pub fn run(py: Python<'_>, message: &str) -> PyErr {
    let made = || py.import(HOME)?.getattr("RunError")?.call1((keywords(message),));
    made().map_or_else(|e| e, PyErr::from_value)
}

/// Replaces flags of the command line in `text` by keywords: `--zero-every` is `zero_every` here.
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
