//! Rows of a pack of designs: spread of K, status words, and which rows are among the best.

use super::dispatch::{Part, apart};
use super::passed::Passed;
use super::tap::TapSeries;
use super::theory::Whisker;
use super::{Charted, Distance, LANES, Lanes, ORDERS, PAIRS, Scratch, Stroke, Tables};
use crate::design::amount;
use crate::kernel::cpu::Pack;
use crate::scene::Tuple;

/// Largest deviation of the strain for which K is told.
pub(super) const MOST: f32 = 0.95;

/// Largest deviation of the strain for which it is taken to grow with the drive.
const LARGEST: f32 = 0.3;

/// The same where the skin gives way: its share of the deviation falls with the drive.
const YIELDING: f32 = 0.7;

impl Tables {
    /// Largest deviation of the strain, over drives that designs share, for which it is taken to grow with the drive.
    pub(super) fn largest(&self) -> f32 {
        if self.fourth { YIELDING } else { LARGEST }
    }
}

/// Statistics of a pack over its distances.
pub(super) struct Rows<T> {
    pub live: usize,
    pub design: Whisker<T>,
    pub passed: Passed<T>,
    /// Each design's own drive, rad or mm, and its power e.
    pub own: [T; 2],
    /// Mean of κ.
    pub mean: [T; ORDERS],
    /// Least and largest κ.
    pub hull: [[T; ORDERS]; 2],
    /// Sums of products of κ − mean, k ≤ l.
    pub spread: [T; PAIRS],
    /// Largest |δ|.
    pub largest: T,
    /// Mean and sum of squares of what κ may be off.
    pub slack: [T; 2],
    /// No contact can move off its whisker.
    pub still: bool,
}

/// A drive.
#[derive(Clone, Copy)]
pub(super) struct Row<T> {
    pub drive: T,
    /// Its power e.
    pub power: T,
    basis: [T; ORDERS],
}

impl<const SET: u8> Row<Lanes<SET>> {
    /// At a drive that designs share.
    #[inline(always)]
    pub fn at(stroke: &Stroke, m: usize) -> Self {
        let mut basis = [Pack::of(0.0); ORDERS];
        for k in 0..m {
            basis[k] = Pack::splat(stroke.basis[k]);
        }
        Self { drive: Pack::splat(stroke.drive), power: Pack::splat(stroke.power), basis }
    }

    /// The polynomial through `values` at this angle.
    #[inline(always)]
    pub fn read(&self, values: &[Lanes<SET>], m: usize) -> Lanes<SET> {
        let mut sum = self.basis[0] * values[0];
        for k in 1..m {
            sum = self.basis[k].mul_add(values[k], sum);
        }
        sum
    }
}

/// [`Rows::fill`].
struct Fill<'a, const SET: u8, const OWN: bool, const FORCE: bool> {
    rows: &'a mut Rows<Lanes<SET>>,
    tables: &'a Tables,
    set: &'a [Charted],
    live: usize,
    tuples: &'a [Tuple],
    scratch: &'a mut Scratch<SET>,
}

impl<const SET: u8, const OWN: bool, const FORCE: bool> Part<SET> for Fill<'_, SET, OWN, FORCE> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        self.rows.filled::<OWN, FORCE>((self.tables, self.set), self.live, self.tuples, self.scratch);
    }
}

impl<const SET: u8> Rows<Lanes<SET>> {
    /// No designs yet.
    #[inline(always)]
    pub fn new() -> Self {
        let zero = Lanes::<SET>::of(0.0);
        Self {
            live: 0,
            design: Whisker::default(),
            passed: Passed { share: Lanes::<SET>::of(1.0), limit: zero, fixed: None },
            own: [zero; 2],
            mean: [zero; ORDERS],
            hull: [[zero; ORDERS]; 2],
            spread: [zero; PAIRS],
            largest: zero,
            slack: [zero; 2],
            still: false,
        }
    }

    /// Statistics of `tuples` from the charts of `set`, the first `live` of which count; their taps, with `FORCE` all that is known of them, stay in
    /// `scratch`.
    #[inline(always)]
    pub fn fill<const OWN: bool, const FORCE: bool>(
        &mut self,
        (tables, set): (&Tables, &[Charted]),
        live: usize,
        tuples: &[Tuple],
        scratch: &mut Scratch<SET>,
    ) {
        apart(Fill::<SET, OWN, FORCE> { rows: self, tables, set, live, tuples, scratch });
    }

