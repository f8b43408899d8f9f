//! What `vibrissa._native` holds.

mod answers;
mod array;
mod column;
mod contour;
mod error;
mod fork;
mod held;
mod job;
mod lab;
mod locate;
mod machine;
mod page;
mod search;
mod several;
mod shape;
mod spec;
mod sweep;
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
    use super::contour::contour;
    #[pymodule_export]
    use super::fork::forked;
    #[pymodule_export]
    use super::lab::{calibrate, simulate, strokes};
    #[pymodule_export]
    use super::locate::Locator;
    #[pymodule_export]
    use super::machine::{answer, ask_drivers_by, chart, devices, left_behind, verify};
    #[pymodule_export]
    use super::page::{explore, report};
    #[pymodule_export]
    use super::search::{optimise, tap};
    #[pymodule_export]
    use super::several::Several;
    #[pymodule_export]
    use super::shape::shape;
    #[pymodule_export]
    use super::spec::{read_columns, units};
    #[pymodule_export]
    use super::sweep::sweep;
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
