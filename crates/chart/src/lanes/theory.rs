//! The estimate's theory of whiskers in a pack: f, where it peaks, and how it grows from a distance.

use super::dispatch::{Part, apart};
use super::neighbours::{Place, picked};
use super::{Charted, Distance, Lanes, Tables};
use crate::estimate::FAR;
use crate::kernel::cpu::Pack;

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy, Default)]
pub(super) struct Whisker<T> {
    pub diameter: T,
    pub tau: T,
    pub length: T,
    /// x1, x2.
    pub gauge: [T; 2],
    /// u = 1/a at the peak of the theory.
    pub peak: T,
    /// C, S and M of f = C (u − τ)(S − M u), to which hub, displacement and shear add factors.
    form: [T; 3],
    /// Readings of words.
    pub words: Thresholds<T>,
}

/// f at which words begin.
#[derive(Clone, Copy, Default)]
pub(super) struct Thresholds<T> {
    /// From it, and up to the next, the near root is within the range of interest.
    pub low: T,
    /// See [`Self::low`].
    pub high: T,
    /// At the peak.
    pub peak: T,
    /// Infinitely far.
    pub farthest: T,
    /// Where f levels off: below the first the distance of a tap beyond the peak has a word, below the second that of one before it.
    ends: [T; 2],
}

impl<const SET: u8> Whisker<Lanes<SET>> {
    /// Of D, τ, L_a and x1, x2.
    #[inline(always)]
    pub fn new(tables: &Tables, [diameter, tau, length]: [Lanes<SET>; 3], gauge: [Lanes<SET>; 2]) -> Self {
        let of = Lanes::<SET>::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [u1, u2] = [one - tau * gauge[0], one - tau * gauge[1]];
        let b = one / (u1 * u2);
        let form = [of(0.75) * diameter * b * b, u1 + u2, gauge[0] * u2 + gauge[1] * u1];
        let peak = tables.peak(diameter, tau, gauge);
        let words = Thresholds { low: zero, high: zero, peak: zero, farthest: zero, ends: [zero; 2] };
        let mut whisker = Self { diameter, tau, length, gauge, peak, form, words };
        let highest = whisker.strain(tables, peak);
        let [lo, hi] = tables.ends.map(Lanes::<SET>::splat);
        let never = of(1e30);
        let high = peak.if_less(hi, whisker.strain(tables, hi), never);
        let farthest = whisker.strain(tables, zero);
        let mut ends = [-never; 2];
        if !farthest.all_at_most(zero) {
            for (end, reach) in ends.iter_mut().zip([FAR, 1.0]) {
                let u = of(1.0 / reach) / length;
                let least = peak.if_less(u, highest, whisker.strain(tables, u));
                *end = zero.if_less(farthest, least, -never);
            }
        }
        whisker.words = Thresholds {
            low: lo.if_less(peak, never, whisker.strain(tables, lo)),
            high: high.min(highest),
            peak: highest,
            farthest,
            ends,
        };
        whisker
    }

    /// What f and words need, of the lanes of `places`.
    #[inline(always)]
    pub fn picked(&self, places: &[Place]) -> Self {
        let [scale, sum, moment] = &self.form;
        let words = &self.words;
        Self {
            diameter: picked(&self.diameter, places),
            tau: picked(&self.tau, places),
            form: [picked(scale, places), picked(sum, places), picked(moment, places)],
            words: Thresholds {
                low: picked(&words.low, places),
                high: picked(&words.high, places),
                peak: picked(&words.peak, places),
                farthest: words.farthest,
                ends: words.ends,
            },
            ..*self
        }
    }

    /// f below which the distance of a tap at `a` mm has a word, that it lies beyond the whisker.
    #[inline(always)]
    pub fn end(&self, a: f32) -> Lanes<SET> {
        (self.peak * Pack::splat(a)).if_less(Pack::splat(1.0), self.words.ends[1], self.words.ends[0])
    }

    /// f per radian or mm at u = 1/a.
    #[inline(always)]
    pub fn strain(&self, tables: &Tables, u: Lanes<SET>) -> Lanes<SET> {
        let [scale, sum, moment] = self.form;
        let f = scale * (u - self.tau) * (sum - moment * u);
        if tables.theory.plain {
            return f;
        }
        let one = Lanes::<SET>::of(1.0);
        let shear = Lanes::<SET>::splat(tables.theory.shear) * self.diameter * self.diameter;
        let lever =
            if tables.theory.displaced { u } else { one + Lanes::<SET>::splat(tables.theory.hub) * u };
        f * lever / (one + shear * u * u)
    }

    /// How f grows from `distance`.
    #[inline(always)]
    pub fn growth(&self, tables: &Tables, distance: &Distance) -> Growth<Lanes<SET>> {
        let of = Lanes::<SET>::of;
        let (one, inverse) = (of(1.0), Lanes::<SET>::splat(distance.inverse));
        let [_, sum, moment] = self.form;
        let beta = moment * inverse;
        let mut growth = Growth {
            steep: inverse / (inverse - self.tau),
            gauge: beta / (sum - beta),
            hub: of(0.0),
            shear: of(0.0),
            vertex: self.peak * Pack::splat(distance.a) - one,
        };
        if !tables.theory.plain {
            let hub = Lanes::<SET>::splat(tables.theory.hub) * inverse;
            let shear = Lanes::<SET>::splat(tables.theory.shear) * self.diameter * self.diameter;
            growth.shear = shear * inverse * inverse;
            growth.hub = if tables.theory.displaced { one } else { hub / (one + hub) };
        }
        growth
    }

