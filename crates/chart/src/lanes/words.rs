//! Status words of taps in a pack, where nothing else is asked of the estimate.

use super::edges::Edges;
use super::groups::Group;
use super::rows::Rows;
use super::tally::Tally;
use super::tap::{TapSeries, Taps};
use super::theory::Thresholds;
use super::{Lanes, Tables};
use crate::kernel::cpu::Pack;
use crate::kernel::ranking::BEYOND;

impl<const SET: u8> Thresholds<Lanes<SET>> {
    /// q from which, and up to which, the near root is within the range of interest, and q at the peak.
    #[inline(always)]
    pub fn bounds(&self, tap: TapSeries<'_, Lanes<SET>>) -> [Lanes<SET>; 3] {
        let one = Lanes::<SET>::of(1.0);
        let inverse = one / tap.strain;
        [self.low, self.high, self.peak].map(|f| f * inverse - one)
    }
}

impl<const SET: u8> Rows<Lanes<SET>> {
    /// Least and largest K̄ of designs that have a drive of their own: where some taps do not count it is anywhere among the others.
    #[inline(always)]
    pub fn calibrations(&self, taps: &Taps<Lanes<SET>>, complete: &Lanes<SET>) -> [Lanes<SET>; 2] {
        let of = Lanes::<SET>::of;
        let (half, one, power) = (of(0.5), of(1.0), self.own[1]);
        if let Some(fixed) = self.passed.fixed {
            return [one + fixed; 2];
        }
        let mut ends = [self.mean[0] - self.slack[0], self.mean[0] + self.slack[0]];
        if !one.all_at_most(*complete) {
            let mut hull = [of(1e30), of(-1e30)];
            for i in 0..taps.len() {
                let tap = taps.at(i);
                hull = [hull[0].min(tap.kappa[0] - tap.slack[0]), hull[1].max(tap.kappa[0] + tap.slack[0])];
            }
            ends = [half.if_less(*complete, ends[0], hull[0]), half.if_less(*complete, ends[1], hull[1])];
        }
        ends.map(|end| one + power * end)
    }

    /// Adds the words of one tap of designs that have a drive of their own. A tap reads f K̄/K, which is compared with what f is where words begin.
    #[inline(always)]
    pub fn count(
        &self,
        tap: TapSeries<'_, Lanes<SET>>,
        edge: &Edges<Lanes<SET>>,
        [least, most]: &[Lanes<SET>; 2],
        tally: &mut Tally<Lanes<SET>>,
    ) {
        let of = Lanes::<SET>::of;
        let (zero, one) = (of(0.0), of(1.0));
        let power = self.own[1];
        let k = one + power * tap.kappa[0];
        let slack = power * tap.slack[0];
        let [slow, fast] = [k - slack, k + slack];
        let words = &self.design.words;
        let [from, to] = [tap.strain * *least, tap.strain * *most];
        let rootless = from.if_less(words.peak * fast, zero, one);
        let rooted = to.if_less(words.peak * slow, one, zero);
        let near = rooted * from.if_less(words.low * fast, zero, (words.high * slow).if_less(to, zero, one));
        let clear = rooted * to.if_less(words.low * slow, one, (words.high * fast).if_less(from, one, zero));
        tally.hard = tally.hard.max(one - rootless.max(near).max(clear));
        tally.rootless = tally.rootless + rootless;
        tally.ambiguous = tally.ambiguous + near;
        if edge.none {
            tally.ok = tally.ok + clear;
        } else {
            tally.hard = tally.hard.max(edge.open);
            tally.strain = tally.strain + (one - edge.above);
            tally.slipped = tally.slipped + (one - edge.slipped);
            tally.ok = tally.ok + clear * edge.above.min(edge.slipped);
        }
        let [fewest, highest] = BEYOND[0].map(|q| of(1.0 + q));
        // q below that of a contact nearly infinitely far: f K̄ − f K < −0.9 (f − f_∞) K.
        let far = tap.strain - of(0.9) * (tap.strain - words.farthest);
        let far = (far * slow).max(far * fast);
        let usual =
            far.all_at_most(from) && (fewest * fast).all_at_most(*least) && most.all_at_most(highest * slow);
        if !usual {
            let beyond = from.if_less(far, one, least.if_less(fewest * fast, one, zero));
            tally.hard = tally.hard.max((highest * slow).if_less(*most, one, beyond));
        }
    }
}

/// What a group of drives gives a tap: least and largest q.
type Reach<T> = [T; 2];

