//! The most likely distance of a tap, or distance and drive, given the readings of several channels (model §7).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::locator::Locator;
use crate::estimator::least::{Minimum, by_values};

/// Distances and drives from which the most likely ones are looked for.
const STARTS: [usize; 2] = [24, 12];
/// Distances are looked for beyond the calibrated ones by this share of their range.
const BEYOND: f64 = 0.1;
/// A small change of an unknown, relative to the end of its range.
const STEP: f64 = 1e-5;
/// Relative gain of χ² at which a search ends.
const SETTLED: f64 = 1e-12;
/// Added to variances, relative: noise-free data leave a covariance of rounding errors.
const RIDGE: f64 = 1e-9;

/// One tap.
pub(super) struct ChannelTap<'a> {
    /// Of each channel what answers it and its signal.
    readings: Vec<(&'a Locator, f64)>,
    /// NaN where it is not known.
    drive: f64,
    noise: Cholesky<f64, Dyn>,
    /// Of distance and drive.
    bounds: [[f64; 2]; 2],
}

impl<'a> ChannelTap<'a> {
    /// `None` where a channel is not calibrated on the side of its signal, or the drive is none of the calibrated ones.
    pub fn new(readings: Vec<(&'a Locator, f64)>, drive: f64, noise: &DMatrix<f64>) -> Option<Self> {
        let mut bounds = [[0.0, f64::INFINITY]; 2];
        for (locator, signal) in &readings {
            let side = locator.side_of(signal.signum())?;
            let [first, last] = side.distances;
            let slack = BEYOND * (last - first);
            let drives = side.ends().map(|u| u + locator.drive_origin);
            for (bound, [lo, hi]) in bounds.iter_mut().zip([[first - slack, last + slack], drives]) {
                *bound = [bound[0].max(lo), bound[1].min(hi)];
            }
            if drive.is_finite() && !side.admits(locator.beyond_origin(drive)) {
                return None;
            }
        }
        let shared = bounds[0][0] < bounds[0][1] && bounds[1][0] <= bounds[1][1];
        shared.then_some(Self { readings, drive, noise: factor(noise)?, bounds })
    }

    /// The same with another covariance of noise; `None` where it is none.
    pub fn with_noise(self, noise: &DMatrix<f64>) -> Option<Self> {
        Some(Self { noise: factor(noise)?, ..self })
    }

    fn unknowns(&self) -> usize {
        if self.drive.is_finite() { 1 } else { 2 }
    }

    /// Distance and drive of unknowns.
    pub fn place(&self, x: &[f64]) -> [f64; 2] {
        [x[0], x.get(1).copied().unwrap_or(self.drive)]
    }

    /// Residuals, white.
    fn white(&self, x: &[f64]) -> Option<Vec<f64>> {
        let [a, u] = self.place(x);
        let one = |(channel, signal): &(&Locator, f64)| channel.expected(a, u, signal.signum()) - signal;
        let r = DVector::from_iterator(self.readings.len(), self.readings.iter().map(one));
        let white = self.noise.l_dirty().solve_lower_triangular(&r)?;
        white.iter().all(|x| x.is_finite()).then(|| white.as_slice().to_vec())
    }

    fn misfit(&self, x: &[f64]) -> f64 {
        self.white(x).map_or(f64::INFINITY, |r| r.iter().map(|r| r * r).sum())
    }

    /// The minima of the misfit that are reached from `starts` and lie inside the range that is looked at, the least first.
    pub fn refined(&self, starts: &[Vec<f64>]) -> Vec<Minimum> {
        let (n, [lo, hi]) = (self.unknowns(), self.bounds[0]);
        let steps = self.bounds.map(|[_, end]| STEP * end);
        let least = |x: &Vec<f64>| by_values(&|x| self.white(x), x, &steps[..n], &self.bounds[..n], SETTLED);
        let found = starts.iter().filter_map(least).filter(|m| m.at[0] > lo && m.at[0] < hi);
        let mut found: Vec<Minimum> = found.collect();
        found.sort_by(|p, q| p.chi2().total_cmp(&q.chi2()));
        found
    }

    /// Whether the drive of `x` is looked for, and lies at an end of the calibrated ones.
    pub fn at_end(&self, x: &[f64]) -> bool {
        let [lo, hi] = self.bounds[1];
        x.get(1).is_some_and(|u| *u <= lo || *u >= hi)
    }

    /// Places from which every minimum is reached: those of a grid that fit better than their neighbours.
    pub fn starts(&self) -> Vec<Vec<f64>> {
        let grid = |i: usize| {
            let [lo, hi] = self.bounds[i];
            (0..STARTS[i]).map(move |k| lo + (hi - lo) * (k as f64 + 0.5) / STARTS[i] as f64)
        };
        // Of each distance the best drive.
        let start = |a: f64| match self.unknowns() {
            1 => vec![a],
            _ => {
                let pairs = grid(1).map(|u| vec![a, u]);
                pairs.min_by(|p, q| self.misfit(p).total_cmp(&self.misfit(q))).expect("there are drives")
            }
        };
        let all: Vec<(f64, Vec<f64>)> = grid(0).map(start).map(|x| (self.misfit(&x), x)).collect();
        let least = |k: usize| {
            let beside = |m: Option<usize>| m.and_then(|m| all.get(m)).is_none_or(|v| v.0 >= all[k].0);
            all[k].0.is_finite() && beside(k.checked_sub(1)) && beside(Some(k + 1))
        };
        (0..all.len()).filter(|k| least(*k)).map(|k| all[k].1.clone()).collect()
    }
}

/// The factor of a covariance, whose entries may be of very different sizes.
fn factor(noise: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let ridge = DMatrix::from_diagonal(&(noise.diagonal() * RIDGE));
    Cholesky::new(noise + ridge)
}
