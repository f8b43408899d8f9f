//! The estimate's theory of whiskers in a pack: f, its peak, and its growth from a distance.

use super::dispatch::part;
use super::neighbours::{Place, picked};
use super::{Charted, Distance, Lanes, Ranker};
use crate::estimate::FAR;
use crate::kernel::cpu::Packed;

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy, Default)]
pub(super) struct Whisker {
    pub diameter: Lanes,
    pub tau: Lanes,
    pub length: Lanes,
    pub gauge: [Lanes; 2],
    /// u = 1/a at the peak of the theory.
    pub peak: Lanes,
    /// C, S and M of f = C (u − τ)(S − M u), to which hub, displacement and shear add factors.
    form: [Lanes; 3],
    pub words: Thresholds,
}

/// [`Thresholds`] as readings over f, less 1: low, high and peak, and between which a distance beyond the whisker has the same reading.
pub(super) type Bounds = ([Lanes; 3], Option<[Lanes; 2]>);

/// f at which words begin.
#[derive(Clone, Copy, Default)]
pub(super) struct Thresholds {
    /// From `low` to `high` the near root is within the range of interest.
    pub low: Lanes,
    pub high: Lanes,
    pub peak: Lanes,
    /// At infinite distance.
    pub farthest: Lanes,
    /// f of a widening whisker at its end: below it the distance has a word; for taps beyond the peak, and before it.
    pub ends: [Lanes; 2],
    /// f between which a distance beyond the tip of a built whisker has the same reading.
    pub unseen: Option<[Lanes; 2]>,
}

impl Thresholds {
    #[inline(always)]
    pub fn picked(&self, places: &[Place]) -> Self {
        let mut own = *self;
        own.low = picked(&self.low, places);
        own.high = picked(&self.high, places);
        own.peak = picked(&self.peak, places);
        if let Some([from, to]) = &self.unseen {
            own.unseen = Some([picked(from, places), picked(to, places)]);
        }
        own
    }
}

impl Whisker {
    #[inline(always)]
    pub fn new(ranker: &Ranker, [diameter, tau, length]: [Lanes; 3], gauge: [Lanes; 2]) -> Self {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [u1, u2] = [one - tau * gauge[0], one - tau * gauge[1]];
        let b = one / (u1 * u2);
        let form = [of(0.75) * diameter * b * b, u1 + u2, gauge[0] * u2 + gauge[1] * u1];
        let peak = ranker.peak(diameter, tau, gauge);
        let words =
            Thresholds { low: zero, high: zero, peak: zero, farthest: zero, ends: [zero; 2], unseen: None };
        let mut whisker = Self { diameter, tau, length, gauge, peak, form, words };
        let highest = whisker.strain(ranker, peak);
        let [lo, hi] = ranker.ends.map(Lanes::splat);
        let never = of(1e30);
        let high = peak.if_less(hi, whisker.strain(ranker, hi), never);
        let farthest = whisker.strain(ranker, zero);
        let mut ends = [-never; 2];
        if !farthest.all_at_most(zero) {
            for (end, reach) in ends.iter_mut().zip([FAR, 1.0]) {
                let u = of(1.0 / reach) / length;
                let least = peak.if_less(u, highest, whisker.strain(ranker, u));
                *end = zero.if_less(farthest, least, -never);
            }
        }
        whisker.words = Thresholds {
            low: lo.if_less(peak, never, whisker.strain(ranker, lo)),
            high: high.min(highest),
            peak: highest,
            farthest,
            ends,
            unseen: None,
        };
        whisker
    }

    /// f below which the distance of a tap at `a` mm lies beyond the whisker.
    #[inline(always)]
    pub fn end(&self, a: f32) -> Lanes {
        (self.peak * Lanes::splat(a)).if_less(Lanes::splat(1.0), self.words.ends[1], self.words.ends[0])
    }

    /// f per radian or mm at u = 1/a.
    #[inline(always)]
    pub fn strain(&self, ranker: &Ranker, u: Lanes) -> Lanes {
        let [scale, sum, moment] = self.form;
        let f = scale * (u - self.tau) * (sum - moment * u);
        if ranker.theory.plain {
            return f;
        }
        let one = Lanes::of(1.0);
        let shear = Lanes::splat(ranker.theory.shear) * self.diameter * self.diameter;
        let lever = if ranker.theory.displaced { u } else { one + Lanes::splat(ranker.theory.hub) * u };
        f * lever / (one + shear * u * u)
    }

    #[inline(always)]
    pub fn growth(&self, ranker: &Ranker, distance: &Distance) -> Growth {
        let of = Lanes::of;
        let (one, inverse) = (of(1.0), Lanes::splat(distance.inverse));
        let [_, sum, moment] = self.form;
        let beta = moment * inverse;
        let mut growth = Growth {
            steep: inverse / (inverse - self.tau),
            gauge: beta / (sum - beta),
            hub: of(0.0),
            shear: of(0.0),
            vertex: self.peak * Lanes::splat(distance.a) - one,
        };
        if !ranker.theory.plain {
            let hub = Lanes::splat(ranker.theory.hub) * inverse;
            let shear = Lanes::splat(ranker.theory.shear) * self.diameter * self.diameter;
            growth.shear = shear * inverse * inverse;
            growth.hub = if ranker.theory.displaced { one } else { hub / (one + hub) };
        }
        growth
    }

