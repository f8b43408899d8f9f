//! Posterior of a stroke: of the distance, and of the drive at which the whisker touched.
//! Above the touch c, a reading at drive u is that of a tap at u − c − o, with the offset o of the calibrated drives. The readings share c, o, the
//! errors of calibration and run ([`Joint`]), a gain and a zero; only the scatter within the stroke is noise.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use vibrissa_core::reduce::sorted;

use super::{Joint, NEAR, Nuisance, Offset, SECOND};
use crate::evidence::ln_det;
use crate::invert::{POINTS, blend, lagrange};

/// First search: bins, grid points in ln a, grid points of the touch.
pub(super) const COARSE: [usize; 3] = [24, 25, 33];
const BINS: usize = 64;
pub(super) const POSTERIOR: [usize; 2] = [17, 9];
/// Distance of starts from the mode as a share of the ranges: from the grid, and from the last search.
const FAR_OFF: f64 = 0.02;
const NEAR_IT: f64 = 0.003;
/// Shared numbers of a stroke alone: gain, zero, error of the zero, three shares of the line, offset of the drive.
const OWN: usize = 7;
/// The last reading is at most this many times the largest calibrated drive beyond the touch.
const PAST: f64 = 1.25;
/// Fall of −2 ln p that shows a contact.
const SEEN: f64 = 16.0;

/// Uncertainty, as a share of the signal, of the straight line between touch and smallest calibrated drive.
const TOE: f64 = 0.05;
const BEND: f64 = 0.01;
/// Uncertainty of the line beyond the largest calibrated drive, as a share of the excess.
const BEYOND: f64 = 0.5;
/// The smallest calibrated drive is at least this share of itself beyond the touch.
const LEAST: f64 = 0.1;
const STEP: f64 = 1e-3;

/// Conditions of a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course<'a> {
    /// True for a run of the calibration.
    pub same_run: bool,
    /// Variance of its zero.
    pub of_zero: f64,
    /// Least drive of the touch.
    pub least: f64,
    /// Uncertain numbers of the object.
    pub nuisances: &'a [Nuisance],
}

/// Result of a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// Quantiles of the distance at 2.5, 15.9, 50, 84.1 and 97.5 %, mm.
    pub a: [f64; 5],
    /// Drive of the touch and its standard deviation.
    pub touch: [f64; 2],
    /// Another distance that fits, mm.
    pub near: Option<f64>,
    /// Drive at which readings deviate most from the best curve, and the deviation in standard deviations.
    pub apart: [f64; 2],
}

pub(super) type Place = [f64; 2];

pub(super) struct Task<'a> {
    pub joint: &'a Joint,
    pub course: Course<'a>,
    pub bins: Vec<Bin>,
    /// Variance of one reading, and of any mean.
    pub noise: [f64; 2],
    pub drives: [f64; 2],
    /// Ranges of ln a and of the touch.
    pub ends: [[f64; 2]; 2],
}

pub(super) struct Mode {
    pub at: Place,
    pub value: f64,
    /// Standard deviation of ln a, d touch/d ln a, standard deviation of the touch at fixed ln a.
    pub shape: [f64; 3],
}

pub(super) struct Off {
    /// Deviation of each bin, in standard deviations of its noise.
    pub left: DVector<f64>,
    pub spread: DVector<f64>,
    /// Change by each shared number, in standard deviations; a column for each bin.
    pub shared: DMatrix<f64>,
}

impl<'a> Task<'a> {
    pub fn new(stroke: &Stroke, joint: &'a Joint, course: Course<'a>, bins: Vec<Bin>) -> Option<Self> {
        let nodes = &joint.inverse.nodes;
        let ends = [f64::min, f64::max].map(|of| nodes.iter().copied().reduce(of));
        let drives = [ends[0]?.exp() - joint.inverse.offset, ends[1]?.exp() - joint.inverse.offset];
        let [first, last] = [stroke.bins.first()?.u, stroke.bins.last()?.u];
        let past = last - PAST * (drives[1] + joint.offset.mean);
        let from = past.min(first - drives[0]).max(course.least.min(last));
        let ends = [[joint.x(0), joint.x(POINTS - 1)], [from, last]];
        Some(Self { joint, course, bins, noise: stroke.noise(joint), drives, ends })
    }

