//! Status words of taps in a pack, where nothing else is asked of the estimate.

use super::edges::Edges;
use super::rows::Rows;
use super::tally::Tally;
use super::tap::TapSeries;
use super::theory::Thresholds;
use super::{Lanes, ORDERS, Tables};
use crate::kernel::cpu::Pack;
use crate::kernel::ranking::BEYOND;

impl<const FMA: bool> Thresholds<Lanes<FMA>> {
    /// q from which, and up to which, the near root is within the range of interest, and q at the peak.
    #[inline(always)]
    pub fn bounds(&self, tap: TapSeries<'_, Lanes<FMA>>) -> [Lanes<FMA>; 3] {
        let one = Lanes::<FMA>::of(1.0);
        let inverse = one / tap.strain;
        [self.low, self.high, self.peak].map(|f| f * inverse - one)
    }
}

impl<const FMA: bool> Rows<Lanes<FMA>> {
    /// Adds the words of one tap of designs that have a drive of their own. A tap reads f K̄/K, which is compared with what f is where words begin.
    #[inline(always)]
    pub fn count(
        &self,
        tap: TapSeries<'_, Lanes<FMA>>,
        edge: &Edges<Lanes<FMA>>,
        complete: &Lanes<FMA>,
        tally: &mut Tally<Lanes<FMA>>,
    ) {
        let of = Lanes::<FMA>::of;
        let (zero, half, one) = (of(0.0), of(0.5), of(1.0));
        let power = self.own[1];
        let k = one + power * tap.kappa[0];
        // Where some taps do not count K̄ is anywhere among the others.
        let whole = half.if_less(*complete, one, zero);
        let calibration = match self.passed.fixed {
            Some(fixed) => fixed,
            None => power * self.mean[0],
        };
        let (mut least, mut most) = (calibration, calibration);
        if self.passed.fixed.is_none() && !one.all_at_most(*complete) {
            let ends = [power * self.hull[0][0], power * self.hull[1][0]];
            least = half.if_less(whole, least, ends[0].min(ends[1]));
            most = half.if_less(whole, most, ends[0].max(ends[1]));
        }
        let (least, most) = (one + least, one + most);
        let words = &self.design.words;
        let [from, to] = [tap.strain * least, tap.strain * most];
        let [low, high, peak] = [words.low * k, words.high * k, words.peak * k];
        let rootless = from.if_less(peak, zero, one);
        let rooted = to.if_less(peak, one, zero);
        let near = rooted * from.if_less(low, zero, high.if_less(to, zero, one));
        let clear = rooted * to.if_less(low, one, high.if_less(from, one, zero));
        let [fewest, highest] = BEYOND[0];
        // q below that of a contact nearly infinitely far: f K̄ − f K < −0.9 (f − f_∞) K.
        let far = (tap.strain - of(0.9) * (tap.strain - words.farthest)) * k;
        let beyond = from.if_less(far, one, least.if_less(of(1.0 + fewest) * k, one, zero));
        let beyond = (of(1.0 + highest) * k).if_less(most, one, beyond);
        let undecided = one - rootless.max(near).max(clear);
        tally.hard = tally.hard.max(beyond).max(undecided);
        tally.rootless = tally.rootless + rootless;
        tally.ambiguous = tally.ambiguous + near;
        tally.strain = tally.strain + (one - edge.above);
        tally.slipped = tally.slipped + (one - edge.slipped);
        tally.ok = tally.ok + clear * edge.above.min(edge.slipped);
    }
}

/// Least and largest power of the drives that designs share, by which most taps' words are known at once.
pub(super) struct Decided<T> {
    powers: [T; 2],
}

impl<const FMA: bool> Decided<Lanes<FMA>> {
    #[inline(always)]
    pub fn new(tables: &Tables) -> Self {
        let ends = [&tables.angles[0], &tables.angles[tables.angles.len() - 1]];
        Self { powers: ends.map(|angle| Pack::splat(angle.stroke.power)) }
    }

