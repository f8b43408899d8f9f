//! Speed against error: what an answer of a given accuracy costs, on every backend and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status. Every measurement is repeated: the best is what the machine can do, the median what it did, their
//! spread how much else it did.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::{Value, json};

use super::compare::{Figures, Line, Odd, compare, of_backend};
use super::configuration::{self, Configuration};
use super::sample::Row;
use super::{Place, Taps, present};
use crate::backend::Backend;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::kernel::rule::smallest_tolerance;
use crate::reduce;
use crate::scene::sampler::Sampler;
use crate::scene::{BackendChoice, Contact, Precision, RunOptions, Tuple};
use crate::sink::values::Field;

/// The configurations of model §5, all effects off to all on.
const EXACT: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

/// Seconds after which slow work is not repeated more often than twice.
const ENOUGH: f64 = 1.5;

/// The configurations of the exact rod, from the simplest to everything on.
pub fn exact() -> Vec<Configuration> {
    let named = |name: &str| configuration::all().into_iter().find(|c| c.name == name);
    EXACT.into_iter().filter_map(named).collect()
}

/// All places that `options` leave, and the reference, which is the yardstick. A tolerance is none of a place: it is measured at several.
///
/// # Errors
/// An adapter that is not there, or no place but the reference.
pub fn places(options: &RunOptions) -> Result<Vec<Place>, Error> {
    let options = RunOptions { tolerance: None, ..options.clone() };
    let mut places: Vec<Place> = Vec::new();
    for place in present(&options, None)? {
        // The same device may be there under two interfaces.
        let one = |p: &Place| (p.backend().adapter.clone(), p.precision);
        if !places.iter().any(|known| one(known) == one(&place)) {
            places.push(place);
        }
    }
    let bare = RunOptions { adapter: None, ..options };
    places.push(Place::new(&bare, (BackendChoice::Reference, Precision::F64, None), None)?);
    Ok(places)
}

/// Name of a place in words and legends, such as "cpu f32"; with the adapter's where there are several.
pub fn name(places: &[Place], place: usize) -> String {
    let (label, own) = (places[place].label(), &places[place].backend().adapter);
    match own {
        Some(adapter) if places.iter().any(|p| p.adapter.is_some() && p.backend().adapter != *own) => {
            format!("{label}, {adapter}")
        }
        _ => label,
    }
}

/// What solves taps, by its name in tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solved {
    /// The closed forms of the linear theory.
    Linear,
    /// The kernel of the exact rod, to a tolerance.
    Exact,
    /// f64 shooting.
    Reference,
}

impl Solved {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Exact => "exact",
            Self::Reference => "reference",
        }
    }
}

/// One measurement, to be made: a point of speed against error.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Place, by number.
    pub place: usize,
    /// Whose taps are solved.
    pub configuration: Configuration,
    /// By what.
    pub solved: Solved,
    /// The tolerance asked for.
    pub tolerance: Option<f64>,
}

/// What a step has shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The step.
    pub step: Step,
    /// Nanoseconds per tap: of the fastest run, and of the median one.
    pub times: [f64; 2],
    /// (slowest − fastest)/median of the runs; `None` of one.
    pub spread: Option<f64>,
    /// Its taps against the reference.
    line: Line,
}

impl Measured {
    /// Taps that the reference solved and this did not: what is fast because it fails.
    pub fn failed(&self) -> usize {
        self.line.odd(Odd::Unsolved)
    }

    /// Taps whose error was measured.
    pub fn taps(&self) -> usize {
        self.line.compared + self.failed()
    }

    /// Strain errors; none where nothing was solved.
    pub fn errors(&self) -> Option<Figures> {
        self.line.errors[0]
    }

    /// Its row of work_precision.csv, on this backend.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let Step { configuration, solved, tolerance, .. } = &self.step;
        let error = |f: fn(&Figures) -> f64| Field::from(self.errors().as_ref().map(f));
        let [best, median] = self.times;
        let sweeps = (*solved == Solved::Exact).then_some(self.line.sweeps[0]);
        let mut fields: Vec<Field> = vec![configuration.name.into()];
        fields.extend(of_backend(backend));
        fields.extend([solved.name().into(), (*tolerance).into(), self.taps().into(), self.failed().into()]);
        fields.extend([best.into(), median.into(), sweeps.into()]);
        fields.extend([error(|e| e.median), error(|e| e.p99), error(|e| e.worst), self.spread.into()]);
        fields
    }
}

