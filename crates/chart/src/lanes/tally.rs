//! Taps per combination of status words, lane by lane.

use super::{LANES, Lanes, Words};
use crate::kernel::cpu::Packed;

/// What an estimate says of a tap: places among the combinations.
pub(super) const CLEAR: usize = 0;
pub(super) const AMBIGUOUS: usize = 1;
pub(super) const ROOTLESS: usize = 2;

/// Drives of a tap, or distances, by their words that do not depend on the estimate: none, `strain_limit`, `slipped_off`, both.
pub(super) type Worn = [Lanes; 4];

/// Those of the drives from `from` to `to` of a tap that is above the strain limit, and has slipped off, from these places on.
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
    /// 1 of a design that must be solved tap by tap.
    pub hard: Lanes,
}

impl Tally {
    /// Nothing yet; `hard` as given.
    #[inline(always)]
    pub fn new(hard: Lanes) -> Self {
        let zero = Lanes::of(0.0);
        Self { taps: [[zero; 4]; 3], hard }
    }

    /// Adds the taps of `worn`, of which the estimate says `told`, in the lanes of `share`.
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

    /// Adds the taps between the drives `from` and `to`. `told` pairs each word of the estimate with its share of the lanes. `edges` are the drives
    /// at which the strain limit is passed and the tap slips off; most lie beyond `to`.
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

    /// Adds taps without any other word.
    #[inline(always)]
    pub fn add_clean(&mut self, told: usize, taps: Lanes) {
        self.taps[told][0] = self.taps[told][0] + taps;
    }

    /// Whether the design in `lane` must be solved tap by tap.
    #[inline(always)]
    pub fn is_hard(&self, lane: usize) -> bool {
        self.hard.0[lane] > 0.5
    }

    /// 1 of the first `live` lanes that are not hard.
    #[inline(always)]
    pub fn counts(&self, live: usize) -> Lanes {
        let zero = Lanes::of(0.0);
        let mut counts = Lanes::of(1.0);
        for lane in live..LANES {
            counts.0[lane] = 0.0;
        }
        zero.if_less(self.hard, zero, counts)
    }

    /// Taps per combination of the lanes that `counts` marks.
    #[inline(always)]
    pub fn words(&self, counts: Lanes) -> Words {
        let zero = Lanes::of(0.0);
        let mut words = Words::default();
        for (k, sum_of) in words.taps.iter_mut().enumerate() {
            // Most combinations have no tap.
            let taps = self.taps[k / 4][k % 4] * counts;
            if !taps.all_at_most(zero) {
                *sum_of = sum(taps);
            }
        }
        words
    }
}

/// Of whole numbers; together they may be more than f32 counts.
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
