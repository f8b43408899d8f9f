//! What long work reports while it runs, and how it is asked to stop.

use std::sync::atomic::AtomicBool;

/// A stop flag that is never raised.
pub static NEVER: AtomicBool = AtomicBool::new(false);

/// Is told how far the work is.
pub trait Progress {
    /// `done` of `total` taps.
    fn at(&mut self, done: u64, total: u64);

    /// The work goes on where `done` taps were done before it began: rates and times are those of the others.
    fn begin(&mut self, _done: u64) {}

    /// Something worth telling, in words.
    fn note(&mut self, _words: &str) {}
}

/// Tells nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn at(&mut self, _: u64, _: u64) {}
}
