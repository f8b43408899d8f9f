//! The distance estimate in a pack: errors of a row, and the words of its taps.

use super::edges::Edges;
use super::rows::{Row, Rows};
use super::tally::Tally;
use super::tap::Tap;
use super::{Lanes, Tables};
use crate::kernel::cpu::Pack;
use crate::kernel::ranking::FARTHEST;
use crate::scene::RankBy;

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
            let [low, high, peak] = self.design.words.bounds(tap);
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
