//! From a signal to a distance: the posterior of the distance, flat within the calibrated range.

use crate::base::Base;
use crate::curve::Curve;

/// Points in ln a.
const POINTS: usize = 161;
/// Points in ln u, where there are several drives.
const DRIVES: usize = 14;
/// How far beyond the calibrated distances an answer is looked for, in ranges of ln a on either side.
const BEYOND: f64 = 0.35;
/// Standard deviation of the prior beyond them, in ranges; of a whisker that is known in ln a, where that is more.
const FADES: [f64; 2] = [0.15, 0.3];
/// Of a whisker that is known, how far beyond, in ln a.
const KNOWN: f64 = 1.2;
/// A signal that is no more than so many standard deviations off has an answer.
const FAR: f64 = 5.0;
/// A posterior of this standard deviation in ln a is wide.
const WIDE: f64 = 0.05;
/// Points of a posterior.
const FINE: usize = 49;

/// What moves the readings that are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct State {
    /// Whether their own zero was taken off.
    pub tared: bool,
    /// Whether they are of the run of the calibration.
    pub same_run: bool,
}

/// A distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The distance, mm: the root, moved by what is known beforehand; the median of the posterior where that is wide.
    pub a: f64,
    /// One standard deviation, mm; half of the 68 % interval where the posterior is wide.
    pub sigma: f64,
    /// d signal/da, 1/mm.
    pub slope: f64,
    /// Variance of the signal that is not of one reading: curve, position, run.
    pub variance: f64,
    /// The next distance with the same signal, mm.
    pub near: Option<f64>,
}

/// Why there is no distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nothing {
    /// Weaker than the furthest tap that is answered.
    Weak,
    /// Stronger than any tap.
    Strong,
}

/// Signals and their variances over ln a, at some drives.
#[derive(Debug, Clone)]
pub struct Inverse {
    /// First ln a and its step.
    grid: [f64; 2],
    /// Ends of the calibrated ln a, and how the prior fades beyond.
    ends: [f64; 3],
    /// What is added to the drive u.
    offset: f64,
    /// ln u of the nodes.
    nodes: Vec<f64>,
    /// Of each node the signal/u, and the variances/u² of noise and of the rest.
    table: Vec<Vec<[f64; 3]>>,
}

impl Inverse {
    /// Of `curve` over its base, for readings in `state`; distances are looked for within `reach`, mm.
    pub fn new(curve: &Curve, base: &Base<'_>, state: State, reach: [f64; 2]) -> Self {
        let [middle, half] = curve.scales.a;
        let ends = [middle - half, middle + half];
        let known = matches!(base, Base::Known(..));
        let beyond = (BEYOND * 2.0 * half).max(if known { KNOWN } else { 0.0 });
        let from = (ends[0] - beyond).max(reach[0].max(1e-9).ln()).min(ends[0]);
        let to = (ends[1] + beyond).min(reach[1].ln()).max(ends[1]);
        let fades = (FADES[0] * 2.0 * half).max(if known { FADES[1] } else { 0.0 });
        let ends = [ends[0], ends[1], fades];
        let step = (to - from) / (POINTS - 1) as f64;
        let [u, width] = curve.scales.u;
        let nodes: Vec<f64> = match width > 0.0 {
            true => (0..DRIVES)
                .map(|k| u + 1.02 * width * (std::f64::consts::PI * (k as f64 + 0.5) / DRIVES as f64).cos())
                .collect(),
            false => vec![u],
        };
        let offset = curve.scales.offset;
        let one = |u: f64, k: usize| {
            let e = curve.expected(base, (from + step * k as f64).exp(), u - offset, state.tared);
            let run = if state.same_run { 0.0 } else { e.of_run };
            let zero =
                if state.tared || state.same_run { 0.0 } else { curve.spread.zero * curve.unit.powi(2) };
            [e.signal / u, e.of_noise / (u * u), (e.of_curve + e.of_position + run + zero) / (u * u)]
        };
        let table = nodes.iter().map(|u| (0..POINTS).map(|k| one(u.exp(), k)).collect()).collect();
        Self { grid: [from, step], ends, offset, nodes, table }
    }

    /// Distances that may be answered, mm.
    pub fn reach(&self) -> [f64; 2] {
        [self.grid[0].exp(), (self.grid[0] + self.grid[1] * (POINTS - 1) as f64).exp()]
    }

