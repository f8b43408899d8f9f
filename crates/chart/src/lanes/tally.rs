//! Taps per status word, lane by lane.

use super::{LANES, Lanes, Words};

/// Taps of each lane per word; whole numbers, far below the 2²⁴ up to which f32 counts.
#[derive(Clone, Copy)]
pub(super) struct Tally<T> {
    pub ok: T,
    pub slipped: T,
    pub strain: T,
    pub rootless: T,
    pub ambiguous: T,
    /// 1 of a design that must be solved tap by tap.
    pub hard: T,
}

impl<const SET: u8> Tally<Lanes<SET>> {
    /// Nothing yet; `hard` as given.
    #[inline(always)]
    pub fn new(hard: Lanes<SET>) -> Self {
        let zero = Lanes::<SET>::of(0.0);
        Self { ok: zero, slipped: zero, strain: zero, rootless: zero, ambiguous: zero, hard }
    }

    /// Whether the design in `lane` must be solved tap by tap.
    #[inline(always)]
    pub fn is_hard(&self, lane: usize) -> bool {
        self.hard.0[lane] > 0.5
    }

    /// 1 of the first `live` lanes that are not hard.
    #[inline(always)]
    pub fn counts(&self, live: usize) -> Lanes<SET> {
        let zero = Lanes::<SET>::of(0.0);
        let mut counts = Lanes::<SET>::of(1.0);
        for lane in live..LANES {
            counts.0[lane] = 0.0;
        }
        zero.if_less(self.hard, zero, counts)
    }

    /// Taps per word of the lanes that `counts` marks.
    #[inline(always)]
    pub fn words(&self, counts: Lanes<SET>) -> Words {
        Words {
            ok: sum(self.ok * counts),
            slipped: sum(self.slipped * counts),
            strain: sum(self.strain * counts),
            rootless: sum(self.rootless * counts),
            ambiguous: sum(self.ambiguous * counts),
            invalid: 0,
        }
    }
}

/// Of whole numbers; together they may be more than f32 counts.
#[inline(always)]
pub(super) fn sum<const SET: u8>(x: Lanes<SET>) -> u64 {
    let (mut sums, mut n) = ([0; LANES], LANES);
    for lane in 0..LANES {
        sums[lane] = x.0[lane] as i32;
    }
    while n > 1 {
        n /= 2;
        for lane in 0..n {
            sums[lane] += sums[lane + n];
        }
    }
    sums[0] as u64
}
