//! Progress reports of long work, and its stop flag.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::SolveError;

/// A stop flag that is never raised.
pub static NEVER: AtomicBool = AtomicBool::new(false);

/// Fails with [`SolveError::Stopped`] once `stop` is set.
pub fn go_on(stop: &AtomicBool) -> Result<(), SolveError> {
    if stop.load(Ordering::Relaxed) { Err(SolveError::Stopped) } else { Ok(()) }
}

/// Receives the progress of work.
pub trait Progress {
    /// `done` of `total` taps.
    fn at(&mut self, done: u64, total: u64);

    /// Work resumes after `done` taps: rates and times count the others only.
    fn begin(&mut self, _done: u64) {}

    /// A message in words.
    fn note(&mut self, _words: &str) {}
}

/// Ignores all reports.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn at(&mut self, _: u64, _: u64) {}
}
