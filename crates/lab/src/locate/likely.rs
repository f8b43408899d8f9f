//! The most likely distance of a tap, or distance and drive, given the readings of several channels (model §7).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::locator::Locator;
use crate::estimator::least::Minimum;

/// Distances and drives from which the most likely ones are looked for.
pub(crate) const STARTS: [usize; 2] = [24, 12];
/// Distances are looked for beyond the calibrated ones by this share of their range.
pub(crate) const BEYOND: f64 = 0.1;
/// A small change of an unknown, relative to the end of its range.
const STEP: f64 = 1e-5;
/// Steps of a search at most.
const STEPS: usize = 100;
/// Relative change at which a search ends.
const SETTLED: f64 = 1e-12;
/// Added to variances, relative: noise-free data leave a covariance of rounding errors.
pub(crate) const RIDGE: f64 = 1e-9;

/// What a channel shows.
pub(crate) trait Response {
    /// Its calibration: sides, limits, words.
    fn of(&self) -> &Locator;

    /// Signal that is expected of a tap at `a` by the drive `u`, on the side of `sign`.
    fn expected(&self, a: f64, u: f64, sign: f64) -> f64 {
        self.of().expected(a, u, sign)
    }

    /// Variance of what is expected there, beyond noise.
    fn left(&self, a: f64, u: f64, sign: f64) -> f64 {
        let left = self.of().left(a, u, sign);
        if left > 0.0 { left } else { 0.0 }
    }
}

impl Response for Locator {
    fn of(&self) -> &Locator {
        self
    }
}

/// One tap.
pub(super) struct ChannelTap<'a> {
    /// Of each channel what answers it and its signal.
    readings: Vec<(&'a dyn Response, f64)>,
    /// NaN where it is not known.
    drive: f64,
    noise: Cholesky<f64, Dyn>,
    /// Of distance and drive.
    bounds: [[f64; 2]; 2],
}

impl<'a> ChannelTap<'a> {
    /// `None` where a channel is not calibrated on the side of its signal, or the drive is none of the calibrated ones.
    pub fn new(readings: Vec<(&'a dyn Response, f64)>, drive: f64, noise: &DMatrix<f64>) -> Option<Self> {
        let mut bounds = [[0.0, f64::INFINITY]; 2];
        for (channel, signal) in &readings {
            let locator = channel.of();
            let side = locator.sides().iter().find(|s| s.sign == signal.signum())?;
            let [first, last] = side.distances;
            let slack = BEYOND * (last - first);
            let drives =
                [side.drives[0], side.drives[side.drives.len() - 1]].map(|u| u + locator.drive_origin);
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
        let one = |(channel, signal): &(&dyn Response, f64)| channel.expected(a, u, signal.signum()) - signal;
        let r = DVector::from_iterator(self.readings.len(), self.readings.iter().map(one));
        let white = self.noise.l_dirty().solve_lower_triangular(&r)?;
        white.iter().all(|x| x.is_finite()).then(|| white.as_slice().to_vec())
    }

    fn misfit(&self, x: &[f64]) -> f64 {
        self.white(x).map_or(f64::INFINITY, |r| r.iter().map(|r| r * r).sum())
    }

    /// The minima of the misfit that are reached from `starts` and lie inside the range that is looked at, the least first.
    pub fn refined(&self, starts: &[Vec<f64>]) -> Vec<Minimum> {
        let [lo, hi] = self.bounds[0];
        let mut found: Vec<Minimum> = starts
            .iter()
            .filter_map(|x| self.settled(x.clone()))
            .filter(|m| m.at[0] > lo && m.at[0] < hi)
            .collect();
        found.sort_by(|p, q| p.chi2().total_cmp(&q.chi2()));
        found
    }

    /// Whether the drive of `x` is looked for, and lies at an end of the calibrated ones.
    pub fn at_end(&self, x: &[f64]) -> bool {
        let [lo, hi] = self.bounds[1];
        x.get(1).is_some_and(|u| *u <= lo || *u >= hi)
    }

    /// White residuals at `x` and their derivatives by central differences, of one side at an end.
    fn slopes(&self, x: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let r = DVector::from_vec(self.white(x)?);
        let mut columns = Vec::with_capacity(x.len());
        for (i, [lo, hi]) in self.bounds[..x.len()].iter().enumerate() {
            let ends = [x[i] - STEP * hi, x[i] + STEP * hi].map(|end| end.clamp(*lo, *hi));
            let at = |end: f64| {
                let mut moved = x.to_vec();
                moved[i] = end;
                self.white(&moved).map(DVector::from_vec)
            };
            columns.push((at(ends[1])? - at(ends[0])?) / (ends[1] - ends[0]));
        }
        Some((r, DMatrix::from_columns(&columns)))
    }

    /// The least misfit that is reached from `x` (Levenberg, Marquardt): a drive that is pushed beyond an end stays there.
    fn settled(&self, mut x: Vec<f64>) -> Option<Minimum> {
        let (mut r, mut j) = self.slopes(&x)?;
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let (gradient, normal) = (j.tr_mul(&r), j.tr_mul(&j));
            let pushed = |i: usize| {
                let [lo, hi] = self.bounds[i];
                (x[i] <= lo && gradient[i] > 0.0) || (x[i] >= hi && gradient[i] < 0.0)
            };
            let free: Vec<usize> = (0..x.len()).filter(|i| !pushed(*i)).collect();
            if free.is_empty() {
                break;
            }
            let damped = DMatrix::from_fn(free.len(), free.len(), |p, q| {
                normal[(free[p], free[q])] * if p == q { 1.0 + damping } else { 1.0 }
            });
            let right = DVector::from_iterator(free.len(), free.iter().map(|i| gradient[*i]));
            let step = damped.lu().solve(&right).filter(|s| s.iter().all(|s| s.is_finite()))?;
            let mut next = x.clone();
            for (i, s) in free.iter().zip(step.iter()) {
                next[*i] = (x[*i] - s).clamp(self.bounds[*i][0], self.bounds[*i][1]);
            }
            if next.iter().zip(&x).all(|(new, old)| (new - old).abs() <= SETTLED * old.abs()) {
                break;
            }
            let better = self.slopes(&next).filter(|(new, _)| new.norm_squared() <= r.norm_squared());
            if let Some((new, slopes)) = better {
                (x, r, j) = (next, new, slopes);
                damping *= 0.1;
            } else {
                damping *= 10.0;
                if damping > 1e12 {
                    break;
                }
            }
        }
        let covariance = j.tr_mul(&j).try_inverse()?;
        Some(Minimum { residuals: r.as_slice().to_vec(), covariance, at: x })
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
