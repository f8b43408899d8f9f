//! Figures of one whisker as functions of its drive, and their smallest value on the part of an interval where a condition holds.

use super::{LimitedBy, Sample};
use crate::error::Error;
use crate::optimise::best::narrowed;
use crate::optimise::evaluate::Scorer;
use crate::optimise::score::{Goal, Limit};
use crate::progress::Progress;
use crate::scene::search::Objective;
use crate::scene::{Axis, Layout, Tuple};

const MINIMA: usize = 6;
/// Relative width at which the search for a minimum ends.
const WIDTH: f64 = 1e-9;
/// A limit or bound within this relative distance counts as reached.
const REACHED: f64 = 1e-6;

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

/// True if all limits but the strain limit are kept.
pub fn relaxed(s: &Sample, goal: Goal) -> bool {
    let mut score = s.score;
    score.set(Limit::Strain, f64::NEG_INFINITY);
    goal.feasible(&score)
}

/// The best drive for which `allowed` holds, polished; `None` if it holds at none of `samples`.
pub fn find(
    curve: &mut Curve<'_>,
    samples: &[Sample],
    goal: Goal,
    allowed: &dyn Fn(&Sample) -> bool,
) -> Result<Option<Sample>, Error> {
    let value = |s: &Sample| if allowed(s) { goal.value(&s.score) } else { f64::INFINITY };
    let at = |i: usize| value(&samples[i]);
    let last = samples.len() - 1;
    let mut minima: Vec<usize> = (0..=last)
        .filter(|&i| at(i).is_finite() && (i == 0 || at(i - 1) >= at(i)) && (i == last || at(i + 1) >= at(i)))
        .collect();
    minima.sort_by(|&a, &b| at(a).total_cmp(&at(b)).then(a.cmp(&b)));
    let mut best: Option<Sample> = None;
    for &i in minima.iter().take(MINIMA) {
        let around = [i.saturating_sub(1), i, (i + 1).min(last)].map(|k| samples[k]);
        let found = narrowed(around, WIDTH, |s| s.drive, &value, |drives| curve.at(drives))?;
        if best.as_ref().is_none_or(|best| value(&found) < value(best)) {
            best = Some(found);
        }
    }
    // Where the value falls towards a bound, rounding may put the best beside it.
    let bound = [&samples[0], &samples[last]].into_iter().find(|end| {
        allowed(end) && best.as_ref().is_some_and(|b| (b.drive - end.drive).abs() <= REACHED * end.drive)
    });
    Ok(bound.copied().or(best))
}

/// Smallest relative step of the search for a kink; larger than the error of the taps.
const STEP: f64 = 1e-3;

/// True if friction gives the curve a kink at its minimum `at`: the contact turns from sticking to sliding, and the slope jumps by the same for any
/// step; for a smooth curve the jump halves with the step.
pub fn kinked(curve: &mut Curve<'_>, at: &Sample, goal: Goal) -> Result<bool, Error> {
    let step = curve.scorer.evaluator.tolerance().cbrt().max(STEP);
    let drives = [1.0 - step, 1.0 - 0.5 * step, 1.0 + 0.5 * step, 1.0 + step].map(|by| at.drive * by);
    let values: Vec<f64> = curve.at(&drives)?.iter().map(|s| goal.value(&s.score)).collect();
    let rise = |a: f64, b: f64| a + b - 2.0 * goal.value(&at.score);
    // Rise over the whole step against the half step: 2× for a kink, 4× for a parabola.
    let kink = rise(values[0], values[3]) < 1.5 * 2.0 * rise(values[1], values[2]);
    Ok(kink && curve.turns([drives[0], drives[3]])?)
}

pub fn limited_by(optimum: &Sample, ends: [f64; 2], objective: Objective) -> (LimitedBy, bool) {
    let row = optimum.row.figures();
    let at_bound = ends.iter().any(|end| (optimum.drive - end).abs() <= REACHED * end);
    let others = [Limit::NoStrain, Limit::Slipped, Limit::Root];
    let word = if optimum.score.limit(Limit::Strain) > -REACHED {
        LimitedBy::Strain
    } else if at_bound {
        LimitedBy::Bound
    } else if others.iter().any(|l| optimum.score.limit(*l) > -REACHED) {
        LimitedBy::CompleteRows
    } else if objective != Objective::Sd && row.noise_rms > row.error_rms {
        LimitedBy::Noise
    } else {
        LimitedBy::Bias
    };
    (word, at_bound)
}
