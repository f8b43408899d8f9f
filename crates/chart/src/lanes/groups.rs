//! Drives that all designs share, some neighbours at a time: what is certain of all of them is asked once.

use std::ops::Range;

use super::{Angle, ORDERS, PAIRS};

/// Neighbours that go together.
pub(super) const TOGETHER: usize = 8;

/// Slack for rounding.
const SAFE: f32 = 1e-6;

/// Some neighbouring drives.
#[derive(Debug)]
pub(super) struct Group {
    /// Their places.
    pub drives: Range<usize>,
    /// Least and largest power e.
    pub powers: [f32; 2],
    /// Of each polynomial the middle of its values, and how far they are from there.
    pub basis: [[f32; ORDERS]; 2],
    /// The same of their products.
    pub products: [[f32; PAIRS]; 2],
}

/// Middle and half of the width of what `values` has at `k`.
fn spans<'a, const N: usize>(values: impl Iterator<Item = &'a [f32; N]> + Clone) -> [[f32; N]; 2] {
    let least: [f32; N] = std::array::from_fn(|k| values.clone().map(|v| v[k]).fold(f32::INFINITY, f32::min));
    let most: [f32; N] =
        std::array::from_fn(|k| values.clone().map(|v| v[k]).fold(f32::NEG_INFINITY, f32::max));
    let of = |f: fn(f32, f32) -> f32| std::array::from_fn(|k| f(least[k], most[k]));
    [of(|lo, hi| 0.5 * (lo + hi)), of(|lo, hi| 0.5 * (hi - lo) + SAFE)]
}

impl Group {
    /// All of `angles`, ascending, whose first has the place `from`.
    fn new(angles: &[Angle], from: usize) -> Self {
        let power = |at: usize| angles[at].stroke.power;
        Self {
            drives: from..from + angles.len(),
            powers: [power(0), power(angles.len() - 1)],
            basis: spans(angles.iter().map(|a| &a.stroke.basis)),
            products: spans(angles.iter().map(|a| &a.products)),
        }
    }

    /// Groups of `angles`, ascending; the first is that of all, if there are any.
    pub fn of(angles: &[Angle]) -> Vec<Self> {
        if angles.is_empty() {
            return Vec::new();
        }
        let parts = angles.chunks(TOGETHER).enumerate().map(|(n, part)| Self::new(part, n * TOGETHER));
        std::iter::once(Self::new(angles, 0)).chain(parts).collect()
    }
}
