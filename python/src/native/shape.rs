//! `vibrissa.shape`.

use std::path::PathBuf;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::error::{Error, InputError};
use vibrissa::progress::Progress;
use vibrissa::shape as bent;
use vibrissa::sink::memory;

use super::job::{self, Ahead};
use super::search::{Tables, named};
use super::spec::asked;
use super::sweep::{Listed, leave_files, read};

/// Bytes of a section while its table is made: its text, in a buffer that may be twice as large, its fields, its columns.
const BYTES_OF_SECTION: u64 = 1024;

/// Bent whiskers of the spec in `path` with the sections of `text` over it, or of these taps: shape, contacts, and run.json.
#[pyfunction]
#[pyo3(signature = (path, text, name, nodes, listed = None, progress = None))]
pub fn shape<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    text: String,
    name: &str,
    nodes: u32,
    listed: Option<Listed<'py>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Tables, String)> {
    let asked = asked(py, path, text, name)?;
    let mut spec = read(py, &asked, listed)?;
    let threads = spec.run.threads;
    job::whole(py, threads, progress, move |stop, tell| {
        let start = std::time::Instant::now();
        leave_files(&mut spec);
        let placed = |e: InputError| Error::from(e.at(&asked.label, None));
        let setup = &spec.study.setup;
        bent::check(setup).map_err(placed)?;
        let room = memory::available().map_or(u64::MAX, |bytes| bytes / BYTES_OF_SECTION);
        bent::rows(&spec.study.space, nodes as usize, room).map_err(placed)?;
        let (method, by) = bent::method(&spec.run, &setup.model)?;
        let steered = (stop, &mut Ahead(tell) as &mut dyn Progress);
        let (counts, tables) = bent::tables(&spec, method, nodes as usize, steered)?;
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let run = bent::document(&spec, by, &counts.described(), &seconds);
        Ok((named(&tables)?, run.to_string()))
    })
}
