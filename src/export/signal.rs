//! What of an estimator is exported: one side, cut to the distances that matter.

use crate::estimator::Forward;
use crate::locate::opened::Opened;

/// How far beyond the range an export knows distances, in shares of it. A distance more than half of it away is always outside.
const BEYOND: f64 = 0.55;

/// The signal of one side over distance and drive.
pub struct Signal<'a> {
    /// The estimator.
    pub of: &'a dyn Forward,
    /// Calibrated drives, ascending.
    pub drives: &'a [f64],
    /// Calibrated distances, mm.
    pub distances: [f64; 2],
    /// Standard deviation of one reading.
    pub noise: f64,
    /// Where the estimator's distances are cut, mm; infinite where they are not.
    pub cut: f64,
}

impl<'a> Signal<'a> {
    /// Of `side`. `length` is that of the whisker, mm.
    pub fn new(of: &'a dyn Forward, side: &'a Opened, noise: f64, length: f64) -> Self {
        let [first, last] = side.distances;
        let cut = (last + BEYOND * (last - first)).max(1.1 * length).max(1.01 * side.interest[1]);
        let ends = [side.drives[0], side.drives[side.drives.len() - 1]];
        let beyond = ends.iter().any(|d| of.knots(*d).last().is_some_and(|k| *k > cut));
        let cut = if beyond { cut } else { f64::INFINITY };
        Self { of, drives: &side.drives, distances: side.distances, noise, cut }
    }

    /// Distances, ascending, mm, between which the signal is smooth at drives near `drive`.
    pub fn knots(&self, drive: f64) -> Vec<f64> {
        let mut knots = self.of.knots(drive);
        if self.cut.is_finite() {
            knots.retain(|k| *k < self.cut);
            knots.push(self.cut);
        }
        knots
    }
}
