//! Inversion of a signal: the posterior of the distance, with a flat prior within the calibrated range.

use std::ops::Range;

use vibrissa_core::{physics::inverse::bracketed, reduce::distinct, status::Status};

use crate::base::Base;
use crate::curve::{Curve, OF_95};

/// Grid points in ln a.
pub const POINTS: usize = 161;
const DRIVES: usize = 14;
/// Search range beyond the calibrated distances, in ranges of ln a on either side.
const BEYOND: f64 = 0.35;
/// Standard deviation of the prior beyond them, in ranges, and for a known whisker in ln a; the larger one counts.
const FADES: [f64; 2] = [0.15, 0.3];
/// Search range beyond the calibrated distances for a known whisker, in ln a.
const KNOWN: f64 = 1.2;
/// A signal this many standard deviations off still has an answer.
const FAR: f64 = 5.0;
const WIDE: f64 = 0.05;
/// Shares of a posterior at its median, one standard deviation to either side, and the ends of the 95 % interval.
pub const SHARES: [f64; 5] = [0.025, 0.158_655, 0.5, 0.841_345, 0.975];
/// Points over which a posterior is integrated.
pub const FINE: usize = 49;

/// Distance from a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Distance in mm: the largest root, shifted by the prior, or the median of a wide posterior.
    pub a: f64,
    /// Next distance with the same signal, mm.
    pub near: Option<f64>,
    /// d signal/da at the distance, 1/mm.
    pub slope: f64,
    /// Variance of the signal without that of one reading: from the calibration; for a posterior also from position and run.
    pub variance: f64,
    /// Standard deviation of a posterior in mm (half of the 68 % interval if wide); NaN if noise, slope and variance give it.
    pub sigma: f64,
    /// 95 % interval of a posterior for known variances, mm; else NaN.
    pub ends: [f64; 2],
    /// True for the median of a wide posterior, false for a root.
    pub wide: bool,
}

impl Found {
    /// Root whose standard deviation follows from noise, slope and variance.
    pub fn root(a: f64, near: Option<f64>, slope: f64, variance: f64) -> Self {
        Self { a, near, slope, variance, sigma: f64::NAN, ends: [f64::NAN; 2], wide: false }
    }
}

/// Signals and variances over ln a, tabulated at some drives.
#[derive(Debug, Clone)]
pub struct Inverse {
    /// First ln a and step.
    pub grid: [f64; 2],
    /// First and last calibrated ln a, and standard deviation of the prior beyond them.
    pub ends: [f64; 3],
    /// Offset added to the drive u.
    pub offset: f64,
    /// ln u of the nodes.
    pub nodes: Vec<f64>,
    /// At each node, point by point: signal/u, and variances/u² of noise, of curve and position, and of a new run.
    table: Vec<Vec<f64>>,
}

impl Inverse {
    /// Table of `curve` over its base within `reach` (mm); `tared` readings have their zero subtracted. Few `drives` are the only nodes.
    pub fn new(curve: &Curve, base: &Base, (tared, reach): (bool, [f64; 2]), drives: Option<&[f64]>) -> Self {
        let [u, width] = curve.scales.u;
        let usual =
            |k: usize| u + 1.02 * width * (std::f64::consts::PI * (k as f64 + 0.5) / DRIVES as f64).cos();
        let few = drives.map(|drives| distinct(drives.iter().map(|u| (u + curve.scales.offset).ln())));
        let few = few.filter(|few| few.len() < DRIVES && few.iter().all(|x| x.is_finite()));
        let many = || (0..DRIVES).map(usual).collect();
        let nodes = if width > 0.0 { few.unwrap_or_else(many) } else { vec![u] };
        let [middle, half] = curve.scales.a;
        let ends = [middle - half, middle + half];
        let known = matches!(base, Base::Known(..));
        let beyond = (BEYOND * 2.0 * half).max(if known { KNOWN } else { 0.0 });
        let from = (ends[0] - beyond).max(reach[0].max(1e-9).ln()).min(ends[0]);
        let to = (ends[1] + beyond).min(reach[1].ln()).max(ends[1]);
        let fades = (FADES[0] * 2.0 * half).max(if known { FADES[1] } else { 0.0 });
        let ends = [ends[0], ends[1], fades];
        let step = (to - from) / (POINTS - 1) as f64;
        let offset = curve.scales.offset;
        let zero = if tared { 0.0 } else { curve.spread.zero * curve.unit.powi(2) };
        let one = |a: f64, u: f64| {
            let e = curve.expected(base, a, u - offset, tared);
            let u2 = u * u;
            vec![e.signal / u, e.of_noise / u2, (e.of_curve + e.of_position) / u2, (e.of_run + zero) / u2]
        };
        let table = tabled(&nodes, [from, step], one);
        Self { grid: [from, step], ends, offset, nodes, table }
    }