impl<const SET: u8> Rows<Lanes<SET>> {
    /// Least and largest q of a tap over the drives of `group`. q = (K̄ − K)(1 + δ), and K̄ − K is θᵉ times a series; where some taps do not
    /// count, K̄ is anywhere among the others.
    #[inline(always)]
    fn reach(
        &self,
        group: &Group,
        tap: TapSeries<'_, Lanes<SET>>,
        every: bool,
        m: usize,
    ) -> Reach<Lanes<SET>> {
        let of = Lanes::<SET>::of;
        let zero = of(0.0);
        let [middle, around] = &group.basis;
        let (mut lo, mut hi) = (zero, zero);
        if every || self.passed.fixed.is_some() {
            let (mut sum, mut apart) = (zero, zero);
            for k in 0..m {
                let mean = if self.passed.fixed.is_some() { zero } else { self.mean[k] };
                let lacks = mean - tap.kappa[k];
                sum = lacks.mul_add(Pack::splat(middle[k]), sum);
                apart = lacks.abs().mul_add(Pack::splat(around[k]), apart);
            }
            (lo, hi) = (sum - apart, sum + apart);
        } else {
            for k in 0..m {
                let apart = (self.hull[1][k] - tap.kappa[k]).max(tap.kappa[k] - self.hull[0][k]);
                hi = apart.mul_add(Pack::splat(middle[k].abs() + around[k]), hi);
            }
            lo = lo - hi;
        }
        let [least, most] = group.powers.map(Lanes::<SET>::splat);
        let fixed = self.passed.fixed.unwrap_or(zero);
        let lo = lo * lo.if_less(zero, most, least) + fixed;
        let hi = hi * hi.if_less(zero, least, most) + fixed;
        // 1 + δ, and rounding.
        let (less, more) = (of(0.99999) - self.largest, of(1.00001) + self.largest);
        [lo * lo.if_less(zero, more, less) - of(1e-7), hi * hi.if_less(zero, less, more) + of(1e-7)]
    }

    /// Adds the words of one tap over all drives that designs share; 1 to those of `rootless_at` at which it has no distance, where that is asked for.
    #[inline(always)]
    pub fn count_shared(
        &self,
        tables: &Tables,
        tap: TapSeries<'_, Lanes<SET>>,
        edges: &Edges<Lanes<SET>>,
        complete: &Lanes<SET>,
        (tally, rootless_at): (&mut Tally<Lanes<SET>>, &mut [Lanes<SET>]),
    ) {
        let of = Lanes::<SET>::of;
        let m = tables.points;
        let drives = tables.angles.len();
        let every = of(drives as f64).all_at_most(*complete);
        let [whole_range, groups @ ..] = tables.groups.as_slice() else { return };
        let [least, most] = self.reach(whole_range, tap, every, m);
        let bounds = self.design.words.bounds(tap);
        let farthest = of(1.0) - self.design.words.farthest / tap.strain;
        let (zero, one) = (of(0.0), of(1.0));
        // 1 where a reading may lie below what the farthest contact gives.
        let [fewest, highest] = BEYOND[1];
        let beyond = (of(-0.9) * farthest).max(of(fewest));
        let beyond = least.if_less(beyond, one, of(highest).if_less(most, one, zero));

        let all = of(drives as f64);
        tally.strain = tally.strain + (all - edges.above);
        tally.slipped = tally.slipped + (all - edges.slipped);
        let clean = edges.above.min(edges.slipped);
        let [clear, ambiguous, _] = certain(bounds, [least, most]);
        let near = one - beyond;
        tally.ok = tally.ok + near * clear * clean;
        tally.ambiguous = tally.ambiguous + near * ambiguous * all;
        let rest = near * (one - clear) * (one - ambiguous);
        let whole = complete.if_less(all, zero, one);
        tally.hard = tally.hard.max(beyond).max(rest * (one - whole));
        let open = rest * whole;
        if open.all_at_most(zero) {
            return;
        }
        let [mut rootless, mut twice, mut free] = [zero; 3];
        for group in groups {
            let [clear, ambiguous, none] = certain(bounds, self.reach(group, tap, true, m));
            if open.all_at_most(clear + ambiguous + none) {
                let (from, n) = (of(group.drives.start as f64), of(group.drives.len() as f64));
                rootless = n.mul_add(none, rootless);
                twice = n.mul_add(ambiguous, twice);
                free = clear.mul_add((clean - from).max(zero).min(n), free);
                for at in rootless_at.get_mut(group.drives.clone()).unwrap_or_default() {
                    *at = at.max(open * none);
                }
                continue;
            }
            let [low, high, peak] = bounds;
            for j in group.drives.clone() {
                let row = self.row::<false>(tables, j);
                let q = self.miss(&row, tap, m);
                let none = peak.if_less(q, one, zero);
                let two = q.if_less(low, zero, high.if_less(q, zero, one));
                rootless = rootless + none;
                if let Some(at) = rootless_at.get_mut(j) {
                    *at = at.max(open * none);
                }
                twice = twice + two;
                free = free + of(j as f64).if_less(clean, one - none.max(two), zero);
            }
        }
        tally.rootless = tally.rootless + open * rootless;
        tally.ambiguous = tally.ambiguous + open * twice;
        tally.ok = tally.ok + open * free;
    }
}

/// 1 where a q of the range has neither word for certain, where it is ambiguous, and where it has no root.
#[inline(always)]
fn certain<const SET: u8>(
    [low, high, peak]: [Lanes<SET>; 3],
    [least, most]: Reach<Lanes<SET>>,
) -> [Lanes<SET>; 3] {
    let (zero, one) = (Lanes::<SET>::of(0.0), Lanes::<SET>::of(1.0));
    let rooted = most.if_less(peak, one, zero);
    let clear = rooted * most.if_less(low, one, high.if_less(least, one, zero));
    let near = rooted * low.if_less(least, most.if_less(high, one, zero), zero) * (one - clear);
    [clear, near, peak.if_less(least, one, zero)]
}
