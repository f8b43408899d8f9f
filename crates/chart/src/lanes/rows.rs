//! Rows of a pack of designs: spread of K, status words, and the best rows.

use super::passed::Passed;
use super::tap::TapSeries;
use super::theory::Whisker;
use super::{Charted, Distance, LANES, Lanes, ORDERS, PAIRS, Ranker, Scratch, Stroke, powered};
use crate::kernel::cpu::{Pack, Packed};
use crate::physics::driven::Driven;
use crate::scene::Tuple;

/// Largest deviation of the strain for which K is given.
pub(super) const MOST: f32 = 0.95;

/// Largest deviation of the strain that is taken to grow with the drive.
const LARGEST: f32 = 0.3;

/// The same with a soft contact, whose share of the deviation falls with the drive.
const YIELDING: f32 = 0.7;

impl Ranker {
    pub(super) fn largest(&self) -> f32 {
        if self.fourth { YIELDING } else { LARGEST }
    }
}

pub(super) struct Rows {
    pub live: usize,
    pub design: Whisker,
    pub passed: Passed,
    /// Each design's drive, rad or mm, and its power e.
    pub own: [Lanes; 2],
    pub mean: [Lanes; ORDERS],
    /// Sums of products of κ − mean, k ≤ l.
    pub spread: [Lanes; PAIRS],
    pub largest: Lanes,
    /// Mean and sum of squares of the error bounds of κ.
    pub slack: [Lanes; 2],
    /// No contact can move off its whisker.
    pub still: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Row {
    pub drive: Lanes,
    pub power: Lanes,
    basis: [Lanes; ORDERS],
}

impl Row {
    #[inline(always)]
    pub fn at(stroke: &Stroke, m: usize) -> Self {
        let mut basis = [Lanes::of(0.0); ORDERS];
        for k in 0..m {
            basis[k] = Lanes::splat(stroke.basis[k]);
        }
        Self { drive: Lanes::splat(stroke.drive), power: Lanes::splat(stroke.power), basis }
    }

    #[inline(always)]
    pub fn read(&self, values: &[Lanes], m: usize) -> Lanes {
        let mut sum = self.basis[0] * values[0];
        for k in 1..m {
            sum = self.basis[k].mul_add(values[k], sum);
        }
        sum
    }
}

impl Rows {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = Lanes::of(0.0);
        Self {
            live: 0,
            design: Whisker::default(),
            passed: Passed { share: Lanes::of(1.0), limit: zero, fixed: None },
            own: [zero; 2],
            mean: [zero; ORDERS],
            spread: [zero; PAIRS],
            largest: zero,
            slack: [zero; 2],
            still: false,
        }
    }