    /// Range of distances that can be answered, mm.
    pub fn reach(&self) -> [f64; 2] {
        [self.grid[0].exp(), (self.grid[0] + self.grid[1] * (POINTS - 1) as f64).exp()]
    }

    pub(crate) fn weights(&self, u: f64) -> Vec<f64> {
        let x = u.ln();
        if let Some(k) = self.nodes.iter().position(|n| *n == x) {
            return (0..self.nodes.len()).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        }
        let (n, angle) = (self.nodes.len() as f64, |k: usize| std::f64::consts::PI * (k as f64 + 0.5));
        let weight = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 } * (angle(k) / n).sin();
        let terms: Vec<f64> = self.nodes.iter().enumerate().map(|(k, node)| weight(k) / (x - node)).collect();
        let sum: f64 = terms.iter().sum();
        terms.iter().map(|t| t / sum).collect()
    }

    /// The numbers at these `places` of a `table` with a row for each node, at a drive above its offset.
    pub(crate) fn between(&self, table: &[Vec<f64>], u: f64, places: Range<usize>) -> Vec<f64> {
        blend(&self.weights(u), table.iter().map(|row| &row[places.clone()]), places.len())
    }

    /// Signals and variances over ln a at the drive u; `same_run` for a reading of a run of the calibration.
    pub fn at(&self, u: f64, same_run: bool) -> Slice {
        let u = u + self.offset;
        let of = |x: &[f64]| {
            let run = if same_run { 0.0 } else { x[3] };
            [x[0] * u, (x[1] * u * u).max(0.0), ((x[2] + run) * u * u).max(0.0)]
        };
        let points: Vec<[f64; 3]> = self.between(&self.table, u, 0..4 * POINTS).chunks(4).map(of).collect();
        let peak = (0..POINTS).max_by(|i, k| points[*i][0].total_cmp(&points[*k][0])).unwrap_or(0);
        Slice { grid: self.grid, ends: self.ends, points, peak }
    }
}

/// At each of these nodes the numbers `of` each point: of its distance, mm, and the drive above its offset. Nodes without a value (the whisker slips off) get
/// signal/u of a parabola through the three nearest nodes, and the other numbers of the nearest one.
pub(crate) fn tabled(nodes: &[f64], grid: [f64; 2], of: impl Fn(f64, f64) -> Vec<f64>) -> Vec<Vec<f64>> {
    let [from, step] = grid;
    let row = |u: &f64| (0..POINTS).flat_map(|k| of((from + step * k as f64).exp(), u.exp())).collect();
    let mut table: Vec<Vec<f64>> = nodes.iter().map(row).collect();
    let width = table.first().map_or(0, |row| row.len() / POINTS);
    for at in (0..POINTS).map(|k| k * width..(k + 1) * width) {
        let (known, holes): (Vec<usize>, Vec<usize>) =
            (0..nodes.len()).partition(|j| table[*j][at.clone()].iter().all(|x| x.is_finite()));
        for j in holes {
            let mut near = known.clone();
            near.sort_by(|p, q| (nodes[*p] - nodes[j]).abs().total_cmp(&(nodes[*q] - nodes[j]).abs()));
            near.truncate(3);
            let share = |p: &usize| {
                let others = near.iter().filter(|q| *q != p);
                others.map(|q| (nodes[j] - nodes[*q]) / (nodes[*p] - nodes[*q])).product::<f64>()
            };
            let signal = near.iter().map(|p| share(p) * table[*p][at.start]).sum();
            let values = match near.first() {
                Some(first) => table[*first][at.clone()].to_vec(),
                // No node has a value: repeat the point before, so that no answer lies there.
                None if at.start > 0 => table[j][at.start - width..at.start].to_vec(),
                None => vec![0.0; width],
            };
            table[j][at.clone()].copy_from_slice(&values);
            if !near.is_empty() {
                table[j][at.start] = signal;
            }
        }
    }
    table
}

