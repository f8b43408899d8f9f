//! Readings of several channels of one sensor: the most likely distance given all of them (model §7).
//!
//! Every channel has its own calibration, which gives the expected signal of a tap. What these leave has one covariance of noise. Where the drive is
//! not known it is found with the distance: two channels tell both.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{Calibration, Located, Locator};
use crate::estimator::least::{Minimum, by_values};
use crate::scene::{Signal, channels::numbered};
use crate::{error::Error, estimator::Opener, measure::names::Channel, status::Status};

/// Squared misfit of one degree of freedom, in units of noise, above which channels contradict each other.
const CONTRADICTORY: f64 = 36.0;
/// Excess of the squared misfit, in units of noise, below which another distance fits as well.
const ALIKE: f64 = 1.0;
/// And below which both fit equally: with as many unknowns as channels, several distances may fit exactly.
const EQUAL: f64 = 1e-3;

/// Distances and drives from which the most likely ones are looked for.
const STARTS: [usize; 2] = [24, 12];
/// Distances are looked for beyond the calibrated ones by this share of their range.
const BEYOND: f64 = 0.1;
/// A small change of an unknown, relative to the end of its range.
const STEP: f64 = 1e-5;
const SETTLED: f64 = 1e-12;
/// Added to variances, relative: noise-free data leave a covariance of rounding errors.
const RIDGE: f64 = 1e-9;

#[derive(Debug, Clone)]
pub struct Sensor {
    /// Of each the name of its column and its calibration.
    pub channels: Vec<(String, Calibration)>,
    /// Covariance of the noise of one reading, in the units of the channels' calibrations.
    pub covariance: Vec<Vec<f64>>,
}

pub struct Several {
    pub locators: Vec<Locator>,
    pub names: Vec<String>,
    pub(super) columns: Vec<Channel>,
    pub(crate) covariance: DMatrix<f64>,
}

impl Several {
    /// Of a calibration in the file `label`; `open` solves models.
    pub fn new(sensor: &Sensor, label: &str, open: Opener<'_>) -> Result<Self, Error> {
        let locator = |(_, c): &(String, Calibration)| Locator::new(c, label, None, open);
        let n = sensor.channels.len();
        let locators: Vec<Locator> = sensor.channels.iter().map(locator).collect::<Result<_, _>>()?;
        let column = |((name, _), locator): (&(String, Calibration), &Locator)| match numbered(name) {
            Some(name) => Channel::Named(name),
            None => Channel::Of(locator.unit.signal().unwrap_or(Signal::Strain)),
        };
        Ok(Self {
            columns: sensor.channels.iter().zip(&locators).map(column).collect(),
            names: sensor.channels.iter().map(|(name, _)| name.clone()).collect(),
            covariance: DMatrix::from_fn(n, n, |i, j| sensor.covariance[i][j]),
            locators,
        })
    }

    /// Distance of a tap by `drive` (NaN: unknown) with these tared signals (NaN: missing), or why there is none; `shares`: variance of each zero over
    /// that of one reading.
    pub fn locate(&self, drive: f64, signals: &[f64], shares: &[f64]) -> Result<Located, Status> {
        let used: Vec<usize> =
            (0..signals.len()).filter(|k| signals[*k].is_finite() && signals[*k] != 0.0).collect();
        let unknowns = if drive.is_finite() { 1 } else { 2 };
        // Infinite: no number. NaN: missing.
        if drive.is_infinite() || signals.iter().any(|x| x.is_infinite()) {
            return Err(Status::BAD_INPUT);
        }
        if used.len() < unknowns {
            let none = signals.iter().all(|x| *x == 0.0);
            return Err(if none { Status::NO_STRAIN } else { Status::BAD_INPUT });
        }
        let mut status = Status::OK;
        let mut noise = self.covariance.select_rows(&used).select_columns(&used);
        for (i, k) in used.iter().enumerate() {
            noise[(i, i)] *= 1.0 + shares[*k];
            status |= self.locators[*k].limit_of(signals[*k]);
        }
        // One tap bends all channels to one side.
        let side = |k: usize| self.locators[k].side_of(signals[k].signum());
        let gauges =
            used.iter().filter(|k| self.locators[**k].rig.known).filter_map(|k| Some(side(*k)?.gauge));
        if gauges.clone().zip(gauges.skip(1)).any(|(one, next)| one != next) {
            return Err(status | Status::NO_ROOT);
        }
        let readings = used.iter().map(|k| (&self.locators[*k], signals[*k])).collect();
        let outside = status | Status::OUTSIDE_CALIBRATION;
        let tap = ChannelTap::new(readings, drive, &noise).ok_or(outside)?;
        let side = side(used[0]).ok_or(outside)?;
        let found = chosen(tap.refined(&tap.starts()), side.distances);
        let first = found.first().ok_or(status | Status::NO_ROOT)?;
        // Adds the errors of the calibrations at this tap.
        let [a, u] = tap.place(&first.at);
        for (i, k) in used.iter().enumerate() {
            noise[(i, i)] += self.locators[*k].left(a, u, signals[*k].signum()).max(0.0);
        }
        let starts: Vec<Vec<f64>> = found.into_iter().map(|m| m.at).collect();
        let tap = ChannelTap { noise: factor(&noise).ok_or(status | Status::NO_ROOT)?, ..tap };
        let found = chosen(tap.refined(&starts), side.distances);
        let (best, others) = found.split_first().ok_or(status | Status::NO_ROOT)?;
        // A large misfit refuses the tap; a smaller one widens σ.
        // At an end of the calibrated drives the drive was not free: beyond it the misfit would be smaller.
        let at_end = tap.at_end(&best.at);
        let (misfit, freedom) = (best.chi2(), (used.len() - unknowns + usize::from(at_end)) as f64);
        if freedom > 0.0 && misfit > CONTRADICTORY + 4.0 * freedom {
            return Err(if at_end { outside } else { status | Status::NO_ROOT });
        }
        let wider = if freedom > 0.0 { (misfit / freedom).sqrt().max(1.0) } else { 1.0 };
        let (a, sigma) = (best.at[0], best.covariance[(0, 0)].sqrt() * wider);
        let alike = |m: &&Minimum| m.chi2() - misfit < ALIKE && (m.at[0] - a).abs() > 3.0 * sigma;
        let other = others.iter().find(alike).map(|m| m.at[0]);
        status |= side.doubts(a, other, sigma);
        // An uncertainty of the whole calibrated range tells no distance.
        if sigma > side.distances[1] - side.distances[0] {
            status |= Status::AMBIGUOUS;
        }
        Ok(Located::normal(a, sigma, status))
    }
}

