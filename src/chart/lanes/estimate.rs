//! The distance estimate in a pack: errors of a row, and the words of its taps.

use super::edges::Edges;
use super::rows::{Row, Rows};
use super::tally::Tally;
use super::tap::Tap;
use super::{Distance, Lanes, ORDERS, Tables};
use crate::kernel::cpu::Pack;
use crate::kernel::ranking::{BEYOND, FARTHEST};
use crate::scene::RankBy;

/// q from which, and up to which, the near root is within the range of interest, and q at the peak.
#[inline(always)]
pub(super) fn bounds<const FMA: bool>(
    tables: &Tables,
    tap: &Tap<Lanes<FMA>>,
    distance: &Distance,
) -> [Lanes<FMA>; 3] {
    let (lo, hi) = (Pack::splat(distance.ends[0]), Pack::splat(distance.ends[1]));
    let growth = &tap.growth;
    let at_lo = growth.at(tables, lo)[0];
    let at_hi = growth.at(tables, hi)[0];
    let peak = growth.at(tables, growth.vertex)[0];
    let never = Lanes::<FMA>::of(1e30);
    [lo.if_less(growth.vertex, never, at_lo), growth.vertex.if_less(hi, at_hi, never).min(peak), peak]
}

/// Steps to a root: each leaves the cube of what there was.
const STEPS: usize = 6;

/// η of the far root of a growth of `q`, and the slope there; the slope is 0 where there is none.
#[inline(always)]
pub(super) fn root<const FMA: bool>(
    tables: &Tables,
    tap: &Tap<Lanes<FMA>>,
    (q, peak): (Lanes<FMA>, Lanes<FMA>),
) -> [Lanes<FMA>; 2] {
    let of = Lanes::<FMA>::of;
    let growth = &tap.growth;
    let zero = of(0.0);
    if tables.theory.plain {
        let [eta, slope] = growth.far(q);
        return [eta, peak.if_less(q, zero, slope)];
    }
    // f grows from the apex, or from infinitely far, to its peak: steps by the parabola at each place, halving where one leaves what is
    // left of that.
    let (mut lo, mut hi) = (growth.least(), growth.vertex);
    let (mut eta, mut slope) = (growth.vertex.if_less(zero, growth.vertex, zero), zero);
    for _ in 0..STEPS {
        let [value, now, curvature] = growth.at(tables, eta);
        let rest = q - value;
        lo = value.if_less(q, eta, lo);
        hi = value.if_less(q, hi, eta);
        slope = (now * now + of(2.0) * curvature * rest).max(zero).sqrt().max(of(1e-6));
        eta = eta + of(2.0) * rest / (now.max(zero) + slope);
        let middle = of(0.5) * (lo + hi);
        eta = eta.if_less(lo, middle, hi.if_less(eta, middle, eta));
    }
    [eta, peak.if_less(q, zero, slope)]
}

/// Least and largest power of the drives, by which most taps' words are known at once.
pub(super) struct Decided<T> {
    powers: [T; 2],
}

impl<const FMA: bool> Decided<Lanes<FMA>> {
    #[inline(always)]
    pub fn new(tables: &Tables, rows: &Rows<Lanes<FMA>>) -> Self {
        let powers = match (tables.angles.first(), tables.angles.last()) {
            (Some(first), Some(last)) if !tables.apart => [Pack::splat(first.power), Pack::splat(last.power)],
            _ => [rows.own[1]; 2],
        };
        Self { powers }
    }

    /// Least and largest q of a tap over all drives. q = (K̄ − K)(1 + δ), and K̄ − K is θᵉ times a series; where some taps do not
    /// count, K̄ is anywhere among the others.
    #[inline(always)]
    fn range(
        &self,
        tables: &Tables,
        rows: &Rows<Lanes<FMA>>,
        tap: &Tap<Lanes<FMA>>,
        every: bool,
        m: usize,
    ) -> [Lanes<FMA>; 2] {
        let of = Lanes::<FMA>::of;
        let zero = of(0.0);
        let mean = if tables.fixed.is_some() { [zero; ORDERS] } else { rows.mean };
        let middle = mean[0] - tap.kappa[0];
        let mut around = zero;
        for k in 1..m {
            around = around + (mean[k] - tap.kappa[k]).abs();
        }
        let (mut lo, mut hi) = (middle - around, middle + around);
        if !every && tables.fixed.is_none() {
            let mut apart = zero;
            for k in 0..m {
                apart = apart + (rows.hull[1][k] - tap.kappa[k]).max(tap.kappa[k] - rows.hull[0][k]);
            }
            (lo, hi) = (zero - apart, apart);
        }
        let [least, most] = self.powers;
        let fixed = Pack::splat(tables.fixed.unwrap_or(0.0));
        let lo = lo * lo.if_less(zero, most, least) + fixed;
        let hi = hi * hi.if_less(zero, least, most) + fixed;
        // 1 + δ, and rounding.
        let (less, more) = (of(0.99999) - rows.largest, of(1.00001) + rows.largest);
        [lo * lo.if_less(zero, more, less) - of(1e-7), hi * hi.if_less(zero, less, more) + of(1e-7)]
    }

