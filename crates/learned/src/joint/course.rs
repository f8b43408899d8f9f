//! What a stroke tells: one posterior of the distance and of the drive at which the whisker touched.
//!
//! A reading by the drive u is one of the sensor at rest before the drive c of the touch, and after it that of a tap by u − c − o, where o is by how
//! much the drives of the calibration are off. All of a stroke share its touch, o, the errors of the calibration and of the run ([`Joint`]), and what
//! is noise between taps: a gain and a zero of their own. Only what readings of one stroke scatter is noise.

use nalgebra::{DMatrix, DVector};

use super::around::{Fits, finer, fits};
use super::stroke::Bin;
use super::{Joint, NEAR, SECOND, Stroke, lagrange};
use crate::invert::{FINE, POINTS, node_weights, quantile};

/// Shares of a posterior: 95 and 68 % intervals, and its middle.
const SHARES: [f64; 5] = [0.025, 0.158_655, 0.5, 0.841_345, 0.975];
/// Bins and places where the posterior is looked for, in ln a and in the drive of the touch.
pub(super) const COARSE: [usize; 3] = [24, 25, 33];
/// Bins that are told by.
const BINS: usize = 64;
/// Points of the posterior in ln a, of which as many as [`FINE`] are made, and in the drive of the touch.
pub(super) const POSTERIOR: [usize; 2] = [17, 9];
/// Standard deviations on either side of a mode that are looked at.
const WINDOW: f64 = 5.0;
/// Bins from which on their residuals tell their scatter.
const JUDGED: usize = 12;
/// Windows that are tried.
const ROUNDS: usize = 10;
/// How far starts are off a mode, as shares of what is looked at: of a grid, and of a few readings less.
const FAR_OFF: f64 = 0.02;
const NEAR_IT: f64 = 0.003;
/// Between no contact and the smallest calibrated drive the signal goes straight, but for this share.
pub(super) const TOE: f64 = 0.05;
/// And beyond the largest one but for this share of what is beyond.
pub(super) const BEYOND: f64 = 0.5;
/// Numbers that only a stroke has: its gain, its zero, the error of the zero, the two shares, the offset of the drive.
const OWN: usize = 6;
/// The smallest calibrated drive is at least so much of itself beyond the touch.
const LEAST: f64 = 0.1;
/// Step of a slope over the drive, as a share of it.
const STEP: f64 = 1e-3;
/// By how much −2 ln p must fall for a contact to be seen.
const SEEN: f64 = 16.0;
/// Readings of a smooth curve leave no more than so many standard deviations of χ².
const SMOOTH: f64 = 4.0;

/// What is known of a stroke beside its readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Whether it is of a run of the calibration.
    pub same_run: bool,
    /// Variance that its zero brings.
    pub of_zero: f64,
    /// Least drive at which the whisker may touch.
    pub least: f64,
    /// The drive of the touch, where it is known.
    pub touch: Option<f64>,
}

/// What a stroke tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// Distances, mm, below which 2.5, 15.9, 50, 84.1 and 97.5 % of the posterior lie.
    pub a: [f64; 5],
    /// Drive at which the whisker touched, and its standard deviation.
    pub touch: [f64; 2],
    /// Another distance that fits, mm.
    pub near: Option<f64>,
    /// Drive at which readings are farthest off the curve that fits best, and by how many of their standard deviations.
    pub apart: [f64; 2],
}

/// ln a and the drive of the touch.
pub(super) type Place = [f64; 2];

/// A stroke that is told.
pub(super) struct Task<'a> {
    pub joint: &'a Joint,
    pub course: Course,
    pub bins: Vec<Bin>,
    /// Variance of one reading, and of any mean.
    pub noise: [f64; 2],
    /// Ends of the calibrated drives.
    pub drives: [f64; 2],
    /// Weights of the nodes of the drive.
    pub weights: Vec<f64>,
    /// Ends of ln a and of the drive of the touch.
    pub ends: [[f64; 2]; 2],
}

/// Bins beside what is expected of them.
struct Off {
    /// What each is off, in standard deviations of its noise.
    left: DVector<f64>,
    /// These.
    spread: DVector<f64>,
    /// By how many of them what is shared moves each; a column is a bin.
    shared: DMatrix<f64>,
}

/// A likely place.
pub(super) struct Mode {
    pub at: Place,
    pub value: f64,
    /// Deviation of ln a, by how much the touch moves with that, and its deviation with ln a held.
    pub shape: [f64; 3],
}

