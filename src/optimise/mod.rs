//! Design search: whisker, gauge and tap with the smallest distance error, within the limits of a rig.
//!
//! A candidate is a design with a drive. Its figures are K_sd and total_rms_mm, or their mean or worst tenth over sampled whiskers. Mostly a limit
//! binds at the optimum, so limits are rules of comparison ([`score`]), not penalties, and the polish models each limit like the objective. Each
//! start ([`global`]) is a particle swarm on the chosen backend, one batch per step, then a polish of its best candidates in f64 ([`mod@polish`]).
//! Starts grow, and end when several agree. The result is a deterministic function of spec and seed. Cost: about 1 000 evaluations in the first
//! start, 9 000 from the fourth on; a polish takes some 15 steps of 2k + k(k − 1)/2 + 3 evaluations for k variables.

pub mod best;
pub mod evaluate;
pub mod front;
pub mod global;
mod judge;
pub mod polish;
pub mod report;
pub mod score;
pub mod sensitivity;
pub mod session;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use crate::backend::Choice;
use crate::census::Row;
use crate::census::needed::Needed;
use crate::census::sample::choosing_in;
use crate::curve::both;
use crate::error::{Error, InputError};
use crate::plan::TRIED;
use crate::progress::NEVER;
use crate::scene::{BackendChoice, Objective, Precision, RunOptions, Search, Spec, Tuple};
use evaluate::{batch, wanted};
use front::Front;
use report::{infeasible, shortfall};

pub use evaluate::Scorer;
pub use report::Report;
pub use score::{Goal, Limit, Score};
pub use session::{Ended, Found, Halt, Place, Session, Stage, Step, Variables, Watch};

pub const TOLERANCE: f64 = 1e-10;
/// A limit within this distance binds; the second value is for sampled whiskers, whose quantile has kinks.
const BINDING: [f64; 2] = [-1e-5, -5e-3];
const AGAIN: usize = 64;

/// Time for the sensitivities once the time of the search is spent: seconds, or a share of it.
const MORE: (f64, f64) = (1.0, 0.1);

fn goal(objective: Objective) -> Goal {
    match objective {
        Objective::Sd => Goal::Figure(0),
        Objective::Distance | Objective::Pareto => Goal::Figure(1),
        Objective::Weighted => Goal::Figure(2),
    }
}

pub fn precise(options: &RunOptions) -> Result<Choice, Error> {
    let backend = options.backend.filter(|b| *b == BackendChoice::Reference).or(Some(BackendChoice::Cpu));
    let (precision, tolerance) = (Some(Precision::F64), Some(TOLERANCE));
    let mut choice = Choice::new(&RunOptions { backend, precision, tolerance, ..RunOptions::default() })?;
    choice.backend.reason = "f64 for the polish".into();
    Ok(choice)
}

pub fn needed(spec: &Spec, search: &Search, bound: f64) -> Result<Needed, Error> {
    if search.robust.as_ref().is_some_and(|robust| !robust.properties.is_empty()) {
        let why = "with tolerances of the rig which effects it needs is not one answer";
        let allowed = "tolerances of D, d, L_a, x_ss, l and the drive alone, or no --model-error";
        return Err(InputError::new(why).key("--model-error").value(bound).allowed(allowed).into());
    }
    let layout = spec.study.space.layout().ok_or_else(no_axes)?;
    let wanted = wanted(&layout, search, &Variables::new(&spec.study.setup, &layout, search));
    Needed::new(&spec.study.setup, &choosing_in(&wanted, &layout), bound)
}

