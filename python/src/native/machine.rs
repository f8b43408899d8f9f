//! `vibrissa.verify`, `vibrissa.devices` and `vibrissa.chart`.

use std::path::PathBuf;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::backend::{self, Choice};
use vibrissa::census::verify as library;
use vibrissa::error::Error;
use vibrissa::kernel::gpu;
use vibrissa::scene::RunOptions;
use vibrissa::spec;

use super::error::raise;
use super::job::{self, Ahead};
use super::spec::unread;
use super::table::Table;

/// GPU drivers are asked by the process that `command`, a program and its arguments, starts: it calls [`answer`].
#[pyfunction]
pub fn ask_drivers_by(command: Vec<String>) {
    backend::ask_by(move || {
        let (program, arguments) = command.split_first()?;
        let mut own = std::process::Command::new(program);
        own.args(arguments);
        Some(own)
    });
}

/// The other process, which opens adapters from number `first` on.
#[pyfunction]
pub fn answer(first: usize) {
    backend::answer(first);
}

/// Whether a call into a driver was given up and has not returned.
#[pyfunction]
pub fn left_behind() -> bool {
    gpu::left_behind()
}

/// What there is to compute on, as JSON; which of it the `[run]` of `text` takes.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<String> {
    job::whole(py, None, None, |_, _| {
        let (adapters, faults) = backend::look();
        let mut all = backend::listed(&adapters, &faults);
        all["auto"] = json!(Choice::new(&RunOptions::default())?.backend);
        Ok(all.to_string())
    })
}

/// Every backend against the reference: the census, run.json, whether nothing is broken, and what should be known of the spec.
#[pyfunction]
#[pyo3(signature = (path, text, quick, samples, seed, bound, progress = None))]
#[allow(clippy::too_many_arguments)]
pub fn verify<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    text: String,
    quick: bool,
    samples: Option<u32>,
    seed: u64,
    bound: Option<f64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Table, String, bool, Vec<String>)> {
    // Only `[run]`: the built-in configurations.
    let built_in =
        path.is_none() && text.parse::<toml::Table>().is_ok_and(|t| t.keys().all(|key| key == "run"));
    let read = || -> Result<_, Error> {
        let file = unread(path, &text, "verify")?;
        let (label, text) = (file.name.display().to_string(), file.text());
        if built_in {
            return Ok((None, spec::parse_listed(&label, text, &file.base, None)?.run));
        }
        let spec = spec::parse(&label, text, &file.base)?;
        spec.one_rig()?;
        Ok((Some(spec.clone()), spec.run))
    };
    let (spec, options) = read().map_err(|e| raise(py, e))?;
    let threads = options.threads;
    job::whole(py, threads, progress, move |stop, tell| {
        let asked = library::CensusOptions { quick, samples, seed, bound };
        let (table, document, good) =
            library::census(spec.as_ref(), &options, asked, stop, &mut Ahead(tell))?;
        let warnings = spec.map_or_else(Vec::new, |spec| spec.warnings);
        Ok((Table::new(table)?, document.to_string(), good, warnings))
    })
}
