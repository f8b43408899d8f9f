//! Rows of a pack of designs: spread of K, status words, and which rows are among the best.

use super::dispatch::{Part, apart};
use super::tally::{Tally, sum};
use super::tap::Tap;
use super::theory::Whisker;
use super::words::Decided;
use super::{Distance, Found, LANES, Lanes, ORDERS, PAIRS, Scratch, Tables};
use crate::design::amount;
use crate::kernel::cpu::Pack;
use crate::scene::{Per, RankBy, Tuple};

/// Largest deviation of the strain for which K is told.
pub(super) const MOST: f32 = 0.95;

/// Largest deviation of the strain for which it is taken to grow with the drive.
pub(super) const LARGEST: f32 = 0.3;

/// Statistics of a pack over its distances.
pub(super) struct Rows<T> {
    pub live: usize,
    pub design: Whisker<T>,
    /// Each design's own drive, rad or mm, and its power e.
    pub own: [T; 2],
    /// Mean of κ.
    pub mean: [T; ORDERS],
    /// Least and largest κ.
    pub hull: [[T; ORDERS]; 2],
    /// Sums of products of κ − mean, k ≤ l.
    spread: [T; PAIRS],
    /// Largest |δ|.
    pub largest: T,
}

/// A drive.
#[derive(Clone, Copy)]
pub(super) struct Row<T> {
    pub drive: T,
    /// Its power e.
    pub power: T,
    basis: [T; ORDERS],
}

impl<const FMA: bool> Row<Lanes<FMA>> {
    /// The polynomial through `values` at this angle.
    #[inline(always)]
    pub fn read(&self, values: &[Lanes<FMA>; ORDERS], m: usize) -> Lanes<FMA> {
        let mut sum = self.basis[0] * values[0];
        for k in 1..m {
            sum = self.basis[k].mul_add(values[k], sum);
        }
        sum
    }
}

/// [`Rows::new`].
struct New<'a, const FMA: bool, const OWN: bool, const FORCE: bool> {
    tables: &'a Tables,
    live: usize,
    tuples: &'a [Tuple],
    scratch: &'a mut Scratch<FMA>,
}

impl<const FMA: bool, const OWN: bool, const FORCE: bool> Part<FMA> for New<'_, FMA, OWN, FORCE> {
    type Out = Rows<Lanes<FMA>>;

    #[inline(always)]
    fn run(self) -> Rows<Lanes<FMA>> {
        Rows::made::<OWN, FORCE>(self.tables, self.live, self.tuples, self.scratch)
    }
}

/// [`Rows::count_and_rank`].
struct Ranking<'a, const FMA: bool, const OWN: bool> {
    rows: &'a Rows<Lanes<FMA>>,
    tables: &'a Tables,
    asked: (&'a [u64], &'a [u32; LANES]),
    bound: f32,
    scratch: &'a mut Scratch<FMA>,
    found: &'a mut Found,
}

impl<const FMA: bool, const OWN: bool> Part<FMA> for Ranking<'_, FMA, OWN> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        self.rows.ranked::<OWN>(self.tables, self.asked, self.bound, self.scratch, self.found);
    }
}

impl<const FMA: bool> Rows<Lanes<FMA>> {
    /// Statistics of `tuples`, the first `live` of which count; their taps, with `FORCE` all that is known of them, stay in `scratch`.
    #[inline(always)]
    pub fn new<const OWN: bool, const FORCE: bool>(
        tables: &Tables,
        live: usize,
        tuples: &[Tuple],
        scratch: &mut Scratch<FMA>,
    ) -> Self {
        apart(New::<FMA, OWN, FORCE> { tables, live, tuples, scratch })
    }

