//! Status words of taps in a pack, if nothing else of the estimate is needed.

use super::edges::Edges;
use super::groups::Group;
use super::neighbours::{Place, picked};
use super::rows::Rows;
use super::tally::{AMBIGUOUS, CLEAR, ROOTLESS, Tally, worn};
use super::tap::{TapSeries, Taps};
use super::theory::Thresholds;
use super::{Lanes, Tables};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::BEYOND;

/// Largest deviation of the strain at which no reading is far from that of its calibration.
const USUAL: f64 = 0.8;
const _: () = assert!(
    (1.0 - USUAL) / (1.0 + USUAL) > 1.0 + BEYOND[0][0] && (1.0 + USUAL) / (1.0 - USUAL) < 1.0 + BEYOND[0][1]
);

pub(super) struct Calibrations {
    /// Least and largest K̄: where some taps do not count it is anywhere among the others.
    least: Lanes,
    most: Lanes,
    /// K̄ and the K of all taps are exact.
    known: bool,
    /// No reading is as far off as [`BEYOND`].
    pub usual: bool,
}

impl Calibrations {
    #[inline(always)]
    pub fn picked(&self, places: &[Place]) -> Self {
        Self { least: picked(&self.least, places), most: picked(&self.most, places), ..*self }
    }

    /// 1 where taps certainly have no root, an ambiguous one, or a clear one, for f and K within bounds.
    #[inline(always)]
    pub fn certain(
        &self,
        words: &Thresholds,
        [least_f, most_f]: [Lanes; 2],
        [least_k, most_k]: [Lanes; 2],
    ) -> [Lanes; 3] {
        let (zero, one) = (Lanes::of(0.0), Lanes::of(1.0));
        let (from, to) = (least_f * self.least, most_f * self.most);
        let rootless = from.if_less(words.peak * most_k, zero, one);
        let rooted = to.if_less(words.peak * least_k, one, zero);
        let near = from.if_less(words.low * most_k, zero, (words.high * least_k).if_less(to, zero, one));
        let clear = to.if_less(words.low * least_k, one, (words.high * most_k).if_less(from, one, zero));
        [rootless, rooted * near, rooted * clear]
    }
}

impl Thresholds {
    /// q from which, and up to which, the near root is within the range of interest, and q at the peak.
    #[inline(always)]
    pub fn bounds(&self, tap: TapSeries<'_>) -> [Lanes; 3] {
        let one = Lanes::of(1.0);
        let inverse = one / tap.strain;
        [self.low * inverse - one, self.high * inverse - one, self.peak * inverse - one]
    }
}

impl Rows {
    #[inline(always)]
    pub fn calibrations(&self, taps: &Taps, complete: &Lanes) -> Calibrations {
        let of = Lanes::of;
        let (zero, half, one, power) = (of(0.0), of(0.5), of(1.0), self.own[1]);
        let whole = one.all_at_most(*complete);
        let [mut least, mut most] = [self.mean[0] - self.slack[0], self.mean[0] + self.slack[0]];
        if let Some(fixed) = self.passed.fixed {
            let fixed = one + fixed;
            return Calibrations {
                least: fixed,
                most: fixed,
                known: self.slack[1].all_at_most(zero),
                usual: false,
            };
        }
        if !whole {
            let mut hull = [of(1e30), of(-1e30)];
            for i in 0..taps.len() {
                let tap = taps.at(i);
                hull = [hull[0].min(tap.kappa[0] - tap.slack[0]), hull[1].max(tap.kappa[0] + tap.slack[0])];
            }
            least = half.if_less(*complete, least, hull[0]);
            most = half.if_less(*complete, most, hull[1]);
        }
        Calibrations {
            least: one + power * least,
            most: one + power * most,
            known: whole && self.slack[1].all_at_most(zero),
            // K̄/K then lies between (1 − δ)/(1 + δ) and its inverse.
            usual: self.largest.all_at_most(of(USUAL)) && self.design.words.farthest.all_at_most(zero),
        }
    }