    /// Whether a contact at `chart` may move off it. Contacts move little: most whiskers are longer than any contact of theirs.
    #[inline(always)]
    pub fn moves(&self, power: Lanes<SET>, chart: &Charted) -> bool {
        let room = (self.length - Pack::splat(chart.a)) * Pack::splat(chart.inverse);
        !(power * Pack::splat(chart.most_arc)).all_at_most(room)
    }
}

/// f(a/(1 + η)) over f(a), less 1, as the product of the growths of its factors.
#[derive(Clone, Copy, Default)]
pub(super) struct Growth<T> {
    /// 1/(1 − p).
    steep: T,
    /// β/(A − β).
    gauge: T,
    /// r₀/(a + r₀), or 1 of a displacement.
    hub: T,
    /// S/a².
    shear: T,
    /// η at the peak.
    pub vertex: T,
}

impl<const SET: u8> Growth<Lanes<SET>> {
    /// η at the apex, or infinitely far of a whisker without one.
    #[inline(always)]
    pub fn least(&self) -> Lanes<SET> {
        let of = Lanes::<SET>::of;
        (of(-1.0) / self.steep).max(of(-1.0))
    }

    /// η of the far root of a growth of `q` of the plain theory, (1 + sη)(1 − gη) − 1 = q, and the slope there.
    #[inline(always)]
    pub fn far(&self, q: Lanes<SET>) -> [Lanes<SET>; 2] {
        let of = Lanes::<SET>::of;
        let (linear, square) = (self.steep - self.gauge, self.steep * self.gauge);
        let slope = (linear * linear - of(4.0) * square * q).max(of(0.0)).sqrt();
        // Beyond the peak the terms of one form cancel, before it those of the other.
        let beyond = of(2.0) * q / (linear + slope);
        let before = (linear - slope) / (of(2.0) * square);
        [linear.if_less(of(0.0), before, beyond), slope]
    }

    /// The slope at the contact, and what its factors give without regard to their sign.
    #[inline(always)]
    pub fn slopes(&self) -> [Lanes<SET>; 2] {
        let other = self.hub - (self.shear + self.shear) / (Lanes::<SET>::of(1.0) + self.shear);
        [self.steep - self.gauge + other, self.steep + self.gauge]
    }

    /// The growth, its slope and its curvature at η.
    #[inline(always)]
    pub fn at(&self, tables: &Tables, eta: Lanes<SET>) -> [Lanes<SET>; 3] {
        let zero = Lanes::<SET>::of(0.0);
        let all = grow([self.steep * eta, self.steep, zero], [-(self.gauge * eta), -self.gauge, zero]);
        if tables.theory.plain {
            return all;
        }
        apart(Beyond { growth: self, all, eta })
    }
}

/// What hub, displacement and shear make of the growth of the plain theory.
struct Beyond<'a, const SET: u8> {
    growth: &'a Growth<Lanes<SET>>,
    all: [Lanes<SET>; 3],
    eta: Lanes<SET>,
}

impl<const SET: u8> Part<SET> for Beyond<'_, SET> {
    type Out = [Lanes<SET>; 3];

    #[inline(always)]
    fn run(self) -> [Lanes<SET>; 3] {
        let Self { growth, all, eta } = self;
        let of = Lanes::<SET>::of;
        let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
        let all = grow(all, [growth.hub * eta, growth.hub, zero]);
        let more = one + eta;
        let below = one / (one + growth.shear * more * more);
        let value = -(growth.shear * eta * (two + eta) * below);
        // (1 + S)/(1 + S (1 + η)²) and its derivatives.
        let fall = two * growth.shear * (one + growth.shear) * below * below;
        let curvature = fall * (of(4.0) * growth.shear * more * more * below - one);
        grow(all, [value, -(fall * more), curvature])
    }
}

/// Two growths, each with its slope and curvature, together.
#[inline(always)]
fn grow<const SET: u8>(a: [Lanes<SET>; 3], b: [Lanes<SET>; 3]) -> [Lanes<SET>; 3] {
    let one = Lanes::<SET>::of(1.0);
    let (more_a, more_b) = (one + a[0], one + b[0]);
    let both = a[1] * b[1];
    [a[0] + b[0] + a[0] * b[0], a[1] * more_b + b[1] * more_a, a[2] * more_b + (both + both) + b[2] * more_a]
}

impl Tables {
    /// u at the peak of the theory: that of the quadratic, then Newton's steps for what the rest adds.
    #[inline(always)]
    pub(super) fn peak<const SET: u8>(
        &self,
        diameter: Lanes<SET>,
        tau: Lanes<SET>,
        [x1, x2]: [Lanes<SET>; 2],
    ) -> Lanes<SET> {
        let of = Lanes::<SET>::of;
        let (one, two) = (of(1.0), of(2.0));
        let [b1, b2] = [one / (one - tau * x1), one / (one - tau * x2)];
        let (sum, moment) = (b1 + b2, x1 * b1 + x2 * b2);
        let mut u = of(0.5) * (sum / moment + tau);
        if self.theory.plain {
            return u;
        }
        let shear = Pack::splat(self.theory.shear) * diameter * diameter;
        let hub = Pack::splat(self.theory.hub);
        for _ in 0..8 {
            let (rise, room) = (u - tau, sum - moment * u);
            let factor = if self.theory.displaced { one / u } else { hub / (one + hub * u) };
            let below = one / (one + shear * u * u);
            let bend = two * shear * u * below;
            // Logarithmic slope of what the quadratic lacks, and its own slope.
            let k = factor - bend;
            let dk = -(factor * factor) - two * shear * below + bend * bend;
            let miss = room - moment * rise + rise * room * k;
            let slope = -(two * moment) + (room - moment * rise) * k + rise * room * dk;
            let step = miss / slope;
            // Not beyond half of the way to an end.
            let most = of(0.5) * rise.min(room / moment);
            u = u - step.max(-most).min(most);
        }
        u
    }
}