impl Stroke {
    /// What the readings so far tell; `None` where no contact is seen.
    pub fn told(&mut self, joint: &Joint, course: Course) -> Option<Told> {
        let task = Task::new(self, joint, course, self.bins(BINS))?;
        // What was likely a few readings ago is so still.
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
        if course.touch.is_none() && none - best.value < SEEN {
            return None;
        }
        let (apart, excess) = task.misfit(best.at)?;
        // Readings that no curve explains tell it less well than they scatter.
        let noise = task.noise.map(|v| v * excess);
        let task = Task { noise, ..task };
        if excess > 2.0 {
            modes = modes.iter().filter_map(|mode| task.mode(mode.at, NEAR_IT)).collect();
        }
        let least = modes.iter().map(|mode| task.value(mode.at)).fold(f64::INFINITY, f64::min);
        let told: Vec<(f64, [f64; 5], Place)> =
            modes.iter().take(3).filter_map(|mode| task.posterior(mode, least)).collect();
        let all: f64 = told.iter().map(|t| t.0).sum();
        // As of several taps, the farthest that is likely is answered.
        let mut likely: Vec<_> = told.into_iter().filter(|t| t.0 >= SECOND * all).collect();
        likely.sort_by(|p, q| q.1[2].total_cmp(&p.1[2]));
        let (_, a, touch) = *likely.first()?;
        Some(Told { a, touch, near: likely.get(1).map(|t| t.1[2]), apart })
    }
}

impl<'a> Task<'a> {
    pub fn new(stroke: &Stroke, joint: &'a Joint, course: Course, bins: Vec<Bin>) -> Option<Self> {
        let nodes = &joint.inverse.nodes;
        let ends = [f64::min, f64::max].map(|of| nodes.iter().copied().reduce(of));
        let drives = [ends[0]?.exp() - joint.inverse.offset, ends[1]?.exp() - joint.inverse.offset];
        let [first, last] = stroke.drives()?;
        // The last reading is of a calibrated tap, or one before it.
        let from = (last - drives[1] - joint.offset[0]).min(first - drives[0]).max(course.least.min(last));
        let touch = course.touch.map_or([from, last], |c| [c, c]);
        let ends = [[joint.x(0), joint.x(POINTS - 1)], touch];
        let weights = node_weights(nodes.len()).collect();
        Some(Self { joint, course, bins, noise: stroke.noise(joint), drives, weights, ends })
    }

    /// Number of what is shared.
    fn shared(&self) -> usize {
        self.joint.of_run.len() + OWN
    }

    /// What is expected at ln a = x, over the nodes of the drive.
    pub fn across(&self, x: f64) -> Vec<Vec<f64>> {
        let (k, t) = self.joint.place(x);
        let (weights, width) = (lagrange(t), self.joint.width());
        let of = |row: &Vec<f64>| {
            let near = row[k * width..(k + NEAR) * width].chunks(width);
            near.zip(weights).fold(vec![0.0; width], |mut sum, (point, w)| {
                sum.iter_mut().zip(point).for_each(|(sum, x)| *sum += w * x);
                sum
            })
        };
        self.joint.table.iter().map(of).collect()
    }

    /// Of a tap by the drive v: signal, variance of its noise, and shared numbers.
    fn tap(&self, across: &[Vec<f64>], v: f64) -> Vec<f64> {
        let inverse = &self.joint.inverse;
        let u = v + inverse.offset;
        let mut all = vec![0.0; self.joint.width()];
        let x = u.ln();
        let mut total = 0.0;
        for ((node, w), values) in inverse.nodes.iter().zip(&self.weights).zip(across) {
            let gap = x - node;
            if gap == 0.0 {
                (all, total) = (values.clone(), 1.0);
                break;
            }
            total += w / gap;
            all.iter_mut().zip(values).for_each(|(sum, x)| *sum += w / gap * x);
        }
        all.iter_mut().for_each(|x| *x *= u / total);
        all[1] = (all[1] * u).max(f64::MIN_POSITIVE);
        all
    }

    /// The signal of such a tap.
    fn signal(&self, across: &[Vec<f64>], v: f64) -> f64 {
        let inverse = &self.joint.inverse;
        let u = v + inverse.offset;
        let (mut sum, mut total) = (0.0, 0.0);
        for ((node, w), values) in inverse.nodes.iter().zip(&self.weights).zip(across) {
            let gap = u.ln() - node;
            if gap == 0.0 {
                return values[0] * u;
            }
            sum += w / gap * values[0];
            total += w / gap;
        }
        sum / total * u
    }