    /// Weights of the nodes for the drive u (barycentric, Chebyshev's nodes of the first kind).
    fn weights(&self, u: f64) -> Vec<f64> {
        let x = u.ln();
        if let Some(k) = self.nodes.iter().position(|n| *n == x) {
            return (0..self.nodes.len()).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        }
        let n = self.nodes.len() as f64;
        let term = |(k, node): (usize, &f64)| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            sign * (std::f64::consts::PI * (k as f64 + 0.5) / n).sin() / (x - node)
        };
        let terms: Vec<f64> = self.nodes.iter().enumerate().map(term).collect();
        let sum: f64 = terms.iter().sum();
        terms.iter().map(|t| t / sum).collect()
    }

    /// Signal, variance of one reading and of the rest at every point, for the drive u.
    pub fn at(&self, u: f64) -> Slice {
        let u = u + self.offset;
        let weights = self.weights(u);
        let mut points = vec![[0.0; 3]; POINTS];
        for (w, row) in weights.iter().zip(&self.table) {
            for (p, x) in points.iter_mut().zip(row) {
                (0..3).for_each(|i| p[i] += w * x[i]);
            }
        }
        for p in &mut points {
            p[0] *= u;
            p[1] = (p[1] * u * u).max(0.0);
            p[2] = (p[2] * u * u).max(0.0);
        }
        let peak = (0..POINTS).max_by(|i, k| points[*i][0].total_cmp(&points[*k][0])).unwrap_or(0);
        Slice { grid: self.grid, ends: self.ends, points, peak }
    }
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
    /// Signal and variances at ln a = x, by cubics through four points.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let s = ((x - self.grid[0]) / self.grid[1]).clamp(0.0, (POINTS - 1) as f64);
        let k = (s as usize).clamp(1, POINTS - 3) - 1;
        let t = s - k as f64;
        let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
        let w = [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0];
        std::array::from_fn(|i| (0..4).map(|j| w[j] * self.points[k + j][i]).sum())
    }

    fn x(&self, k: usize) -> f64 {
        self.grid[0] + self.grid[1] * k as f64
    }

    /// The ln a between the points k and k + 1 at which the signal is `y`.
    fn root(&self, y: f64, k: usize) -> f64 {
        let (mut lo, mut hi) = (self.x(k), self.x(k + 1));
        let (mut f_lo, mut f_hi) = (self.points[k][0] - y, self.points[k + 1][0] - y);
        let mut side = 0;
        // Regula falsi, Illinois.
        for _ in 0..60 {
            let x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo);
            let f = self.at(x)[0] - y;
            if f == 0.0 || (hi - lo).abs() < 1e-15 {
                return x;
            }
            if (f > 0.0) == (f_hi > 0.0) {
                (hi, f_hi) = (x, f);
                if side == 1 {
                    f_lo *= 0.5;
                }
                side = 1;
            } else {
                (lo, f_lo) = (x, f);
                if side == -1 {
                    f_hi *= 0.5;
                }
                side = -1;
            }
            if f.abs() <= 1e-15 * y.abs() {
                return x;
            }
        }
        0.5 * (lo + hi)
    }

    fn slope(&self, x: f64) -> f64 {
        let h = 1e-3 * self.grid[1];
        let (lo, hi) = ((x - h).max(self.grid[0]), (x + h).min(self.x(POINTS - 1)));
        (self.at(hi)[0] - self.at(lo)[0]) / (hi - lo)
    }

    /// Density of the prior at ln a = x to that within the calibrated distances.
    fn prior(&self, x: f64) -> f64 {
        let off = (self.ends[0] - x).max(x - self.ends[1]).max(0.0);
        (-0.5 * (off / self.ends[2]).powi(2)).exp()
    }

    /// The distance of a signal `y`, whose own zero brings `share` of the variance of one reading, and `more` beside.
    ///
    /// # Errors
    /// A signal of no tap.
    pub fn find(&self, y: f64, share: f64, more: f64) -> Result<Answer, Nothing> {
        let spread = |p: &[f64; 3]| (p[1] * (1.0 + share) + p[2] + more).sqrt();
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
        let step = (window[1] - window[0]) / (FINE - 1) as f64;
        let place = |k: usize| window[0] + step * k as f64;
        let likely = |k: usize| {
            let p = self.at(place(k));
            let sd = spread(&p);
            let t = (p[0] - y) / sd;
            // Flat in mm.
            (t, (-0.5 * t * t).exp() / sd * place(k).exp())
        };
        let flat: Vec<(f64, f64)> = (0..FINE).map(likely).collect();
        if far.is_none() && flat.iter().all(|p| p.0.abs() > FAR) {
            return Err(if self.points[last][0] > y { Nothing::Weak } else { Nothing::Strong });
        }
        let [first, end, _] = self.ends;
        let [x, sigma] = match local {
            // Within the calibrated distances the prior says nothing: there it is the root.
            Some((x, sd)) if sd < WIDE && window[0] >= first && window[1] <= end => [x, x.exp() * sd],
            _ => {
                let points: Vec<(f64, f64)> =
                    flat.iter().enumerate().map(|(k, p)| (p.0, p.1 * self.prior(place(k)))).collect();
                let of = |points: &[(f64, f64)]| {
                    [0.158_655, 0.5, 0.841_345].map(|s| quantile(points, window[0], step, s))
                };
                let ([lo, middle, hi], [p, q, r]) = (of(&points), of(&flat));
                match local {
                    // Moved, and made narrower, by what the prior does.
                    Some((x, sd)) if sd < WIDE && (hi - lo) > 0.0 => {
                        let x = x + middle - q;
                        [x, x.exp() * sd * (hi - lo) / (r - p)]
                    }
                    _ => [middle, 0.5 * (hi.exp() - lo.exp())],
                }
            }
        };
        let p = self.at(x);
        let a = x.exp();
        let found = Answer { a, sigma, slope: self.slope(x) / a, variance: p[2] + more, near };
        if found.a.is_finite() && found.sigma.is_finite() { Ok(found) } else { Err(Nothing::Weak) }
    }
}

/// The point below which a share of the mass lies; densities are taken as parabolas in their logarithm between points.
fn quantile(points: &[(f64, f64)], from: f64, step: f64, share: f64) -> f64 {
    let cells: Vec<f64> = points.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1)).collect();
    let total: f64 = cells.iter().sum();
    let mut below = 0.0;
    for (k, cell) in cells.iter().enumerate() {
        if below + cell >= share * total {
            // Within a cell the density goes straight.
            let (p, q, wanted) = (points[k].1, points[k + 1].1, share * total - below);
            let rise = q - p;
            let t = if rise.abs() < 1e-12 * (p + q) {
                wanted / p
            } else {
                ((p * p + 2.0 * rise * wanted).max(0.0).sqrt() - p) / rise
            };
            return from + step * (k as f64 + t);
        }
        below += cell;
    }
    f64::NAN
}
