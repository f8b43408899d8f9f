//! Readings of several channels of one sensor: the most likely distance given all of them (model §7).
//!
//! Every channel has a calibration of its own, which says what is expected of a tap; their noise goes together as the covariance of what
//! these leave. Where the drive is not known it is found with the distance: two channels tell both.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::calibration::Calibration;
use super::locator::{Located, Locator};
use super::table::{Reading, Readings};
use crate::error::Error;
use crate::estimator::bounded::{self, Problem};
use crate::estimator::model::exact::Opener;
use crate::locate::stream::Ask;
use crate::measure::columns::Channel;
use crate::scene::Signal;
use crate::status::Status;

/// Distances and drives from which the most likely ones are looked for.
const STARTS: [usize; 2] = [24, 12];
/// Distances are looked for beyond the calibrated ones by this share of their range.
const BEYOND: f64 = 0.1;
/// Step of difference quotients, relative.
const STEP: f64 = 1e-4;
/// Relative change at which a search ends.
const SETTLED: f64 = 1e-12;
/// Squared misfit of one degree of freedom, in units of noise, above which channels contradict each other.
const CONTRADICTORY: f64 = 36.0;
/// Excess of the squared misfit, in units of noise, below which another distance fits as well.
const ALIKE: f64 = 1.0;

/// What a calibration of several channels holds.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Of each the name of its column and its calibration.
    pub channels: Vec<(String, Calibration)>,
    /// Covariance of the noise of one reading, in the units of the channels' calibrations.
    pub covariance: Vec<Vec<f64>>,
}

/// Answers readings of several channels.
pub struct Several {
    /// What answers each of them alone.
    pub locators: Vec<Locator>,
    columns: Vec<Channel>,
    covariance: DMatrix<f64>,
}

/// A reading of all channels.
#[derive(Debug, Clone)]
pub struct Together {
    /// That of each.
    pub each: Vec<Reading>,
    /// The distance that all tell.
    pub located: Located,
}

impl Several {
    /// Of a calibration in the file `label`; `open` solves models.
    ///
    /// # Errors
    /// As [`Locator::new`].
    pub fn new(sensor: &Sensor, label: &str, open: Opener<'_>) -> Result<Self, Error> {
        let locator = |(_, c): &(String, Calibration)| {
            let mut locator = Locator::new(c, label, None, open)?;
            locator.of_several = true;
            Ok::<_, Error>(locator)
        };
        let n = sensor.channels.len();
        let locators: Vec<Locator> = sensor.channels.iter().map(locator).collect::<Result<_, _>>()?;
        let columns =
            sensor.channels.iter().zip(&locators).map(|((name, _), l)| column(name, l.unit.signal()));
        Ok(Self {
            columns: columns.collect(),
            covariance: DMatrix::from_fn(n, n, |i, j| sensor.covariance[i][j]),
            locators,
        })
    }

