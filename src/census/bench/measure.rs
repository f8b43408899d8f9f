//! The steps of a benchmark, measured.

use std::sync::atomic::{AtomicBool, Ordering};

use super::probe::Probe;
use super::stopwatch::{Times, repeat};
use super::{Measured, Settings, Solved, Step};
use crate::census::configuration::{self, Configuration};
use crate::census::{Figures, Place, Taps, relative, sample::Row};
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::kernel::{
    Rule, Rung,
    rule::{every_rule, smallest_tolerance},
};
use crate::scene::sampler::Sampler;
use crate::scene::{BackendChoice, Precision, RunOptions, Tuple};

/// What a benchmark tells while it runs.
pub enum News {
    /// A step begins: its number, from 1, and what it measures.
    Begun(usize, String),
    /// A measurement is made.
    Made(Box<Measured>),
}

/// Takes the `steps` of `settings` on `places`; the first of a configuration is that of the reference.
///
/// # Errors
/// A device that fails; [`SolveError::Stopped`] once `stop` is set.
pub fn measure(
    settings: &Settings,
    steps: Vec<Step>,
    places: &[Place],
    stop: &AtomicBool,
    tell: &mut dyn FnMut(News),
) -> Result<(), Error> {
    let mut judge: Option<Judge> = None;
    for (n, step) in steps.into_iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            return Err(SolveError::Stopped.into());
        }
        tell(News::Begun(n + 1, step.words(places)));
        let measured = match &judge {
            Some(judge) if step.solved != Solved::Reference => {
                let place = &places[step.place];
                judge.point(step, place, settings.repeats)?
            }
            _ => {
                let (new, point) = Judge::new(settings, step)?;
                judge = Some(new);
                point
            }
        };
        tell(News::Made(Box::new(measured)));
    }
    Ok(())
}

/// About `count` taps of `c`, the same ones for every configuration: whiskers of L_a = 50 mm with a gauge of 2 mm at 5 mm, spread over
/// D 8–12 mm, d 2–7 mm and θ 0.5–10° by Sobol points, each tapped at 8 distances from 20 to 48 mm.
pub fn taps(c: &Configuration, count: usize) -> Taps {
    let distances: std::sync::Arc<[f64]> = (0..8).map(|i| 20.0 + 4.0 * f64::from(i)).collect();
    let row = |k: u32| {
        let at = |dimension, from: f64, to: f64| {
            from + (to - from) * f64::from(Sampler::Sobol.coordinate(1, dimension, k)) / 2f64.powi(32)
        };
        let (big, tip, drive) = (at(0, 8.0, 12.0), at(1, 2.0, 7.0), at(2, 0.5, 10.0));
        let point =
            Tuple { D: big, d: tip, L_a: 50.0, x_ss: 5.0, l: 2.0, a: f64::NAN, drive, ..Tuple::default() };
        Row::new(point, distances.clone())
    };
    let whiskers = count.div_ceil(distances.len()).max(1) as u32;
    Taps::of_rows(&c.setup, &(0..whiskers).map(row).collect::<Vec<_>>())
}

/// The taps of a configuration with the answers of the reference.
struct Judge {
    compared: Taps,
    answers: Vec<Outcome>,
    /// Taps on which kernels are timed, of which the first are compared.
    timed: Taps,
}

impl Judge {
    /// Solves the taps of a step by the reference, and by cpu f64 as far as that goes: two methods that share nothing. Also the reference's own point.
    fn new(settings: &Settings, step: Step) -> Result<(Self, Measured), Error> {
        let c = &step.configuration;
        let compared = taps(c, settings.compared);
        let (answers, times) = repeat(1, || compared.answers(Method::Reference))?;
        let times = times.per(answers.len());
        let timed = taps(c, settings.timed_of(c).max(answers.len()));
        let other = (BackendChoice::Cpu, Precision::F64, None);
        let other =
            Place::new(&RunOptions::default(), other, None)?.at(smallest_tolerance(Precision::F64))?;
        let other = compared.answers(other.open(&compared.setup.model)?)?;
        let judge = Self { compared, answers, timed };
        let point = judge.compare(&other, step, (times, [None; 2]));
        Ok((judge, Measured { taps: point.taps - point.failed, failed: 0, ..point }))
    }

