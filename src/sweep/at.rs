//! How far a ranked sweep of a grid is, as it is kept.

use super::select::Best;
use crate::chart::lanes::{Found, Words};
use crate::sink::pack::{Packed, Packer, Unpacker};

/// How far a ranked sweep is.
pub(super) enum At {
    /// Its rows are ranked up to this design: what was found in charts, and the best of the rows that were solved.
    Ranked(u64, Found, Best),
    /// The rows kept, and how many of their designs are written.
    Kept(Vec<(u64, u32)>, u64),
}

impl Packed for At {
    fn pack(&self, to: &mut Packer<'_>) {
        match self {
            Self::Ranked(next, found, best) => pack_ranked((*next, found, best), to),
            Self::Kept(places, next) => {
                1u8.pack(to);
                places.pack(to);
                next.pack(to);
            }
        }
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        match from.take::<u8>()? {
            0 => {
                let (next, rows, complete, (taps, invalid, best)) = from.take()?;
                let words = Words { taps, invalid };
                Some(Self::Ranked(next, Found { rows, complete, words, ..Found::default() }, best))
            }
            1 => Some(Self::Kept(from.take()?, from.take()?)),
            _ => None,
        }
    }
}

/// Packs [`At::Ranked`] without taking it.
pub(super) fn pack_ranked((next, found, best): (u64, &Found, &Best), to: &mut Packer<'_>) {
    0u8.pack(to);
    next.pack(to);
    found.rows.pack(to);
    found.complete.pack(to);
    found.words.taps.pack(to);
    found.words.invalid.pack(to);
    best.pack(to);
}