/// `found`, best first, with that one at the head which is told where several fit equally well: the farthest of the calibrated ones, or of all.
fn chosen(mut found: Vec<Minimum>, [first, last]: [f64; 2]) -> Vec<Minimum> {
    let Some(least) = found.first().map(Minimum::chi2) else { return found };
    let rank = |m: &Minimum| ((first..=last).contains(&m.at[0]), m.at[0]);
    let best = (0..found.len()).filter(|k| found[*k].chi2() <= least + EQUAL).max_by(|p, q| {
        let (p, q) = (rank(&found[*p]), rank(&found[*q]));
        p.0.cmp(&q.0).then(p.1.total_cmp(&q.1))
    });
    let head = found.remove(best.unwrap_or(0));
    found.insert(0, head);
    found
}

/// The signals of one tap, whose distance, or distance and drive, are looked for.
struct ChannelTap<'a> {
    /// Of each channel what answers it and its signal.
    readings: Vec<(&'a Locator, f64)>,
    /// NaN where it is not known.
    drive: f64,
    noise: Cholesky<f64, Dyn>,
    bounds: [[f64; 2]; 2],
}

impl<'a> ChannelTap<'a> {
    /// `None` where a channel is not calibrated on the side of its signal, or the drive is none of the calibrated ones.
    fn new(readings: Vec<(&'a Locator, f64)>, drive: f64, noise: &DMatrix<f64>) -> Option<Self> {
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

    fn unknowns(&self) -> usize {
        if self.drive.is_finite() { 1 } else { 2 }
    }

    fn place(&self, x: &[f64]) -> [f64; 2] {
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
    fn refined(&self, starts: &[Vec<f64>]) -> Vec<Minimum> {
        let (n, [lo, hi]) = (self.unknowns(), self.bounds[0]);
        let steps = self.bounds.map(|[_, end]| STEP * end);
        let least = |x: &Vec<f64>| by_values(&|x| self.white(x), x, &steps[..n], &self.bounds[..n], SETTLED);
        let found = starts.iter().filter_map(least).filter(|m| m.at[0] > lo && m.at[0] < hi);
        let mut found: Vec<Minimum> = found.collect();
        found.sort_by(|p, q| p.chi2().total_cmp(&q.chi2()));
        found
    }

    /// Whether the drive of `x` is looked for, and lies at an end of the calibrated ones.
    fn at_end(&self, x: &[f64]) -> bool {
        let [lo, hi] = self.bounds[1];
        x.get(1).is_some_and(|u| *u <= lo || *u >= hi)
    }

    /// Places from which every minimum is reached: those of a grid that fit better than their neighbours.
    fn starts(&self) -> Vec<Vec<f64>> {
        let grid = |i: usize| {
            let [lo, hi] = self.bounds[i];
            (0..STARTS[i]).map(move |k| lo + (hi - lo) * (k as f64 + 0.5) / STARTS[i] as f64)
        };
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