    /// Adds the words of one tap of designs that each have a drive. The reading f K̄/K is compared with f where words begin.
    #[inline(always)]
    pub fn count(
        &self,
        (tap, a): (TapSeries<'_>, f32),
        edge: &Edges,
        calibrations: &Calibrations,
        tally: &mut Tally,
    ) {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let power = self.own[1];
        let k = power.mul_add(tap.kappa[0], one);
        let words = &self.design.words;
        let (clear, near, rootless);
        if calibrations.known {
            let read = tap.strain * calibrations.least;
            rootless = read.if_less(words.peak * k, zero, one);
            let within = read.if_less(words.low * k, zero, (words.high * k).if_less(read, zero, one));
            near = within * (one - rootless);
            clear = one - rootless - near;
        } else {
            let slack = power * tap.slack[0];
            [rootless, near, clear] = calibrations.certain(words, [tap.strain; 2], [k - slack, k + slack]);
            tally.hard = tally.hard.max(one - rootless.max(near).max(clear));
        }
        let told = [(CLEAR, clear), (AMBIGUOUS, near), (ROOTLESS, rootless)];
        if edge.none {
            for (told, taps) in told {
                tally.add_clean(told, taps);
            }
        } else {
            tally.hard = tally.hard.max(edge.open);
            let worn = worn([edge.above, edge.slipped], [zero, one]);
            for (told, share) in told {
                tally.add(told, share, &worn);
            }
        }
        if !calibrations.usual {
            let slack = power * tap.slack[0];
            let [fewest, highest] = [of(1.0 + BEYOND[0][0]), of(1.0 + BEYOND[0][1])];
            let out = (tap.strain * calibrations.least).if_less(self.design.end(a) * (k + slack), one, zero);
            tally.hard = tally.hard.max(clear * out);
            // q below that of a contact nearly infinitely far: f K̄ − f K < −0.9 (f − f_∞) K.
            let far = tap.strain - of(0.9) * (tap.strain - words.farthest);
            let far = (far * (k - slack)).max(far * (k + slack));
            let beyond = calibrations.least.if_less(fewest * (k + slack), one, zero);
            let beyond = (tap.strain * calibrations.least).if_less(far, one, beyond);
            tally.hard = tally.hard.max((highest * (k - slack)).if_less(calibrations.most, one, beyond));
        }
    }
}

type Reach = [Lanes; 2];

impl Rows {
    /// Least and largest q of a tap over the drives of `group`; q = (K̄ − K)(1 + δ). If some taps do not count, K̄ is anywhere among the others.
    #[inline(always)]
    fn reach(&self, group: &Group, tap: TapSeries<'_>, every: bool, m: usize) -> Reach {
        let of = Lanes::of;
        let zero = of(0.0);
        let [middle, around] = &group.basis;
        let (mut lo, mut hi) = (zero, zero);
        if every || self.passed.fixed.is_some() {
            let (mut sum, mut apart) = (zero, zero);
            for k in 0..m {
                let mean = if self.passed.fixed.is_some() { zero } else { self.mean[k] };
                let lacks = mean - tap.kappa[k];
                sum = lacks.mul_add(Lanes::splat(middle[k]), sum);
                apart = lacks.abs().mul_add(Lanes::splat(around[k]), apart);
            }
            (lo, hi) = (sum - apart, sum + apart);
        } else {
            for k in 0..m {
                let apart = (self.hull[1][k] - tap.kappa[k]).max(tap.kappa[k] - self.hull[0][k]);
                hi = apart.mul_add(Lanes::splat(middle[k].abs() + around[k]), hi);
            }
            lo = lo - hi;
        }
        let [least, most] = [Lanes::splat(group.powers[0]), Lanes::splat(group.powers[1])];
        let fixed = self.passed.fixed.unwrap_or(zero);
        let lo = lo * lo.if_less(zero, most, least) + fixed;
        let hi = hi * hi.if_less(zero, least, most) + fixed;
        let (less, more) = (of(0.99999) - self.largest, of(1.00001) + self.largest);
        [lo * lo.if_less(zero, more, less) - of(1e-7), hi * hi.if_less(zero, less, more) + of(1e-7)]
    }

