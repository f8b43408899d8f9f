//! Posterior of a stroke around a mode, and quality of its fit.

use std::f64::consts::TAU;

use vibrissa_core::normal::quantile as quantile_of_bell;

use super::course::{Mode, POSTERIOR, Place, Task};
use super::{NEAR, lagrange};
use crate::invert::{FINE, quantile};

const SHARES: [f64; 5] = [0.025, 0.158_655, 0.5, 0.841_345, 0.975];
const NONE: f64 = 60.0;
const WINDOW: f64 = 5.0;
/// Fewest bins whose residuals determine their scatter.
const JUDGED: usize = 12;
const ROUNDS: usize = 10;
/// Standard deviations of χ² above which a curve does not fit.
const SMOOTH: f64 = 4.0;

impl Task<'_> {
    /// Mass about `mode` relative to exp(−`least`/2), quantiles of the distance, and touch with standard deviation.
    pub fn posterior(&self, mode: &Mode, least: f64) -> Option<(f64, [f64; 5], Place)> {
        let [sd, slope, alone] = mode.shape;
        let touches = if alone > 0.0 { POSTERIOR[1] } else { 1 };
        let mut reach = [WINDOW; 2];
        for _ in 0..ROUNDS {
            let lo = (mode.at[0] - reach[0] * sd).max(self.ends[0][0]);
            let hi = (mode.at[0] + reach[0] * sd).min(self.ends[0][1]);
            let step = (hi - lo) / (POSTERIOR[0] - 1) as f64;
            let part = 2.0 * reach[1] * alone / (touches.max(2) - 1) as f64;
            let off = |k: usize| part * (k as f64 - 0.5 * (touches - 1) as f64);
            let (mut along, mut beside, mut touch) = ([0.0; POSTERIOR[0]], [0.0; POSTERIOR[1]], [0.0; 3]);
            for (i, sum) in along.iter_mut().enumerate() {
                let moved = lo + step * i as f64 - mode.at[0];
                let across = self.across(mode.at[0] + moved);
                for (k, sum_beside) in beside[..touches].iter_mut().enumerate() {
                    let c = slope * moved + off(k);
                    let at = [mode.at[0] + moved, mode.at[1] + c];
                    let p = (-0.5 * (self.value_of(&across, at) - least)).exp();
                    *sum += p;
                    *sum_beside += p;
                    (0..3).for_each(|n| touch[n] += p * c.powi(n as i32));
                }
            }
            let mut change = [fits(&along), fits(&beside[..touches])];
            let last = POSTERIOR[0] - 1;
            let cut = |i: usize, at: f64, end: f64| along[i] == 0.0 || (at - end).abs() < 1e-12;
            if change[0] == Fits::TooNarrow && cut(0, lo, self.ends[0][0]) && cut(last, hi, self.ends[0][1]) {
                change[0] = Fits::Well;
            }
            if touches == 1 {
                change[1] = Fits::Well;
            }
            if change == [Fits::Well; 2] {
                let mass = along.iter().sum::<f64>() * step * if touches > 1 { part } else { 1.0 };
                let (density, step) = (finer(&along), (hi - lo) / (FINE - 1) as f64);
                let a = SHARES.map(|share| quantile(&density, lo, step, share).exp());
                let mean = touch[1] / touch[0];
                let sd = (touch[2] / touch[0] - mean * mean).max(0.0).sqrt();
                return a.iter().all(|a| a.is_finite()).then_some((mass, a, [mode.at[1] + mean, sd]));
            }
            for (reach, change) in reach.iter_mut().zip(change) {
                *reach *= match change {
                    Fits::Well => 1.0,
                    Fits::TooNarrow => 1.7,
                    Fits::TooWide => 0.4,
                }
            }
        }
        Some(self.bell(mode, least))
    }

    fn bell(&self, mode: &Mode, least: f64) -> (f64, [f64; 5], Place) {
        let [sd, slope, alone] = mode.shape;
        let [lo, hi] = self.ends[0];
        let a = SHARES.map(|share| (mode.at[0] + sd * quantile_of_bell(share)).clamp(lo, hi).exp());
        let mass = (-0.5 * (mode.value - least)).exp() * TAU.sqrt() * sd;
        let mass = if alone > 0.0 { mass * TAU.sqrt() * alone } else { mass };
        (mass, a, [mode.at[1], alone.hypot(slope * sd)])
    }

    /// Drive of the largest misfit of adjacent readings, its size in standard deviations, and the factor for the variances.
    pub fn misfit(&self, at: Place) -> Option<([f64; 2], f64)> {
        let off = self.at(&self.across(at[0]), at);
        let (_, solved) = self.solved(&off)?;
        let left = &off.left - off.shared.tr_mul(&solved);
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
        let freedom = self.freedom(&off)?.max(1.0);
        let excess = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0).sqrt();
        // Many residuals determine the scatter better than differences of neighbours.
        let judged = excess > SMOOTH || left.len() >= JUDGED;
        Some((most, if judged { chi2 / freedom } else { 1.0 }))
    }
}

fn finer(of: &[f64; POSTERIOR[0]]) -> [f64; FINE] {
    let top = of.iter().copied().fold(0.0, f64::max);
    let logs = of.map(|p| (p / top).ln().max(-NONE));
    std::array::from_fn(|i| {
        let s = (i * (POSTERIOR[0] - 1)) as f64 / (FINE - 1) as f64;
        let k = (s as usize + 1).saturating_sub(NEAR / 2).min(POSTERIOR[0] - NEAR);
        let ln: f64 = lagrange(s - k as f64).iter().zip(&logs[k..]).map(|(w, l)| w * l).sum();
        if ln <= -0.9 * NONE { 0.0 } else { ln.exp() }
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fits {
    Well,
    TooNarrow,
    TooWide,
}

fn fits(density: &[f64]) -> Fits {
    let top = density.iter().copied().fold(0.0, f64::max);
    let last = density.len() - 1;
    if density[0].max(density[last]) > 1e-3 * top {
        return Fits::TooNarrow;
    }
    let seen = density.iter().filter(|p| **p > 1e-3 * top).count();
    if 3 * seen < density.len() { Fits::TooWide } else { Fits::Well }
}
