//! The best tap angle of one whisker. Without noise the smallest angle is best, because all deviations grow with θ². The error from noise falls with
//! 1/θ, so with noise the optimum lies inside the interval, unless the strain limit comes first. The curve is evaluated in f64 on an even grid; each
//! local minimum is narrowed down by halving.

mod search;
mod write;

use std::sync::atomic::AtomicBool;

use crate::backend::{Backend, Choice};
use crate::census::needed::Needed;
use crate::curve::both;
use crate::error::{Error, InputError};
use crate::optimise::score::{Goal, Limit, Score};
use crate::optimise::{TOLERANCE, evaluate::Scorer, no_axes};
use crate::plan;
use crate::progress::Progress;
use crate::scene::{
    BackendChoice, Budget, Contact, Limits, Objective, Precision, RunOptions, Search, Setup, Study, Theory,
};
use crate::statistics::DriveRow;
use search::{COARSE, Curve, STEPS, tried};

pub use search::{find, needed};
pub use write::{k_names, result, table, unit};

/// Reason for the CPU in f64 as default.
const FEW: &str = "few taps";
/// Most taps of the grid, and of the polish, that are referred to the reference.
const REFERRED: [usize; 2] = [600, 1500];
const EVALUATIONS: u64 = 1200;

#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Degrees or mm.
    pub drive: f64,
    pub row: DriveRow,
    pub score: Score,
}

vibrissa_core::words! {
    /// The limit that stops the improvement.
    LimitedBy {
        /// Inside the interval; bias is the larger part of the total.
        Bias = "bias",
        /// Inside the interval; noise is the larger part.
        Noise = "noise",
        /// The gauge's strain limit.
        Strain = "strain_limit",
        /// A bound of the interval.
        Bound = "bound",
        /// Beyond it a tap has no strain or no root, or slips off.
        CompleteRows = "complete_rows",
        /// A contact turns from sticking to sliding, which gives the objective a kink.
        Friction = "friction",
    }
}

/// The result of the search.
#[derive(Debug)]
#[non_exhaustive]
pub struct Report {
    /// The curve on its grid.
    pub curve: Vec<Sample>,
    /// The best drive that keeps the strain limit.
    pub optimum: Sample,
    /// The best drive without the strain limit.
    pub unconstrained: Sample,
    /// The limit at the optimum.
    pub limited_by: LimitedBy,
    /// True if it lies at a bound of the interval.
    pub at_bound: bool,
    /// `limited_by` as a sentence.
    pub why: String,
    /// The result of the other estimator; `None` without distances or with two gauges.
    pub other: Option<Other>,
    /// Evaluations spent.
    pub evaluations: u64,
    /// Duration in seconds.
    pub seconds: f64,
    /// The backend that computed it.
    pub backend: Backend,
    /// `model_error` of `run.json`, if effects could be left off, and the same in a few lines of text.
    pub model_error: Option<(serde_json::Value, String)>,
}

/// The best drive by the other estimator.
#[derive(Debug)]
pub struct Other {
    pub theory: Theory,
    /// The best drive within the strain limit, or the reason why it is missing.
    pub optimum: Result<Sample, String>,
    /// True if it lies at a bound of the interval.
    pub at_bound: bool,
}

pub fn choice(options: &RunOptions, study: &Study) -> Result<Choice, Error> {
    let free = matches!(options.backend, None | Some(BackendChoice::Auto) | Some(BackendChoice::Cpu))
        && options.adapter.is_none();
    if free && options.precision.is_none() && options.tolerance.is_none() {
        return few(&RunOptions { tolerance: Some(TOLERANCE), ..RunOptions::default() });
    }
    Choice::for_work(options, plan::of_study(study, options))
}

/// The CPU for few taps, in f64 unless `options` say otherwise.
pub fn few(options: &RunOptions) -> Result<Choice, Error> {
    let precision = options.precision.or(Some(Precision::F64));
    let mut choice =
        Choice::new(&RunOptions { backend: Some(BackendChoice::Cpu), precision, ..options.clone() })?;
    choice.backend.reason = FEW.into();
    Ok(choice)
}

#[derive(Clone, Copy)]
struct TapAsked<'a> {
    ends: [f64; 2],
    objective: Objective,
    choice: &'a Choice,
    needed: Option<&'a Needed>,
    stop: &'a AtomicBool,
}

