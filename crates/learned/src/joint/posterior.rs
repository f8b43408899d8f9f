//! Modes of a stroke's posterior, the posterior around a mode, and quality of its fit.

use std::f64::consts::TAU;

use vibrissa_core::normal::quantile as quantile_of_bell;

use super::NEAR;
use super::course::{COARSE, Mode, POSTERIOR, Place, Task};
use crate::invert::{FINE, SHARES, lagrange, quantiles};

const NONE: f64 = 60.0;
const WINDOW: f64 = 5.0;
/// Fewest bins whose residuals determine their scatter.
const JUDGED: usize = 12;
const ROUNDS: usize = 10;
/// Standard deviations of χ² above which a curve does not fit.
const SMOOTH: f64 = 4.0;
const VALLEYS: usize = 3;

impl Task<'_> {
    /// Mass about `mode` relative to exp(−`least`/2), quantiles of the distance, and touch with standard deviation.
    pub fn posterior(&self, mode: &Mode, least: f64) -> Option<(f64, [f64; 5], Place)> {
        let [sd, slope, alone] = mode.shape;
        let mut reach = [WINDOW; 2];
        for _ in 0..ROUNDS {
            let lo = (mode.at[0] - reach[0] * sd).max(self.ends[0][0]);
            let hi = (mode.at[0] + reach[0] * sd).min(self.ends[0][1]);
            let step = (hi - lo) / (POSTERIOR[0] - 1) as f64;
            let part = 2.0 * reach[1] * alone / (POSTERIOR[1] - 1) as f64;
            let off = |k: usize| part * (k as f64 - 0.5 * (POSTERIOR[1] - 1) as f64);
            let (mut along, mut beside, mut touch) = ([0.0; POSTERIOR[0]], [0.0; POSTERIOR[1]], [0.0; 3]);
            for (i, sum) in along.iter_mut().enumerate() {
                let moved = lo + step * i as f64 - mode.at[0];
                let across = self.across(mode.at[0] + moved);
                for (k, sum_beside) in beside.iter_mut().enumerate() {
                    let c = slope * moved + off(k);
                    let at = [mode.at[0] + moved, mode.at[1] + c];
                    let p = (-0.5 * (self.value_of(&across, at) - least)).exp();
                    *sum += p;
                    *sum_beside += p;
                    (0..3).for_each(|n| touch[n] += p * c.powi(n as i32));
                }
            }
            let last = POSTERIOR[0] - 1;
            let cut = |i: usize, at: f64, end: f64| along[i] == 0.0 || (at - end).abs() < 1e-12;
            let whole = cut(0, lo, self.ends[0][0]) && cut(last, hi, self.ends[0][1]);
            let mut change = [wider(&along), wider(&beside)];
            if whole && change[0] > 1.0 {
                change[0] = 1.0;
            }
            if change == [1.0; 2] {
                let mass = along.iter().sum::<f64>() * step * part;
                let (density, step) = (finer(&along), (hi - lo) / (FINE - 1) as f64);
                let a = quantiles(&density, lo, step).map(f64::exp);
                let mean = touch[1] / touch[0];
                let sd = (touch[2] / touch[0] - mean * mean).max(0.0).sqrt();
                return a.iter().all(|a| a.is_finite()).then_some((mass, a, [mode.at[1] + mean, sd]));
            }
            (0..2).for_each(|k| reach[k] *= change[k]);
        }
        // As of a normal distribution.
        let [lo, hi] = self.ends[0];
        let a = SHARES.map(|share| (mode.at[0] + sd * quantile_of_bell(share)).clamp(lo, hi).exp());
        let mass = (-0.5 * (mode.value - least)).exp() * TAU * sd * alone;
        Some((mass, a, [mode.at[1], alone.hypot(slope * sd)]))
    }

    /// Drive of the largest misfit of adjacent readings, its size in standard deviations, and the factor for the variances.
    pub fn misfit(&self, at: Place) -> Option<([f64; 2], f64)> {
        let off = self.at(&self.across(at[0]), at);
        let (factor, b) = self.factor(&off)?;
        let left = &off.left - off.shared.tr_mul(&factor.solve(&b));
        let left: Vec<[f64; 2]> = left.iter().zip(&off.spread).map(|(r, s)| [r * s, s * s]).collect();
        let mut most = [f64::NAN, 0.0];
        for size in [1, 2, 4, 8] {
            for (k, run) in left.windows(size).enumerate() {
                let (sum, weight) = run.iter().fold((0.0, 0.0), |(s, w), [r, d]| (s + r / d, w + 1.0 / d));
                let z: f64 = sum / f64::sqrt(weight);
                if z.abs() > f64::abs(most[1]) {
                    most = [self.bins[k + size / 2].u, z];
                }
            }
        }
        let chi2: f64 = left.iter().map(|[r, d]| r * r / d).sum();
        // Degrees of freedom for the noise: trace of (1 + sᵀ s)⁻¹, less 2 for distance and touch.
        let told = self.shared() as f64 - factor.inverse().trace();
        let freedom = (left.len() as f64 - told - 2.0).max(1.0);
        let excess = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0).sqrt();
        // Many residuals determine the scatter better than differences of neighbours.
        let judged = excess > SMOOTH || left.len() >= JUDGED;
        Some((most, if judged { chi2 / freedom } else { 1.0 }))
    }

    pub fn starts(&self) -> Vec<Place> {
        let grid = |k: usize, n: usize, i: usize| {
            let [lo, hi] = self.ends[k];
            lo + (hi - lo) * i as f64 / (n - 1) as f64
        };
        let of = |i: usize| {
            let x = grid(0, COARSE[1], i);
            let across = self.across(x);
            let value = |c: f64| self.value_of(&across, [x, c]);
            let values: Vec<f64> = (0..COARSE[2]).map(|k| value(grid(1, COARSE[2], k))).collect();
            // A valley may lie between two readings: refine around each of the lowest.
            let narrowed = |k: usize| {
                let (mut at, mut least) = (grid(1, COARSE[2], k), values[k]);
                let mut step = 0.5 * (self.ends[1][1] - self.ends[1][0]) / COARSE[2] as f64;
                for _ in 0..9 {
                    for c in [at - step, at + step] {
                        let there = value(c);
                        if there < least {
                            (at, least) = (c, there);
                        }
                    }
                    step *= 0.5;
                }
                (at, least)
            };
            let all = valleys(&values).into_iter().take(VALLEYS).map(narrowed);
            let (at, least) =
                all.min_by(|p, q| p.1.total_cmp(&q.1)).unwrap_or((self.ends[1][0], f64::INFINITY));
            ([x, at], least)
        };
        let all: Vec<(Place, f64)> = (0..COARSE[1]).map(of).collect();
        let least: Vec<f64> = all.iter().map(|place| place.1).collect();
        let found = valleys(&least).into_iter().filter(|i| least[*i].is_finite());
        found.take(3).map(|i| all[i].0).collect()
    }

    /// Mode reached from `start`; `near` is the size of the first simplex, as a share of the ranges.
    pub fn mode(&self, start: Place, near: f64) -> Option<Mode> {
        let scale = [0, 1].map(|k| self.ends[k][1] - self.ends[k][0]);
        let size = scale.map(|s| near * s);
        let (mut at, mut value) = (start, self.value(start));
        // Nelder-Mead, restarted while it gains: a simplex may collapse in a narrow valley.
        let mut idle = 0;
        for share in [1.0, 0.2, 1.0, 0.04, 0.2, 1.0, 0.04, 0.2] {
            let before = value;
            (at, value) = simplex(&|p| self.value(p), at, size.map(|s| share * s));
            idle = if before - value < 1e-2 { idle + 1 } else { 0 };
            if idle == 2 {
                break;
            }
        }
        if !value.is_finite() {
            return None;
        }
        let step = |k: usize| {
            let mut h = 1e-3 * scale[k];
            for _ in 0..40 {
                let sides = [-h, h].map(|h| {
                    let mut p = at;
                    p[k] += h;
                    self.value(p) - value
                });
                let known: Vec<f64> = sides.into_iter().filter(|rise| rise.is_finite()).collect();
                let rise = known.iter().sum::<f64>() / known.len() as f64;
                if !rise.is_finite() || rise > 3.0 {
                    h *= 0.5;
                } else if rise < 0.3 && h < 0.2 * scale[k] {
                    h *= 1.9;
                } else {
                    break;
                }
            }
            h
        };
        let h = [step(0), step(1)];
        let moved = |i: f64, k: f64| {
            let p = [at[0] + i * h[0], at[1] + k * h[1]];
            self.value(p).min(value + 50.0)
        };
        let second = |i: f64, k: f64| 0.5 * (moved(i, k) + moved(-i, -k) - 2.0 * value).max(1e-6);
        let [xx, cc] = [second(1.0, 0.0), second(0.0, 1.0)];
        let xc = 0.25 * (second(1.0, 1.0) - second(1.0, -1.0));
        // −2 ln p ≈ xx p² + 2 xc p q + cc q², p and q in steps.
        let xc = xc.clamp(-0.999_999 * (xx * cc).sqrt(), 0.999_999 * (xx * cc).sqrt());
        let alone = (xx - xc * xc / cc).max(1e-9);
        Some(Mode { at, value, shape: [h[0] / alone.sqrt(), -xc / cc * h[1] / h[0], h[1] / cc.sqrt()] })
    }
}

