//! The strain, arc and force of a tap from its chart.

use super::read::{Values, dot};
use super::theory::{Growth, Whisker};
use super::{Charted, Lanes, ORDERS, Tables};
use crate::axis::AXES;
use crate::kernel::cpu::Pack;
use crate::scene::RankBy;

/// A tap as a series over the drive, or at its own.
#[derive(Clone, Copy)]
pub(super) struct TapSeries<'a, T> {
    /// (K − 1)/θᵉ.
    pub kappa: &'a [T],
    /// (c/a − 1)/θᵉ, where the contact may slip off at all.
    pub arc: &'a [T],
    /// (P over that of the linear theory − 1)/θᵉ, where it is asked for.
    pub force: T,
    /// Largest |δ|.
    pub largest: T,
    /// f, per radian or mm.
    pub strain: T,
    /// How f grows with η, where distances are estimated.
    pub growth: &'a Growth<T>,
}

/// The taps of a pack; what is read together lies together.
pub(super) struct Taps<T> {
    /// Orders over the drive of each.
    m: usize,
    pub kappa: Vec<T>,
    pub arc: Vec<T>,
    pub force: Vec<T>,
    largest: Vec<T>,
    strain: Vec<T>,
    growth: Vec<Growth<T>>,
}

impl<const FMA: bool> Taps<Lanes<FMA>> {
    /// Of `n` taps, of `m` orders over the drive each.
    pub fn new(n: usize, m: usize) -> Self {
        let zeros = |n: usize| vec![Pack::default(); n];
        let growth = vec![Growth::default(); n];
        Self {
            m,
            kappa: zeros(n * m),
            arc: zeros(n * m),
            force: zeros(n),
            largest: zeros(n),
            strain: zeros(n),
            growth,
        }
    }

    /// How many.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.strain.len()
    }

    /// Tap `i`.
    #[inline(always)]
    pub fn at(&self, i: usize) -> TapSeries<'_, Lanes<FMA>> {
        let own = i * self.m..(i + 1) * self.m;
        TapSeries {
            kappa: &self.kappa[own.clone()],
            arc: &self.arc[own],
            force: self.force[i],
            largest: self.largest[i],
            strain: self.strain[i],
            growth: &self.growth[i],
        }
    }

    /// Adds what the theory says of `design` at each distance; its growth where distances are estimated, and with `FIGURES`.
    #[inline(always)]
    pub fn add_theory<const FIGURES: bool>(&mut self, tables: &Tables, design: &Whisker<Lanes<FMA>>) {
        for (strain, distance) in self.strain.iter_mut().zip(&tables.distances) {
            *strain = design.strain(tables, Pack::splat(distance.inverse));
        }
        if FIGURES || tables.by != RankBy::KSd {
            for (growth, distance) in self.growth.iter_mut().zip(&tables.distances) {
                *growth = design.growth(tables, distance);
            }
        }
    }
}

impl Tables {
    /// What `chart` says of `design`, over the points or at its own drive, but for its theory; its arc where that is asked for, with `FORCE` its
    /// force.
    #[inline(always)]
    pub(super) fn tap<const FMA: bool, const OWN: bool, const FORCE: bool>(
        &self,
        design: &Whisker<Lanes<FMA>>,
        [drive, power]: [Lanes<FMA>; 2],
        (chart, with_arc): (&Charted, bool),
        (basis, products): (&mut [Vec<Lanes<FMA>>; AXES], &mut Values<FMA>),
        (taps, i): (&mut Taps<Lanes<FMA>>, usize),
    ) {
        let of = Lanes::<FMA>::of;
        let own = i * taps.m..(i + 1) * taps.m;
        let (into, into_arc) = (&mut taps.kappa[own.clone()], &mut taps.arc[own]);
        let (one, inverse) = (of(1.0), Pack::splat(chart.inverse));
        let p = design.tau * Pack::splat(chart.a);
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let own = if self.theory.displaced { drive * inverse } else { drive };
        let quantities = [own, s1, design.diameter * inverse, p, s2];
        chart.polynomials::<FMA, OWN>(&quantities, basis, products);
        let scale = Pack::splat(chart.scale);
        if OWN && chart.branches.len() > 1 {
            let (read, _) = self.choice.read::<FMA, FORCE>(&chart.branches, basis, products);
            let [deviation, arc, force] = [scale * read[0], scale * read[1], scale * read[2]];
            let delta = power * deviation;
            into[0] = -(deviation / (one + delta));
            (taps.largest[i], into_arc[0], taps.force[i]) = (delta.abs(), arc, force);
            return;
        }
        let [strain, arc, force] = &chart.branches[0];
        let orders = strain.orders();
        let strain = strain.read(basis, products);
        let mut largest = of(0.0);
        if OWN {
            let deviation = scale * dot(&strain, &basis[0]);
            let delta = power * deviation;
            into[0] = -(deviation / (one + delta));
            largest = delta.abs();
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
                let delta = Lanes::<FMA>::splat(self.grid[k].power) * deviation;
                kappa[k] = -(deviation / (one + delta));
                largest = largest.max(delta.abs());
            }
            for k in 0..n {
                let mut sum = Lanes::<FMA>::splat(self.from_points[k][0]) * kappa[0];
                for j in 1..n {
                    sum = Lanes::<FMA>::splat(self.from_points[k][j]).mul_add(kappa[j], sum);
                }
                into[k] = sum;
            }
        }
        taps.largest[i] = largest;
        for arc in into_arc.iter_mut() {
            *arc = of(0.0);
        }
        if with_arc {
            let arc = arc.read(basis, products);
            if OWN {
                into_arc[0] = scale * dot(&arc, &basis[0]);
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
                        into_arc[k] = back.mul_add(scale * *value, into_arc[k]);
                    }
                }
            }
        }
        if FORCE {
            let force = force.read(basis, products);
            taps.force[i] = scale * dot(&force, &basis[0]);
        }
    }
}
