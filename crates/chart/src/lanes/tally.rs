//! Taps per combination of status words, lane by lane.

use std::ops::Range;

use super::{LANES, Lanes, Words};
use crate::kernel::cpu::Packed;

/// Shares of lanes by result of an estimate, in the order of [`crate::kernel::ranking::TOLD`].
pub(super) type Results = [Lanes; 3];

#[inline(always)]
pub(super) fn times([clear, ambiguous, rootless]: Results, share: Lanes) -> Results {
    [clear * share, ambiguous * share, rootless * share]
}

/// Taps of each lane per combination; whole numbers of at most 2²⁴, up to which f32 counts exactly.
pub(super) struct Tally<'a> {
    /// For each result, by words that do not depend on the estimate: no word, `strain_limit`, `slipped_off`, both.
    pub taps: [[Lanes; 4]; 3],
    /// 1 for a design that must be solved tap by tap.
    pub hard: Lanes,
    /// 1 at each drive at which a tap has no distance; empty where no row needs it.
    pub rootless: &'a mut [Lanes],
}

impl<'a> Tally<'a> {
    #[inline(always)]
    pub fn new(hard: Lanes, rootless: &'a mut [Lanes]) -> Self {
        Self { taps: [[Lanes::of(0.0); 4]; 3], hard, rootless }
    }

    /// Adds `results` at `drives` of a tap that is above the strain limit from the drive `above` on and has slipped off from `slipped` on.
    #[inline(always)]
    pub fn add(&mut self, results: Results, [above, slipped]: [Lanes; 2], drives: Range<usize>) {
        let zero = Lanes::of(0.0);
        let [from, to] = [Lanes::of(drives.start as f64), Lanes::of(drives.end as f64)];
        let is_clean = to.all_at_most(above.min(slipped));
        let mut worn = [to - from, zero, zero, zero];
        if !is_clean {
            let (above, slipped) = (above.max(from).min(to), slipped.max(from).min(to));
            let clean = above.min(slipped);
            worn = [clean - from, slipped - clean, above - clean, to - above.max(slipped)];
        }
        for (taps, share) in self.taps.iter_mut().zip(results) {
            // Most packs have only clear taps.
            if share.all_at_most(zero) {
                continue;
            }
            taps[0] = share.mul_add(worn[0], taps[0]);
            if !is_clean {
                for k in 1..worn.len() {
                    taps[k] = share.mul_add(worn[k], taps[k]);
                }
            }
        }
        self.mark(results[2], drives);
    }

    #[inline(always)]
    pub fn mark(&mut self, rootless: Lanes, drives: Range<usize>) {
        for at in self.rootless.get_mut(drives).unwrap_or_default() {
            *at = at.max(rootless);
        }
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

/// Sum of whole numbers; the total may exceed what f32 counts.
#[inline(always)]
pub(super) fn sum(x: Lanes) -> u64 {
    let mut sums = [0.0; 4];
    for part in x.0.as_chunks::<4>().0 {
        for k in 0..4 {
            sums[k] += f64::from(part[k]);
        }
    }
    (sums[0] + sums[1] + sums[2] + sums[3]) as u64
}