fn find_by(study: &Study, asked: TapAsked<'_>, progress: &mut dyn Progress) -> Result<Report, Error> {
    let report = tried(study, asked, STEPS, &mut *progress)?;
    if !asked.objective.needs_distance() || !both::possible(&study.setup) {
        return Ok(report);
    }
    let theory = study.setup.estimate.theory.compared();
    let mut study = study.clone();
    study.setup.estimate.theory = theory;
    let (other, evaluations, seconds) = match tried(&study, asked, COARSE, progress) {
        Ok(o) => (Other { theory, optimum: Ok(o.optimum), at_bound: o.at_bound }, o.evaluations, o.seconds),
        Err(Error::Input(why)) => (Other { theory, optimum: Err(why.message), at_bound: false }, 0, 0.0),
        Err(failed) => return Err(failed),
    };
    let (evaluations, seconds) = (report.evaluations + evaluations, report.seconds + seconds);
    Ok(Report { other: Some(other), evaluations, seconds, ..report })
}

/// Fails with [`SolveError::TooHard`](crate::error::SolveError::TooHard) if kernels leave too many taps to the reference.
fn best(study: &Study, of: TapAsked<'_>, steps: f64, progress: &mut dyn Progress) -> Result<Report, Error> {
    let TapAsked { ends, objective, choice, needed, stop } = of;
    let begun = std::time::Instant::now();
    let (setup, layout) = (&study.setup, study.space.layout().ok_or_else(no_axes)?);
    let strain_key = "gauge.strain_limit";
    let strain = setup.gauge.strain_limit;
    let limits = Limits { strain, strain_key, force: None, unambiguous: false, tip_not_wider: false };
    let (weights, budget, variables) = ([1.0; 2], Budget::default(), Vec::new());
    let search = Search { objective, weights, seed: 0, budget, variables, limits, robust: None };
    let needed = needed.filter(|n| !n.left().is_empty());
    let full = needed.map(|n| Setup { model: n.full.model, ..setup.clone() });
    let guard = needed.zip(full.as_ref()).map(|(n, full)| n.guard(full)).transpose()?;
    let mut scorer = Scorer::new(setup, &layout, &search, choice.open(&setup.model)?);
    scorer.evaluator = scorer.evaluator.guarded(guard);
    scorer.evaluator.stop = stop;
    let mut curve = Curve::new(scorer, &layout, progress);
    curve.scorer.referral.most = REFERRED[0];
    let samples = curve.grid(ends, steps)?;
    curve.scorer.referral.most = curve.scorer.evaluator.referred + REFERRED[1];
    let goal = if objective == Objective::Sd { Goal::Figure(0) } else { Goal::Figure(1) };

    // All limits but that of the strain.
    let free = |s: &Sample| {
        let mut score = s.score;
        score.set(Limit::Strain, f64::NEG_INFINITY);
        goal.feasible(&score)
    };
    let name = unit(setup).0;
    let Some(unconstrained) = search::least(&mut curve, &samples, goal, &free)? else {
        let status = samples.iter().fold(samples[0].row.status, |all, s| all | s.row.status);
        let why = format!("no {name} of the interval gives a complete row; the taps are {status}");
        let allowed = "distances beyond the gauge and before the tip";
        return Err(InputError::new(why).key("tap.a").allowed(allowed).into());
    };
    let kept = |s: &Sample| goal.feasible(&s.score);
    let optimum = match kept(&unconstrained) {
        true => Some(unconstrained),
        false => search::least(&mut curve, &samples, goal, &kept)?,
    };
    let Some(optimum) = optimum else {
        let over = samples.iter().map(|s| s.score.limit(Limit::Strain)).fold(f64::INFINITY, f64::min);
        // Strain of the skin; a foil reads less.
        let (times, limit) = (1.0 + over, setup.gauge.strain_limit);
        let least = limit * times;
        let error = InputError::new(format!(
            "every {name} of the interval strains the gauge beyond its limit: at least {least:.4}, {times:.3} times the limit"
        ));
        let error = error.key("gauge.strain_limit").value(limit);
        return Err(error.allowed(format!("≥ {least:.4}, or a smaller {name}")).into());
    };
    let (mut limited_by, at_bound) = search::limited_by(&optimum, ends, objective);
    let inside = matches!(limited_by, LimitedBy::Bias | LimitedBy::Noise);
    if inside
        && matches!(setup.model.contact, Contact::Coulomb(f64::MIN_POSITIVE..))
        && search::kinked(&mut curve, &optimum, goal)?
    {
        limited_by = LimitedBy::Friction;
    }
    let mut report = Report {
        why: String::new(),
        curve: samples,
        optimum,
        unconstrained,
        limited_by,
        at_bound,
        other: None,
        evaluations: curve.evaluations,
        seconds: begun.elapsed().as_secs_f64(),
        backend: choice.backend.clone(),
        model_error: None,
    };
    report.why = write::why(setup, &report, ends, objective);
    Ok(report)
}
