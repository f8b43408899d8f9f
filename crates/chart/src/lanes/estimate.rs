//! The distance estimate in a pack: errors of a row.

use super::rows::{Row, Rows};
use super::tap::{TapSeries, Taps};
use super::{Distance, Lanes, ORDERS, Ranker};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::FARTHEST;
use crate::scene::RankBy;

/// Steps to a root; convergence is cubic.
const STEPS: usize = 6;

/// η of the far root of a growth of `q`, and the slope there; the slope is 0 without a root.
#[inline(always)]
pub(super) fn root(ranker: &Ranker, tap: TapSeries<'_>, (q, peak): (Lanes, Lanes)) -> [Lanes; 2] {
    let of = Lanes::of;
    let growth = tap.growth;
    let zero = of(0.0);
    if ranker.theory.plain {
        let [eta, slope] = growth.far(q);
        return [eta, peak.if_less(q, zero, slope)];
    }
    // f grows from the apex, or from infinity, to its peak: steps by the parabola at each place, halving the bracket where one leaves it.
    let (mut lo, mut hi) = (growth.least(), growth.vertex);
    let (mut eta, mut slope) = (growth.vertex.if_less(zero, growth.vertex, zero), zero);
    for _ in 0..STEPS {
        let [value, now, curvature] = growth.at(ranker, eta);
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

pub(super) struct Told {
    /// â − a, mm.
    pub error: Lanes,
    /// Standard deviation of â from noise, mm.
    pub sigma: Lanes,
    /// 1 above the peak, where no distance exists.
    pub none: Lanes,
    /// 1 where the distance is infinite, or beyond: a widening whisker may read less than at its farthest contact.
    pub lost: Lanes,
    smooth: Lanes,
}

/// Least slope of f at the root, as shares of its slope at the contact and of the slopes of its factors, for a smooth distance.
const SMOOTH: [f64; 2] = [0.5, 0.1];

impl Told {
    /// `q`: the reading; `noise` θ: its standard deviation; `peak`: q at the peak.
    #[inline(always)]
    pub fn new(
        ranker: &Ranker,
        (tap, distance): (TapSeries<'_>, &Distance),
        (q, peak, noise): (Lanes, Lanes, Lanes),
    ) -> Self {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [eta, slope] = root(ranker, tap, (q, peak));
        let whole = one / (one + eta);
        let a = Lanes::splat(distance.a);
        let [here, factors] = tap.growth.slopes();
        let least = (of(SMOOTH[0]) * here.abs()).max(of(SMOOTH[1]) * factors);
        Self {
            error: a * eta * whole,
            // |f′(â)| = f(a) times the slope, times (1 + η)²/a.
            sigma: noise * a * whole * whole / (tap.strain * slope).max(of(1e-30)),
            none: peak.if_less(q, one, zero),
            lost: (one + eta).if_less(of(FARTHEST), one, zero),
            smooth: least.if_less(slope, one, zero),
        }
    }
}

impl Rows {
    #[inline(always)]
    fn distance(
        &self,
        ranker: &Ranker,
        row: &Row,
        tap: (TapSeries<'_>, &Distance),
        (noise, peak): (Lanes, Lanes),
    ) -> Told {
        Told::new(ranker, tap, (self.miss(row, tap.0, ranker.points), peak, noise))
    }

    #[inline(always)]
    pub fn noise(&self, ranker: &Ranker, row: &Row) -> Lanes {
        let k = Lanes::of(1.0) + self.calibration(row, ranker.points);
        k * Lanes::splat(ranker.noise) / row.drive / self.passed.share
    }

    /// The value by which a row is ranked, of its distance errors, and 1 where every tap has a distance.
    #[inline(always)]
    pub fn estimate(&self, ranker: &Ranker, row: &Row, taps: &Taps, by: RankBy) -> (Lanes, Lanes) {
        let of = Lanes::of;
        let [mut squares, mut largest, mut noises, mut none] = [of(0.0); 4];
        let noise = self.noise(ranker, row);
        for (i, distance) in ranker.distances.iter().enumerate() {
            let tap = (taps.at(i), distance);
            let ([.., peak], _) = self.design.words.bounds(tap.0.strain);
            let told = self.distance(ranker, row, tap, (noise, peak));
            squares = told.error.mul_add(told.error, squares);
            largest = largest.max(told.error.abs());
            noises = told.sigma.mul_add(told.sigma, noises);
            none = none + told.none.max(told.lost);
        }
        let share = of(1.0 / taps.len() as f64);
        let rank = match by {
            RankBy::ErrorRms => (squares * share).sqrt(),
            RankBy::ErrorMax => largest,
            RankBy::NoiseRms => (noises * share).sqrt(),
            _ => ((squares + noises) * share).sqrt(),
        };
        (rank, none.if_less(of(0.5), of(1.0), of(0.0)))
    }
}

/// Share of a bound on squares reserved for the error of the polynomials.
const MARGIN: f64 = 0.05;

/// Lower bounds on what ranks the rows, over shared drives, from smooth distances only. Rows that may be among the best are then estimated.
pub(super) struct Floor {
    /// Mean of (â − a)² over driveᵉ².
    errors: [Lanes; ORDERS],
    /// Mean of the noise's variance times drive².
    noises: [Lanes; ORDERS],
}

impl Floor {
    /// True over enough drives for a ranking by a value that it bounds.
    pub fn pays(ranker: &Ranker, by: RankBy) -> bool {
        by != RankBy::ErrorMax && ranker.angles.len() > 2 * ranker.points
    }

    #[inline(always)]
    pub fn new(ranker: &Ranker, rows: &Rows, taps: &Taps) -> Self {
        let (zero, half) = (Lanes::of(0.0), Lanes::of(0.5));
        let share = Lanes::of((1.0 - MARGIN) / taps.len() as f64);
        let (mut errors, mut noises) = ([zero; ORDERS], [zero; ORDERS]);
        let m = ranker.points;
        for (i, distance) in ranker.distances.iter().enumerate() {
            let tap = (taps.at(i), distance);
            let ([.., peak], _) = rows.design.words.bounds(tap.0.strain);
            let (mut squares, mut variances) = ([zero; ORDERS], [zero; ORDERS]);
            let mut smooth = Lanes::of(1.0);
            for (k, stroke) in ranker.grid.iter().enumerate() {
                let row = Row::at(stroke, m);
                let told = rows.distance(ranker, &row, tap, (rows.noise(ranker, &row), peak));
                smooth = smooth.min(told.smooth);
                let (error, sigma) = (told.error / row.power, told.sigma * row.drive);
                (squares[k], variances[k]) = (error * error, sigma * sigma);
            }
            for k in 0..m {
                // NaN without a distance.
                errors[k] = errors[k] + half.if_less(smooth, share * squares[k], zero);
                noises[k] = noises[k] + half.if_less(smooth, share * variances[k], zero);
            }
        }
        let mut floor = Self { errors: [zero; ORDERS], noises: [zero; ORDERS] };
        ranker.to_series(&errors, &mut floor.errors[..m]);
        ranker.to_series(&noises, &mut floor.noises[..m]);
        floor
    }

    /// Square of the bound of a row.
    #[inline(always)]
    pub fn at(&self, ranker: &Ranker, row: &Row, by: RankBy) -> Lanes {
        let m = ranker.points;
        let errors = row.power * row.power * row.read(&self.errors, m);
        let noises = row.read(&self.noises, m) / (row.drive * row.drive);
        match by {
            RankBy::ErrorRms => errors,
            RankBy::NoiseRms => noises,
            _ => errors + noises,
        }
    }
}
