//! What `vibrissa._native` holds.

use pyo3::prelude::*;

/// Native part of vibrissa; use the package `vibrissa`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use crate::array::Array;
    #[pymodule_export]
    use crate::contour::contour;
    #[pymodule_export]
    use crate::fork::forked;
    #[pymodule_export]
    use crate::lab::{calibrate, simulate, strokes};
    #[pymodule_export]
    use crate::locate::Locator;
    #[pymodule_export]
    use crate::machine::{answer, ask_drivers_by, chart, devices, left_behind, verify};
    #[pymodule_export]
    use crate::page::{explore, report};
    #[pymodule_export]
    use crate::search::{optimise, tap};
    #[pymodule_export]
    use crate::several::Several;
    #[pymodule_export]
    use crate::shape::shape;
    #[pymodule_export]
    use crate::spec::{read_columns, units};
    #[pymodule_export]
    use crate::sweep::sweep;
    #[pymodule_export]
    use crate::table::Table;
    #[pymodule_export]
    use crate::taps::Taps;
    #[pymodule_export]
    use crate::words::counts;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
