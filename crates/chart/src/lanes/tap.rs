//! The strain, arc and force of a tap from its chart.

use super::dispatch::by_lanes;
use super::read::{Basis, Values};
use super::rows::Rows;
use super::theory::{Growth, Whisker};
use super::{Charted, LANES, Lanes, ORDERS, Ranker, Scratch};
use crate::distance::Function;
use crate::kernel::cpu::Packed;
use crate::physics::driven::Driven;
use crate::scene::Tuple;

/// Slack of a tap without a known bound.
const UNKNOWN: f64 = 1e6;

#[derive(Clone, Copy)]
pub(super) struct TapSeries<'a> {
    /// (K − 1)/θᵉ.
    pub kappa: &'a [Lanes],
    /// (c/a − 1)/θᵉ, where the contact may slip off at all.
    pub arc: &'a [Lanes],
    /// (P over that of the linear theory − 1)/θᵉ, where requested.
    pub force: Lanes,
    pub largest: Lanes,
    /// f, per radian or mm.
    pub strain: Lanes,
    /// Error bounds of κ and the arc, where charts are read roughly.
    pub slack: [Lanes; 2],
    /// Growth of f with η, where distances are estimated.
    pub growth: &'a Growth,
}

pub(super) struct Taps {
    m: usize,
    pub kappa: Vec<Lanes>,
    pub arc: Vec<Lanes>,
    pub force: Vec<Lanes>,
    largest: Vec<Lanes>,
    pub strain: Vec<Lanes>,
    slack: Vec<[Lanes; 2]>,
    growth: Vec<Growth>,
}

impl Taps {
    pub fn new(n: usize, m: usize) -> Self {
        let zeros = |n: usize| vec![Lanes::default(); n];
        let growth = vec![Growth::default(); n];
        Self {
            m,
            kappa: zeros(n * m),
            arc: zeros(n * m),
            force: zeros(n),
            largest: zeros(n),
            strain: zeros(n),
            slack: vec![[Lanes::default(); 2]; n],
            growth,
        }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.strain.len()
    }

    #[inline(always)]
    pub fn at(&self, i: usize) -> TapSeries<'_> {
        let own = i * self.m..(i + 1) * self.m;
        TapSeries {
            kappa: &self.kappa[own.clone()],
            arc: &self.arc[own],
            force: self.force[i],
            largest: self.largest[i],
            strain: self.strain[i],
            slack: self.slack[i],
            growth: &self.growth[i],
        }
    }

    /// Adds the growth of the theory of `design` at each distance where distances are estimated, and with `FIGURES`.
    #[inline(always)]
    pub fn add_growth<const FIGURES: bool>(&mut self, ranker: &Ranker, design: &Whisker) {
        if FIGURES || ranker.by.is_some() {
            for (growth, distance) in self.growth.iter_mut().zip(&ranker.distances) {
                *growth = design.growth(ranker, distance);
            }
        }
    }
}