    /// Statistics of `tuples` from the charts of `set`; the first `live` count. Their taps, with `FORCE` complete, stay in `scratch`.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    pub fn fill<const OWN: bool, const FORCE: bool>(
        &mut self,
        (ranker, set): (&Ranker, &[Charted]),
        live: usize,
        tuples: &[Tuple],
        scratch: &mut Scratch,
    ) {
        let of = Lanes::of;
        let mut columns = [[0.0f32; LANES]; 6];
        for lane in 0..LANES {
            let t = &tuples[if lane < live { lane } else { 0 }];
            let driven = Driven::of_users(ranker.scope.setup.drive, t.drive);
            let values = [t.D, t.D - t.d, t.L_a, t.x_ss, t.l, driven.size()];
            for (column, value) in columns.iter_mut().zip(values) {
                column[lane] = value as f32;
            }
        }
        let [diameter, narrower, length, x1, grid, mut own] = columns.map(Pack::new);
        let taper = narrower / length;
        let (tau, slope) = (taper / diameter, of(0.5) * taper);
        let x2 = x1 + grid / slope.mul_add(slope, of(1.0)).sqrt();
        if !OWN {
            // For slipped-off contacts the largest drive counts.
            own = Lanes::splat(ranker.angles[ranker.angles.len() - 1].stroke.drive);
        }
        self.passed = Passed::new(ranker, &tuples[..live]);
        let mut design = Whisker::new(ranker, [diameter, tau, length], [x1, x2]);
        match &ranker.scope.flexed {
            Some(flexed) => flexed.fill(ranker, &mut design, grid, scratch),
            None => {
                for (strain, distance) in scratch.taps.strain.iter_mut().zip(&ranker.distances) {
                    *strain = design.strain(ranker, Lanes::splat(distance.inverse));
                }
            }
        }
        let power = powered(own, ranker.power);
        let m = ranker.orders::<OWN>();
        (self.live, self.design, self.own, self.largest) = (live, design, [own, power], of(0.0));
        (self.slack, self.still) = ([of(0.0); 2], true);
        self.mean[..m].fill(of(0.0));
        for sum in &mut self.spread[..m * (m + 1) / 2] {
            *sum = of(0.0);
        }
        let Scratch { basis, products, taps, charts, .. } = &mut *scratch;
        let each = ranker.between.is_none();
        let into = if each { &mut *taps } else { &mut *charts };
        // Between charts an arc is read from those of all.
        let mut any = FORCE;
        if !each {
            for chart in set {
                any |= design.moves(power, chart);
            }
        }
        for (i, chart) in set.iter().enumerate() {
            let moves = any || each && design.moves(power, chart);
            self.still &= !moves;
            let with_arc = moves || chart.slides != 0.0;
            let at = (&mut **basis, &mut *products);
            ranker.tap::<OWN, FORCE>(&design, [own, power], (chart, with_arc), at, (&mut *into, i));
        }
        match &ranker.between {
            None => taps.add_growth::<FORCE>(ranker, &design),
            Some(between) => {
                self.push_forms(ranker, between, charts);
                match OWN && !FORCE {
                    true => return,
                    false => self.read_between::<FORCE>(ranker, scratch),
                }
            }
        }
        let taps = &scratch.taps;
        if each {
            for i in 0..taps.len() {
                self.push(taps.at(i), i, m);
            }
        }
    }

    #[inline(always)]
    pub fn read_between<const FORCE: bool>(&self, ranker: &Ranker, scratch: &mut Scratch) {
        let Some(between) = &ranker.between else { return };
        let Scratch { taps, charts, .. } = scratch;
        between.fill::<FORCE>(charts, FORCE || !self.still, taps);
        taps.add_growth::<FORCE>(ranker, &self.design);
    }

    #[inline(always)]
    fn push(&mut self, tap: TapSeries<'_>, i: usize, m: usize) {
        let [share, rest] = [1.0, i as f64].map(|x| Lanes::of(x / (i + 1) as f64));
        self.largest = self.largest.max(tap.largest);
        self.slack[0] = (tap.slack[0] - self.slack[0]).mul_add(share, self.slack[0]);
        self.slack[1] = tap.slack[0].mul_add(tap.slack[0], self.slack[1]);
        let mut apart = self.mean;
        for k in 0..m {
            apart[k] = tap.kappa[k] - apart[k];
            self.mean[k] = apart[k].mul_add(share, self.mean[k]);
        }
        self.spread(&apart, rest, m);
    }

    /// Adds `share` of the products of deviations from the mean.
    #[inline(always)]
    pub(super) fn spread(&mut self, apart: &[Lanes; ORDERS], share: Lanes, m: usize) {
        let mut at = 0;
        for k in 0..m {
            let shared = apart[k] * share;
            for l in k..m {
                self.spread[at] = shared.mul_add(apart[l], self.spread[at]);
                at += 1;
            }
        }
    }

    /// P of linear theory at `distance`, N.
    #[inline(always)]
    pub fn linear_force(&self, ranker: &Ranker, distance: &Distance) -> Lanes {
        let (a, inverse) = (Lanes::splat(distance.a), Lanes::splat(distance.inverse));
        let (one, square) = (Lanes::of(1.0), self.design.diameter * self.design.diameter);
        let lever = if ranker.theory.displaced { one } else { a + Lanes::splat(ranker.theory.hub) };
        let reach = (one - self.design.tau * a) * lever * inverse * inverse * inverse;
        let yielding = one + Lanes::splat(ranker.shear) * square * inverse * inverse;
        self.own[0] * Lanes::splat(ranker.stiffness) * square * square * reach / yielding
    }

    #[inline(always)]
    pub fn row<const OWN: bool>(&self, ranker: &Ranker, j: usize) -> Row {
        if OWN {
            let mut basis = [Lanes::of(0.0); ORDERS];
            basis[0] = Lanes::of(1.0);
            return Row { drive: self.own[0], power: self.own[1], basis };
        }
        Row::at(&ranker.angles[j].stroke, ranker.points)
    }

    /// q = K̄/K − 1 of a tap of a row.
    #[inline(always)]
    pub fn miss(&self, row: &Row, tap: TapSeries<'_>, m: usize) -> Lanes {
        let deviation = row.power * row.read(tap.kappa, m);
        (self.calibration(row, m) - deviation) / (Lanes::of(1.0) + deviation)
    }

    /// K̄ − 1 of a row.
    #[inline(always)]
    pub fn calibration(&self, row: &Row, m: usize) -> Lanes {
        match self.passed.fixed {
            Some(fixed) => fixed,
            None => row.power * row.read(&self.mean, m),
        }
    }
}
