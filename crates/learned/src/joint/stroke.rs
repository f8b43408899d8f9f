//! Readings of a stroke at growing drive, in bounded memory.

use super::Joint;
use super::course::Place;

/// Bins of a stroke at most.
const MOST: usize = 64;
/// Differences between neighbours that are remembered.
const DIFFERENCES: usize = 128;
/// Bins of several readings from which on it is asked whether their means vary more than readings say.
const MEANS: usize = 8;
/// All places are looked at again when a share of 1 in so many readings has come.
const AGAIN: usize = 4;
/// What the calibration says of the noise counts as so many differences.
const BEFORE: f64 = 4.0;
/// A median tells a variance as well as a mean of this share of the numbers.
const MEDIAN: f64 = 0.37;

/// Readings next to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bin {
    /// Number of readings.
    pub n: f64,
    /// Mean drive.
    pub u: f64,
    /// Mean signal.
    pub y: f64,
}

/// Readings that differ by whole numbers of steps, but for this share of one, are rounded to them.
const ROUNDED: f64 = 1e-3;
/// Fewest differences that say so.
const FEWEST: usize = 4;

/// Readings at growing drive.
#[derive(Debug, Clone, Default)]
pub struct Stroke {
    bins: Vec<Bin>,
    count: usize,
    /// The last two readings.
    last: Vec<Bin>,
    /// By how much readings differ from those before them.
    steps: Vec<f64>,
    /// Second differences of readings, in units of the deviation of one.
    differences: Vec<f64>,
    /// Likely places, and until how many readings they are looked for from there.
    modes: (Vec<Place>, usize),
}

impl Stroke {
    /// Readings so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Least and largest drive so far, as means of their bins.
    pub fn drives(&self) -> Option<[f64; 2]> {
        Some([self.bins.first()?.u, self.bins.last()?.u])
    }

    /// Likely places of fewer readings; `None` where all places are to be looked at.
    pub(super) fn recent(&self) -> Option<&[Place]> {
        (self.count < self.modes.1 && !self.modes.0.is_empty()).then_some(&self.modes.0)
    }

    /// Remembers likely places.
    pub(super) fn remember(&mut self, modes: Vec<Place>) {
        if self.recent().is_none() {
            self.modes.1 = self.count + 1 + self.count / AGAIN;
        }
        self.modes.0 = modes;
    }

    /// Adds the reading `y` by the drive `u`. One that repeats that before it to the last digit tells nothing.
    pub fn add(&mut self, u: f64, y: f64) {
        let one = Bin { n: 1.0, u, y };
        self.count += 1;
        if let Some(before) = self.last.last() {
            if *before == one {
                return;
            }
            remember(&mut self.steps, self.count, (y - before.y).abs());
        }
        self.last.push(one);
        if let [p, q, r] = self.last[..] {
            remember(&mut self.differences, self.count, off(p, q, r));
            self.last.remove(0);
        }
        // Drives jitter.
        let place = self.bins.partition_point(|bin| bin.u <= u);
        self.bins.insert(place, one);
        if self.bins.len() > MOST {
            let width = |k: &usize| self.bins[k + 1].u - self.bins[k.saturating_sub(1)].u;
            let narrowest = (0..MOST).min_by(|i, k| width(i).total_cmp(&width(k))).unwrap_or(0);
            let other = self.bins.remove(narrowest + 1);
            self.bins[narrowest] = joined(self.bins[narrowest], other);
        }
    }

    /// The step to which readings are rounded; 0 where they are not.
    fn step(&self) -> f64 {
        let moved = || self.steps.iter().copied().filter(|d| *d > 0.0);
        let step = moved().fold(f64::INFINITY, f64::min);
        let whole = |d: f64| (d / step - (d / step).round()).abs() < ROUNDED;
        if self.steps.len() >= FEWEST && step.is_finite() && moved().all(whole) { step } else { 0.0 }
    }

    /// At most `most` bins.
    pub(super) fn bins(&self, most: usize) -> Vec<Bin> {
        let size = self.bins.len().div_ceil(most).max(1);
        let all = self.bins.chunks(size).map(|c| c.iter().copied().reduce(joined).unwrap_or(c[0]));
        all.collect()
    }

    /// Variances of one reading, and of the mean of any number of them, as far as it does not fall with the number. Neighbours tell it, so that
    /// neither contact nor slip does, and where they are few the calibration.
    pub(super) fn noise(&self, joint: &Joint) -> [f64; 2] {
        let square = |of: &[f64]| of.first().map_or(0.0, |_| (1.4826 * median(of)).powi(2));
        let n = MEDIAN * self.differences.len() as f64;
        let before = joint.rest[1].max(f64::MIN_POSITIVE);
        let one = (BEFORE * before + n * square(&self.differences)) / (BEFORE + n);
        // A staircase that goes with the drive hides its steps from neighbours.
        let one = one + self.step().powi(2) / 12.0;
        let means: Vec<f64> = self
            .bins
            .windows(3)
            .filter(|w| w.iter().all(|bin| bin.n > 1.0))
            .map(|w| {
                let [p, q, r] = [0, 1, 2].map(|k| w[k]);
                off(p, q, r) / spread(p, q, r)
            })
            .collect();
        let more = if means.len() < MEANS { 0.0 } else { one * (square(&means) - 1.0).max(0.0) };
        let n = self.bins.iter().map(|bin| bin.n).sum::<f64>() / self.bins.len().max(1) as f64;
        [one, more / n]
    }
}

/// Puts `x` in the place of the oldest of many.
fn remember(all: &mut Vec<f64>, count: usize, x: f64) {
    if all.len() == DIFFERENCES { all[count % DIFFERENCES] = x } else { all.push(x) }
}

fn joined(p: Bin, q: Bin) -> Bin {
    let n = p.n + q.n;
    Bin { n, u: (p.n * p.u + q.n * q.u) / n, y: (p.n * p.y + q.n * q.y) / n }
}

/// Where q lies between p and r.
fn share(p: Bin, q: Bin, r: Bin) -> f64 {
    if r.u > p.u { (q.u - p.u) / (r.u - p.u) } else { 0.5 }
}

/// |Deviation| of q from the line through its neighbours, over that of such a deviation of readings of variance 1.
fn off(p: Bin, q: Bin, r: Bin) -> f64 {
    let t = share(p, q, r);
    (q.y - (1.0 - t) * p.y - t * r.y).abs() / (1.0 + t * t + (1.0 - t) * (1.0 - t)).sqrt()
}

/// Standard deviation of [`off`] for means of readings of variance 1.
fn spread(p: Bin, q: Bin, r: Bin) -> f64 {
    let t = share(p, q, r);
    let all = 1.0 + t * t + (1.0 - t) * (1.0 - t);
    ((1.0 / q.n + t * t / r.n + (1.0 - t) * (1.0 - t) / p.n) / all).sqrt()
}

fn median(of: &[f64]) -> f64 {
    let mut all = of.to_vec();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}
