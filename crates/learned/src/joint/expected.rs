//! Expected readings of a stroke.

use nalgebra::{DMatrix, DVector};

use super::course::{Place, Task};
use super::{NEAR, Nuisance, Offset};
use crate::invert::{blend, lagrange};

/// Uncertainty, as a share of the signal, of the straight line between touch and smallest calibrated drive.
pub(super) const TOE: f64 = 0.05;
pub(super) const BEND: f64 = 0.01;
/// Uncertainty of the line beyond the largest calibrated drive, as a share of the excess.
pub(super) const BEYOND: f64 = 0.5;
/// The smallest calibrated drive is at least this share of itself beyond the touch.
const LEAST: f64 = 0.1;
const STEP: f64 = 1e-3;

pub(super) struct Off {
    /// Deviation of each bin, in standard deviations of its noise.
    pub left: DVector<f64>,
    pub spread: DVector<f64>,
    /// Change by each shared number, in standard deviations; a column for each bin.
    pub shared: DMatrix<f64>,
}

impl Task<'_> {
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

    fn signal(&self, across: &[Vec<f64>], v: f64) -> f64 {
        let u = v + self.joint.inverse.offset;
        let weights = self.joint.inverse.weights(u);
        u * weights.iter().zip(across).map(|(w, values)| w * values[0]).sum::<f64>()
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
        let mut off = Off {
            left: DVector::zeros(n),
            spread: DVector::zeros(n),
            shared: DMatrix::zeros(self.shared(), n),
        };
        for (k, bin) in self.bins.iter().enumerate() {
            let since = bin.u - touch;
            let (values, slope) = match since {
                s if s <= 0.0 => (rest.clone(), 0.0),
                s if s < from => part(&ends[0], s, from),
                s if s > to => part(&ends[1], s, to),
                s => {
                    let (v, values) = (s - mean, self.tap(across, s - mean));
                    let slope = (self.signal(across, (1.0 + STEP) * v) - values[0]) / (STEP * v);
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