    /// Reads and answers `bytes`; `added` names the columns that follow what is kept of each row. The header of what is kept, and the rows.
    ///
    /// # Errors
    /// As [`Readings::of`].
    pub fn read(
        &self,
        bytes: &[u8],
        ask: &Ask<'_>,
        added: &[&'static str],
    ) -> Result<(Vec<u8>, Vec<Together>), Error> {
        let mut all: Vec<Readings> = Vec::new();
        for (locator, column) in self.locators.iter().zip(&self.columns) {
            let names = ask.columns.of_channel(column.clone());
            all.push(Readings::of(locator, bytes, &Ask { columns: &names, ..*ask }, added)?);
        }
        let header = all[0].header.clone();
        let rows = (0..all[0].rows.len()).map(|k| {
            let each: Vec<Reading> = all.iter().map(|r| r.rows[k].clone()).collect();
            let signals: Vec<f64> = each.iter().map(|r| r.signal).collect();
            let shares: Vec<f64> = each.iter().map(|r| r.share).collect();
            let located = match each.iter().any(|r| r.rests) {
                true => Located::nothing(Status::NO_STRAIN),
                false => self.locate(each[0].drive, &signals, &shares),
            };
            Together { each, located }
        });
        Ok((header, rows.collect()))
    }

    /// The distance of a tap by `drive` (degrees or mm; NaN where it is not known) with these tared signals; of each zero the variance in
    /// units of that of one reading. A channel without a reading is left out.
    pub fn locate(&self, drive: f64, signals: &[f64], shares: &[f64]) -> Located {
        let used: Vec<usize> =
            (0..signals.len()).filter(|k| signals[*k].is_finite() && signals[*k] != 0.0).collect();
        let unknowns = if drive.is_finite() { 1 } else { 2 };
        if used.len() < unknowns {
            let none = signals.iter().all(|x| *x == 0.0);
            return Located::nothing(if none { Status::NO_STRAIN } else { Status::BAD_INPUT });
        }
        let mut status = Status::OK;
        let mut noise = DMatrix::from_fn(used.len(), used.len(), |i, j| self.covariance[(used[i], used[j])]);
        for (i, k) in used.iter().enumerate() {
            noise[(i, i)] *= 1.0 + shares[*k];
            if drive.is_finite() {
                let alone = self.locators[*k].locate(drive, signals[*k]).status;
                if alone.has(Status::STRAIN_LIMIT) {
                    status |= Status::STRAIN_LIMIT;
                }
            }
        }
        let Some(tap) = Tap::new(self, (&used, signals), drive, &noise) else {
            return Located::nothing(status | Status::OUTSIDE_CALIBRATION);
        };
        let Some((x, _, _)) = tap.search() else {
            return Located::nothing(status | Status::NO_ROOT);
        };
        // What the calibrations leave, where the tap is.
        let [a, u] = tap.place(&x);
        for (i, k) in used.iter().enumerate() {
            noise[(i, i)] += self.left(*k, a, u, signals[*k].signum());
        }
        let Some(tap) = Tap::new(self, (&used, signals), drive, &noise) else {
            return Located::nothing(status | Status::NO_ROOT);
        };
        let Some((x, sigma, other)) = tap.search() else {
            return Located::nothing(status | Status::NO_ROOT);
        };
        // Channels that no distance explains together; less of that makes the answer less certain.
        let freedom = (used.len() - unknowns) as f64;
        let misfit = tap.white(&x).map_or(f64::INFINITY, |r| r.norm_squared());
        if freedom > 0.0 && misfit > CONTRADICTORY + 4.0 * freedom {
            return Located::nothing(status | Status::NO_ROOT);
        }
        let sigma = if freedom > 0.0 { sigma * (misfit / freedom).sqrt().max(1.0) } else { sigma };
        let side = self.locators[used[0]].sides().iter().find(|s| s.sign == signals[used[0]].signum());
        status |= side.map_or(Status::OUTSIDE_CALIBRATION, |side| side.doubts(x[0], other, sigma));
        Located { distance: x[0], sigma, status }
    }

    /// Variance of what is expected of the channel `k`, beyond noise.
    fn left(&self, k: usize, a: f64, u: f64, sign: f64) -> f64 {
        let of = &self.locators[k];
        let expected = |a: f64| of.expected(a, u, sign);
        let slope = (expected(a * (1.0 + STEP)) - expected(a * (1.0 - STEP))) / (2.0 * STEP * a);
        let alone = of.locate(u, expected(a));
        let left = (alone.sigma * slope).powi(2) - of.noise().powi(2);
        if left > 0.0 { left } else { 0.0 }
    }
}

/// The column of the channel `name`, which shows `signal`.
fn column(name: &str, signal: Option<Signal>) -> Channel {
    let numbered = crate::scene::channels::numbered(name);
    match (numbered, signal) {
        (Some(name), _) => Channel::Named(name),
        (None, signal) => Channel::Of(signal.unwrap_or(Signal::Strain)),
    }
}

/// One tap, whose distance, or distance and drive, are looked for.
struct Tap<'a> {
    of: &'a Several,
    used: &'a [usize],
    signals: &'a [f64],
    drive: f64,
    noise: Cholesky<f64, Dyn>,
    /// Of distance and drive.
    bounds: [[f64; 2]; 2],
}

impl<'a> Tap<'a> {
    /// `None` where a channel is not calibrated on the side of its signal, or the drive is none of the calibrated ones.
    fn new(
        of: &'a Several,
        (used, signals): (&'a [usize], &'a [f64]),
        drive: f64,
        noise: &DMatrix<f64>,
    ) -> Option<Self> {
        let mut bounds = [[0.0, f64::INFINITY]; 2];
        for k in used {
            let locator = &of.locators[*k];
            let side = locator.sides().iter().find(|s| s.sign == signals[*k].signum())?;
            let [first, last] = side.distances;
            let slack = BEYOND * (last - first);
            let drives =
                [side.drives[0], side.drives[side.drives.len() - 1]].map(|u| u + locator.drive_origin);
            for (bound, [lo, hi]) in bounds.iter_mut().zip([[first - slack, last + slack], drives]) {
                *bound = [bound[0].max(lo), bound[1].min(hi)];
            }
            if drive.is_finite() && !side.admits(drive - locator.drive_origin) {
                return None;
            }
        }
        let scale = noise.diagonal().map(|v| v.sqrt());
        let scaled =
            DMatrix::from_fn(noise.nrows(), noise.nrows(), |i, j| noise[(i, j)] / (scale[i] * scale[j]));
        // Noise-free data leave a covariance of rounding errors.
        let ridge = DMatrix::identity(noise.nrows(), noise.nrows()) * 1e-9;
        let scaled = scaled + ridge;
        let full =
            DMatrix::from_fn(noise.nrows(), noise.nrows(), |i, j| scaled[(i, j)] * scale[i] * scale[j]);
        Some(Self { of, used, signals, drive, noise: Cholesky::new(full)?, bounds })
    }

