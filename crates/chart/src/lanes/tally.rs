//! Taps per combination of status words, lane by lane.

use super::{LANES, Lanes, Words};
use crate::kernel::cpu::Packed;

/// Results of an estimate, as indices.
pub(super) const CLEAR: usize = 0;
pub(super) const AMBIGUOUS: usize = 1;
pub(super) const ROOTLESS: usize = 2;

/// Counts by words that do not depend on the estimate: no word, `strain_limit`, `slipped_off`, both.
pub(super) type Worn = [Lanes; 4];

/// Drives from `from` to `to`, for a tap that is above the strain limit from `above` on and has slipped off from `slipped` on.
#[inline(always)]
pub(super) fn worn([above, slipped]: [Lanes; 2], [from, to]: [Lanes; 2]) -> Worn {
    let (above, slipped) = (above.max(from).min(to), slipped.max(from).min(to));
    let clean = above.min(slipped);
    [clean - from, slipped - clean, above - clean, to - above.max(slipped)]
}

/// Taps of each lane per combination; whole numbers, far below the 2²⁴ up to which f32 counts.
#[derive(Clone, Copy)]
pub(super) struct Tally {
    pub taps: [Worn; 3],
    /// 1 for a design that must be solved tap by tap.
    pub hard: Lanes,
}

impl Tally {
    #[inline(always)]
    pub fn new(hard: Lanes) -> Self {
        let zero = Lanes::of(0.0);
        Self { taps: [[zero; 4]; 3], hard }
    }

    #[inline(always)]
    pub fn add(&mut self, told: usize, share: Lanes, worn: &Worn) {
        // Most packs have only clear taps.
        if share.all_at_most(Lanes::of(0.0)) {
            return;
        }
        for k in 0..worn.len() {
            self.taps[told][k] = share.mul_add(worn[k], self.taps[told][k]);
        }
    }

    /// Adds the taps between the drives `from` and `to`; `told`: results with their share of the lanes; `edges`: strain limit and slip-off.
    #[inline(always)]
    pub fn add_between(&mut self, told: &[(usize, Lanes)], edges: [Lanes; 2], [from, to]: [Lanes; 2]) {
        if to.all_at_most(edges[0].min(edges[1])) {
            let taps = to - from;
            for (told, share) in told {
                self.add_clean(*told, *share * taps);
            }
        } else {
            let worn = worn(edges, [from, to]);
            for (told, share) in told {
                self.add(*told, *share, &worn);
            }
        }
    }

    #[inline(always)]
    pub fn add_clean(&mut self, told: usize, taps: Lanes) {
        self.taps[told][0] = self.taps[told][0] + taps;
    }

    #[inline(always)]
    pub fn is_hard(&self, lane: usize) -> bool {
        self.hard.0[lane] > 0.5
    }

    #[inline(always)]
    pub fn counts(&self, live: usize) -> Lanes {
        let zero = Lanes::of(0.0);
        let mut counts = Lanes::of(1.0);
        for lane in live..LANES {
            counts.0[lane] = 0.0;
        }
        zero.if_less(self.hard, zero, counts)
    }

    #[inline(always)]
    pub fn words(&self, counts: Lanes) -> Words {
        let zero = Lanes::of(0.0);
        let mut words = Words::default();
        for (k, sum_of) in words.taps.iter_mut().enumerate() {
            let taps = self.taps[k / 4][k % 4] * counts;
            if !taps.all_at_most(zero) {
                *sum_of = sum(taps);
            }
        }
        words
    }
}

/// Sum of whole numbers in integers: the total may exceed what f32 counts.
#[inline(always)]
pub(super) fn sum(x: Lanes) -> u64 {
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
