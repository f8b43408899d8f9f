//! What the taps of a sweep share: ranking millions of designs from one chart of the rod.
//!
//! A frictionless Hooke rod on the centreline knows only (τa, θ), and a gauge only adds its place. So a sweep of such rods that is
//! ranked (`top`) solves a few thousand taps to make a [`rod::RodChart`], and every design's rows follow from it in a
//! few flops each ([`lanes`]). The rows kept are solved again, tap by tap, before they are ranked and written; designs outside the
//! chart are solved tap by tap from the start. A [`scope::Scope`] says which sweeps qualify and holds what designs share.

// Index loops are what the lanes vectorise on, and they read like the shader's.
#![allow(clippy::needless_range_loop)]

pub mod device;
pub mod drives;
pub mod lanes;
pub mod rod;
pub mod scope;

pub use device::{Batch, Ranker};
pub use lanes::{Found, Tables};
pub use scope::{Case, Scope};