    #[inline(always)]
    fn made<const OWN: bool, const FORCE: bool>(
        tables: &Tables,
        live: usize,
        tuples: &[Tuple],
        scratch: &mut Scratch<FMA>,
    ) -> Self {
        let of = Lanes::<FMA>::of;
        let mut columns = [[0.0f32; LANES]; 6];
        for lane in 0..LANES {
            let t = &tuples[if lane < live { lane } else { 0 }];
            let slope = 0.5 * (t.D - t.d) / t.L_a;
            let x2 = t.x_ss + t.l / (1.0 + slope * slope).sqrt();
            let drive = amount(tables.kind, t.drive);
            let values = [t.D, (t.D - t.d) / (t.D * t.L_a), t.L_a, t.x_ss, x2, drive];
            for (column, value) in columns.iter_mut().zip(values) {
                column[lane] = value as f32;
            }
        }
        let [diameter, tau, length, x1, x2, mut own] = columns.map(Pack);
        if !OWN {
            // The largest counts where contacts slip off.
            own = Pack::splat(tables.angles[tables.angles.len() - 1].drive);
        }
        let design = Whisker::new(tables, [diameter, tau, length], [x1, x2]);
        let power = match tables.power {
            0 => of(1.0),
            1 => own,
            _ => own * own,
        };
        let m = tables.points;
        let mut rows = Self {
            live,
            design,
            own: [own, power],
            mean: [of(0.0); ORDERS],
            hull: [[of(1e30); ORDERS], [of(-1e30); ORDERS]],
            spread: [of(0.0); PAIRS],
            largest: of(0.0),
        };
        let Scratch { basis, products, taps, charts, .. } = scratch;
        match &tables.between {
            None => {
                for (i, ((chart, distance), tap)) in
                    tables.charts.iter().zip(&tables.distances).zip(taps).enumerate()
                {
                    let at = (&mut *basis, &mut **products);
                    tables.tap::<FMA, OWN, FORCE>(
                        &design,
                        [own, power],
                        (chart, FORCE || design.moves(power, chart)),
                        at,
                        tap,
                    );
                    tap.told::<FORCE>(tables, &design, distance);
                    rows.push(tap, i, m);
                }
            }
            Some(between) => {
                let mut with_arc = FORCE;
                for chart in &tables.charts {
                    with_arc |= design.moves(power, chart);
                }
                for (chart, tap) in tables.charts.iter().zip(&mut *charts) {
                    let at = (&mut *basis, &mut **products);
                    tables.tap::<FMA, OWN, FORCE>(&design, [own, power], (chart, with_arc), at, tap);
                }
                rows.push_forms(tables, between, charts);
                between.fill::<FMA, FORCE>(charts, (m, with_arc), taps);
                for (distance, tap) in tables.distances.iter().zip(taps) {
                    tap.told::<FORCE>(tables, &design, distance);
                    rows.widen(tap, m);
                }
            }
        }
        rows
    }

    /// Takes the tap at distance `i`.
    #[inline(always)]
    fn push(&mut self, tap: &Tap<Lanes<FMA>>, i: usize, m: usize) {
        let share = Lanes::<FMA>::of(1.0 / (i + 1) as f64);
        let (mut from_old, mut from_new) = ([Lanes::<FMA>::of(0.0); ORDERS], [Lanes::<FMA>::of(0.0); ORDERS]);
        self.largest = self.largest.max(tap.largest);
        for k in 0..m {
            from_old[k] = tap.kappa[k] - self.mean[k];
            self.mean[k] = from_old[k].mul_add(share, self.mean[k]);
            from_new[k] = tap.kappa[k] - self.mean[k];
        }
        self.spread(&from_old, &from_new, m);
        self.widen(tap, m);
    }

