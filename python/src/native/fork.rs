//! Forked processes: they have the memory of the first one and none of its threads. Work goes to threads of their own.

use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

use pyo3::prelude::*;

use super::error;
use super::job;

/// No fork, or none since the package was imported.
const WHOLE: u8 = 0;
/// Forked while nothing was computed.
const FORKED: u8 = 1;
/// Forked amid work: what that work held is held for ever.
const AMID: u8 = 2;

static PROCESS: AtomicU8 = AtomicU8::new(WHOLE);
static WORKING: AtomicUsize = AtomicUsize::new(0);

/// Lives as long as work on another thread.
pub struct Working(());

impl Working {
    pub fn new() -> Self {
        WORKING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        WORKING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Whether threads of the library are those of another process.
pub fn is_forked() -> bool {
    PROCESS.load(Ordering::Relaxed) != WHOLE
}

/// Refuses to compute in a process that cannot.
pub fn check(py: Python<'_>) -> PyResult<()> {
    if PROCESS.load(Ordering::Relaxed) != AMID {
        return Ok(());
    }
    let why = "this process was forked while vibrissa computed in another thread, and cannot compute";
    Err(error::run(py, &format!("{why}; start it by spawn: multiprocessing.get_context(\"spawn\")")))
}

/// For `os.register_at_fork`, in the child. Devices that `kept` holds are not closed here: their driver's threads are gone.
#[pyfunction]
pub fn forked(kept: Bound<'_, PyAny>) {
    std::mem::forget(kept.unbind());
    job::forget_pools();
    let amid = WORKING.swap(0, Ordering::SeqCst) > 0 || PROCESS.load(Ordering::Relaxed) == AMID;
    PROCESS.store(if amid { AMID } else { FORKED }, Ordering::SeqCst);
}