    /// The bins where the touch is there.
    fn at(&self, across: &[Vec<f64>], touch: f64) -> Off {
        let joint = self.joint;
        let width = joint.width();
        let [lo, hi] = self.drives;
        let ends = self.drives.map(|v| self.tap(across, v));
        let [mean, sd] = joint.offset;
        // Of the calibrated drives beyond the touch.
        let mean = mean.max((LEAST - 1.0) * lo);
        let [from, to] = [lo + mean, hi + mean];
        let rest = &joint.rest;
        let floor = rest[1];
        // In proportion to what is without contact, up to the first calibrated drive, and from the last one on.
        let part = |end: &[f64], share: f64| -> Vec<f64> {
            (0..width).map(|c| rest[c] * (1.0 - share) + end[c] * share).collect()
        };
        let of_run = |c: usize| self.course.same_run && joint.of_run[c];
        let n = self.bins.len();
        let mut off = Off {
            left: DVector::zeros(n),
            spread: DVector::zeros(n),
            shared: DMatrix::zeros(self.shared(), n),
        };
        for (k, bin) in self.bins.iter().enumerate() {
            let since = bin.u - touch;
            let values = match since {
                s if s <= 0.0 => rest.clone(),
                s if s < from => part(&ends[0], s / from),
                s if s > to => part(&ends[1], s / to),
                s => self.tap(across, s - mean),
            };
            let signal = values[0] - rest[0];
            let slope = match since {
                s if s <= 0.0 => 0.0,
                // A touch that comes earlier before the calibrated drives makes the way to them less steep.
                s if s < from => signal / from,
                s if s > to => signal / to,
                s => (self.signal(across, (1.0 + STEP) * (s - mean)) - values[0]) / (STEP * (s - mean)),
            };
            let toe = if since > 0.0 && since < from { TOE * (1.0 - since / from) } else { 0.0 };
            let beyond = if since > to { BEYOND * (1.0 - to / since) } else { 0.0 };
            // Noise of a tap that goes with its signal is a gain of the stroke.
            let relative = if since > 0.0 { (values[1] - floor).max(0.0).sqrt() } else { 0.0 };
            let moved = sd * slope;
            let own =
                [relative, floor.sqrt(), self.course.of_zero.sqrt(), toe * signal, beyond * signal, moved];
            let sd = (self.noise[0] / bin.n + self.noise[1]).sqrt();
            off.left[k] = (bin.y - values[0]) / sd;
            off.spread[k] = sd;
            let common = values[2..].iter().enumerate().map(|(c, x)| if of_run(c) { 0.0 } else { *x });
            let mut column = off.shared.column_mut(k);
            column.iter_mut().zip(common.chain(own)).for_each(|(to, x)| *to = x / sd);
        }
        off
    }

    /// −2 ln of the posterior.
    pub fn value(&self, at: Place) -> f64 {
        if self.is_inside(at) { self.value_of(&self.across(at[0]), at) } else { f64::INFINITY }
    }

    fn is_inside(&self, at: Place) -> bool {
        (0..2).all(|k| at[k] >= self.ends[k][0] && at[k] <= self.ends[k][1])
    }

    pub fn value_of(&self, across: &[Vec<f64>], at: Place) -> f64 {
        if !self.is_inside(at) {
            return f64::INFINITY;
        }
        self.solved(&self.at(across, at[1])).map_or(f64::INFINITY, |s| s.0 - 2.0 * self.joint.prior(at[0]))
    }

    /// −2 ln of the likelihood, and what is shared.
    fn solved(&self, off: &Off) -> Option<(f64, DVector<f64>)> {
        let n = self.shared();
        let a = DMatrix::identity(n, n) + &off.shared * off.shared.transpose();
        let b = &off.shared * &off.left;
        let factor = a.cholesky()?;
        let ln_det = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        let solved = factor.solve(&b);
        let ln_spread = 2.0 * off.spread.iter().map(|x| x.ln()).sum::<f64>();
        let value = off.left.norm_squared() + ln_spread - b.dot(&solved) + ln_det;
        value.is_finite().then_some((value, solved))
    }

    /// Mass of the posterior around `mode`, over that at `least`, shares of it, and the touch.
    fn posterior(&self, mode: &Mode, least: f64) -> Option<(f64, [f64; 5], Place)> {
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
            // At its own ends the posterior may be cut.
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
        None
    }

    /// Drive at which readings next to each other are farthest off, by how many standard deviations, and by what variances are to be multiplied.
    fn misfit(&self, at: Place) -> Option<([f64; 2], f64)> {
        let off = self.at(&self.across(at[0]), at[1]);
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
        let freedom = (left.len() as f64 - 3.0).max(1.0);
        let excess = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0).sqrt();
        // Many residuals tell the scatter better than differences between neighbours do.
        let judged = excess > SMOOTH || left.len() >= JUDGED;
        Some((most, if judged { chi2 / freedom } else { 1.0 }))
    }
}
