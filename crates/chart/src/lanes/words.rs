//! Status words of taps in a pack, if nothing else of the estimate is needed.

use super::groups::Group;
use super::rows::Rows;
use super::tally::{Results, Tally, times};
use super::tap::{TapSeries, Taps};
use super::theory::{Bounds, Thresholds};
use super::{Lanes, ORDERS, Ranker};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::BEYOND;

/// Largest deviation of the strain at which no reading is far from that of its calibration.
const USUAL: f64 = 0.8;
const _: () = assert!(
    (1.0 - USUAL) / (1.0 + USUAL) > 1.0 + BEYOND[0][0] && (1.0 + USUAL) / (1.0 - USUAL) < 1.0 + BEYOND[0][1]
);

/// Series of K̄ − 1 over driveᵉ, and bounds on their errors: where some taps do not count K̄ is anywhere among the others.
pub(super) struct Calibration {
    centre: [Lanes; ORDERS],
    radius: [Lanes; ORDERS],
    /// Without errors.
    exact: bool,
}

/// Least and largest value.
pub(super) type Reach = [Lanes; 2];

/// 1 where all of a range is certainly clear, ambiguous, or without a root: readings over f, less 1, or in the unit of the limits.
#[inline(always)]
pub(super) fn certain(([low, high, peak], unseen): Bounds, [least, most]: Reach) -> Results {
    let (zero, one) = (Lanes::of(0.0), Lanes::of(1.0));
    let rooted = peak.if_less(most, zero, one);
    let mut clear = rooted * most.if_less(low, one, high.if_less(least, one, zero));
    let mut near = rooted * least.if_less(low, zero, high.if_less(most, zero, one));
    if let Some([low, high]) = unseen {
        clear = clear * most.if_less(low, one, high.if_less(least, one, zero));
        near = near.max(rooted * least.if_less(low, zero, high.if_less(most, zero, one)));
    }
    near = near * (one - clear);
    [clear, near, peak.if_less(least, one, zero)]
}

impl Thresholds {
    /// q from which, and up to which, the near root is within the range of interest, and q at the peak, of a tap with f = `strain`.
    #[inline(always)]
    pub fn bounds(&self, strain: Lanes) -> Bounds {
        let one = Lanes::of(1.0);
        let inverse = one / strain;
        let three = [self.low * inverse - one, self.high * inverse - one, self.peak * inverse - one];
        let Some([from, to]) = self.unseen else { return (three, None) };
        (three, Some([from * inverse - one, to * inverse - one]))
    }
}

impl Rows {
    /// `complete`: first drive at which some tap of each design does not count.
    #[inline(always)]
    pub fn calibration_of<const OWN: bool>(
        &self,
        ranker: &Ranker,
        taps: &Taps,
        complete: Lanes,
    ) -> Calibration {
        let (zero, half, all) = (Lanes::of(0.0), Lanes::of(0.5), Lanes::of(ranker.drives::<OWN>() as f64));
        let mut known = Calibration { centre: [zero; ORDERS], radius: [zero; ORDERS], exact: true };
        if self.passed.fixed.is_some() {
            return known;
        }
        let partly = !all.all_at_most(complete);
        known.exact = !partly && self.slack[0].all_at_most(zero);
        for k in 0..ranker.orders::<OWN>() {
            (known.centre[k], known.radius[k]) = (self.mean[k], self.slack[0]);
            if partly {
                let [mut least, mut most] = [Lanes::of(1e30), Lanes::of(-1e30)];
                for i in 0..taps.len() {
                    let tap = taps.at(i);
                    least = least.min(tap.kappa[k] - tap.slack[0]);
                    most = most.max(tap.kappa[k] + tap.slack[0]);
                }
                known.centre[k] = complete.if_less(all, half * (least + most), known.centre[k]);
                known.radius[k] = complete.if_less(all, half * (most - least), known.radius[k]);
            }
        }
        known
    }

    /// No reading is as far from its calibration as [`BEYOND`]: K̄/K lies between (1 − δ)/(1 + δ) and its inverse.
    #[inline(always)]
    pub fn is_usual(&self) -> bool {
        let is_narrowing = self.design.words.farthest.all_at_most(Lanes::of(0.0));
        self.passed.fixed.is_none() && self.largest.all_at_most(Lanes::of(USUAL)) && is_narrowing
    }