/// Swarms use the reduced model `needed`, if given; polish and figures use the full model. If the best or the front violate its bound, the swarms are
/// repeated.
/// Errors: no design keeps the limits; the search ended before any did; a backend failed.
pub fn find(
    spec: &Spec,
    search: &Search,
    (choice, options, mut needed): (&Choice, &RunOptions, Option<Needed>),
    stop: &AtomicBool,
    watch: &mut dyn Watch,
) -> Result<Report, Error> {
    let begun = Instant::now();
    let (setup, layout) = (&spec.study.setup, spec.study.space.layout().ok_or_else(no_axes)?);
    let precise = &precise(options)?;
    let variables = Variables::new(&spec.study.setup, &layout, search);
    let wanted = wanted(&layout, search, &variables);
    let fewer = needed.as_ref().map(|n| n.setup.clone());
    let of_swarm = |needed: Option<&Needed>| match (needed, &fewer) {
        (Some(n), Some(fewer)) if n.fallbacks == 0 => fewer,
        _ => setup,
    };
    let scorer = |choice: &Choice, setup| {
        let mut scorer = Scorer::new(setup, &layout, search, choice.open(&setup.model)?);
        // Taps near no equilibrium get no distance; the reference would need seconds for each.
        scorer.referral.far = false;
        scorer.batch = batch(&choice.backend);
        Ok::<_, Error>(scorer)
    };
    let before = choice.seconds + needed.as_ref().map_or(0.0, |n| n.seconds[0]);
    let mut chart = None;
    let mut swarm = |setup| {
        let (scorer, charting) = (scorer(choice, setup)?, Instant::now());
        let (scorer, charted) = scorer.charted(&layout, &wanted, choice)?;
        let seconds = charting.elapsed().as_secs_f64();
        if charted || seconds > TRIED {
            chart = Some(chart.unwrap_or(0.0) + seconds);
        }
        Ok::<_, Error>(scorer)
    };
    let scorers = [swarm(of_swarm(needed.as_ref()))?, scorer(precise, setup)?];
    let taps_each = scorers[0].taps();
    let goal = goal(search.objective);
    let mut session = Session {
        scorers,
        variables: &variables,
        goal,
        budget: search.budget,
        kept_back: 0,
        begun: Instant::now(),
        stop,
        watch,
        start: 0,
        swarms: 0,
        evaluations: 0,
        history: Vec::new(),
        best: [None; 2],
        archive: Vec::new(),
    };

    let (ended, front, best) = loop {
        session.stop_by(stop);
        let (ended, front) = match search.objective {
            Objective::Pareto => front::search(&mut session, search.seed)?,
            _ => (global::ending(global::run(&mut session, goal, search.seed))?, None),
        };
        session.stop_by(&NEVER);
        let best = settle(&mut session, ended, goal)?;
        if let Some(needed) = needed.as_mut().filter(|_| ended != Ended::Interrupted) {
            let found = front.iter().flatten().chain([&best]).map(|f| f.point);
            let rows: Vec<Row> = found.map(Row::over(&layout, layout.n_distances)).collect();
            if !needed.keeps(&rows, ended == Ended::Converged, &|| Ok(()))? {
                session.scorers[0] = swarm(of_swarm(Some(needed)))?;
                continue;
            }
        }
        break (ended, front, best);
    };
    let search_seconds = session.begun.elapsed().as_secs_f64();
    if !goal.feasible(&best.score) {
        if ended == Ended::Converged {
            return Err(infeasible(setup, search, &best.score).into());
        }
        let closest = shortfall(setup, search, &best.score);
        let why =
            format!("ended by {} before a design that keeps the limits was found: {closest}", ended.word());
        return Err(Error::Run(why));
    }
    let mut design = |found: Found| session.scorers[1].design(found);
    let best = design(best)?;
    let front = front.map(|all| all.into_iter().map(&mut design).collect::<Result<_, _>>());
    let front = front.transpose()?.map(Front::new);

    let searched = Instant::now();
    let more = search.budget.seconds.filter(|_| ended == Ended::Seconds).map(|s| (MORE.1 * s).max(MORE.0));
    let on = || !stop.load(Ordering::Relaxed) && more.is_none_or(|s| searched.elapsed().as_secs_f64() < s);
    let sensitivity = sensitivity::run(&mut session.scorers, &variables, &best.point, search.seed, &on)?;
    let asked_to_stop = stop.load(Ordering::Relaxed);
    let one = search.objective.needs_distance() && both::possible(setup);
    let other = || best::judge((setup, &layout), search, precise, (&best.point, goal));
    let other = (one && !asked_to_stop).then(other).transpose()?;
    let binds = |&l: &Limit| best.score.limit(l) > BINDING[usize::from(l == Limit::Samples)];
    Ok(Report {
        value: goal.value(&best.score),
        at_bounds: variables.at_bounds(&best.point),
        best,
        ended,
        starts: session.swarms,
        evaluations: session.evaluations,
        taps_each,
        seconds: [begun.elapsed().as_secs_f64() + before, search_seconds],
        chart,
        model_error: needed.map(|n| (n.summary(), n.sentence())),
        binding: Limit::ALL.into_iter().filter(binds).collect(),
        other,
        sensitivity,
        front,
        backends: [choice.backend.clone(), precise.backend.clone()],
        history: std::mem::take(&mut session.history),
    })
}

pub fn no_axes() -> InputError {
    InputError::new("this needs axes; the tuples of a file cannot be varied")
        .key("tuples.file")
        .allowed("[whisker], [gauge] and [tap]")
}

fn settle(session: &mut Session<'_>, ended: Ended, goal: Goal) -> Result<Found, Error> {
    let mut best = session.best[1];
    if ended != Ended::Converged {
        session.archive.retain(|(stage, _)| *stage == Stage::Swarm);
        let mut left = session.take();
        left.sort_by(|a, b| goal.compare(&a.score, &b.score));
        left.truncate(AGAIN);
        left.extend(session.best[0].filter(|_| best.is_none() && left.is_empty()));
        let again = session.again(&left.iter().map(|f| f.point).collect::<Vec<Tuple>>())?;
        best = best.into_iter().chain(again).min_by(|a, b| goal.compare(&a.score, &b.score));
    }
    best.ok_or_else(|| Error::Run("the search ended before its first evaluation; nothing was written".into()))
}
