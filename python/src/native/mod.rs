//! The contents of `vibrissa._native`.

mod command;
mod error;
mod job;
mod locate;
mod machine;
mod spec;
mod table;
mod taps;

use pyo3::prelude::*;

/// Native part of vibrissa; use the package `vibrissa`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::{
        command::run,
        job::forked,
        locate::Locator,
        machine::{answer, ask_drivers_by, devices, left_behind, recommended},
        spec::{fit_material, read_columns, units},
        table::Table,
        taps::Taps,
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