    /// Adds the words of one tap over all drives.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub fn count<const OWN: bool>(
        &self,
        tables: &Tables,
        rows: &Rows<Lanes<FMA>>,
        (tap, distance): (&Tap<Lanes<FMA>>, &Distance),
        edges: &Edges<Lanes<FMA>>,
        complete: &Lanes<FMA>,
        tally: &mut Tally<Lanes<FMA>>,
    ) {
        let of = Lanes::<FMA>::of;
        let m = tables.points;
        let drives = if OWN { 1 } else { tables.angles.len() };
        let every = of(drives as f64).all_at_most(*complete);
        let [least, most] = if OWN {
            let q = rows.miss(tables, &rows.row::<OWN>(tables, 0), tap, m);
            [q - of(1e-7), q + of(1e-7)]
        } else {
            self.range(tables, rows, tap, every, m)
        };
        let [low, high, peak] = bounds(tables, tap, distance);
        let farthest = -tap.growth.at(tables, of(-1.0))[0];
        let (zero, one) = (of(0.0), of(1.0));
        // 1 where every drive has a root; where each is clear of the other word; where each has it; where a reading may lie below
        // what the farthest contact gives.
        let certain = most.if_less(peak, one, zero);
        let clear = most.if_less(low, one, high.if_less(least, one, zero));
        let ambiguous = low.if_less(least, most.if_less(high, one, zero), zero);
        // One reading is known; of many only bounds are.
        let [fewest, highest] = BEYOND[usize::from(!OWN)];
        let beyond = (of(-0.9) * farthest).max(of(fewest));
        let beyond = least.if_less(beyond, one, of(highest).if_less(most, one, zero));

        let all = of(drives as f64);
        tally.strain = tally.strain + (all - edges.above);
        tally.slipped = tally.slipped + (all - edges.slipped);
        let clear = certain * clear;
        let ambiguous = certain * ambiguous * (one - clear);
        let near = one - beyond;
        tally.ok = tally.ok + near * clear * edges.above.min(edges.slipped);
        tally.ambiguous = tally.ambiguous + near * ambiguous * all;
        let rest = near * (one - clear) * (one - ambiguous);
        let whole = complete.if_less(all, zero, one);
        tally.hard = tally.hard.max(beyond).max(rest * (one - whole));
        let open = rest * whole;
        if open.all_at_most(zero) {
            return;
        }
        let clean = edges.above.min(edges.slipped);
        let [mut rootless, mut twice, mut free] = [zero; 3];
        for j in 0..drives {
            let row = rows.row::<OWN>(tables, j);
            let q = rows.miss(tables, &row, tap, m);
            let none = peak.if_less(q, one, zero);
            let two = q.if_less(low, zero, high.if_less(q, zero, one));
            rootless = rootless + none;
            twice = twice + two;
            free = free + of(j as f64).if_less(clean, one - none.max(two), zero);
        }
        tally.rootless = tally.rootless + open * rootless;
        tally.ambiguous = tally.ambiguous + open * twice;
        tally.ok = tally.ok + open * free;
    }
}

impl<const FMA: bool> Rows<Lanes<FMA>> {
    /// Distance errors of a row, reduced to its ranked value, and 1 where every tap has a distance; its taps' words go to `counts`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub fn estimate(
        &self,
        tables: &Tables,
        row: &Row<Lanes<FMA>>,
        taps: &[Tap<Lanes<FMA>>],
        m: usize,
        edges: &[Edges<Lanes<FMA>>],
        place: Lanes<FMA>,
        tally: &mut Tally<Lanes<FMA>>,
    ) -> (Lanes<FMA>, Lanes<FMA>) {
        let of = Lanes::<FMA>::of;
        let (zero, one) = (of(0.0), of(1.0));
        let (mut squares, mut largest, mut noises) = (zero, zero, zero);
        let noise = (one + self.calibration(tables, row, m)) * Pack::splat(tables.noise) / row.drive;
        let [mut none_sum, mut two_sum, mut strain_sum, mut slip_sum, mut free_sum] = [zero; 5];
        for ((tap, distance), edge) in taps.iter().zip(&tables.distances).zip(edges) {
            let q = self.miss(tables, row, tap, m);
            let [low, high, peak] = bounds(tables, tap, distance);
            let [eta, slope] = root(tables, tap, (q, peak));
            let whole = one / (one + eta);
            let a = Pack::splat(distance.a);
            let error = a * eta * whole;
            squares = error.mul_add(error, squares);
            largest = largest.max(error.abs());
            // |f′(â)| = f(a) times the slope, times (1 + η)²/a.
            let sigma = noise * a * whole * whole / (tap.strain * slope).max(of(1e-30));
            noises = sigma.mul_add(sigma, noises);
            // Below what the farthest contact gives, a widening whisker has no root.
            let none = peak.if_less(q, one, (one + eta).if_less(of(FARTHEST), one, zero));
            let near = q.if_less(low, zero, high.if_less(q, zero, one)) * (one - none);
            let over = place.if_less(edge.above, zero, one);
            let off = place.if_less(edge.slipped, zero, one);
            none_sum = none_sum + none;
            two_sum = two_sum + near;
            strain_sum = strain_sum + over;
            slip_sum = slip_sum + off;
            free_sum = free_sum + (one - none.max(near).max(over).max(off));
        }
        tally.rootless = tally.rootless + none_sum;
        tally.ambiguous = tally.ambiguous + two_sum;
        tally.strain = tally.strain + strain_sum;
        tally.slipped = tally.slipped + slip_sum;
        tally.ok = tally.ok + free_sum;
        let share = of(1.0 / taps.len() as f64);
        let rank = match tables.by {
            RankBy::ErrorMax => largest,
            RankBy::NoiseRms => (noises * share).sqrt(),
            RankBy::TotalRms => ((squares + noises) * share).sqrt(),
            _ => (squares * share).sqrt(),
        };
        (rank, none_sum.if_less(of(0.5), one, zero))
    }
}
