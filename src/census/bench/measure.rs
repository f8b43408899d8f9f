//! The steps of a benchmark, measured.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::probe::{Account, Probe};
use super::stopwatch::{Times, repeat};
use super::{Measured, Settings, Shape, Solved, Step, What, exact};
use crate::census::configuration::{self, Configuration};
use crate::census::{Figures, Place, Taps, relative, sample::Row};
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::kernel::{
    Rule, Rung,
    rule::{every_rule, smallest_tolerance},
};
use crate::plan::Plan;
use crate::progress::Silent;
use crate::scene::axis::Points;
use crate::scene::sampler::Sampler;
use crate::scene::{Axis, BackendChoice, Output, Precision, RunOptions, Space, Spec, Study};
use crate::sweep::{self, Target};

/// Distances at which every whisker is tapped.
const DISTANCES: u64 = 8;

/// What a benchmark tells while it runs.
pub enum News {
    /// A step begins: its number, from 1, and what it measures.
    Begun(usize, String),
    /// A measurement is made.
    Made(Box<Measured>),
}

/// Takes all steps of `settings` on `places`; whole sweeps write into `scratch`.
///
/// # Errors
/// A device or a file that fails; [`SolveError::Stopped`] once `stop` is set.
pub fn measure(
    settings: &Settings,
    places: &[Place],
    scratch: &Path,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(News),
) -> Result<(), Error> {
    let (mut judge, mut alone) = (None, f64::NAN);
    for (n, step) in settings.steps(places).into_iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            return Err(SolveError::Stopped.into());
        }
        tell(News::Begun(n + 1, step.words(places)));
        let place = &places[step.place];
        let measured = match (step.what, &judge) {
            (What::Point(c, Solved::Reference, _), _) => {
                let (new, point) = Judge::new(settings, &c, step)?;
                judge = Some(new);
                point
            }
            (What::Point(..), Some(judge)) => judge.point(step, place, settings.repeats)?,
            (What::Point(..), None) => return Err(Error::Run("no reference to compare with".into())),
            (What::Threads(threads), _) => {
                let times = on_threads(settings, place, threads)?;
                if threads == 1 {
                    alone = times.best;
                }
                Measured { speedup: alone / times.best, ..Measured::new(step, times) }
            }
            (What::Sweep(shape, taps), _) => {
                // Long runs vary little; short ones are repeated.
                let repeats = if taps > 1_000_000 { 1 } else { settings.repeats };
                sweep(step, (shape, taps), place, (scratch, stop), repeats)?
            }
        };
        tell(News::Made(Box::new(measured)));
    }
    Ok(())
}

/// The study of `c` on whiskers of L_a = 50 mm with a gauge of 2 mm at 5 mm, of these D, d, a and θ; only the best designs are written.
fn study(c: &Configuration, [big, tip, a, theta]: [Axis; 4]) -> Study {
    let [length, place, grid] = [50.0, 5.0, 2.0].map(Axis::Value);
    let space = Space::grid([big, tip, length, place, grid, a, theta]).expect("few enough to count");
    let output = Output { tuples: Some(false), distances: false, top: Some(100), ..Output::default() };
    Study { setup: c.setup(), space, output }
}

/// `samples` whiskers, spread over D 8–12 mm, d 2–7 mm and θ 0.5–10° by Sobol points, each tapped at [`DISTANCES`] distances from 20 to
/// 48 mm.
fn independent(c: &Configuration, samples: u64) -> Result<Study, Error> {
    let points = Points { samples, sampler: Sampler::Sobol, seed: 1 };
    let axis = |min: f64, max: f64, dimension| Axis::samples(min, max, false, points, dimension);
    let a = Axis::steps(20.0, 48.0, DISTANCES)?;
    Ok(study(c, [axis(8.0, 12.0, 0)?, axis(2.0, 7.0, 1)?, a, axis(0.5, 10.0, 2)?]))
}