    /// The measurement of a `step` that took these times of a tap, of its kernel alone, and its sweeps; the taps `found` are compared.
    fn compare(&self, found: &[Outcome], step: Step, (times, [kernel, sweeps]): Spent) -> Measured {
        let (mut taps, mut failed, mut errors) = (0, 0, Vec::new());
        for (i, (answer, found)) in self.answers.iter().zip(found).enumerate() {
            if !answer.strain.is_finite() {
                continue;
            }
            taps += 1;
            if found.strain.is_finite() {
                let size = answer.strain.abs().max(self.compared.least(i));
                errors.push((relative((found.strain - answer.strain).abs(), size), i));
            } else {
                failed += 1;
            }
        }
        Measured { step, times, taps, failed, kernel, sweeps, errors: Figures::new(errors, f64::INFINITY) }
    }

    /// The point of `step`, at `place`.
    fn point(&self, step: Step, place: &Place, repeats: usize) -> Result<Measured, Error> {
        let asked = step.tolerance.or(place.backend().tolerance).unwrap_or(1e-5);
        // The closed forms are those of the first configuration.
        let linear =
            (step.solved == Solved::Linear).then(|| taps(&configuration::all()[0], self.timed.tasks.len()));
        let timed = linear.as_ref().unwrap_or(&self.timed);
        let model = &timed.setup.model;
        let (rungs, tolerance, alone) = match step.solved {
            Solved::Nodes(nodes) => {
                let rule = rule(place.precision, nodes);
                (vec![Rung::new(rule, place.precision, &model.material, asked)], 1.0, Some(asked))
            }
            _ => match place.at(asked)?.open(model)? {
                Method::Fast { rungs, .. } => (rungs, asked, None),
                Method::Reference => (Vec::new(), asked, None),
            },
        };
        let (outcomes, (times, spent)) = fast(timed, place, repeats, (rungs, tolerance, alone))?;
        // Closed forms need no kernel.
        let spent = if linear.is_some() { [None; 2] } else { spent };
        Ok(self.compare(&outcomes, step, (times, spent)))
    }
}

/// Nanoseconds of a tap, of its kernel alone, and its sweeps.
type Spent = (Times, [Option<f64>; 2]);

/// The rule of the ladder with `nodes`, or its first with another number of them.
fn rule(precision: Precision, nodes: usize) -> Rule {
    let ladder = every_rule(precision);
    let known = ladder.iter().find(|r| r.nodes == nodes);
    known.copied().unwrap_or(Rule { nodes, ..ladder[0] })
}

/// Times `taps` on `place` on `rungs`, to a tolerance. `alone`: the only rung, solved to that tolerance, all its answers taken.
fn fast(
    taps: &Taps,
    place: &Place,
    repeats: usize,
    (rungs, tolerance, alone): (Vec<Rung>, f64, Option<f64>),
) -> Result<(Vec<Outcome>, Spent), Error> {
    let (probe, account) = Probe::new(place.choice.solver()?, alone);
    let method = Method::Fast { solver: Box::new(probe), rungs, tolerance };
    let mut evaluator = Evaluator::new(&taps.setup, method);
    let mut run = || evaluator.run(&taps.designs, &taps.tasks);
    // The first run pays for pipelines and buffers.
    run()?;
    account.take();
    let (mut seconds, mut sweeps, n) = (f64::INFINITY, 0.0, taps.tasks.len());
    let (outcomes, times) = repeat(repeats, || {
        let outcomes = run();
        let spent = account.take();
        seconds = spent.seconds.min(seconds);
        sweeps = spent.sweeps;
        outcomes
    })?;
    Ok((outcomes, (times.per(n), [Some(1e9 / n as f64 * seconds), Some(sweeps / n as f64)])))
}
