//! What `vibrissa._native` holds.

mod answers;
mod array;
mod column;
mod command;
mod error;
mod fork;
mod held;
mod job;
mod locate;
mod machine;
mod spec;
mod table;
mod taps;
mod words;

use pyo3::prelude::*;

/// Native part of vibrissa; use the package `vibrissa`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::array::Array;
    #[pymodule_export]
    use super::command::run;
    #[pymodule_export]
    use super::fork::forked;
    #[pymodule_export]
    use super::locate::Locator;
    #[pymodule_export]
    use super::machine::{answer, ask_drivers_by, devices, left_behind, verify};
    #[pymodule_export]
    use super::spec::{fit_material, read_columns, units};
    #[pymodule_export]
    use super::table::Table;
    #[pymodule_export]
    use super::taps::Taps;
    #[pymodule_export]
    use super::words::recommended;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