/// About `taps` taps on a grid of D, d and 100 tap angles at 10 distances.
fn gridded(c: &Configuration, taps: u64) -> Result<Study, Error> {
    let (angles, distances) = if taps >= 10_000 { (100, 10) } else { (10, 10) };
    let side = ((taps as f64 / (angles * distances) as f64).sqrt().round() as u64).max(1);
    let axis = |from: f64, to: f64, steps: u64| match steps {
        1 => Ok(Axis::Value(from)),
        _ => Axis::steps(from, to, steps),
    };
    let (big, tip) = (axis(8.0, 12.0, side)?, axis(2.0, 7.0, side)?);
    Ok(study(c, [big, tip, axis(21.0, 48.0, distances)?, axis(0.5, 10.0, angles)?]))
}

/// About `count` taps of `c`, the same well-spread ones for every configuration: a whole number of whiskers, one at least.
///
/// # Errors
/// None for the configurations of a benchmark.
pub fn taps(c: &Configuration, count: usize) -> Result<Taps, Error> {
    let Study { setup, space, .. } = independent(c, (count as u64).div_ceil(DISTANCES).max(1))?;
    let layout = space.layout().expect("the taps of a benchmark are a grid");
    let distances: std::sync::Arc<[f64]> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let point = |k: u64| layout.stroke(&layout.design(k), 0);
    let rows: Vec<Row> = (0..layout.n_designs).map(|k| Row::new(point(k), distances.clone())).collect();
    Ok(Taps::of_rows(&setup, &rows))
}

/// The taps of a configuration with the answers of the reference.
struct Judge {
    compared: Taps,
    answers: Vec<Outcome>,
    /// Taps on which kernels are timed, of which the first are compared.
    timed: Taps,
}

impl Judge {
    /// Solves the taps of `c` by the reference, and by cpu f64 as far as that goes: two methods that share nothing. Also the reference's own point.
    fn new(settings: &Settings, c: &Configuration, step: Step) -> Result<(Self, Measured), Error> {
        let compared = taps(c, settings.compared)?;
        let (answers, times) = repeat(1, || compared.answers(Method::Reference))?;
        let times = times.per(answers.len());
        let timed = taps(c, settings.timed_of(c).max(answers.len()))?;
        let other = (BackendChoice::Cpu, Precision::F64, None);
        let other =
            Place::new(&RunOptions::default(), other, None)?.at(smallest_tolerance(Precision::F64))?;
        let other = compared.answers(other.open(&compared.setup.model)?)?;
        let judge = Self { compared, answers, timed };
        let point = judge.compare(&other, Measured::new(step, times));
        Ok((judge, Measured { taps: point.taps - point.failed, failed: 0, ..point }))
    }

    /// `point` with taps compared, taps that only the reference solved, errors.
    fn compare(&self, found: &[Outcome], mut point: Measured) -> Measured {
        let mut errors = Vec::new();
        for (i, (answer, found)) in self.answers.iter().zip(found).enumerate() {
            if !answer.strain.is_finite() {
                continue;
            }
            point.taps += 1;
            if found.strain.is_finite() {
                let size = answer.strain.abs().max(self.compared.least(i));
                errors.push((relative((found.strain - answer.strain).abs(), size), i));
            } else {
                point.failed += 1;
            }
        }
        Measured { errors: Figures::new(errors, f64::INFINITY), ..point }
    }

