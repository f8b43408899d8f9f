//! The best tap angle of one whisker: K_sd, bias, noise and total against the drive, the optimum, and what limits it.
//!
//! Without noise the smallest angle is best, for all that is wrong grows with θ²; the error by noise falls with 1/θ, so with noise there is
//! an optimum inside, unless the gauge's strain limit comes first. The curve is evaluated in f64 on an even grid; around every
//! local minimum of it the optimum is polished by Brent's method, and where a limit cuts the interval its end is found by
//! bisection.

mod curve;
mod needed;
mod optimum;
mod tried;
mod write;

use std::sync::atomic::AtomicBool;

use crate::backend::{Backend, Choice};
use crate::census::needed::Needed;
use crate::curve::both;
use crate::error::Error;
use crate::optimise::evaluate::Scorer;
use crate::optimise::run::{no_axes, precise};
use crate::optimise::score::{Goal, Score};
use crate::plan::pays;
use crate::progress::Progress;
use crate::scene::search::{Budget, Limits, Objective, Search};
use crate::scene::{BackendChoice, Contact, Layout, RunOptions, Setup, Study, Theory};
use crate::statistics::DriveRow;

use curve::Curve;
use tried::{COARSE, STEPS, incomplete, overstrained, tried};

use needed::find_needed;
pub use needed::needed;
pub use write::{k_names, result, table, unit};

/// Why the CPU is taken in f64 where nothing is said.
const FEW: &str = "few taps";
/// Taps of the grid, and of the polish, that a kernel may leave to the reference.
const LEFT: [usize; 2] = [600, 1500];
/// Evaluations of one estimator, about.
const EVALUATIONS: u64 = 1200;

/// Taps that a best drive over the distances of `layout` takes, about.
pub fn taps(layout: &Layout) -> u64 {
    EVALUATIONS.saturating_mul(layout.n_distances)
}

/// The curve at one drive.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Degrees or mm.
    pub drive: f64,
    /// Its row of designs.csv.
    pub row: DriveRow,
    /// Its figures and limits.
    pub score: Score,
}

/// What ends the way to something better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitedBy {
    /// Bias is the larger part of the total at an optimum inside.
    Bias,
    /// Noise is.
    Noise,
    /// The gauge's strain limit.
    Strain,
    /// A bound of the interval.
    Bound,
    /// Beyond it a tap has no strain, no root, or slips off.
    CompleteRows,
    /// There a contact turns from sticking to sliding, and what is made small has a kink.
    Friction,
}

impl LimitedBy {
    /// Word in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bias => "bias",
            Self::Noise => "noise",
            Self::Strain => "strain_limit",
            Self::Bound => "bound",
            Self::CompleteRows => "complete_rows",
            Self::Friction => "friction",
        }
    }
}

/// What was found.
#[derive(Debug)]
#[non_exhaustive]
pub struct Report {
    /// The curve on its grid.
    pub curve: Vec<Sample>,
    /// The best drive that keeps the strain limit.
    pub optimum: Sample,
    /// The best drive whatever the strain; `None` never happens where there is an optimum.
    pub unconstrained: Sample,
    /// What limits the optimum.
    pub limited_by: LimitedBy,
    /// Whether it lies at a bound of the interval.
    pub at_bound: bool,
    /// The same in a sentence.
    pub why: String,
    /// What the other estimator would give; `None` where no distance is told, or by two gauges.
    pub other: Option<Other>,
    /// Evaluations spent.
    pub evaluations: u64,
    /// Seconds.
    pub seconds: f64,
    /// Where it was computed.
    pub backend: Backend,
    /// `model_error` of `run.json`, where effects could be left off, and the same in a few lines.
    pub model_error: Option<(serde_json::Value, String)>,
}

/// The best drive where distances are told in another way.
#[derive(Debug)]
pub struct Other {
    /// By what.
    pub theory: Theory,
    /// The best drive that keeps the strain limit, or why there is none.
    pub optimum: Result<Sample, String>,
    /// Whether it lies at a bound of the interval.
    pub at_bound: bool,
}

/// Where a best drive is looked for: what `options` ask for, else, for few taps, the CPU in f64.
///
/// # Errors
/// A backend that the machine does not have.
pub fn choice(options: &RunOptions, study: &Study) -> Result<Choice, Error> {
    let free = matches!(options.backend, None | Some(BackendChoice::Auto) | Some(BackendChoice::Cpu))
        && options.adapter.is_none();
    if free && options.precision.is_none() && options.tolerance.is_none() {
        let mut choice = precise(&RunOptions::default())?;
        choice.backend.reason = FEW.into();
        return Ok(choice);
    }
    Choice::for_work(options, pays::of_study(study, options))
}

