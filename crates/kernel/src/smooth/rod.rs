//! The chart of the plain rod: what one table says of every frictionless Hooke tap on the centreline.
//!
//! Without hub, shear and surface the dimensionless rod knows only p = τa and the tap angle; a gauge adds where it sits.
//! With t = θ², unit of length a, and the first-order solution W₀ = 3θ(1 − p), c = 1,
//!
//! - W = W₀ (1 + t ω(p, t)), c = 1 + t ζ(p, t),
//! - Δξ(s) = ∫_s^c (1 − cos ψ) ds = t X(s; p, t), by which the lever arm of the force is shorter than c − s,
//!
//! and the strain over that of the linear theory is 1 + δ with
//!
//! `δ/t = ω + (1 + tω) r (ζ − X̃)`, `r = (u1 + u2)/(u2 (1 − s1) + u1 (1 − s2))`, u = 1 − p s,
//!
//! X̃ the mean of X over the gauge [s1, s2] with the weight 1/(1 − ps)³. ω, ζ and X are smooth: Chebyshev series in t, 1/(1 − p) and s, of
//! which only the coefficients that matter are kept. Their values come from the f64 kernel.

use crate::{Effects, Rung, Solution, Tap, cpu::Cpu};
use vibrissa_core::physics::chebyshev::{basis, coefficients, placed, points, scaled, series};
use vibrissa_core::reduce::Sweeps;
use vibrissa_core::scene::{Material, Precision};

/// Tolerance of the solves.
const TOLERANCE: f64 = 1e-11;

/// Most terms over p and over s, and points over t.
pub const MOST: [usize; 3] = [24, 12, 8];

/// Numbers of points over t that are tried.
const SQUARES: [usize; 6] = [2, 3, 4, 5, 6, 8];

/// Share of a solution's strain that the charted rod may be wrong by, of the tolerance asked.
const SHARE: f64 = 0.1;

/// Largest error of δ/t relative to |δ/t| + [`SMALL`]: keeps SD(K) where K − 1 is small.
const RELATIVE: f64 = 1e-4;

/// Coefficients that are left out, each at most this.
const NEGLIGIBLE: f64 = 0.05 * RELATIVE * SMALL;

/// A small δ/t: where K − 1 changes sign along a, errors are measured against this.
const SMALL: f64 = 0.02;

/// Where a chart holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// p = τa.
    pub taper: [f64; 2],
    /// s = x/a of any point of a gauge.
    pub place: [f64; 2],
    /// Largest θ, rad.
    pub angle: f64,
}

impl Range {
    /// Range of 1/(1 − p).
    pub fn stiffness(&self) -> [f64; 2] {
        self.taper.map(|p| 1.0 / (1.0 - p))
    }
}

/// ω, ζ and X over a range.
#[derive(Debug, Clone, PartialEq)]
pub struct RodChart {
    /// Where it holds.
    pub range: Range,
    /// Largest t.
    pub square: f64,
    /// Terms over p.
    pub terms: usize,
    /// Terms of X over s.
    pub place_terms: usize,
    /// For each term over t: coefficients over p of ω, of ζ, and of each coefficient over s of X; short where the rest does
    /// not matter.
    pub values: Vec<Vec<Vec<f64>>>,
    /// Largest error of the strain found on points between those of the chart, relative.
    pub error: f64,
    /// Of the taps solved to make and to check it.
    pub sweeps: Sweeps,
}

/// ω, ζ and X(s) at given p and t.
#[derive(Debug, Clone, PartialEq)]
struct Point {
    force: f64,
    arc: f64,
    shortening: Vec<f64>,
}

/// What `run.json` says of a chart.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Range of τa.
    pub taper: [f64; 2],
    /// Range of x/a on the gauge.
    pub place: [f64; 2],
    /// Largest θ, degrees.
    pub theta_deg: f64,
    /// Coefficients of the series.
    pub coefficients: usize,
    /// Largest relative error of the strain at the points that checked it.
    pub strain_error: f64,
    /// Taps solved to make and to check it.
    pub solved: u64,
}

impl RodChart {
    /// Its range, size and error.
    pub fn summary(&self) -> Summary {
        Summary {
            taper: self.range.taper,
            place: self.range.place,
            theta_deg: self.range.angle.to_degrees(),
            coefficients: self.values.iter().flatten().map(Vec::len).sum(),
            strain_error: self.error,
            solved: self.sweeps.taps,
        }
    }