/// Σ weight · point over points of `width` numbers each.
pub(crate) fn blend<'p>(weights: &[f64], points: impl Iterator<Item = &'p [f64]>, width: usize) -> Vec<f64> {
    let mut sums = vec![0.0; width];
    for (w, point) in weights.iter().zip(points) {
        sums.iter_mut().zip(point).for_each(|(sum, x)| *sum += w * x);
    }
    sums
}

/// First of the N points of a grid around x, and the steps from there to x.
pub(crate) fn place<const N: usize>([from, step]: [f64; 2], x: f64) -> (usize, f64) {
    let s = ((x - from) / step).clamp(0.0, (POINTS - 1) as f64);
    let k = (s as usize + 1).saturating_sub(N / 2).min(POINTS - N);
    (k, s - k as f64)
}

/// Weights of N even points in the polynomial through them, t steps from the first.
pub(crate) fn lagrange<const N: usize>(t: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let others = (0..N).filter(|j| *j != i);
        others.map(|j| (t - j as f64) / (i as f64 - j as f64)).product()
    })
}

/// Derivatives of [`lagrange`].
pub(crate) fn slopes<const N: usize>(t: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let term = |m: usize| {
            let others = (0..N).filter(|j| *j != i && *j != m);
            others.map(|j| (t - j as f64) / (i as f64 - j as f64)).product::<f64>() / (i as f64 - m as f64)
        };
        (0..N).filter(|m| *m != i).map(term).sum()
    })
}

/// Signals over ln a at one drive.
#[derive(Debug, Clone)]
pub struct Slice {
    grid: [f64; 2],
    ends: [f64; 3],
    points: Vec<[f64; 3]>,
    peak: usize,
}