fn finer(of: &[f64; POSTERIOR[0]]) -> [f64; FINE] {
    let top = of.iter().copied().fold(0.0, f64::max);
    let logs = of.map(|p| (p / top).ln().max(-NONE));
    std::array::from_fn(|i| {
        let s = (i * (POSTERIOR[0] - 1)) as f64 / (FINE - 1) as f64;
        let k = (s as usize + 1).saturating_sub(NEAR / 2).min(POSTERIOR[0] - NEAR);
        let ln: f64 = lagrange::<NEAR>(s - k as f64).iter().zip(&logs[k..]).map(|(w, l)| w * l).sum();
        if ln <= -0.9 * NONE { 0.0 } else { ln.exp() }
    })
}

/// Factor for a reach: above 1 where the `density` is cut at an end, below 1 where few of its points count.
fn wider(density: &[f64]) -> f64 {
    let top = density.iter().copied().fold(0.0, f64::max);
    let counts = |p: &f64| *p > 1e-3 * top;
    if counts(&density[0]) || counts(&density[density.len() - 1]) {
        return 1.7;
    }
    if 3 * density.iter().filter(|p| counts(p)).count() < density.len() { 0.4 } else { 1.0 }
}

fn valleys(values: &[f64]) -> Vec<usize> {
    let beside = |k: Option<usize>, own: f64| k.and_then(|k| values.get(k)).is_none_or(|v| *v >= own);
    let is_low = |k: &usize| beside(k.checked_sub(1), values[*k]) && beside(Some(k + 1), values[*k]);
    let mut low: Vec<usize> = (0..values.len()).filter(is_low).collect();
    low.sort_by(|i, k| values[*i].total_cmp(&values[*k]));
    low
}