    fn unknowns(&self) -> usize {
        if self.drive.is_finite() { 1 } else { 2 }
    }

    fn place(&self, x: &DVector<f64>) -> [f64; 2] {
        [x[0], if self.drive.is_finite() { self.drive } else { x[1] }]
    }

    /// Residuals, white.
    fn white(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let [a, u] = self.place(x);
        let one =
            |k: &usize| self.of.locators[*k].expected(a, u, self.signals[*k].signum()) - self.signals[*k];
        let r = DVector::from_iterator(self.used.len(), self.used.iter().map(one));
        self.noise.l_dirty().solve_lower_triangular(&r).filter(|r| r.iter().all(|x| x.is_finite()))
    }

    fn quotients(&self, x: &DVector<f64>) -> Option<DMatrix<f64>> {
        let columns = (0..self.unknowns()).map(|i| {
            let at = |share: f64| {
                let mut moved = x.clone();
                let [lo, hi] = self.bounds[i];
                moved[i] = (x[i] * (1.0 + share)).clamp(lo, hi);
                Some((moved[i], self.white(&moved)?))
            };
            let ((p, lo), (q, hi)) = (at(-STEP)?, at(STEP)?);
            Some((hi - lo) / (q - p))
        });
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }

    /// The most likely unknowns, the standard deviation of the distance, and another distance that is as likely.
    fn search(&self) -> Option<(DVector<f64>, f64, Option<f64>)> {
        let grid = |i: usize| {
            let [lo, hi] = self.bounds[i];
            (0..STARTS[i]).map(move |k| lo + (hi - lo) * (k as f64 + 0.5) / STARTS[i] as f64)
        };
        let starts: Vec<DVector<f64>> = match self.unknowns() {
            1 => grid(0).map(|a| DVector::from_element(1, a)).collect(),
            // Of each distance the best drive.
            _ => grid(0)
                .filter_map(|a| {
                    let of = |u: f64| {
                        let x = DVector::from_vec(vec![a, u]);
                        self.white(&x).map(|r| (r.norm_squared(), x))
                    };
                    grid(1).filter_map(of).min_by(|p, q| p.0.total_cmp(&q.0)).map(|best| best.1)
                })
                .collect(),
        };
        let valued: Vec<(f64, DVector<f64>)> =
            starts.into_iter().filter_map(|x| self.white(&x).map(|r| (r.norm_squared(), x))).collect();
        let least = |k: usize| {
            let beside = |m: Option<usize>| m.and_then(|m| valued.get(m)).is_none_or(|v| v.0 >= valued[k].0);
            beside(k.checked_sub(1)) && beside(Some(k + 1))
        };
        let mut found: Vec<(f64, DVector<f64>)> = (0..valued.len())
            .filter(|k| least(*k))
            .filter_map(|k| {
                let x = valued[k].1.clone();
                let bounds = &self.bounds[..self.unknowns()];
                let Ok(x) = bounded::minimise(self, x.clone(), x, bounds, SETTLED);
                Some((self.white(&x)?.norm_squared(), x))
            })
            .collect();
        found.sort_by(|p, q| p.0.total_cmp(&q.0));
        let (misfit, x) = found.first()?.clone();
        let j = self.quotients(&x)?;
        let sigma = j.tr_mul(&j).try_inverse()?[(0, 0)].sqrt();
        // At an end of what is looked for nothing fits.
        let [lo, hi] = self.bounds[0];
        let inside = x[0] > lo && x[0] < hi;
        let alike = |(m, y): &&(f64, DVector<f64>)| m - misfit < ALIKE && (y[0] - x[0]).abs() > 3.0 * sigma;
        let other = found[1..].iter().find(alike).map(|(_, y)| y[0]);
        (sigma.is_finite() && inside).then_some((x, sigma, other))
    }
}

impl Problem for Tap<'_> {
    type Model = DVector<f64>;
    type Error = std::convert::Infallible;

    fn model(&self, x: &DVector<f64>, _: &DVector<f64>) -> Result<DVector<f64>, Self::Error> {
        Ok(x.clone())
    }

    fn residuals(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        self.white(x)
    }

    fn slopes(&self, x: &mut DVector<f64>) -> Result<Option<DMatrix<f64>>, Self::Error> {
        Ok(self.quotients(x))
    }
}
