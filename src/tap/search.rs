//! Figures of one whisker as functions of its drive, and their smallest value on the part of an interval where a condition holds.
//! The best tap angle, also by a reduced model (`--model-error`), in bounded time: the reference takes up to a second per tap; if kernels leave many
//! taps to it, the search is repeated with a larger tolerance, then with fewer drives, and refused if it would still take minutes.

use std::sync::atomic::AtomicBool;

use super::{EVALUATIONS, FEW, LimitedBy, Report, Sample, TapAsked, best, few, find_by, write};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::census::sample::{Row, choosing_in};
use crate::chart::ranges::Wanted;
use crate::design::Design;
use crate::error::{Error, InputError, SolveError};
use crate::optimise::{Goal, Limit, Scorer, best::narrowed, no_axes};
use crate::progress::{Progress, go_on};
use crate::scene::{Axis, Layout, Objective, RunOptions, Signal, Study, Tuple};

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
        let (whisker, n) = (layout.stroke(&layout.design(0), 0), layout.n_distances);
        let taps = [n, EVALUATIONS.saturating_mul(n)];
        Self { scorer, whisker, taps, progress, evaluations: 0 }
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

/// The best drive for which `allowed` holds, polished; `None` if it holds at none of `samples`.
pub fn least(
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
    let mut sticks = |drive| curve.scorer.sticking(&Tuple { drive, ..curve.whisker });
    Ok(kink && sticks(drives[0])? != sticks(drives[3])?)
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

/// With `bound`, effects are left off whose joint change of strain stays within it: over the interval, at the optima, and where the status changes.
/// Errors: several whiskers, or a tuple file; no complete row; no drive within the strain limit; a failing backend; `stop`.
pub fn find(
    study: &Study,
    ends: [f64; 2],
    objective: Objective,
    choice: &Choice,
    (bound, stop, progress): (Option<f64>, &AtomicBool, &mut dyn Progress),
) -> Result<Report, Error> {
    let asked = TapAsked { ends, objective, choice, needed: None, stop };
    let Some(bound) = bound else { return find_by(study, asked, progress) };
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let (mut needed, mut study) = (needed(study, ends, bound)?, study.clone());
    let whisker = layout.stroke(&layout.design(0), 0);
    let row = Row::over(&layout, layout.n_distances);
    loop {
        study.setup = needed.setup.clone();
        let report = match find_by(&study, TapAsked { needed: Some(&needed), ..asked }, &mut *progress) {
            Err(Error::Input(_)) if !needed.left().is_empty() => {
                needed.give_up();
                continue;
            }
            found => found?,
        };
        // The optima, the ends of the curve, and both sides of each change of status.
        let ends = report.curve.first().into_iter().chain(report.curve.last());
        let other = report.other.as_ref().and_then(|other| other.optimum.as_ref().ok());
        let steps = report.curve.windows(2).filter(|s| s[0].row.status != s[1].row.status).flatten();
        let optima = [&report.optimum, &report.unconstrained].into_iter().chain(other);
        let drives = optima.chain(ends).chain(steps).map(|s| s.drive);
        let rows: Vec<Row> = drives.map(|drive| row(Tuple { drive, ..whisker })).collect();
        if needed.keeps(&rows, true, &|| Ok(go_on(stop)?))? {
            let model_error = Some((needed.summary(), needed.sentence()));
            return Ok(Report { model_error, ..report });
        }
    }
}

pub fn needed(study: &Study, ends: [f64; 2], bound: f64) -> Result<Needed, Error> {
    let layout = study.space.layout().ok_or_else(no_axes)?;
    let wanted = Wanted { drive: ends, ..Wanted::of(&layout) };
    Needed::new(&study.setup, &choosing_in(&wanted, &layout), bound)
}

/// Largest numbers of grid steps, one per attempt. The optimum is polished for any grid.
pub const STEPS: &[f64] = &[1000.0, 200.0, 50.0];
pub const COARSE: &[f64] = &[100.0, 50.0];

pub(super) fn tried(
    study: &Study,
    asked: TapAsked<'_>,
    steps: &[f64],
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let (setup, layout) = (&study.setup, study.space.layout().ok_or_else(no_axes)?);
    let ([nearest, _], shared) = (layout.reach(), Design::new(setup, layout.design(0)).shared);
    let plain = setup.signal == Signal::Strain && setup.channels.is_none();
    // A contact at or before the gauge's near end: no drive gives it a signal.
    if let Some(begins) = shared.map(|shared| shared.gauge[0]).filter(|begins| plain && nearest <= *begins) {
        let name = write::unit(setup).0;
        let error = InputError::new(format!(
            "no {name} gives a complete row: a tap at {nearest} mm does not bend the gauge, which begins at {begins} mm (no_strain)"
        ));
        let allowed = format!("> {begins} mm, or a gauge nearer to the clamp");
        return Err(error.key("tap.a").value(nearest).allowed(allowed).into());
    }
    // A choice for few taps may be too fine: then f64 with its usual tolerance.
    let free = asked.choice.backend.reason == FEW;
    let looser = free.then(|| few(&RunOptions::default())).transpose()?;
    let first = looser.is_some().then_some((asked.choice, steps[0]));
    let then = steps.iter().map(|steps| (looser.as_ref().unwrap_or(asked.choice), *steps));
    for (choice, steps) in first.into_iter().chain(then) {
        match best(study, TapAsked { choice, ..asked }, steps, &mut *progress) {
            Err(Error::Solve(SolveError::TooHard)) => {
                progress.note("many taps of this whisker are hard to solve: again, less finely");
            }
            done => return done,
        }
    }
    let why = "so many taps of this whisker are hard to solve that its best tap would take minutes";
    let allowed = "distances beyond the end of the gauge, a whisker that tapers less; or --backend reference, which takes its time";
    Err(InputError::new(why).key("tap.a").allowed(allowed).into())
}