/// Steps of a simplex.
const MOVES: usize = 80;

/// Minimum of a function of two numbers, and its value, by the simplex of Nelder and Mead from `start`; it ends where the values differ by less than 1e-3.
/// Values may be infinite.
pub fn simplex(value: &dyn Fn(Place) -> f64, start: Place, size: Place) -> (Place, f64) {
    let corner = |k: usize| {
        let mut p = start;
        if k > 0 {
            p[k - 1] += size[k - 1];
        }
        let here = value(p);
        if k == 0 || here.is_finite() {
            return (p, here);
        }
        p[k - 1] -= 2.0 * size[k - 1];
        (p, value(p))
    };
    let mut all = [0, 1, 2].map(corner);
    let between = |p: Place, q: Place, t: f64| [0, 1].map(|k| p[k] + t * (q[k] - p[k]));
    for _ in 0..MOVES {
        all.sort_by(|p, q| p.1.total_cmp(&q.1));
        let [best, next, worst] = all;
        if worst.1 - best.1 < 1e-3 {
            break;
        }
        let middle = between(best.0, next.0, 0.5);
        let tried = |t: f64| {
            let p = between(worst.0, middle, t);
            (p, value(p))
        };
        let mirrored = tried(2.0);
        let better = if mirrored.1 < best.1 {
            let further = tried(3.0);
            Some(if further.1 < mirrored.1 { further } else { mirrored })
        } else if mirrored.1 < next.1 {
            Some(mirrored)
        } else {
            let inner = tried(if mirrored.1 < worst.1 { 1.5 } else { 0.5 });
            Some(inner).filter(|inner| inner.1 < worst.1.min(mirrored.1))
        };
        match better {
            Some(better) => all[2] = better,
            None => all[1..].iter_mut().for_each(|(p, of)| {
                *p = between(best.0, *p, 0.5);
                *of = value(*p);
            }),
        }
    }
    all.sort_by(|p, q| p.1.total_cmp(&q.1));
    all[0]
}
