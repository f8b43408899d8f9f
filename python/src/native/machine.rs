//! `vibrissa.devices`, the child process that tests GPU drivers, and words that users say.

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::backend::{self, Choice};
use vibrissa::kernel::gpu;
use vibrissa::recommend;
use vibrissa::scene::RunOptions;
use vibrissa::status::Status;

use super::job;

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

/// What there is to compute on, as JSON, and what `auto` takes of it.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<String> {
    job::whole(py, None, None, |_, _| {
        let (adapters, faults) = backend::look();
        let mut all = backend::listed(&adapters, &faults);
        all["auto"] = json!(Choice::new(&RunOptions::default())?.backend);
        Ok(all.to_string())
    })
}

/// The place of the row that is recommended: of `values`, smaller is better; `codes` are places in `words`, those of the taps of each row.
#[pyfunction]
pub fn recommended(values: Vec<f64>, codes: Vec<i32>, words: Vec<String>) -> Option<usize> {
    let words: Vec<Status> = words.iter().map(|words| Status::of_words(words)).collect();
    let of =
        |code: i32| usize::try_from(code).ok().and_then(|code| words.get(code).copied()).unwrap_or_default();
    recommend::recommended(codes.into_iter().map(of).zip(values)).map(|(place, _)| place)
}
