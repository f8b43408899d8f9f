//! Single lanes of a pack, each asked at neighbouring distances, side by side in a pack of their own.

use super::{LANES, Lanes};

/// Neighbours that are asked of one lane.
pub(super) const NEIGHBOURS: usize = 8;

/// Lanes that are asked at a time.
pub(super) const PLACES: usize = LANES / NEIGHBOURS;

/// What is asked.
#[derive(Clone, Copy, Default)]
pub(super) struct Place {
    /// Of the pack.
    pub lane: usize,
    /// Of neighbours.
    pub group: usize,
}

/// The values that `x` has in the lanes of `places`, each for all of its neighbours.
#[inline(always)]
pub(super) fn picked<const SET: u8>(x: &Lanes<SET>, places: &[Place]) -> Lanes<SET> {
    let mut all = Lanes::<SET>::of(0.0);
    for (part, place) in all.0.as_chunks_mut::<NEIGHBOURS>().0.iter_mut().zip(places) {
        *part = [x.0[place.lane]; NEIGHBOURS];
    }
    all
}