impl Slice {
    /// Signal and variances at ln a = x, by cubic interpolation.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let (k, t) = place::<4>(self.grid, x);
        let w = lagrange::<4>(t);
        std::array::from_fn(|i| w.iter().zip(&self.points[k..]).map(|(w, point)| w * point[i]).sum())
    }

    fn slope(&self, x: f64) -> f64 {
        let (k, t) = place::<4>(self.grid, x);
        let w = slopes::<4>(t);
        w.iter().zip(&self.points[k..]).map(|(w, point)| w * point[0]).sum::<f64>() / self.grid[1]
    }

    fn x(&self, k: usize) -> f64 {
        self.grid[0] + self.grid[1] * k as f64
    }

    fn root(&self, y: f64, k: usize) -> f64 {
        bracketed(|x| self.at(x)[0] - y, self.x(k), self.x(k + 1))
    }

    /// Distance for a signal `y`; `more` is the variance of its zero.
    /// Errors: a signal weaker than at the farthest distance of the table, or stronger than any.
    pub fn find(&self, y: f64, more: f64) -> Result<Found, Status> {
        let spread = |p: &[f64; 3]| (p[1] + p[2] + more).sqrt();
        let last = POINTS - 1;
        let crosses = |k: &usize| (self.points[*k][0] >= y) != (self.points[*k + 1][0] >= y);
        let far = (self.peak..last).rev().find(crosses).map(|k| self.root(y, k));
        let near = (0..self.peak).rev().find(crosses).map(|k| self.root(y, k).exp());
        let local = far.map(|x| {
            let p = self.at(x);
            (x, spread(&p) / self.slope(x).abs())
        });
        let [from, to] = [self.x(self.peak), self.x(last)];
        let window = match local {
            Some((x, sd)) if sd < WIDE => [(x - 6.0 * sd).max(from), (x + 6.0 * sd).min(to)],
            _ => [from.min(self.x(last - 1)), to],
        };
        let wide = local.is_none_or(|(_, sd)| sd >= WIDE);
        let [first, end, _] = self.ends;
        let ([x, sigma], ends) = match local {
            // Within the calibrated distances the prior is flat: the root is the answer.
            Some((x, sd)) if sd < WIDE && window[0] >= first && window[1] <= end => {
                let (a, sigma) = (x.exp(), x.exp() * sd);
                ([x, sigma], [-OF_95, OF_95].map(|z| a + z * sigma))
            }
            _ => self.posterior(y, local, window, spread)?,
        };
        let p = self.at(x);
        let a = x.exp();
        let found = Found { a, sigma, ends, slope: self.slope(x) / a, variance: p[2] + more, near, wide };
        let sound = found.a.is_finite() && found.sigma.is_finite();
        sound.then_some(found).ok_or(Status::OUTSIDE_CALIBRATION)
    }

    /// [ln a, σ in mm] and 95 % interval in mm of the posterior on `window`; `local` is the root and its standard deviation in ln a.
    fn posterior(
        &self,
        y: f64,
        local: Option<(f64, f64)>,
        window: [f64; 2],
        spread: impl Fn(&[f64; 3]) -> f64,
    ) -> Result<([f64; 2], [f64; 2]), Status> {
        let step = (window[1] - window[0]) / (FINE - 1) as f64;
        let place = |k: usize| window[0] + step * k as f64;
        let mut least = f64::INFINITY;
        let mut likely = |k: usize| {
            let p = self.at(place(k));
            let sd = spread(&p);
            let t = (p[0] - y) / sd;
            least = least.min(t.abs());
            // Jacobian: the prior is flat in mm.
            (-0.5 * t * t).exp() / sd * place(k).exp()
        };
        let flat: [f64; FINE] = std::array::from_fn(&mut likely);
        if local.is_none() && least > FAR {
            let weak = self.points[POINTS - 1][0] > y;
            return Err(if weak { Status::OUTSIDE_CALIBRATION } else { Status::NO_ROOT });
        }
        let faded: [f64; FINE] = std::array::from_fn(|k| flat[k] * prior(self.ends, place(k)));
        let [from, lo, middle, hi, to] = quantiles(&faded, window[0], step);
        Ok(match local {
            Some((x, sd)) if sd < WIDE && hi > lo => {
                let [_, p, q, r, _] = quantiles(&flat, window[0], step);
                let x = x + middle - q;
                ([x, x.exp() * sd * (hi - lo) / (r - p)], [from, to].map(|end| (end + x - middle).exp()))
            }
            _ => ([middle, 0.5 * (hi.exp() - lo.exp())], [from, to].map(f64::exp)),
        })
    }
}

/// Prior density at ln a = x relative to the calibrated range.
pub(crate) fn prior([first, last, fades]: [f64; 3], x: f64) -> f64 {
    let off = (first - x).max(x - last).max(0.0);
    (-0.5 * (off / fades).powi(2)).exp()
}

/// Quantiles, at [`SHARES`], of a density that is linear between points.
pub(crate) fn quantiles(points: &[f64; FINE], from: f64, step: f64) -> [f64; 5] {
    SHARES.map(|share| {
        let wanted = share * points.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum::<f64>();
        let mut below = 0.0;
        for (k, w) in points.windows(2).enumerate() {
            let (p, q) = (w[0], w[1]);
            let cell = 0.5 * (p + q);
            if below + cell >= wanted {
                let (rise, left) = (q - p, wanted - below);
                let (flat, end) = (rise.abs() < 1e-12 * (p + q), (p * p + 2.0 * rise * left).max(0.0).sqrt());
                let t = if flat { left / p } else { (end - p) / rise };
                return from + step * (k as f64 + t);
            }
            below += cell;
        }
        f64::NAN
    })
}