    /// True if a contact at `chart` may move off the whisker, which most whiskers are too long for.
    #[inline(always)]
    pub fn moves(&self, power: Lanes, chart: &Charted) -> bool {
        let room = (self.length - Lanes::splat(chart.a)) * Lanes::splat(chart.inverse);
        !(power * Lanes::splat(chart.most_arc)).all_at_most(room)
    }
}

/// f(a/(1 + η)) over f(a), less 1, as the product of the growths of its factors.
#[derive(Clone, Copy, Default)]
pub(super) struct Growth {
    /// 1/(1 − p).
    steep: Lanes,
    /// β/(A − β).
    gauge: Lanes,
    /// r₀/(a + r₀), or 1 of a displacement.
    hub: Lanes,
    /// S/a².
    shear: Lanes,
    /// η at the peak.
    pub vertex: Lanes,
}

impl Growth {
    /// η at the apex, or at infinity of a whisker without one.
    #[inline(always)]
    pub fn least(&self) -> Lanes {
        let of = Lanes::of;
        (of(-1.0) / self.steep).max(of(-1.0))
    }

    /// η of the far root of a growth of `q` of the plain theory, (1 + sη)(1 − gη) − 1 = q, and the slope there.
    #[inline(always)]
    pub fn far(&self, q: Lanes) -> [Lanes; 2] {
        let of = Lanes::of;
        let (linear, square) = (self.steep - self.gauge, self.steep * self.gauge);
        let slope = (linear * linear - of(4.0) * square * q).max(of(0.0)).sqrt();
        // Beyond the peak the terms of one form cancel, before it those of the other.
        let beyond = of(2.0) * q / (linear + slope);
        let before = (linear - slope) / (of(2.0) * square);
        [linear.if_less(of(0.0), before, beyond), slope]
    }

    /// The slope at the contact, and the sum of the absolute slopes of the plain factors.
    #[inline(always)]
    pub fn slopes(&self) -> [Lanes; 2] {
        let other = self.hub - (self.shear + self.shear) / (Lanes::of(1.0) + self.shear);
        [self.steep - self.gauge + other, self.steep + self.gauge]
    }

    /// The growth, its slope and its curvature at η.
    #[inline(always)]
    pub fn at(&self, ranker: &Ranker, eta: Lanes) -> [Lanes; 3] {
        let zero = Lanes::of(0.0);
        let all = grow([self.steep * eta, self.steep, zero], [-(self.gauge * eta), -self.gauge, zero]);
        if ranker.theory.plain {
            return all;
        }
        part!(self.beyond(all, eta))
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    fn beyond(&self, all: [Lanes; 3], eta: Lanes) -> [Lanes; 3] {
        let of = Lanes::of;
        let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
        let all = grow(all, [self.hub * eta, self.hub, zero]);
        let more = one + eta;
        let below = one / (one + self.shear * more * more);
        let value = -(self.shear * eta * (two + eta) * below);
        // (1 + S)/(1 + S (1 + η)²) and its derivatives.
        let fall = two * self.shear * (one + self.shear) * below * below;
        let curvature = fall * (of(4.0) * self.shear * more * more * below - one);
        grow(all, [value, -(fall * more), curvature])
    }
}

#[inline(always)]
fn grow(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    let one = Lanes::of(1.0);
    let (more_a, more_b) = (one + a[0], one + b[0]);
    let both = a[1] * b[1];
    [a[0] + b[0] + a[0] * b[0], a[1] * more_b + b[1] * more_a, a[2] * more_b + (both + both) + b[2] * more_a]
}

impl Ranker {
    /// u at the peak of the theory: that of the quadratic, then Newton's steps for the other terms.
    #[inline(always)]
    pub(super) fn peak(&self, diameter: Lanes, tau: Lanes, [x1, x2]: [Lanes; 2]) -> Lanes {
        let of = Lanes::of;
        let (one, two) = (of(1.0), of(2.0));
        let [b1, b2] = [one / (one - tau * x1), one / (one - tau * x2)];
        let (sum, moment) = (b1 + b2, x1 * b1 + x2 * b2);
        let mut u = of(0.5) * (sum / moment + tau);
        if self.theory.plain {
            return u;
        }
        let shear = Lanes::splat(self.theory.shear) * diameter * diameter;
        let hub = Lanes::splat(self.theory.hub);
        for _ in 0..8 {
            let (rise, room) = (u - tau, sum - moment * u);
            let factor = if self.theory.displaced { one / u } else { hub / (one + hub * u) };
            let below = one / (one + shear * u * u);
            let bend = two * shear * u * below;
            // Logarithmic slope of the factors besides the quadratic, and its slope.
            let k = factor - bend;
            let dk = -(factor * factor) - two * shear * below + bend * bend;
            let miss = room - moment * rise + rise * room * k;
            let slope = -(two * moment) + (room - moment * rise) * k + rise * room * dk;
            let step = miss / slope;
            // At most half of the way to an end.
            let most = of(0.5) * rise.min(room / moment);
            u = u - step.max(-most).min(most);
        }
        u
    }
}
