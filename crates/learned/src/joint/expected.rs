//! What readings of a stroke are expected to be.

use nalgebra::{DMatrix, DVector};

use super::course::{Place, Task};
use super::{NEAR, Nuisance, Offset, lagrange};

/// Between no contact and the smallest calibrated drive the signal goes straight, but for this share.
pub(super) const TOE: f64 = 0.05;
/// And bends there by no more than this share, as a whisker's own curve does.
pub(super) const BEND: f64 = 0.01;
/// And beyond the largest one but for this share of what is beyond.
pub(super) const BEYOND: f64 = 0.5;
/// The smallest calibrated drive is at least so much of itself beyond the touch.
const LEAST: f64 = 0.1;
/// Step of a slope over the drive, as a share of it.
const STEP: f64 = 1e-3;

/// Bins beside what is expected of them.
pub(super) struct Off {
    /// What each is off, in standard deviations of its noise.
    pub left: DVector<f64>,
    /// These.
    pub spread: DVector<f64>,
    /// By how many of them what is shared moves each; a column is a bin.
    pub shared: DMatrix<f64>,
}

impl Task<'_> {
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

    /// Of a tap by the drive v: signal, deviation of its noise that goes with it, and shared numbers.
    fn tap(&self, across: &[Vec<f64>], v: f64) -> Vec<f64> {
        let u = v + self.joint.inverse.offset;
        let weights = self.joint.inverse.weights(u);
        let mut all = vec![0.0; self.joint.width()];
        for (w, values) in weights.iter().zip(across) {
            all.iter_mut().zip(values).for_each(|(sum, x)| *sum += w * x);
        }
        all.iter_mut().for_each(|x| *x *= u);
        all[1] = (all[1] * u - self.joint.rest[1]).max(0.0).sqrt();
        all
    }

    /// The signal of such a tap.
    fn signal(&self, across: &[Vec<f64>], v: f64) -> f64 {
        let u = v + self.joint.inverse.offset;
        let weights = self.joint.inverse.weights(u);
        u * weights.iter().zip(across).map(|(w, values)| w * values[0]).sum::<f64>()
    }

    /// The bins where distance and touch are these.
    pub fn at(&self, across: &[Vec<f64>], [x, touch]: Place) -> Off {
        let joint = self.joint;
        let width = joint.width();
        let [lo, hi] = self.drives;
        let ends = self.drives.map(|v| self.tap(across, v));
        let Offset { mean, moved: ref by, own } = joint.offset;
        // Of the calibrated drives beyond the touch.
        let mean = mean.max((LEAST - 1.0) * lo);
        let [from, to] = [lo + mean, hi + mean];
        let floor = joint.rest[1];
        let mut rest = joint.rest.clone();
        rest[1] = 0.0;
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
            let toe = if since > 0.0 && since < from { 1.0 - since / from } else { 0.0 };
            let bend = BEND * toe * since / from;
            let toe = TOE * toe;
            let beyond = if since > to { BEYOND * (1.0 - to / since) } else { 0.0 };
            // Where the drives of the calibration begin is learned with its curve: whichever it is, contact begins where it is seen.
            let moved = own * slope;
            // Noise of a tap that goes with its signal is a gain of the stroke.
            let own = [
                values[1],
                floor.sqrt(),
                self.course.of_zero.sqrt(),
                toe * signal,
                bend * signal,
                beyond * signal,
                moved,
            ];
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
