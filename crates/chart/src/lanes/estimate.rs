//! The distance estimate in a pack: errors of a row.

use super::rows::{Row, Rows};
use super::tap::{TapSeries, Taps};
use super::{Distance, Lanes, ORDERS, Tables};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::FARTHEST;
use crate::scene::RankBy;

/// Steps to a root: each leaves the cube of what there was.
const STEPS: usize = 6;

/// η of the far root of a growth of `q`, and the slope there; the slope is 0 where there is none.
#[inline(always)]
pub(super) fn root(tables: &Tables, tap: TapSeries<'_>, (q, peak): (Lanes, Lanes)) -> [Lanes; 2] {
    let of = Lanes::of;
    let growth = tap.growth;
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

/// What a tap's reading says of its distance.
pub(super) struct Told {
    /// â − a, mm.
    pub error: Lanes,
    /// Of the noise, mm.
    pub sigma: Lanes,
    /// 1 above the peak: there is no distance.
    pub none: Lanes,
    /// 1 where the distance is infinitely far, or beyond: a widening whisker may read less than what its farthest contact gives.
    pub lost: Lanes,
    /// 1 where the distance changes smoothly with the reading: far from the peak of f.
    smooth: Lanes,
}

/// Shares of the slope of f at the contact, and of what its factors alone give, below which a distance is not taken to be smooth.
const SMOOTH: [f64; 2] = [0.5, 0.1];

impl Told {
    /// Of the reading `q` of `tap`, whose standard deviation is `noise` θ; `peak` is q at the peak.
    #[inline(always)]
    pub fn new(
        tables: &Tables,
        (tap, distance): (TapSeries<'_>, &Distance),
        (q, peak, noise): (Lanes, Lanes, Lanes),
    ) -> Self {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [eta, slope] = root(tables, tap, (q, peak));
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
    /// The distance that a tap of a row tells.
    #[inline(always)]
    fn distance(
        &self,
        tables: &Tables,
        row: &Row,
        tap: (TapSeries<'_>, &Distance),
        (noise, peak): (Lanes, Lanes),
    ) -> Told {
        Told::new(tables, tap, (self.miss(row, tap.0, tables.points), peak, noise))
    }

    /// K̄ σ/θ of a reading.
    #[inline(always)]
    fn noise(&self, tables: &Tables, row: &Row) -> Lanes {
        let k = Lanes::of(1.0) + self.calibration(row, tables.points);
        k * Lanes::splat(tables.noise) / row.drive / self.passed.share
    }

    /// The value by which a row is ranked, of its distance errors, and 1 where every tap has a distance.
    #[inline(always)]
    pub fn estimate(&self, tables: &Tables, row: &Row, taps: &Taps) -> (Lanes, Lanes) {
        let of = Lanes::of;
        let [mut squares, mut largest, mut noises, mut none] = [of(0.0); 4];
        let noise = self.noise(tables, row);
        for (i, distance) in tables.distances.iter().enumerate() {
            let tap = (taps.at(i), distance);
            let [.., peak] = self.design.words.bounds(tap.0);
            let told = self.distance(tables, row, tap, (noise, peak));
            squares = told.error.mul_add(told.error, squares);
            largest = largest.max(told.error.abs());
            noises = told.sigma.mul_add(told.sigma, noises);
            none = none + told.none.max(told.lost);
        }
        let share = of(1.0 / taps.len() as f64);
        let rank = match tables.by {
            RankBy::ErrorMax => largest,
            RankBy::NoiseRms => (noises * share).sqrt(),
            RankBy::TotalRms => ((squares + noises) * share).sqrt(),
            _ => (squares * share).sqrt(),
        };
        (rank, none.if_less(of(0.5), of(1.0), of(0.0)))
    }
}

/// Share of a bound on squares that is left to the error of the polynomials.
const MARGIN: f64 = 0.05;

/// Bounds from below on what rows are ranked by, as polynomials over the drives that designs share: distances that change smoothly with the
/// drive alone, from a few of the drives. A row that may be among the best is estimated.
pub(super) struct Floor {
    /// Mean of (â − a)² over driveᵉ².
    errors: [Lanes; ORDERS],
    /// Mean of the noise's variance times drive².
    noises: [Lanes; ORDERS],
}

/// Coefficients over the drives, times `share`, from values at the points.
#[inline(always)]
fn series(tables: &Tables, values: &[Lanes; ORDERS], share: Lanes) -> [Lanes; ORDERS] {
    let mut series = [Lanes::of(0.0); ORDERS];
    for k in 0..tables.points {
        for n in 0..tables.points {
            series[k] = Lanes::splat(tables.from_points[k][n]).mul_add(values[n], series[k]);
        }
        series[k] = series[k] * share;
    }
    series
}

impl Floor {
    /// Whether `tables` rank by what has one, and by enough drives.
    pub fn pays(tables: &Tables) -> bool {
        let smooth = matches!(tables.by, RankBy::ErrorRms | RankBy::NoiseRms | RankBy::TotalRms);
        smooth && tables.angles.len() > 2 * tables.points
    }

    /// Of `rows` with their taps.
    #[inline(always)]
    pub fn new(tables: &Tables, rows: &Rows, taps: &Taps) -> Self {
        let (zero, half) = (Lanes::of(0.0), Lanes::of(0.5));
        let (mut errors, mut noises) = ([zero; ORDERS], [zero; ORDERS]);
        let m = tables.points;
        for (i, distance) in tables.distances.iter().enumerate() {
            let tap = (taps.at(i), distance);
            let [.., peak] = rows.design.words.bounds(tap.0);
            let (mut squares, mut variances) = ([zero; ORDERS], [zero; ORDERS]);
            let mut smooth = Lanes::of(1.0);
            for (k, stroke) in tables.grid.iter().enumerate() {
                let row = Row::at(stroke, m);
                let told = rows.distance(tables, &row, tap, (rows.noise(tables, &row), peak));
                smooth = smooth.min(told.smooth);
                let (error, sigma) = (told.error / row.power, told.sigma * row.drive);
                (squares[k], variances[k]) = (error * error, sigma * sigma);
            }
            for k in 0..m {
                // Without a distance they are no numbers.
                errors[k] = errors[k] + half.if_less(smooth, squares[k], zero);
                noises[k] = noises[k] + half.if_less(smooth, variances[k], zero);
            }
        }
        let share = Lanes::of((1.0 - MARGIN) / taps.len() as f64);
        Self { errors: series(tables, &errors, share), noises: series(tables, &noises, share) }
    }

    /// Square of the bound of a row.
    #[inline(always)]
    pub fn at(&self, tables: &Tables, row: &Row) -> Lanes {
        let m = tables.points;
        let errors = row.power * row.power * row.read(&self.errors, m);
        let noises = row.read(&self.noises, m) / (row.drive * row.drive);
        match tables.by {
            RankBy::NoiseRms => noises,
            RankBy::TotalRms => errors + noises,
            _ => errors,
        }
    }
}