    /// The chart over `range` whose strain is good to a tenth of `tolerance`. Where the rod next to the apex is beyond a chart of
    /// bounded size, or folds, the range over p is shortened; `None` where that does not help.
    pub fn new(range: Range, tolerance: f64) -> Option<Self> {
        let [lo, hi] = range.taper;
        let shorter = |k: i32| 1.0 - (1.0 - hi) * 1.25f64.powi(k);
        (0..12)
            .map(|k| Range { taper: [lo, shorter(k)], ..range })
            .take_while(|r| r.taper[1] >= lo)
            .find_map(|r| Self::over(r, tolerance))
    }

    fn over(range: Range, tolerance: f64) -> Option<Self> {
        // Far below the largest angle the deviations drown in the rounding of the solutions.
        let most = range.angle.max(0.05);
        let mut sweeps = Sweeps::default();
        for count in SQUARES {
            let mut chart = Self::through(range, most * most, count, &mut sweeps)?;
            let (strain, relative) = chart.check(most, &mut sweeps)?;
            (chart.error, chart.sweeps) = (strain, sweeps);
            if strain <= SHARE * tolerance && relative <= RELATIVE {
                return Some(chart);
            }
        }
        None
    }

    /// Through `count` squares up to `square`, with as many terms over p and s as it takes.
    fn through(range: Range, square: f64, count: usize, sweeps: &mut Sweeps) -> Option<Self> {
        let [rows, columns, _] = MOST;
        let squares: Vec<f64> = squares(square, count);
        let tapers: Vec<f64> = points(rows).into_iter().map(|x| taper(range.taper, x)).collect();
        let places: Vec<f64> = points(columns).into_iter().map(|x| placed(range.place, x)).collect();
        let wanted: Vec<(f64, f64)> =
            squares.iter().flat_map(|&t| tapers.iter().map(move |&p| (p, t))).collect();
        let points = solve(&wanted, &places, sweeps)?;
        // Functions × terms over p × squares, then terms over t.
        let series: Vec<Vec<f64>> = points.iter().map(|p| coefficients(&p.shortening)).collect();
        let function = |f: usize, k: usize, i: usize| {
            let at = k * rows + i;
            match f {
                0 => points[at].force,
                1 => points[at].arc,
                f => series[at][f - 2],
            }
        };
        let mut values = vec![vec![Vec::new(); 2 + columns]; count];
        for f in 0..2 + columns {
            let over_taper: Vec<Vec<f64>> = (0..count)
                .map(|k| coefficients(&(0..rows).map(|i| function(f, k, i)).collect::<Vec<_>>()))
                .collect();
            for i in 0..rows {
                let over_squares: Vec<f64> = over_taper.iter().map(|c| c[i]).collect();
                for (k, c) in coefficients(&over_squares).into_iter().enumerate() {
                    values[k][f].push(c);
                }
            }
        }
        for c in values.iter_mut().flatten() {
            let kept = c.iter().rposition(|c| c.abs() > NEGLIGIBLE).map_or(0, |i| i + 1);
            c.truncate(kept);
        }
        let functions =
            values.iter().filter_map(|v| v.iter().rposition(|c| !c.is_empty())).max().unwrap_or(0);
        let place_terms = (functions + 1).saturating_sub(2).max(1);
        values.iter_mut().for_each(|v| v.truncate(2 + place_terms));
        let terms = values.iter().flatten().map(Vec::len).max().unwrap_or(0).max(1);
        Some(Self {
            range,
            square,
            terms,
            place_terms,
            values,
            error: f64::INFINITY,
            sweeps: Sweeps::default(),
        })
    }

    /// Values at t of the polynomials over t.
    pub fn basis(&self, t: f64) -> Vec<f64> {
        basis(self.values.len(), scaled([0.0, self.square], t))
    }

