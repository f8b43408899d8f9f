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

impl<const FMA: bool> Tally<Lanes<FMA>> {
    /// Nothing yet; `hard` as given.
    #[inline(always)]
    pub fn new(hard: Lanes<FMA>) -> Self {
        let zero = Lanes::<FMA>::of(0.0);
        Self { ok: zero, slipped: zero, strain: zero, rootless: zero, ambiguous: zero, hard }
    }

    /// Whether the design in `lane` must be solved tap by tap.
    #[inline(always)]
    pub fn is_hard(&self, lane: usize) -> bool {
        self.hard.0[lane] > 0.5
    }

    /// 1 of the first `live` lanes that are not hard.
    #[inline(always)]
    pub fn counts(&self, live: usize) -> Lanes<FMA> {
        let zero = Lanes::<FMA>::of(0.0);
        let mut counts = Lanes::<FMA>::of(1.0);
        for lane in live..LANES {
            counts.0[lane] = 0.0;
        }
        zero.if_less(self.hard, zero, counts)
    }

    /// Taps per word of the lanes that `counts` marks.
    #[inline(always)]
    pub fn words(&self, counts: Lanes<FMA>) -> Words {
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

/// Of whole numbers.
#[inline(always)]
pub(super) fn sum<const FMA: bool>(x: Lanes<FMA>) -> u64 {
    let mut sum = 0;
    for value in x.0 {
        sum += value as i32;
    }
    sum as u64
}
