//! `vibrissa.verify`, `vibrissa.devices` and `vibrissa.chart`.

use std::path::PathBuf;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::backend::{self, Backend, Choice};
use vibrissa::census::verify::{self as census, Case, Verified};
use vibrissa::census::{Place, present};
use vibrissa::error::{Error, InputError};
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
    if let Some(bad) = bound.filter(|b| !(*b > 0.0 && b.is_finite())) {
        let error = InputError::new("a bound on an error must be a positive number").key("bound").value(bad);
        return Err(raise(py, error.allowed("> 0").into()));
    }
    // Only `[run]`: the built-in configurations.
    let built_in =
        path.is_none() && text.parse::<toml::Table>().is_ok_and(|t| t.keys().all(|key| key == "run"));
    let read = || -> Result<_, Error> {
        let file = unread(path, &text, "verify")?;
        let (label, text) = (file.name.display().to_string(), file.text());
        match built_in {
            true => Ok((None, spec::parse_listed(&label, text, &file.base, None)?.run)),
            false => {
                let spec = spec::parse(&label, text, &file.base)?;
                spec.one_rig()?;
                Ok((Some(spec.clone()), spec.run))
            }
        }
    };
    let (spec, options) = read().map_err(|e| raise(py, e))?;
    let threads = options.threads;
    job::whole(py, threads, progress, move |stop, tell| {
        let start = std::time::Instant::now();
        let places = present(&options, bound)?;
        let samples = samples.unwrap_or(census::samples(spec.is_some(), quick));
        let cases = match &spec {
            Some(spec) => vec![Case::of_study(&spec.name, spec.study.clone(), samples, seed)],
            None => Case::built_in(samples, seed, quick),
        };
        let taps = cases.iter().map(|c| c.tuples.len() as u64).sum();
        let backends: Vec<Backend> = places.iter().map(Place::backend).cloned().collect();
        let mut lines = Vec::new();
        let done = census::run(&cases, &places, stop, &mut Ahead(tell), &mut |line| lines.push(line))?;
        let verified = Verified {
            spec: spec.as_ref(),
            samples,
            seed,
            backends: &backends,
            lines: &lines,
            stopped: (done < taps).then_some([done, taps]),
            seconds: start.elapsed().as_secs_f64(),
        };
        let table = Table::new(verified.table()?)?;
        let good = done == taps && lines.iter().all(|line| line.faults().is_empty());
        let document = verified.document().to_string();
        Ok((table, document, good, spec.map_or_else(Vec::new, |spec| spec.warnings)))
    })
}
