//! Shared drives in groups of neighbours, whose words are decided together where that is certain.

use std::ops::Range;

use super::{Angle, ORDERS, PAIRS};
use crate::reduce::range;

pub(super) const TOGETHER: usize = 8;

const SAFE: f32 = 1e-6;

#[derive(Debug)]
pub(super) struct Group {
    pub drives: Range<usize>,
    pub powers: [f32; 2],
    /// Middle and half-width of the range of each polynomial.
    pub basis: [[f32; ORDERS]; 2],
    pub products: [[f32; PAIRS]; 2],
}

fn spans<'a, const N: usize>(values: impl Iterator<Item = &'a [f32; N]> + Clone) -> [[f32; N]; 2] {
    let ends = |k: usize| range(values.clone().map(|v| f64::from(v[k]))).map(|x| x as f32);
    let of = |f: fn([f32; 2]) -> f32| std::array::from_fn(|k| f(ends(k)));
    [of(|[lo, hi]| 0.5 * (lo + hi)), of(|[lo, hi]| 0.5 * (hi - lo) + SAFE)]
}

impl Group {
    fn new(angles: &[Angle], from: usize) -> Self {
        let power = |at: usize| angles[at].stroke.power;
        Self {
            drives: from..from + angles.len(),
            powers: [power(0), power(angles.len() - 1)],
            basis: spans(angles.iter().map(|a| &a.stroke.basis)),
            products: spans(angles.iter().map(|a| &a.products)),
        }
    }

    /// Groups of `angles`, ascending; the first holds all. Without any it is that of a design's own drive, over which nothing is a series.
    pub fn of(angles: &[Angle]) -> Vec<Self> {
        if angles.is_empty() {
            let basis = std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 });
            let one = Self {
                drives: 0..1,
                powers: [1.0; 2],
                basis: [basis, [0.0; ORDERS]],
                products: [[0.0; PAIRS]; 2],
            };
            return vec![one];
        }
        let parts = angles.chunks(TOGETHER).enumerate().map(|(n, part)| Self::new(part, n * TOGETHER));
        std::iter::once(Self::new(angles, 0)).chain(parts).collect()
    }
}
