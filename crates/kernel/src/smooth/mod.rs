//! What the taps of a sweep share: ranking millions of designs from one chart of the rod.
//!
//! A frictionless Hooke rod on the centreline knows only (τa, θ), and a gauge only adds its place. So a sweep of such rods that is
//! ranked (`top`) solves a few thousand taps to make a [`rod::RodChart`], and every design's rows follow from it in a
//! few flops each ([`lanes`]). The rows kept are solved again, tap by tap, before they are ranked and written; designs outside the
//! chart are solved tap by tap from the start. A [`scope::Scope`] says which sweeps qualify and holds what designs share.

// Index loops are what the lanes vectorise on, and they read like the shader's.
#![allow(clippy::needless_range_loop)]

pub mod drives;
pub mod lanes;
pub mod rod;
pub mod scope;

pub use lanes::{Found, Tables};
pub use scope::{Case, Scope};

use vibrissa_core::error::SolveError;

/// What a finished batch brings.
pub struct Batch {
    /// Its designs.
    pub range: std::ops::Range<u64>,
    /// Rows that are complete; designs that have one where designs compete.
    pub complete: u64,
    /// Taps per status word.
    pub words: lanes::Words,
    /// Designs with a row below the bound.
    pub best: Vec<u64>,
    /// Designs that must be solved tap by tap.
    pub hard: Vec<u64>,
}

/// Ranks the designs of a scope on a device, in batches that overlap.
pub trait Ranking {
    /// Designs of a batch at most.
    fn most(&self) -> u64;

    /// Whether another batch can start.
    fn free(&self) -> bool;

    /// Starts a batch that looks for rows below `bound`.
    fn start(&mut self, range: std::ops::Range<u64>, bound: f32);

    /// Waits for the oldest batch; `None` when none is in flight.
    fn finish(&mut self) -> Option<Result<Batch, SolveError>>;
}
