//! Posterior of a stroke: of the distance, and of the drive at which the whisker touched.
//! Above the touch c, a reading at drive u is that of a tap at u − c − o, with the offset o of the calibrated drives. The readings share c, o, the
//! errors of calibration and run ([`Joint`]), a gain and a zero; only the scatter within the stroke is noise.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::expected::Off;
use super::stroke::Bin;
use super::{Joint, Nuisance, SECOND, Stroke};
use crate::evidence::ln_det;
use crate::invert::POINTS;

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
}

impl<'a> Task<'a> {
    pub fn new(stroke: &Stroke, joint: &'a Joint, course: Course<'a>, bins: Vec<Bin>) -> Option<Self> {
        let nodes = &joint.inverse.nodes;
        let ends = [f64::min, f64::max].map(|of| nodes.iter().copied().reduce(of));
        let drives = [ends[0]?.exp() - joint.inverse.offset, ends[1]?.exp() - joint.inverse.offset];
        let [first, last] = stroke.drives()?;
        let from = (last - PAST * (drives[1] + joint.offset.mean))
            .min(first - drives[0])
            .max(course.least.min(last));
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
}