impl Ranker {
    /// Reads `design` from `chart`, over the points or at its drive, without its theory; its arc if `with_arc`, with `FORCE` its force.
    #[inline(always)]
    pub(super) fn tap<const OWN: bool, const FORCE: bool>(
        &self,
        design: &Whisker,
        [drive, power]: [Lanes; 2],
        (chart, with_arc): (&Charted, bool),
        (basis, products): (&mut Basis, &mut Values),
        (taps, i): (&mut Taps, usize),
    ) {
        let of = Lanes::of;
        let own = i * taps.m..(i + 1) * taps.m;
        let (into, into_arc) = (&mut taps.kappa[own.clone()], &mut taps.arc[own]);
        let (one, inverse) = (of(1.0), Lanes::splat(chart.inverse));
        let p = design.tau * Lanes::splat(chart.a);
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let own = if self.theory.displaced { drive * inverse } else { drive };
        let quantities = [own, s1, design.diameter * inverse, p, s2];
        let last = match (FORCE, with_arc || chart.functions[0].len() > 1) {
            (true, _) => Function::Force,
            (_, true) => Function::Arc,
            _ => Function::Strain,
        };
        chart.polynomials::<OWN>(&quantities, last, basis, products);
        let scale = Lanes::splat(chart.scale);
        let choice = &self.choice;
        if OWN {
            let ([strain, arc, force], _) = choice.read::<FORCE>(&chart.functions, with_arc, products);
            let deviation = scale * strain;
            (into_arc[0], taps.force[i]) = (scale * arc, scale * force);
            let delta = power * deviation;
            let inverse = one / (one + delta);
            into[0] = -(deviation * inverse);
            // Every mean of a polynomial over the gauge is at most that of the first.
            let missed = Lanes::splat(chart.missed[0]) * basis[4][0];
            taps.largest[i] = power.mul_add(missed, delta.abs());
            // m/((1 + δ)(1 + δ − m θᵉ)), if the last term is far below 1; else no bound is known.
            let near = missed * inverse;
            let share = power * near;
            let more = share.if_less(of(0.1), one + of(1.2) * share, of(UNKNOWN));
            taps.slack[i] = [near * inverse * more, of(0.0)];
            if with_arc {
                taps.slack[i][1] = Lanes::splat(chart.missed[1]);
                if chart.slides != 0.0 {
                    // Another branch may hold if the arc may have the other sign.
                    let [slack, arc_slack] = taps.slack[i];
                    let arc = into_arc[0] * Lanes::splat(chart.slides);
                    taps.slack[i][0] = arc.if_less(arc_slack, of(UNKNOWN), slack);
                }
            }
            return;
        }
        let [strain, arc, _] = chart.functions.each_ref().map(|of| &of[0]);
        let read = strain.sums::<false>(products);
        (taps.largest[i], taps.slack[i]) = (of(0.0), [of(0.0); 2]);
        // δ is a series, 1/(1 + δ) is not: through the points over the drive.
        let n = self.points;
        let mut values = [of(0.0); ORDERS];
        for k in 0..n {
            let deviation = scale * at_point(chart, k, &read[..strain.orders]);
            let delta = Lanes::splat(self.grid[k].power) * deviation;
            values[k] = -(deviation / (one + delta));
            taps.largest[i] = taps.largest[i].max(delta.abs());
        }
        self.to_series(&values, into);
        if with_arc {
            let read = arc.sums::<false>(products);
            for k in 0..n {
                values[k] = scale * at_point(chart, k, &read[..arc.orders]);
            }
            self.to_series(&values, into_arc);
        } else {
            into_arc.fill(of(0.0));
        }
    }

    /// The series over the drive through `values` at the points.
    #[inline(always)]
    pub(super) fn to_series(&self, values: &[Lanes; ORDERS], into: &mut [Lanes]) {
        for (into, row) in into.iter_mut().zip(&self.from_points) {
            let mut sum = Lanes::splat(row[0]) * values[0];
            for j in 1..self.points {
                sum = Lanes::splat(row[j]).mul_add(values[j], sum);
            }
            *into = sum;
        }
    }

    /// K − 1 of taps of easy designs, each with the place of its distance, as in the rows.
    pub fn deviations(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        by_lanes!(self.has, self.deviations_lanes(taps))
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn deviations_lanes(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        let (mut scratch, mut rows) = (Scratch::new(self), Rows::new());
        let mut found = Vec::with_capacity(taps.len());
        for taps in taps.chunks(LANES) {
            let tuples: Vec<Tuple> = taps.iter().map(|(tuple, _)| *tuple).collect();
            let own = self.angles.is_empty() || self.apart;
            match own {
                true => rows.fill::<true, false>((self, &self.charts), taps.len(), &tuples, &mut scratch),
                false => rows.fill::<false, false>((self, &self.charts), taps.len(), &tuples, &mut scratch),
            }
            if own {
                rows.read_between::<false>(self, &mut scratch);
            }
            for (lane, (tuple, i)) in taps.iter().enumerate() {
                let kappa: Vec<f32> = scratch.taps.at(*i).kappa.iter().map(|k| k.0[lane]).collect();
                let drive = Driven::of_users(self.scope.setup.drive, tuple.drive).size() as f32;
                let shared = self.angles.iter().map(|a| &a.stroke).find(|a| !own && a.drive == drive);
                let deviation = match shared {
                    Some(a) => a.power * kappa.iter().zip(&a.basis).map(|(k, t)| k * t).sum::<f32>(),
                    None if own => rows.own[1].0[lane] * kappa[0],
                    None => f32::NAN,
                };
                let share = f64::from(rows.passed.share.0[lane]);
                let deviation = f64::from(deviation);
                found.push(if share == 1.0 { deviation } else { (1.0 + deviation) / share - 1.0 });
            }
        }
        found
    }
}

/// A series over the drive at point `k`.
#[inline(always)]
fn at_point(chart: &Charted, k: usize, series: &[Lanes]) -> Lanes {
    let mut sum = series[0];
    for j in 1..series.len() {
        sum = Lanes::splat(chart.at_points[k][j]).mul_add(series[j], sum);
    }
    sum
}
