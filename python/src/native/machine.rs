//! `vibrissa.devices`, and the child process that tests GPU drivers.

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::backend::{self, Choice};
use vibrissa::kernel::gpu;
use vibrissa::scene::RunOptions;

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
