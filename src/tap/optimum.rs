//! The smallest value of a curve on the part of an interval where a condition holds.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error as ArgminError, Executor};
use argmin::solver::brent::BrentOpt;

use super::curve::Curve;
use super::{LimitedBy, Sample};
use crate::error::Error;
use crate::optimise::score::{Goal, Limit};
use crate::scene::search::Objective;

const MINIMA: usize = 6;
/// Relative width at which bisection and Brent's method stop.
const WIDTH: f64 = 1e-9;
/// A limit or bound within this relative distance counts as reached.
const REACHED: f64 = 1e-6;

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
        let low = inner(curve, &samples[i], &samples[i.saturating_sub(1)], allowed)?;
        let high = inner(curve, &samples[i], &samples[(i + 1).min(last)], allowed)?;
        let mut found = vec![samples[i], low, high];
        if high.drive - low.drive > WIDTH * high.drive {
            found.extend(brent(curve, [low.drive, high.drive], goal)?);
        }
        for s in found {
            if value(&s).is_finite() && best.as_ref().is_none_or(|b| value(&s) < value(b)) {
                best = Some(s);
            }
        }
    }
    // Brent's method stops just inside a bound towards which the value falls.
    let bound = [&samples[0], &samples[last]].into_iter().find(|end| {
        allowed(end) && best.as_ref().is_some_and(|b| (b.drive - end.drive).abs() <= REACHED * end.drive)
    });
    Ok(bound.copied().or(best))
}

/// The farthest allowed sample from `from` towards `to`.
fn inner(
    curve: &mut Curve<'_>,
    from: &Sample,
    to: &Sample,
    allowed: &dyn Fn(&Sample) -> bool,
) -> Result<Sample, Error> {
    if allowed(to) {
        return Ok(*to);
    }
    let (mut inside, mut outside) = (*from, to.drive);
    while (outside - inside.drive).abs() > 0.01 * WIDTH * outside.abs() {
        let middle = 0.5 * (inside.drive + outside);
        let sample = curve.at(&[middle])?[0];
        if allowed(&sample) {
            inside = sample;
        } else {
            outside = middle;
        }
    }
    Ok(inside)
}

fn brent(curve: &mut Curve<'_>, [low, high]: [f64; 2], goal: Goal) -> Result<Option<Sample>, Error> {
    let cost = Cost { curve: RefCell::new(curve), goal, failed: RefCell::default() };
    let solver = BrentOpt::new(low, high).set_tolerance(WIDTH, WIDTH * high);
    let run =
        Executor::new(&cost, solver).configure(|state| state.param(low).max_iters(200)).timer(false).run();
    let drive = run.map(|run| run.state.best_param).map_err(|e| e.to_string());
    if let Some(failed) = cost.failed.take() {
        return Err(failed);
    }
    match drive.map_err(Error::Run)? {
        Some(drive) => Ok(curve.at(&[drive])?.first().copied()),
        None => Ok(None),
    }
}

struct Cost<'c, 'a> {
    curve: RefCell<&'c mut Curve<'a>>,
    goal: Goal,
    failed: RefCell<Option<Error>>,
}

impl CostFunction for &Cost<'_, '_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, drive: &f64) -> Result<f64, ArgminError> {
        let sample = self.curve.borrow_mut().at(&[*drive]).map_err(|e| {
            let words = ArgminError::msg(e.to_string());
            self.failed.replace(Some(e));
            words
        })?[0];
        let value = self.goal.value(&sample.score);
        Ok(if value.is_nan() { f64::INFINITY } else { value })
    }
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