/// Sizes of a benchmark: how much is measured, as data, so that `--plan` tells what a run does.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Whether this is a short run.
    pub quick: bool,
    /// Configurations of the exact rod.
    pub configurations: Vec<Configuration>,
    /// Taps whose error is measured, and on which the reference is timed.
    pub compared: usize,
    /// Taps on which a fast kernel is timed.
    pub timed: usize,
    /// Runs of each measurement at most; slow ones are run twice.
    pub repeats: usize,
    /// The only tolerance, where one was asked for.
    pub tolerance: Option<f64>,
}

impl Settings {
    /// Sizes of a full or a `quick` run.
    pub fn new(quick: bool, tolerance: Option<f64>) -> Self {
        let kept = |c: &Configuration| !quick || ["hooke", "neo"].contains(&c.name);
        let configurations = exact().into_iter().filter(kept).collect();
        let (compared, timed, repeats) = if quick { (200, 1 << 12, 3) } else { (10_000, 1 << 17, 5) };
        Self { quick, configurations, compared, timed, repeats, tolerance }
    }

    /// Tolerances at which `precision` is measured.
    fn tolerances(&self, precision: Precision) -> Vec<f64> {
        match (precision, self.quick) {
            _ if self.tolerance.is_some_and(|t| t < smallest_tolerance(precision)) => vec![],
            _ if self.tolerance.is_some() => self.tolerance.into_iter().collect(),
            (Precision::F32, false) => vec![1e-3, 1e-4, 1e-5, 1e-6],
            (Precision::F32, true) => vec![1e-3, 1e-5],
            (Precision::F64, false) => vec![1e-4, 1e-6, 1e-8, 1e-10],
            (Precision::F64, true) => vec![1e-8],
        }
    }

    /// All steps of a run on `places`, of which the last is the reference.
    pub fn steps(&self, places: &[Place]) -> Vec<Step> {
        let mut steps = Vec::new();
        for (i, configuration) in self.configurations.iter().enumerate() {
            let mut add = |place: usize, solved: Solved, tolerance: Option<f64>| {
                steps.push(Step { place, configuration: configuration.clone(), solved, tolerance });
            };
            let kernels = places.len() - 1;
            add(kernels, Solved::Reference, None);
            for (place, p) in places[..kernels].iter().enumerate() {
                self.tolerances(p.precision).into_iter().for_each(|t| add(place, Solved::Exact, Some(t)));
                if i == 0 {
                    // The same taps by the linear theory: what leaving the rod out costs.
                    add(place, Solved::Linear, None);
                }
            }
        }
        steps
    }

    /// Taps solved and seconds spent on `steps`, repeats included, to the order of magnitude.
    pub fn cost(&self, steps: &[Step], places: &[Place]) -> (u64, f64) {
        let cost = |step: &Step| {
            let backend = places[step.place].backend();
            let (taps, rate) = match (backend.name, backend.precision) {
                ("reference", _) => (self.compared, 1e4 * backend.threads as f64),
                ("gpu", _) if !backend.software => (self.timed * (self.repeats + 1), 2e7),
                _ => (self.timed * (self.repeats + 1), 1e6 * backend.threads as f64),
            };
            (taps as u64, taps as f64 / rate)
        };
        steps.iter().map(cost).fold((0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "quick": self.quick,
            "configurations": self.configurations.iter().map(|c| c.name).collect::<Vec<_>>(),
            "taps_compared": self.compared,
            "taps_timed": self.timed,
            "repeats": self.repeats,
            "tolerance": self.tolerance,
        })
    }
}

