//! The strain of a tap from its chart, and the estimate's theory around it.

use super::dispatch::{Part, apart};
use super::read::dot;
use super::read::Values;
use super::{Charted, Distance, Lanes, ORDERS, Tables};
use crate::chart::axis::AXES;
use crate::kernel::cpu::Pack;

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy)]
pub(super) struct Whisker<T> {
    pub diameter: T,
    pub tau: T,
    pub length: T,
    /// x1, x2.
    pub gauge: [T; 2],
    /// u = 1/a at the peak of the theory.
    pub peak: T,
}

impl<const FMA: bool> Whisker<Lanes<FMA>> {
    /// Whether a contact at `chart` may move off it. Contacts move little: most whiskers are longer than any contact of theirs.
    #[inline(always)]
    pub fn moves(&self, power: Lanes<FMA>, chart: &Charted) -> bool {
        let room = (self.length - Pack::splat(chart.a)) * Pack::splat(chart.inverse);
        !(power * Pack::splat(chart.most_arc)).all_at_most(room)
    }
}

/// A tap as a series over the drive, or at its own.
#[derive(Clone, Copy, Default)]
pub(super) struct Tap<T> {
    /// (K − 1)/θᵉ.
    pub kappa: [T; ORDERS],
    /// (c/a − 1)/θᵉ, where the contact may slip off at all.
    pub arc: [T; ORDERS],
    /// (P over that of the linear theory − 1)/θᵉ, where it is asked for.
    pub force: T,
    /// Largest |δ|.
    pub largest: T,
    /// f, per radian or mm.
    pub strain: T,
    /// How f grows with η: see [`Growth`].
    pub growth: Growth<T>,
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

impl<const FMA: bool> Growth<Lanes<FMA>> {
    /// η at the apex, or infinitely far of a whisker without one.
    #[inline(always)]
    pub fn least(&self) -> Lanes<FMA> {
        let of = Lanes::<FMA>::of;
        (of(-1.0) / self.steep).max(of(-1.0))
    }

    /// η of the far root of a growth of `q` of the plain theory, (1 + sη)(1 − gη) − 1 = q, and the slope there.
    #[inline(always)]
    pub fn far(&self, q: Lanes<FMA>) -> [Lanes<FMA>; 2] {
        let of = Lanes::<FMA>::of;
        let (linear, square) = (self.steep - self.gauge, self.steep * self.gauge);
        let slope = (linear * linear - of(4.0) * square * q).max(of(0.0)).sqrt();
        // Beyond the peak the terms of one form cancel, before it those of the other.
        let beyond = of(2.0) * q / (linear + slope);
        let before = (linear - slope) / (of(2.0) * square);
        [linear.if_less(of(0.0), before, beyond), slope]
    }

    /// The growth, its slope and its curvature at η.
    #[inline(always)]
    pub fn at(&self, tables: &Tables, eta: Lanes<FMA>) -> [Lanes<FMA>; 3] {
        let zero = Lanes::<FMA>::of(0.0);
        let all = grow([self.steep * eta, self.steep, zero], [-(self.gauge * eta), -self.gauge, zero]);
        if tables.theory.plain {
            return all;
        }
        apart(Beyond { growth: self, all, eta })
    }
}

/// What hub, displacement and shear make of the growth of the plain theory.
struct Beyond<'a, const FMA: bool> {
    growth: &'a Growth<Lanes<FMA>>,
    all: [Lanes<FMA>; 3],
    eta: Lanes<FMA>,
}