    pub fn shared(&self) -> usize {
        self.joint.of_run.len() + OWN + self.course.nuisances.len()
    }

    pub fn value(&self, at: Place) -> f64 {
        self.value_of(&self.across(at[0]), at)
    }

    /// −2 ln p at a place, from the table `across` at its ln a.
    pub fn value_of(&self, across: &[Vec<f64>], at: Place) -> f64 {
        let value = || {
            let off = self.at(across, at);
            let (factor, b) = self.factor(&off)?;
            let ln_spread = 2.0 * off.spread.iter().map(|x| x.ln()).sum::<f64>();
            let value = off.left.norm_squared() + ln_spread - b.dot(&factor.solve(&b)) + ln_det(&factor);
            value.is_finite().then(|| value - 2.0 * self.joint.prior(at[0], [0.0; 2]))
        };
        let inside = (0..2).all(|k| (self.ends[k][0]..=self.ends[k][1]).contains(&at[k]));
        if inside { value().unwrap_or(f64::INFINITY) } else { f64::INFINITY }
    }

    /// Factor of 1 + s sᵀ of the shared numbers s, and Σ s · deviation.
    pub fn factor(&self, off: &Off) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let n = self.shared();
        let (mut a, mut b) = (DMatrix::<f64>::identity(n, n), DVector::<f64>::zeros(n));
        for (shared, left) in off.shared.column_iter().zip(&off.left) {
            a.syger(1.0, &shared, &shared, 1.0);
            b.axpy(*left, &shared, 1.0);
        }
        Some((a.cholesky()?, b))
    }

    /// Table at ln a = x: a row for each node of the drive.
    pub fn across(&self, x: f64) -> Vec<Vec<f64>> {
        let (k, t) = self.joint.place(x);
        let (weights, width) = (lagrange::<NEAR>(t), self.joint.width());
        let of = |row: &Vec<f64>| blend(&weights, row[k * width..].chunks(width), width);
        self.joint.table.iter().map(of).collect()
    }

    fn tap(&self, across: &[Vec<f64>], v: f64) -> Vec<f64> {
        let u = v + self.joint.inverse.offset;
        let mut all = self.joint.inverse.between(across, u, 0..self.joint.width());
        all.iter_mut().for_each(|x| *x *= u);
        all[1] = (all[1] * u - self.joint.rest[1]).max(0.0).sqrt();
        all
    }

    pub fn at(&self, across: &[Vec<f64>], [x, touch]: Place) -> Off {
        let joint = self.joint;
        let width = joint.width();
        let [lo, hi] = self.drives;
        let ends = self.drives.map(|v| self.tap(across, v));
        let Offset { mean, moved: ref by, own } = joint.offset;
        let mean = mean.max((LEAST - 1.0) * lo);
        let [from, to] = [lo + mean, hi + mean];
        let [floor, of_zero] = [joint.rest[1], self.course.of_zero].map(f64::sqrt);
        let mut rest = joint.rest.clone();
        rest[1] = 0.0;
        // Linear from the touch to the first calibrated drive, and from the last one on.
        let part = |end: &[f64], since: f64, until: f64| {
            let share = since / until;
            let values: Vec<f64> = (0..width).map(|c| rest[c] * (1.0 - share) + end[c] * share).collect();
            let slope = (values[0] - rest[0]) / until;
            (values, slope)
        };
        let of_run = |c: usize| self.course.same_run && joint.of_run[c];
        let n = self.bins.len();
        let (left, spread, shared) = (DVector::zeros(n), DVector::zeros(n), DMatrix::zeros(self.shared(), n));
        let mut off = Off { left, spread, shared };
        for (k, bin) in self.bins.iter().enumerate() {
            let since = bin.u - touch;
            let (values, slope) = match since {
                s if s <= 0.0 => (rest.clone(), 0.0),
                s if s < from => part(&ends[0], s, from),
                s if s > to => part(&ends[1], s, to),
                s => {
                    let (v, values) = (s - mean, self.tap(across, s - mean));
                    let u = (1.0 + STEP) * v + joint.inverse.offset;
                    let beyond = u * joint.inverse.between(across, u, 0..1)[0];
                    let slope = (beyond - values[0]) / (STEP * v);
                    (values, slope)
                }
            };
            let signal = values[0] - rest[0];
            let toe = if since > 0.0 && since < from { 1.0 - since / from } else { 0.0 };
            let bend = BEND * toe * since / from;
            let toe = TOE * toe;
            let beyond = if since > to { BEYOND * (1.0 - to / since) } else { 0.0 };
            // The offset of the calibrated drives is learned with the curve; contact begins where the stroke shows it.
            let moved = own * slope;
            // Proportional noise of a tap is a gain of the whole stroke.
            let own = [values[1], floor, of_zero, toe * signal, bend * signal, beyond * signal, moved];
            let sd = (self.noise[0] / bin.n + self.noise[1]).sqrt();
            let of_object = |own: &Nuisance| {
                if since > 0.0 { own.at(x, since - mean).map(|c| c * signal) } else { [0.0; 2] }
            };
            let changes = self.course.nuisances.iter().map(of_object);
            off.left[k] = (bin.y - values[0] - changes.clone().map(|c| c[0]).sum::<f64>()) / sd;
            off.spread[k] = sd;
            let common = values[2..].iter().zip(by).enumerate();
            let common = common.map(|(c, (x, by))| if of_run(c) { 0.0 } else { x - by * slope });
            let mut column = off.shared.column_mut(k);
            let all = common.chain(own).chain(changes.map(|c| c[1]));
            column.iter_mut().zip(all).for_each(|(to, x)| *to = x / sd);
        }
        off
    }
}

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
    /// Distance from the readings so far; `None` before a contact is seen.
    pub fn told(&mut self, joint: &Joint, course: Course<'_>) -> Option<Told> {
        let task = Task::new(self, joint, course, self.bins(BINS))?;
        // Modes of a few readings ago are good starts.
        let (starts, near) = match self.recent() {
            Some(modes) => (modes.to_vec(), NEAR_IT),
            None => (Task::new(self, joint, course, self.bins(COARSE[0]))?.starts(), FAR_OFF),
        };
        let mut modes: Vec<Mode> = starts.into_iter().filter_map(|at| task.mode(at, near)).collect();
        modes.sort_by(|p, q| p.value.total_cmp(&q.value));
        modes.dedup_by(|q, p| (0..2).all(|k| (q.at[k] - p.at[k]).abs() < p.shape[2 * k].max(1e-9)));
        self.remember(modes.iter().map(|mode| mode.at).collect());
        let best = modes.first()?;
        let none = task.value([best.at[0], task.ends[1][1]]);
        if none - best.value < SEEN {
            return None;
        }
        let (apart, excess) = task.misfit(best.at)?;
        // A misfit inflates the variances.
        let noise = task.noise.map(|v| v * excess);
        let task = Task { noise, ..task };
        if excess > 2.0 {
            modes = modes.iter().filter_map(|mode| task.mode(mode.at, NEAR_IT)).collect();
        }
        let least = modes.iter().map(|mode| task.value(mode.at)).fold(f64::INFINITY, f64::min);
        let told: Vec<(f64, [f64; 5], Place)> =
            modes.iter().take(3).filter_map(|mode| task.posterior(mode, least)).collect();
        let all: f64 = told.iter().map(|t| t.0).sum();
        // The farthest likely distance is reported, as for several taps.
        let mut likely: Vec<_> = told.into_iter().filter(|t| t.0 >= SECOND * all).collect();
        likely.sort_by(|p, q| q.1[2].total_cmp(&p.1[2]));
        let (_, a, touch) = *likely.first()?;
        Some(Told { a, touch, near: likely.get(1).map(|t| t.1[2]), apart })
    }

    fn recent(&self) -> Option<&[Place]> {
        (self.count < self.modes.1 && !self.modes.0.is_empty()).then_some(&self.modes.0)
    }

    fn remember(&mut self, modes: Vec<Place>) {
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

    fn bins(&self, most: usize) -> Vec<Bin> {
        let size = self.bins.len().div_ceil(most).max(1);
        let all = self.bins.chunks(size).map(|c| c.iter().copied().reduce(joined).unwrap_or(c[0]));
        all.collect()
    }

    /// Variance of one reading, and the part of a mean's variance that more readings do not reduce; from neighbours, so that contact does not count.
    fn noise(&self, joint: &Joint) -> [f64; 2] {
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