/// The best drive within `ends` of the one whisker of `study`, over its distances, and what the other estimator would give; nothing is
/// written. Effects whose joint change of strain stays within `bound`, if there is one, are left off: over the interval, at the optima, and where
/// a status changes from one drive of the curve to the next.
///
/// # Errors
/// Several whiskers' tuple file; rows that are never complete; a strain limit that no drive keeps; a backend that fails; `stop`, set from outside.
pub fn find(
    study: &Study,
    ends: [f64; 2],
    objective: Objective,
    choice: &Choice,
    (bound, stop, progress): (Option<f64>, &AtomicBool, &mut dyn Progress),
) -> Result<Report, Error> {
    let asked = TapAsked { ends, objective, choice, needed: None, stop };
    match bound {
        Some(bound) => find_needed(study, asked, bound, progress),
        None => find_by(study, asked, progress),
    }
}

/// What is asked of a whisker.
#[derive(Clone, Copy)]
struct TapAsked<'a> {
    ends: [f64; 2],
    objective: Objective,
    choice: &'a Choice,
    /// What is needed of the model, which is that of the study then.
    needed: Option<&'a Needed>,
    stop: &'a AtomicBool,
}

/// The best drive by the model of `study`, and what the other estimator would give.
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
    Ok(Report {
        other: Some(other),
        evaluations: report.evaluations + evaluations,
        seconds: report.seconds + seconds,
        ..report
    })
}

/// The best drive by one estimator, on a grid of at most so many `steps`; [`SolveError::TooHard`](crate::error::SolveError::TooHard) where kernels
/// leave too many taps to the reference.
fn best(
    study: &Study,
    asked: TapAsked<'_>,
    steps: f64,
    progress: &mut dyn Progress,
) -> Result<Report, Error> {
    let TapAsked { ends, objective, choice, needed, stop } = asked;
    let begun = std::time::Instant::now();
    let (setup, layout) = (&study.setup, study.space.layout().ok_or_else(no_axes)?);
    let search = search(setup, objective);
    let needed = needed.filter(|n| !n.left().is_empty());
    let full = needed.map(|n| Setup { model: n.full.model, ..setup.clone() });
    let guard = needed.zip(full.as_ref()).map(|(n, full)| n.guard(full)).transpose()?;
    let mut scorer = Scorer::new(setup, &layout, &search, choice.open(&setup.model)?);
    scorer.evaluator = scorer.evaluator.guarded(guard);
    scorer.evaluator.stop = stop;
    let mut curve = Curve::new(scorer, &layout, progress);
    curve.scorer.evaluator.spare = LEFT[0];
    let samples = curve.grid(ends, steps)?;
    curve.scorer.evaluator.spare = LEFT[1];
    let goal = if objective == Objective::Sd { Goal::Figure(0) } else { Goal::Figure(1) };

    let free = |s: &Sample| optimum::relaxed(s, goal);
    let Some(unconstrained) = optimum::find(&mut curve, &samples, goal, &free)? else {
        return Err(incomplete(setup, &samples).into());
    };
    let kept = |s: &Sample| goal.feasible(&s.score);
    // The least of all drives is the least of those that keep the strain limit, where it keeps it.
    let optimum = match kept(&unconstrained) {
        true => Some(unconstrained),
        false => optimum::find(&mut curve, &samples, goal, &kept)?,
    };
    let Some(optimum) = optimum else { return Err(overstrained(setup, &samples).into()) };
    let (mut limited_by, at_bound) = optimum::limited_by(&optimum, ends, objective);
    let inside = matches!(limited_by, LimitedBy::Bias | LimitedBy::Noise);
    if inside
        && matches!(setup.model.contact, Contact::Coulomb(f64::MIN_POSITIVE..))
        && optimum::kinked(&mut curve, &optimum, goal)?
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

/// A search without variables: what a score of the curve needs.
fn search(setup: &Setup, objective: Objective) -> Search {
    let strain = setup.gauge.strain_limit;
    let strain_key = "gauge.strain_limit";
    let limits = Limits { strain, strain_key, force: None, unambiguous: false, tip_not_wider: false };
    Search {
        objective,
        weights: [1.0; 2],
        seed: 0,
        budget: Budget::default(),
        variables: Vec::new(),
        limits,
        robust: None,
    }
}