    /// Adds products of deviations.
    #[inline(always)]
    pub(super) fn spread(&mut self, a: &[Lanes<FMA>; ORDERS], b: &[Lanes<FMA>; ORDERS], m: usize) {
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
    fn widen(&mut self, tap: &Tap<Lanes<FMA>>, m: usize) {
        for k in 0..m {
            self.hull[0][k] = self.hull[0][k].min(tap.kappa[k]);
            self.hull[1][k] = self.hull[1][k].max(tap.kappa[k]);
        }
    }

    /// P of the linear theory at `distance`, N.
    #[inline(always)]
    pub fn linear_force(&self, tables: &Tables, distance: &Distance) -> Lanes<FMA> {
        let (a, inverse) = (Pack::splat(distance.a), Pack::splat(distance.inverse));
        let (one, square) = (Lanes::<FMA>::of(1.0), self.design.diameter * self.design.diameter);
        let lever = if tables.theory.displaced { one } else { a + Pack::splat(tables.theory.hub) };
        let reach = (one - self.design.tau * a) * lever * inverse * inverse * inverse;
        let yielding = one + Lanes::<FMA>::splat(tables.shear) * square * inverse * inverse;
        self.own[0] * Pack::splat(tables.stiffness) * square * square * reach / yielding
    }

    /// Drive `j`.
    #[inline(always)]
    pub fn row<const OWN: bool>(&self, tables: &Tables, j: usize) -> Row<Lanes<FMA>> {
        if OWN {
            let mut basis = [Pack::of(0.0); ORDERS];
            basis[0] = Pack::of(1.0);
            return Row { drive: self.own[0], power: self.own[1], basis };
        }
        let a = &tables.angles[j];
        let mut basis = [Pack::of(0.0); ORDERS];
        for k in 0..tables.points {
            basis[k] = Pack::splat(a.basis[k]);
        }
        Row { drive: Pack::splat(a.drive), power: Pack::splat(a.power), basis }
    }

    /// Counts the words of all taps and adds the rows below `bound`.
    #[inline(always)]
    pub fn count_and_rank<const OWN: bool>(
        &self,
        tables: &Tables,
        asked: (&[u64], &[u32; LANES]),
        bound: f32,
        scratch: &mut Scratch<FMA>,
        found: &mut Found,
    ) {
        apart(Ranking::<FMA, OWN> { rows: self, tables, asked, bound, scratch, found });
    }

    #[inline(always)]
    fn ranked<const OWN: bool>(
        &self,
        tables: &Tables,
        (ks, places): (&[u64], &[u32; LANES]),
        bound: f32,
        scratch: &mut Scratch<FMA>,
        found: &mut Found,
    ) {
        let of = Lanes::<FMA>::of;
        let m = tables.points;
        let (taps, edges) = (&scratch.taps, &mut scratch.edges);
        let drives = if OWN { 1 } else { tables.angles.len() };
        let estimates = tables.by != RankBy::KSd;
        let most = Pack::splat(if OWN { MOST } else { LARGEST });
        let mut tally = Tally::new(self.largest.if_less(most, of(0.0), of(1.0)));
        edges.clear();
        // First drive at which any tap of the design has slipped: from there its rows are not complete.
        let mut complete = of(drives as f64);
        let last = self.row::<OWN>(tables, drives - 1);
        for (tap, distance) in taps.iter().zip(&tables.distances) {
            let edge = self.edges::<OWN>(tables, tap, distance, &last, drives, m);
            complete = complete.min(edge.slipped);
            edges.push(edge);
        }
        if !estimates && OWN {
            for (tap, edge) in taps.iter().zip(&*edges) {
                self.count(tables, tap, edge, &complete, &mut tally);
            }
        } else if !estimates {
            let decided = Decided::new(tables);
            for (tap, edge) in taps.iter().zip(&*edges) {
                decided.count(tables, self, tap, edge, &complete, &mut tally);
            }
        }

        let scale = if tables.elongation { self.design.gauge[1] - self.design.gauge[0] } else { of(1.0) };
        let scale = scale * of((1.0 / (taps.len() as f64 - 1.0)).sqrt());
        let (bound, never) = (Lanes::<FMA>::splat(bound), of(f64::INFINITY));
        let mut best = [never, of(0.0)];
        let mut rows_complete = complete;
        if estimates {
            rows_complete = of(0.0);
        }
        let start = found.rows.len();
        for j in 0..drives {
            let place = of(j as f64);
            let mut rank = if estimates {
                let row = self.row::<OWN>(tables, j);
                let (rank, whole) = self.estimate(tables, &row, taps, m, edges, place, &mut tally);
                let whole = place.if_less(complete, whole, of(0.0));
                rows_complete = rows_complete + whole;
                of(0.5).if_less(whole, rank, never)
            } else if OWN {
                self.own[1] * self.spread[0].max(of(0.0)).sqrt() * scale
            } else {
                let a = &tables.angles[j];
                let mut sum = self.spread[0] * Pack::splat(a.products[0]);
                for at in 1..m * (m + 1) / 2 {
                    sum = self.spread[at].mul_add(Pack::splat(a.products[at]), sum);
                }
                Lanes::<FMA>::splat(a.power) * sum.max(of(0.0)).sqrt() * scale
            };
            if !estimates {
                rank = place.if_less(complete, rank, never);
            }
            match tables.per {
                Per::Row if bound.all_at_most(rank) => {}
                Per::Row => {
                    for lane in 0..self.live {
                        let place = if OWN { places[lane] } else { tables.angles[j].place };
                        if rank.0[lane] < bound.0[lane] && !tally.is_hard(lane) {
                            found.rows.push((rank.0[lane], ks[lane], place));
                        }
                    }
                }
                Per::Design => {
                    best[1] = rank.if_less(best[0], place, best[1]);
                    best[0] = rank.min(best[0]);
                }
            }
        }
        let counts = tally.counts(self.live);
        found.words.add(&tally.words(counts));
        found.complete += match tables.per {
            Per::Row => sum(rows_complete * counts),
            Per::Design => sum(of(0.0).if_less(rows_complete, counts, of(0.0))),
        };
        if tables.per == Per::Design && !bound.all_at_most(best[0]) {
            for lane in (0..self.live).filter(|&lane| best[0].0[lane] < bound.0[lane]) {
                let j = best[1].0[lane] as usize;
                let place = if OWN { places[lane] } else { tables.angles[j].place };
                found.rows.push((best[0].0[lane], ks[lane], place));
            }
        }
        if (0..self.live).any(|lane| tally.is_hard(lane)) {
            // Rows pushed before a design turned out to be hard.
            let mut at = start;
            while at < found.rows.len() {
                let lane = ks.iter().position(|&k| k == found.rows[at].1);
                if lane.is_some_and(|lane| tally.is_hard(lane)) {
                    found.rows.swap_remove(at);
                } else {
                    at += 1;
                }
            }
            found.hard.extend((0..self.live).filter(|&lane| tally.is_hard(lane)).map(|lane| ks[lane]));
        }
    }

    /// q = K̄/K − 1 of a tap of a row.
    #[inline(always)]
    pub fn miss(
        &self,
        tables: &Tables,
        row: &Row<Lanes<FMA>>,
        tap: &Tap<Lanes<FMA>>,
        m: usize,
    ) -> Lanes<FMA> {
        let deviation = row.power * row.read(&tap.kappa, m);
        (self.calibration(tables, row, m) - deviation) / (Lanes::<FMA>::of(1.0) + deviation)
    }

    /// K̄ − 1 of a row.
    #[inline(always)]
    pub fn calibration(&self, tables: &Tables, row: &Row<Lanes<FMA>>, m: usize) -> Lanes<FMA> {
        match tables.fixed {
            Some(fixed) => Pack::splat(fixed),
            None => row.power * row.read(&self.mean, m),
        }
    }
}