    /// Largest errors on points in between: of the strain, and of δ/t relative to |δ/t| + [`SMALL`].
    fn check(&self, most: f64, sweeps: &mut Sweeps) -> Option<(f64, f64)> {
        // Weyl points fill the three axes evenly.
        let at = |i: usize, step: f64| (0.5 + step * (i + 1) as f64).fract();
        let (n, each) = (96, 4);
        let wanted: Vec<(f64, f64)> = (0..n)
            .map(|i| {
                let p = taper(self.range.taper, 2.0 * at(i, 0.819_172_513_396_164_4) - 1.0);
                (p, (most * at(i, 0.671_043_606_703_789_2)).powi(2))
            })
            .collect();
        let places: Vec<f64> =
            (0..each).map(|k| placed(self.range.place, 2.0 * at(k, 0.549_700_477_901_970_1) - 1.0)).collect();
        let points = solve(&wanted, &places, sweeps)?;
        let (mut strain, mut relative) = (0.0f64, 0.0f64);
        for (&(p, t), point) in wanted.iter().zip(&points) {
            for (&s, &shortening) in places.iter().zip(&point.shortening) {
                let exact = deviation(t, s, [point.force, point.arc, shortening]);
                let charted = deviation(t, s, self.at(p, t, s));
                let error = (exact - charted).abs();
                strain = strain.max(t * error);
                relative = relative.max(error / (exact.abs() + SMALL));
            }
        }
        Some((strain, relative))
    }

    /// ω, ζ and X(s).
    pub fn at(&self, p: f64, t: f64, s: f64) -> [f64; 3] {
        let (x, y) = (scaled(self.range.stiffness(), 1.0 / (1.0 - p)), scaled(self.range.place, s));
        let mut sum = [0.0; 3];
        for (values, l) in self.values.iter().zip(&self.basis(t)) {
            let over_place: Vec<f64> = values.iter().map(|c| series(c, x).0).collect();
            sum[0] += l * over_place[0];
            sum[1] += l * over_place[1];
            sum[2] += l * series(&over_place[2..], y).0;
        }
        sum
    }
}

/// δ/t of a point gauge at `s`.
fn deviation(t: f64, s: f64, [force, arc, shortening]: [f64; 3]) -> f64 {
    force + (1.0 + t * force) * (arc - shortening) / (1.0 - s)
}

/// Solves the rod at each (p, t) with a point gauge at each of `places`.
fn solve(wanted: &[(f64, f64)], places: &[f64], sweeps: &mut Sweeps) -> Option<Vec<Point>> {
    let rungs = Rung::ladder(Precision::F64, &Material::Hooke(1.0), TOLERANCE);
    let tap = |p: f64, t: f64, s: f64| Tap {
        taper: p,
        rest: 1.0 - p,
        angle: t.sqrt(),
        near: 1.0 - s,
        far: 1.0 - s,
        width: 1.0,
        weight: 1.0,
        pole_x: 1.0,
        radius: 1.0,
        force: 3.0 * t.sqrt() * (1.0 - p),
        strain: 3.0 * t.sqrt() * (1.0 - p) * (1.0 - s) / (1.0 - p * s).powi(3),
        ..Tap::default()
    };
    let taps: Vec<Tap<f64>> =
        wanted.iter().flat_map(|&(p, t)| places.iter().map(move |&s| tap(p, t, s))).collect();
    let mut solutions: Vec<Solution<f64>> = Vec::new();
    crate::solve(&mut Cpu::new(Precision::F64), Effects::default(), &rungs, TOLERANCE, &taps, &mut solutions)
        .ok()?;
    solutions.iter().for_each(|s| sweeps.push(s.sweeps));
    if !solutions.iter().all(|s| s.within(TOLERANCE)) {
        return None;
    }
    let point = |(&(_, t), row): (&(f64, f64), &[Solution<f64>])| {
        let (force, arc) = (row[0].force / t, row[0].arc / t);
        let shortening = row
            .iter()
            .zip(places)
            .map(|(s, place)| arc - (s.strain / t - force) * (1.0 - place) / (1.0 + t * force))
            .collect();
        Point { force, arc, shortening }
    };
    Some(wanted.iter().zip(solutions.chunks(places.len())).map(point).collect())
}

/// p at x ∈ [−1, 1] of a range; the charts are polynomials in 1/(1 − p), on which the rod depends most evenly: over p = 0…0.8
/// they need 11 terms, against more than 24 in p and 17 in log(1 − p).
fn taper([lo, hi]: [f64; 2], x: f64) -> f64 {
    1.0 - 1.0 / placed([1.0 / (1.0 - lo), 1.0 / (1.0 - hi)], x)
}

/// `count` Chebyshev points of t ∈ [0, `square`].
pub fn squares(square: f64, count: usize) -> Vec<f64> {
    points(count).into_iter().map(|x| placed([0.0, square], x)).collect()
}