    /// The point of `step`, at `place`.
    fn point(&self, step: Step, place: &Place, repeats: usize) -> Result<Measured, Error> {
        let What::Point(_, solved, tolerance) = step.what else {
            return Err(Error::Run("no point of work and precision".into()));
        };
        let (precision, model) = (place.precision, &self.timed.setup.model);
        let ladder = |tolerance: f64, model| match place.at(tolerance)?.open(model)? {
            Method::Fast { rungs, .. } => Ok::<_, Error>(rungs),
            Method::Reference => Ok(Vec::new()),
        };
        let asked = tolerance.or(place.backend().tolerance).unwrap_or(1e-5);
        let run = match solved {
            Solved::Nodes(nodes) => {
                let rung = Rung::new(rule(precision, nodes), precision, &model.material, asked);
                fast(&self.timed, place, repeats, (vec![rung], 1.0, Some(asked)))?
            }
            Solved::Linear => {
                let taps = taps(&configuration::all()[0], self.timed.tasks.len())?;
                let rungs = ladder(asked, &taps.setup.model)?;
                // Closed forms need no kernel.
                Run { kernel: None, sweeps: None, ..fast(&taps, place, repeats, (rungs, asked, None))? }
            }
            _ => fast(&self.timed, place, repeats, (ladder(asked, model)?, asked, None))?,
        };
        let Run { outcomes, times, kernel, sweeps } = run;
        Ok(self.compare(&outcomes, Measured { kernel, sweeps, ..Measured::new(step, times) }))
    }
}

/// What was solved, with its cost per tap.
struct Run {
    outcomes: Vec<Outcome>,
    times: Times,
    kernel: Option<f64>,
    sweeps: Option<f64>,
}

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
) -> Result<Run, Error> {
    let (probe, account) = Probe::new(place.choice.solver()?, alone);
    let method = Method::Fast { solver: Box::new(probe), rungs, tolerance };
    let mut evaluator = Evaluator::new(&taps.setup, method);
    let mut run = || evaluator.run(&taps.designs, &taps.tasks);
    // The first run pays for pipelines and buffers.
    run()?;
    account.take();
    let (mut seconds, mut sweeps, n) = (Vec::new(), 0.0, taps.tasks.len());
    let (outcomes, times) = repeat(repeats, || {
        let outcomes = run();
        let spent = Account::take(&account);
        seconds.push(spent.seconds);
        sweeps = spent.sweeps;
        outcomes
    })?;
    let kernel = Some(Times::of(seconds).per(n).best);
    Ok(Run { outcomes, times: times.per(n), kernel, sweeps: Some(sweeps / n as f64) })
}

/// Nanoseconds per tap of the simplest configuration on so many threads.
fn on_threads(settings: &Settings, place: &Place, threads: usize) -> Result<Times, Error> {
    let count = if place.is_reference() { settings.compared.min(1000) } else { settings.timed };
    let taps = taps(&exact()[0], count)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| Error::Run(e.to_string()))?;
    let mut evaluator = Evaluator::new(&taps.setup, place.method(&taps.setup.model)?);
    let mut run = || pool.install(|| evaluator.run(&taps.designs, &taps.tasks));
    run()?;
    Ok(repeat(settings.repeats, run)?.1.per(taps.tasks.len()))
}

/// A whole sweep, reduced to the best designs, into a folder in `scratch`.
fn sweep(
    step: Step,
    (shape, taps): (Shape, u64),
    place: &Place,
    (scratch, stop): (&Path, &AtomicBool),
    repeats: usize,
) -> Result<Measured, Error> {
    let study = match shape {
        Shape::Independent => independent(&exact()[0], taps / DISTANCES)?,
        Shape::Gridded => gridded(&exact()[0], taps)?,
    };
    let spec = Spec::of(shape.name(), study.clone());
    let (report, seconds) = repeat(repeats, || {
        let folder = tempfile::tempdir_in(scratch).map_err(|e| Error::io(scratch, e))?;
        let plan = Plan::new(&study, &place.choice)?;
        let out = folder.path().join("sweep");
        sweep::run(&spec, &plan, &place.choice, &Target::new(&out, stop), &mut Silent)
    })?;
    let c = &report.counts;
    let failed = c.status.get("not_converged").copied().unwrap_or(0);
    Ok(Measured { taps: c.taps, failed, solved: [c.solved, c.interpolated], ..Measured::new(step, seconds) })
}