    /// Least and largest q of a tap over the drives of `group`; q = (K̄ − K)/K.
    #[inline(always)]
    fn reach<const OWN: bool>(
        &self,
        group: &Group,
        tap: TapSeries<'_>,
        known: &Calibration,
        m: usize,
    ) -> Reach {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [middle, around] = &group.basis;
        let (mut sum, mut apart) = (zero, zero);
        for k in 0..m {
            let lacks = known.centre[k] - tap.kappa[k];
            sum = lacks.mul_add(Lanes::splat(middle[k]), sum);
            apart = lacks.abs().mul_add(Lanes::splat(around[k]), apart);
        }
        for k in 0..if known.exact { 0 } else { m } {
            apart = known.radius[k].mul_add(Lanes::splat(middle[k].abs() + around[k]), apart);
        }
        let (mut powers, mut slack) = (group.powers.map(Lanes::splat), of(1e-7));
        // Bounds of 1/K = 1 + δ.
        let (mut less, mut more) = (of(0.99999) - self.largest, of(1.00001) + self.largest);
        if OWN {
            (powers, slack, apart) = ([self.own[1]; 2], zero, apart + tap.slack[0]);
            // 1/K at each design's drive, K within x of itself: 1 − x < 1/(1 + x), 1/(1 − x) < 1 + 2 x.
            let inverse = one / self.own[1].mul_add(tap.kappa[0], one);
            let x = self.own[1] * tap.slack[0] * inverse;
            less = inverse - inverse * x;
            more = of(0.4).if_less(x, of(1e30), inverse + inverse * (x + x));
        }
        let fixed = self.passed.fixed.unwrap_or(zero);
        let (lo, hi) = (sum - apart, sum + apart);
        let lo = lo * lo.if_less(zero, powers[1], powers[0]) + fixed;
        let hi = hi * hi.if_less(zero, powers[0], powers[1]) + fixed;
        [lo * lo.if_less(zero, more, less) - slack, hi * hi.if_less(zero, less, more) + slack]
    }

    /// Adds the words of one tap at all drives.
    #[inline(always)]
    pub fn count<const OWN: bool>(
        &self,
        ranker: &Ranker,
        (tap, a, edges): (TapSeries<'_>, f32, [Lanes; 2]),
        (complete, known): (Lanes, &Calibration),
        tally: &mut Tally<'_>,
    ) {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let (m, drives) = (ranker.orders::<OWN>(), ranker.drives::<OWN>());
        let [whole_range, groups @ ..] = ranker.groups.as_slice() else { return };
        let bounds = self.design.words.bounds(tap.strain);
        let [least, most] = self.reach::<OWN>(whole_range, tap, known, m);
        let results = certain(bounds, [least, most]);
        let known_word = results[0] + results[1] + results[2];

        let mut near = one;
        if !(OWN && self.is_usual()) {
            let [fewest, highest] = BEYOND[usize::from(!OWN)];
            let inverse = one / tap.strain;
            let farthest = (of(0.9) * (self.design.words.farthest * inverse - one)).max(of(fewest));
            let beyond = least.if_less(farthest, one, of(highest).if_less(most, one, zero));
            // A widening whisker may have a word beyond its tip.
            let out = least.if_less(self.design.end(a) * inverse - one, one, zero);
            near = one - beyond.max(out * (one - results[1]));
        }
        tally.add(times(results, near), edges, 0..drives);
        let open = near * (one - known_word);
        let whole = if OWN { zero } else { complete.if_less(of(drives as f64), zero, one) };
        tally.hard = tally.hard.max(one - near).max(open * (one - whole));
        let open = open * whole;
        if OWN || open.all_at_most(zero) {
            return;
        }
        for group in groups {
            let results = certain(bounds, self.reach::<OWN>(group, tap, known, m));
            if open.all_at_most(results[0] + results[1] + results[2]) {
                tally.add(times(results, open), edges, group.drives.clone());
                continue;
            }
            // Words of a group without limits are summed first.
            let is_free = of(group.drives.end as f64).all_at_most(edges[0].min(edges[1]));
            let mut free = [zero; 3];
            for j in group.drives.clone() {
                let q = self.miss(&self.row::<OWN>(ranker, j), tap, m);
                let results = certain(bounds, [q; 2]);
                if is_free {
                    free = [free[0] + results[0], free[1] + results[1], free[2] + results[2]];
                    tally.mark(open * results[2], j..j + 1);
                } else {
                    tally.add(times(results, open), edges, j..j + 1);
                }
            }
            for (taps, free) in tally.taps.iter_mut().zip(free) {
                taps[0] = open.mul_add(free, taps[0]);
            }
        }
    }
}
