//! Simulated faults of an adapter, for tests: development builds read them from [`VARIABLE`], release builds do not.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Environment variable: `lose N`, `panic N` or `hang N`, from the N-th call into the driver on (compiling, or waiting for a dispatch; from 0), or `A
/// => B`, which replaces the first A in a shader's text.
const VARIABLE: &str = "VIBRISSA_LIE";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    Lose,
    Panic,
    /// The call does not end in time.
    Hang,
}

#[derive(Debug, Default)]
struct Told {
    fault: Option<(Fault, u64)>,
    text: Option<(String, String)>,
    calls: AtomicU64,
}

/// The faults from the environment; clones count the same calls.
#[derive(Debug, Clone, Default)]
pub(super) struct Lie(Arc<Told>);

impl Lie {
    pub fn new() -> Self {
        let asked = std::env::var(VARIABLE).ok().filter(|_| cfg!(debug_assertions)).unwrap_or_default();
        let text = asked.split_once(" => ").map(|(from, to)| (from.to_owned(), to.to_owned()));
        let fault = asked.split_once(' ').and_then(|(word, from)| {
            let known = [("lose", Fault::Lose), ("panic", Fault::Panic), ("hang", Fault::Hang)];
            Some((known.into_iter().find(|(name, _)| *name == word)?.1, from.parse().ok()?))
        });
        Self(Arc::new(Told { fault, text, calls: AtomicU64::new(0) }))
    }

    pub fn next(&self) -> Option<Fault> {
        let call = self.0.calls.fetch_add(1, Ordering::Relaxed);
        self.0.fault.filter(|(_, from)| call >= *from).map(|(fault, _)| fault)
    }

    pub fn text(&self, wgsl: &str) -> String {
        self.0.text.as_ref().map_or_else(|| wgsl.to_owned(), |(from, to)| wgsl.replacen(from, to, 1))
    }
}