impl<const FMA: bool> Part<FMA> for Beyond<'_, FMA> {
    type Out = [Lanes<FMA>; 3];

    #[inline(always)]
    fn run(self) -> [Lanes<FMA>; 3] {
        let Self { growth, all, eta } = self;
        let of = Lanes::<FMA>::of;
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
fn grow<const FMA: bool>(a: [Lanes<FMA>; 3], b: [Lanes<FMA>; 3]) -> [Lanes<FMA>; 3] {
    let one = Lanes::<FMA>::of(1.0);
    let (more_a, more_b) = (one + a[0], one + b[0]);
    let both = a[1] * b[1];
    [a[0] + b[0] + a[0] * b[0], a[1] * more_b + b[1] * more_a, a[2] * more_b + (both + both) + b[2] * more_a]
}

impl Tables {
    /// u at the peak of the theory: that of the quadratic, then Newton's steps for what the rest adds.
    #[inline(always)]
    pub(super) fn peak<const FMA: bool>(
        &self,
        diameter: Lanes<FMA>,
        tau: Lanes<FMA>,
        [x1, x2]: [Lanes<FMA>; 2],
    ) -> Lanes<FMA> {
        let of = Lanes::<FMA>::of;
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

    /// What `chart` says of `design`, over the points or at its own drive, but for its theory; its arc where that is asked for, with `FORCE` its
    /// force.
    #[inline(always)]
    pub(super) fn tap<const FMA: bool, const OWN: bool, const FORCE: bool>(
        &self,
        design: &Whisker<Lanes<FMA>>,
        [drive, power]: [Lanes<FMA>; 2],
        (chart, with_arc): (&Charted, bool),
        (basis, products): (&mut [Vec<Lanes<FMA>>; AXES], &mut Values<FMA>),
        tap: &mut Tap<Lanes<FMA>>,
    ) {
        let of = Lanes::<FMA>::of;
        let (one, inverse) = (of(1.0), Pack::splat(chart.inverse));
        let p = design.tau * Pack::splat(chart.a);
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let own = if self.theory.displaced { drive * inverse } else { drive };
        let quantities = [own, s1, design.diameter * inverse, p, s2];
        chart.polynomials::<FMA, OWN>(&quantities, basis, products);
        let scale = Pack::splat(chart.scale);
        if OWN && chart.branches.len() > 1 {
            let (read, _) =
                self.choice.read::<FMA, FORCE>(&chart.branches, basis, products);
            let [deviation, arc, force] = [scale * read[0], scale * read[1], scale * read[2]];
            let delta = power * deviation;
            tap.kappa[0] = -(deviation / (one + delta));
            (tap.largest, tap.arc[0], tap.force) = (delta.abs(), arc, force);
            return;
        }
        let [strain, arc, force] = &chart.branches[0];
        let orders = strain.orders();
        let strain = strain.read(basis, products);
        tap.largest = of(0.0);
        if OWN {
            let deviation = scale * dot(&strain, &basis[0]);
            let delta = power * deviation;
            tap.kappa[0] = -(deviation / (one + delta));
            tap.largest = delta.abs();
        } else {
            // δ is a series, 1/(1 + δ) is not: through the points over the drive.
            let n = self.points;
            let mut kappa = [of(0.0); ORDERS];
            for k in 0..n {
                let basis = &chart.at_points[k];
                let mut deviation = strain[0];
                for j in 1..orders {
                    deviation = Lanes::<FMA>::splat(basis[j]).mul_add(strain[j], deviation);
                }
                let deviation = scale * deviation;
                let delta = Lanes::<FMA>::splat(self.powers[k]) * deviation;
                kappa[k] = -(deviation / (one + delta));
                tap.largest = tap.largest.max(delta.abs());
            }
            for k in 0..n {
                let mut sum = Lanes::<FMA>::splat(self.from_points[k][0]) * kappa[0];
                for j in 1..n {
                    sum = Lanes::<FMA>::splat(self.from_points[k][j]).mul_add(kappa[j], sum);
                }
                tap.kappa[k] = sum;
            }
        }
        tap.arc = [of(0.0); ORDERS];
        if with_arc {
            let arc = arc.read(basis, products);
            if OWN {
                tap.arc[0] = scale * dot(&arc, &basis[0]);
            } else {
                for k in 0..self.points {
                    let mut values = [of(0.0); ORDERS];
                    for (n, value) in values.iter_mut().enumerate().take(self.points) {
                        for (a, t) in arc.iter().zip(&chart.at_points[n]) {
                            *value = Lanes::<FMA>::splat(*t).mul_add(*a, *value);
                        }
                    }
                    for (n, value) in values.iter().enumerate().take(self.points) {
                        let back = Lanes::<FMA>::splat(self.from_points[k][n]);
                        tap.arc[k] = back.mul_add(scale * *value, tap.arc[k]);
                    }
                }
            }
        }
        if FORCE {
            let force = force.read(basis, products);
            tap.force = scale * dot(&force, &basis[0]);
        }
    }

    /// f of the theory, and how it grows with η.
    #[inline(always)]
    pub(super) fn told<const FMA: bool>(
        &self,
        design: &Whisker<Lanes<FMA>>,
        distance: &Distance,
        tap: &mut Tap<Lanes<FMA>>,
    ) {
        let of = Lanes::<FMA>::of;
        let (one, inverse) = (of(1.0), Pack::splat(distance.inverse));
        let p = design.tau * Pack::splat(distance.a);
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let rest = one - p;
        let (u1, u2) = (one - p * s1, one - p * s2);
        let (near, far) = (one - s1, one - s2);
        let lever = near * u2 + far * u1;
        let beta = s1 * u2 + s2 * u1;
        let b = one / (u1 * u2);
        let mut f = of(0.75) * design.diameter * inverse * rest * lever * b * b;
        let mut growth = Growth {
            steep: one / rest,
            gauge: beta / lever,
            hub: of(0.0),
            shear: of(0.0),
            vertex: design.peak * Pack::splat(distance.a) - one,
        };
        if !self.theory.plain {
            let hub = Lanes::<FMA>::splat(self.theory.hub) * inverse;
            let shear = Lanes::<FMA>::splat(self.theory.shear) * design.diameter * design.diameter;
            growth.shear = shear * inverse * inverse;
            growth.hub = if self.theory.displaced { one } else { hub / (one + hub) };
            f = f * if self.theory.displaced { inverse } else { one + hub } / (one + growth.shear);
        }
        (tap.strain, tap.growth) = (f, growth);
    }
}