    /// Least and largest q of a tap over all drives. q = (K̄ − K)(1 + δ), and K̄ − K is θᵉ times a series; where some taps do not
    /// count, K̄ is anywhere among the others.
    #[inline(always)]
    fn range(
        &self,
        rows: &Rows<Lanes<FMA>>,
        tap: TapSeries<'_, Lanes<FMA>>,
        every: bool,
        m: usize,
    ) -> [Lanes<FMA>; 2] {
        let of = Lanes::<FMA>::of;
        let zero = of(0.0);
        let mean = if rows.passed.fixed.is_some() { [zero; ORDERS] } else { rows.mean };
        let middle = mean[0] - tap.kappa[0];
        let mut around = zero;
        for k in 1..m {
            around = around + (mean[k] - tap.kappa[k]).abs();
        }
        let (mut lo, mut hi) = (middle - around, middle + around);
        if !every && rows.passed.fixed.is_none() {
            let mut apart = zero;
            for k in 0..m {
                apart = apart + (rows.hull[1][k] - tap.kappa[k]).max(tap.kappa[k] - rows.hull[0][k]);
            }
            (lo, hi) = (zero - apart, apart);
        }
        let [least, most] = self.powers;
        let fixed = rows.passed.fixed.unwrap_or(zero);
        let lo = lo * lo.if_less(zero, most, least) + fixed;
        let hi = hi * hi.if_less(zero, least, most) + fixed;
        // 1 + δ, and rounding.
        let (less, more) = (of(0.99999) - rows.largest, of(1.00001) + rows.largest);
        [lo * lo.if_less(zero, more, less) - of(1e-7), hi * hi.if_less(zero, less, more) + of(1e-7)]
    }

    /// Adds the words of one tap over all drives; 1 to those of `rootless` at which it has no distance, where that is asked for.
    #[inline(always)]
    pub fn count(
        &self,
        tables: &Tables,
        rows: &Rows<Lanes<FMA>>,
        tap: TapSeries<'_, Lanes<FMA>>,
        edges: &Edges<Lanes<FMA>>,
        complete: &Lanes<FMA>,
        (tally, rootless_at): (&mut Tally<Lanes<FMA>>, &mut [Lanes<FMA>]),
    ) {
        let of = Lanes::<FMA>::of;
        let m = tables.points;
        let drives = tables.angles.len();
        let every = of(drives as f64).all_at_most(*complete);
        let [least, most] = self.range(rows, tap, every, m);
        let [low, high, peak] = rows.design.words.bounds(tap);
        let farthest = of(1.0) - rows.design.words.farthest / tap.strain;
        let (zero, one) = (of(0.0), of(1.0));
        // 1 where every drive has a root; where each is clear of the other word; where each has it; where a reading may lie below
        // what the farthest contact gives.
        let certain = most.if_less(peak, one, zero);
        let clear = most.if_less(low, one, high.if_less(least, one, zero));
        let ambiguous = low.if_less(least, most.if_less(high, one, zero), zero);
        let [fewest, highest] = BEYOND[1];
        let beyond = (of(-0.9) * farthest).max(of(fewest));
        let beyond = least.if_less(beyond, one, of(highest).if_less(most, one, zero));

        let all = of(drives as f64);
        tally.strain = tally.strain + (all - edges.above);
        tally.slipped = tally.slipped + (all - edges.slipped);
        let clear = certain * clear;
        let ambiguous = certain * ambiguous * (one - clear);
        let near = one - beyond;
        tally.ok = tally.ok + near * clear * edges.above.min(edges.slipped);
        tally.ambiguous = tally.ambiguous + near * ambiguous * all;
        let rest = near * (one - clear) * (one - ambiguous);
        let whole = complete.if_less(all, zero, one);
        tally.hard = tally.hard.max(beyond).max(rest * (one - whole));
        let open = rest * whole;
        if open.all_at_most(zero) {
            return;
        }
        let clean = edges.above.min(edges.slipped);
        let [mut rootless, mut twice, mut free] = [zero; 3];
        for j in 0..drives {
            let row = rows.row::<false>(tables, j);
            let q = rows.miss(&row, tap, m);
            let none = peak.if_less(q, one, zero);
            let two = q.if_less(low, zero, high.if_less(q, zero, one));
            rootless = rootless + none;
            if let Some(at) = rootless_at.get_mut(j) {
                *at = at.max(open * none);
            }
            twice = twice + two;
            free = free + of(j as f64).if_less(clean, one - none.max(two), zero);
        }
        tally.rootless = tally.rootless + open * rootless;
        tally.ambiguous = tally.ambiguous + open * twice;
        tally.ok = tally.ok + open * free;
    }
}