    #[inline(always)]
    fn filled<const OWN: bool, const FORCE: bool>(
        &mut self,
        (tables, set): (&Tables, &[Charted]),
        live: usize,
        tuples: &[Tuple],
        scratch: &mut Scratch<SET>,
    ) {
        let of = Lanes::<SET>::of;
        let mut columns = [[0.0f32; LANES]; 6];
        for lane in 0..LANES {
            let t = &tuples[if lane < live { lane } else { 0 }];
            let values = [t.D, t.D - t.d, t.L_a, t.x_ss, t.l, amount(tables.kind, t.drive)];
            for (column, value) in columns.iter_mut().zip(values) {
                column[lane] = value as f32;
            }
        }
        let [diameter, narrower, length, x1, grid, mut own] = columns.map(Pack);
        let taper = narrower / length;
        let (tau, slope) = (taper / diameter, of(0.5) * taper);
        let x2 = x1 + grid / slope.mul_add(slope, of(1.0)).sqrt();
        if !OWN {
            // The largest counts where contacts slip off.
            own = Pack::splat(tables.angles[tables.angles.len() - 1].stroke.drive);
        }
        self.passed = Passed::new(tables, &tuples[..live]);
        let design = Whisker::new(tables, [diameter, tau, length], [x1, x2]);
        let power = match tables.power {
            0 => of(1.0),
            1 => own,
            _ => own * own,
        };
        let m = if OWN { 1 } else { tables.points };
        (self.live, self.design, self.own, self.largest) = (live, design, [own, power], of(0.0));
        (self.slack, self.still) = ([of(0.0); 2], true);
        for k in 0..m {
            (self.mean[k], self.hull[0][k], self.hull[1][k]) = (of(0.0), of(1e30), of(-1e30));
        }
        for sum in &mut self.spread[..m * (m + 1) / 2] {
            *sum = of(0.0);
        }
        let Scratch { basis, products, taps, charts, .. } = &mut *scratch;
        let each = tables.between.is_none();
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
            tables.tap::<SET, OWN, FORCE>(&design, [own, power], (chart, with_arc), at, (&mut *into, i));
        }
        match &tables.between {
            None => taps.add_theory::<FORCE>(tables, &design),
            Some(between) => {
                self.push_forms(tables, between, charts);
                // At drives of their own many distances need not be read one by one.
                match OWN && !FORCE {
                    true => return,
                    false => self.read_between::<FORCE>(tables, scratch),
                }
            }
        }
        let taps = &scratch.taps;
        for i in 0..taps.len() {
            let tap = taps.at(i);
            if each {
                self.push(tap, i, m);
            }
            if !OWN {
                self.widen(tap, m);
            }
        }
    }

    /// Reads the taps at all distances between those at the charts.
    #[inline(always)]
    pub fn read_between<const FORCE: bool>(&self, tables: &Tables, scratch: &mut Scratch<SET>) {
        let Some(between) = &tables.between else { return };
        let Scratch { taps, charts, .. } = scratch;
        between.fill::<SET, FORCE>(charts, FORCE || !self.still, taps);
        taps.add_theory::<FORCE>(tables, &self.design);
    }

    /// Takes the tap at distance `i`.
    #[inline(always)]
    fn push(&mut self, tap: TapSeries<'_, Lanes<SET>>, i: usize, m: usize) {
        let share = Lanes::<SET>::of(1.0 / (i + 1) as f64);
        let (mut from_old, mut from_new) = ([Lanes::<SET>::of(0.0); ORDERS], [Lanes::<SET>::of(0.0); ORDERS]);
        self.largest = self.largest.max(tap.largest);
        self.slack[0] = (tap.slack[0] - self.slack[0]).mul_add(share, self.slack[0]);
        self.slack[1] = tap.slack[0].mul_add(tap.slack[0], self.slack[1]);
        for k in 0..m {
            from_old[k] = tap.kappa[k] - self.mean[k];
            self.mean[k] = from_old[k].mul_add(share, self.mean[k]);
            from_new[k] = tap.kappa[k] - self.mean[k];
        }
        self.spread(&from_old, &from_new, m);
    }

    /// Adds products of deviations.
    #[inline(always)]
    pub(super) fn spread(&mut self, a: &[Lanes<SET>; ORDERS], b: &[Lanes<SET>; ORDERS], m: usize) {
        let mut at = 0;
        for k in 0..m {
            for l in k..m {
                self.spread[at] = a[k].mul_add(b[l], self.spread[at]);
                at += 1;
            }
        }
    }

    /// Takes κ of `tap` into the least and largest.
    #[inline(always)]
    fn widen(&mut self, tap: TapSeries<'_, Lanes<SET>>, m: usize) {
        for k in 0..m {
            self.hull[0][k] = self.hull[0][k].min(tap.kappa[k]);
            self.hull[1][k] = self.hull[1][k].max(tap.kappa[k]);
        }
    }

    /// P of the linear theory at `distance`, N.
    #[inline(always)]
    pub fn linear_force(&self, tables: &Tables, distance: &Distance) -> Lanes<SET> {
        let (a, inverse) = (Pack::splat(distance.a), Pack::splat(distance.inverse));
        let (one, square) = (Lanes::<SET>::of(1.0), self.design.diameter * self.design.diameter);
        let lever = if tables.theory.displaced { one } else { a + Pack::splat(tables.theory.hub) };
        let reach = (one - self.design.tau * a) * lever * inverse * inverse * inverse;
        let yielding = one + Lanes::<SET>::splat(tables.shear) * square * inverse * inverse;
        self.own[0] * Pack::splat(tables.stiffness) * square * square * reach / yielding
    }

    /// Drive `j`.
    #[inline(always)]
    pub fn row<const OWN: bool>(&self, tables: &Tables, j: usize) -> Row<Lanes<SET>> {
        if OWN {
            let mut basis = [Pack::of(0.0); ORDERS];
            basis[0] = Pack::of(1.0);
            return Row { drive: self.own[0], power: self.own[1], basis };
        }
        Row::at(&tables.angles[j].stroke, tables.points)
    }

    /// q = K̄/K − 1 of a tap of a row.
    #[inline(always)]
    pub fn miss(&self, row: &Row<Lanes<SET>>, tap: TapSeries<'_, Lanes<SET>>, m: usize) -> Lanes<SET> {
        let deviation = row.power * row.read(tap.kappa, m);
        (self.calibration(row, m) - deviation) / (Lanes::<SET>::of(1.0) + deviation)
    }

    /// K̄ − 1 of a row.
    #[inline(always)]
    pub fn calibration(&self, row: &Row<Lanes<SET>>, m: usize) -> Lanes<SET> {
        match self.passed.fixed {
            Some(fixed) => fixed,
            None => row.power * row.read(&self.mean, m),
        }
    }
}
