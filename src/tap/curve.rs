//! Figures of one whisker as functions of its drive.

use super::Sample;
use crate::error::Error;
use crate::optimise::evaluate::Scorer;
use crate::progress::Progress;
use crate::scene::Layout;
use crate::scene::{Axis, Tuple};

pub struct Curve<'a> {
    pub scorer: Scorer<'a>,
    whisker: Tuple,
    taps: [u64; 2],
    progress: &'a mut dyn Progress,
    pub evaluations: u64,
}

impl<'a> Curve<'a> {
    pub fn new(scorer: Scorer<'a>, layout: &Layout, progress: &'a mut dyn Progress) -> Self {
        Self {
            scorer,
            whisker: layout.stroke(&layout.design(0), 0),
            taps: [layout.n_distances, super::taps(layout)],
            progress,
            evaluations: 0,
        }
    }

    pub fn turns(&mut self, drives: [f64; 2]) -> Result<bool, Error> {
        let [before, after] = drives.map(|drive| self.scorer.sticking(&Tuple { drive, ..self.whisker }));
        Ok(before? != after?)
    }

    /// Samples at these drives, degrees or mm.
    pub fn at(&mut self, drives: &[f64]) -> Result<Vec<Sample>, Error> {
        self.evaluations += drives.len() as u64;
        let all = self.scorer.along(&self.whisker, drives)?;
        let [each, most] = self.taps;
        let done = each.saturating_mul(self.evaluations);
        self.progress.at(done, most.max(done));
        Ok(drives.iter().zip(all).map(|(&drive, (row, score))| Sample { drive, row, score }).collect())
    }

    /// Samples from end to end in at most `steps` steps of 1, 2 or 5 times a power of ten, with both ends.
    pub fn grid(&mut self, [from, to]: [f64; 2], steps: f64) -> Result<Vec<Sample>, Error> {
        let least = (to - from) / steps;
        let power = 10f64.powf(least.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= least * (1.0 - 1e-9));
        // Printed and parsed, so that the step is a decimal number.
        let step: f64 = format!("{:e}", step.unwrap_or(least)).parse().unwrap_or(least);
        let mut drives: Vec<f64> = Axis::step(from, to, step)?.iter().collect();
        if drives.last() != Some(&to) {
            drives.push(to);
        }
        self.at(&drives)
    }
}