    /// Adds the words of one tap over all shared drives; sets 1 in `rootless_at`, unless empty, at drives without a distance.
    #[inline(always)]
    pub fn count_shared(
        &self,
        tables: &Tables,
        (tap, a): (TapSeries<'_>, f32),
        edges: &Edges,
        complete: &Lanes,
        (tally, rootless_at): (&mut Tally, &mut [Lanes]),
    ) {
        let of = Lanes::of;
        let m = tables.points;
        let drives = tables.angles.len();
        let every = of(drives as f64).all_at_most(*complete);
        let [whole_range, groups @ ..] = tables.groups.as_slice() else { return };
        let [least, most] = self.reach(whole_range, tap, every, m);
        let bounds = self.design.words.bounds(tap);
        let farthest = of(1.0) - self.design.words.farthest / tap.strain;
        let (zero, one) = (of(0.0), of(1.0));
        let [fewest, highest] = BEYOND[1];
        let beyond = (of(-0.9) * farthest).max(of(fewest));
        let beyond = least.if_less(beyond, one, of(highest).if_less(most, one, zero));

        let all = of(drives as f64);
        // A widening whisker may have a word beyond its tip.
        let out = least.if_less(self.design.end(a) / tap.strain - one, one, zero);
        let edges = [edges.above, edges.slipped];
        let [clear, ambiguous, _] = certain(bounds, [least, most]);
        let beyond = beyond.max(out * (one - ambiguous));
        let near = one - beyond;
        let told = [(CLEAR, near * clear), (AMBIGUOUS, near * ambiguous)];
        tally.add_between(&told, edges, [zero, all]);
        let rest = near * (one - clear) * (one - ambiguous);
        let whole = complete.if_less(all, zero, one);
        tally.hard = tally.hard.max(beyond).max(rest * (one - whole));
        let open = rest * whole;
        if open.all_at_most(zero) {
            return;
        }
        for group in groups {
            let ends = [of(group.drives.start as f64), of(group.drives.end as f64)];
            let [clear, ambiguous, none] = certain(bounds, self.reach(group, tap, true, m));
            if open.all_at_most(clear + ambiguous + none) {
                let told = [(CLEAR, open * clear), (AMBIGUOUS, open * ambiguous), (ROOTLESS, open * none)];
                tally.add_between(&told, edges, ends);
                for at in rootless_at.get_mut(group.drives.clone()).unwrap_or_default() {
                    *at = at.max(open * none);
                }
                continue;
            }
            let [low, high, peak] = bounds;
            // A group without limits is summed first.
            let free = ends[1].all_at_most(edges[0].min(edges[1]));
            let mut drives = [(CLEAR, zero), (AMBIGUOUS, zero), (ROOTLESS, zero)];
            for j in group.drives.clone() {
                let row = self.row::<false>(tables, j);
                let q = self.miss(&row, tap, m);
                let none = peak.if_less(q, one, zero);
                let two = q.if_less(low, zero, high.if_less(q, zero, one));
                if let Some(at) = rootless_at.get_mut(j) {
                    *at = at.max(open * none);
                }
                let clear = one - none.max(two);
                if free {
                    drives[CLEAR].1 = drives[CLEAR].1 + open * clear;
                    drives[AMBIGUOUS].1 = drives[AMBIGUOUS].1 + open * two;
                    drives[ROOTLESS].1 = drives[ROOTLESS].1 + open * none;
                } else {
                    let told = [(CLEAR, open * clear), (AMBIGUOUS, open * two), (ROOTLESS, open * none)];
                    tally.add_between(&told, edges, [of(j as f64), of(j as f64 + 1.0)]);
                }
            }
            if free {
                for (told, taps) in drives {
                    tally.add_clean(told, taps);
                }
            }
        }
    }
}

/// 1 where all q of the range are certainly clear, ambiguous, or without a root.
#[inline(always)]
fn certain([low, high, peak]: [Lanes; 3], [least, most]: Reach) -> [Lanes; 3] {
    let (zero, one) = (Lanes::of(0.0), Lanes::of(1.0));
    let rooted = most.if_less(peak, one, zero);
    let clear = rooted * most.if_less(low, one, high.if_less(least, one, zero));
    let near = rooted * low.if_less(least, most.if_less(high, one, zero), zero) * (one - clear);
    [clear, near, peak.if_less(least, one, zero)]
}