/// About `count` taps of `c`, the same ones for every configuration: whiskers of L_a = 50 mm with a gauge of 2 mm at 5 mm, spread over
/// D 8–12 mm, d 2–7 mm and θ 0.5–10° by Sobol points, each tapped at 8 distances from 20 to 48 mm.
pub fn taps(c: &Configuration, count: usize) -> Taps {
    let distances: Arc<[f64]> = (0..8).map(|i| 20.0 + 4.0 * f64::from(i)).collect();
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
        let to = step.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
        let (on, of) = (name(places, step.place), step.configuration.name);
        tell(News::Begun(n + 1, format!("{of} {} on {on}{to}", step.solved.name())));
        if step.solved == Solved::Reference {
            judge = Some(Judge::new(settings, &step.configuration)?);
        }
        let Some(judge) = &judge else { continue };
        tell(News::Made(Box::new(judge.measured(step, places, settings.repeats)?)));
    }
    Ok(())
}

/// The taps of a configuration with the answers of the reference.
struct Judge {
    compared: Taps,
    answers: Vec<Outcome>,
    seconds: Vec<f64>,
    /// Taps on which kernels are timed, of which the first are compared.
    timed: Taps,
}

impl Judge {
    fn new(settings: &Settings, c: &Configuration) -> Result<Self, Error> {
        let compared = taps(c, settings.compared);
        let (answers, seconds) = repeat(1, || compared.answers(Method::Reference))?;
        // Fewer with friction, whose taps take tens of sweeps.
        let friction = c.setup.model.contact != Contact::Frictionless;
        let timed = (settings.timed / if friction { 8 } else { 1 }).max(answers.len());
        Ok(Self { compared, answers, seconds, timed: taps(c, timed) })
    }

    /// Times a `step` and compares what it finds. The reference itself is compared with cpu f64 as far as that goes: two methods that share nothing.
    fn measured(&self, step: Step, places: &[Place], repeats: usize) -> Result<Measured, Error> {
        let place = &places[step.place];
        let (found, mut seconds) = if step.solved == Solved::Reference {
            let cpu = (BackendChoice::Cpu, Precision::F64, None);
            let finest = smallest_tolerance(Precision::F64);
            let choice = Place::new(&RunOptions::default(), cpu, None)?.at(finest)?;
            (self.compared.answers(choice.open(&self.compared.setup.model)?)?, self.seconds.clone())
        } else {
            // The closed forms are those of the first configuration.
            let linear = || taps(&configuration::all()[0], self.timed.tasks.len());
            let linear = (step.solved == Solved::Linear).then(linear);
            let timed = linear.as_ref().unwrap_or(&self.timed);
            let choice = step.tolerance.map(|t| place.at(t)).transpose()?;
            let method = choice.as_ref().unwrap_or(&place.choice).open(&timed.setup.model)?;
            let mut evaluator = Evaluator::new(&timed.setup, method);
            let mut run = || evaluator.run(&timed.designs, &timed.tasks);
            // The first run pays for pipelines and buffers.
            run()?;
            repeat(repeats, run)?
        };
        let per =
            1e9 / if step.solved == Solved::Reference { self.answers.len() } else { found.len() } as f64;
        seconds.sort_by(f64::total_cmp);
        let [best, slowest] = [seconds[0], seconds[seconds.len() - 1]];
        let median = reduce::median(&mut seconds.clone());
        let found = &found[..self.answers.len()];
        let compared = compare(&self.compared, &self.answers, found, f64::INFINITY);
        let of = (step.configuration.name.to_owned(), self.compared.setup.drive);
        let at = (step.place, f64::INFINITY);
        let line = Line::new(of, at, |i| self.compared.tuple(i), &compared, [&self.answers, found]);
        let spread = (seconds.len() > 1).then(|| (slowest - best) / median);
        Ok(Measured { step, times: [per * best, per * median], spread, line })
    }
}

/// Runs `f` `repeats` ≥ 1 times, slow work only twice: its last result, and the seconds of each run.
fn repeat<T, E>(repeats: usize, mut f: impl FnMut() -> Result<T, E>) -> Result<(T, Vec<f64>), E> {
    let mut seconds = Vec::with_capacity(repeats);
    loop {
        let start = Instant::now();
        let result = f()?;
        seconds.push(start.elapsed().as_secs_f64());
        let slow = seconds.len() >= 2 && seconds.iter().sum::<f64>() > ENOUGH;
        if slow || seconds.len() >= repeats {
            return Ok((result, seconds));
        }
    }
}
