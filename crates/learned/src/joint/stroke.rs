//! Readings of a stroke at growing drive, in bounded memory.

use vibrissa_core::reduce::sorted;

use super::Joint;
use super::course::Place;

const MOST: usize = 64;
const DIFFERENCES: usize = 128;
/// Fewest bins of several readings whose means show excess scatter.
const MEANS: usize = 8;
/// A full search of n readings is valid for n/`AGAIN` more.
const AGAIN: usize = 4;
/// Weight of the calibration's noise, in differences.
const BEFORE: f64 = 4.0;
/// Efficiency of a median as a measure of variance.
const MEDIAN: f64 = 0.37;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bin {
    pub n: f64,
    /// Mean drive.
    pub u: f64,
    /// Mean signal.
    pub y: f64,
}

/// Readings count as rounded if their differences are multiples of a step within this share of it.
const ROUNDED: f64 = 1e-3;
const FEWEST: usize = 4;

/// Readings at growing drive.
#[derive(Debug, Clone, Default)]
pub struct Stroke {
    bins: Vec<Bin>,
    /// Number of readings so far.
    pub count: usize,
    last: Vec<Bin>,
    steps: Vec<f64>,
    differences: Vec<f64>,
    modes: (Vec<Place>, usize),
}

impl Stroke {
    /// Least and largest mean drive of the bins.
    pub fn drives(&self) -> Option<[f64; 2]> {
        Some([self.bins.first()?.u, self.bins.last()?.u])
    }

    pub(super) fn recent(&self) -> Option<&[Place]> {
        (self.count < self.modes.1 && !self.modes.0.is_empty()).then_some(&self.modes.0)
    }

    pub(super) fn remember(&mut self, modes: Vec<Place>) {
        if self.recent().is_none() {
            self.modes.1 = self.count + 1 + self.count / AGAIN;
        }
        self.modes.0 = modes;
    }

    /// Adds the reading `y` at drive `u`. An exact repeat of the last reading is not used.
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
        // Jitter: drives are not monotonic.
        let place = self.bins.partition_point(|bin| bin.u <= u);
        self.bins.insert(place, one);
        if self.bins.len() > MOST {
            let width = |k: &usize| self.bins[k + 1].u - self.bins[k.saturating_sub(1)].u;
            let narrowest = (0..MOST).min_by(|i, k| width(i).total_cmp(&width(k))).unwrap_or(0);
            let other = self.bins.remove(narrowest + 1);
            self.bins[narrowest] = joined(self.bins[narrowest], other);
        }
    }

    fn step(&self) -> f64 {
        let moved = || self.steps.iter().copied().filter(|d| *d > 0.0);
        let step = moved().fold(f64::INFINITY, f64::min);
        let whole = |d: f64| (d / step - (d / step).round()).abs() < ROUNDED;
        if self.steps.len() >= FEWEST && step.is_finite() && moved().all(whole) { step } else { 0.0 }
    }

    pub(super) fn bins(&self, most: usize) -> Vec<Bin> {
        let size = self.bins.len().div_ceil(most).max(1);
        let all = self.bins.chunks(size).map(|c| c.iter().copied().reduce(joined).unwrap_or(c[0]));
        all.collect()
    }

    /// Variance of one reading, and the part of a mean's variance that more readings do not reduce; from neighbours, so that contact does not count.
    pub(super) fn noise(&self, joint: &Joint) -> [f64; 2] {
        let square = |of: &[f64]| {
            let all = sorted(of.iter().copied());
            all.get(all.len() / 2).map_or(0.0, |median| (1.4826 * median).powi(2))
        };
        let n = MEDIAN * self.differences.len() as f64;
        let before = joint.rest[1].max(f64::MIN_POSITIVE);
        let one = (BEFORE * before + n * square(&self.differences)) / (BEFORE + n);
        // A staircase in phase with the drive hides its steps from neighbours.
        let one = one + self.step().powi(2) / 12.0;
        let triples = self.bins.windows(3).filter(|w| w.iter().all(|bin| bin.n > 1.0));
        let means: Vec<f64> = triples.map(|w| off(w[0], w[1], w[2])).collect();
        let more = if means.len() < MEANS { 0.0 } else { one * (square(&means) - 1.0).max(0.0) };
        let n = self.bins.iter().map(|bin| bin.n).sum::<f64>() / self.bins.len().max(1) as f64;
        [one, more / n]
    }
}

fn remember(all: &mut Vec<f64>, count: usize, x: f64) {
    if all.len() == DIFFERENCES { all[count % DIFFERENCES] = x } else { all.push(x) }
}

fn joined(p: Bin, q: Bin) -> Bin {
    let n = p.n + q.n;
    Bin { n, u: (p.n * p.u + q.n * q.u) / n, y: (p.n * p.y + q.n * q.y) / n }
}

/// |Deviation| of q from the line through p and r, over its standard deviation for means of readings of variance 1.
fn off(p: Bin, q: Bin, r: Bin) -> f64 {
    let t = if r.u > p.u { (q.u - p.u) / (r.u - p.u) } else { 0.5 };
    let variance = 1.0 / q.n + t * t / r.n + (1.0 - t) * (1.0 - t) / p.n;
    (q.y - (1.0 - t) * p.y - t * r.y).abs() / variance.sqrt()
}
