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

/// A benchmark: what is measured, as data, so that `--plan` tells what a run does.
pub struct Bench {
    /// Whether this is a short run.
    quick: bool,
    /// Configurations of the exact rod.
    configurations: Vec<Configuration>,
    /// The reference, which is the yardstick, and every backend at several tolerances.
    pub places: Vec<Place>,
    /// Taps whose error is measured, and on which the reference is timed.
    compared: usize,
    /// Taps on which a fast kernel is timed.
    timed: usize,
    /// Runs of each measurement at most; slow ones are run twice.
    repeats: usize,
}

impl Bench {
    /// A full or a `quick` run on all places that `options` leave.
    ///
    /// # Errors
    /// An adapter that is not there, or no place but the reference.
    pub fn new(options: &RunOptions, quick: bool) -> Result<Self, Error> {
        let (asked, bare) = (options.tolerance, RunOptions { tolerance: None, ..options.clone() });
        let reference = (BackendChoice::Reference, Precision::F64, None);
        let mut places = vec![Place::new(&RunOptions { adapter: None, ..bare.clone() }, reference, None)?];
        let free = matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none();
        let mut known = Vec::new();
        for place in present(&bare, None)? {
            let one = (place.backend().adapter.clone(), place.precision);
            // The same device may be there under two interfaces; software compiles for a minute what the CPU has compiled.
            if known.contains(&one) || quick && free && place.backend().software {
                continue;
            }
            known.push(one);
            let least = smallest_tolerance(place.precision);
            let usual: &[f64] = match (place.precision, quick) {
                (Precision::F32, false) => &[1e-3, 1e-4, 1e-5, 1e-6],
                (Precision::F32, true) => &[1e-3, 1e-5],
                (Precision::F64, false) => &[1e-4, 1e-6, 1e-8, 1e-10],
                (Precision::F64, true) => &[1e-8],
            };
            let tolerances = asked.as_ref().map_or(usual, std::slice::from_ref).iter();
            for tolerance in tolerances.filter(|t| **t >= least) {
                places.push(place.at(*tolerance)?);
            }
        }
        let kept = |c: &Configuration| !quick || ["hooke", "neo"].contains(&c.name);
        let configurations = exact().into_iter().filter(kept).collect();
        let (compared, timed, repeats) = if quick { (200, 1 << 12, 3) } else { (10_000, 1 << 17, 5) };
        Ok(Self { quick, configurations, places, compared, timed, repeats })
    }

    /// Measurements.
    pub fn steps(&self) -> usize {
        self.configurations.len() * self.places.len()
    }

    /// Taps solved and seconds spent, repeats included, to the order of magnitude.
    pub fn cost(&self) -> (usize, f64) {
        let cost = |place: &Place| {
            let (backend, kernel) = (place.backend(), self.timed * (self.repeats + 1));
            let (taps, rate) = match (backend.name, backend.software) {
                ("reference", _) => (self.compared, 1e4 * backend.threads as f64),
                ("gpu", false) => (kernel, 2e7),
                _ => (kernel, 1e6 * backend.threads as f64),
            };
            (taps, taps as f64 / rate)
        };
        let all = self.places.iter().map(cost).fold((0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        (all.0 * self.configurations.len(), all.1 * self.configurations.len() as f64)
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "quick": self.quick,
            "configurations": self.configurations.iter().map(|c| c.name).collect::<Vec<_>>(),
            "places": self.places.iter().map(Place::name).collect::<Vec<_>>(),
            "taps_compared": self.compared,
            "taps_timed": self.timed,
            "repeats": self.repeats,
        })
    }

    /// Measures everything, one after the other; each configuration begins with the reference.
    ///
    /// # Errors
    /// A device that fails; [`SolveError::Stopped`] once `stop` is set.
    pub fn measure(&self, stop: &AtomicBool, tell: &mut dyn FnMut(News)) -> Result<(), Error> {
        for (i, c) in self.configurations.iter().enumerate() {
            let mut judge: Option<Judge> = None;
            for (k, place) in self.places.iter().enumerate() {
                if stop.load(Ordering::Relaxed) {
                    return Err(SolveError::Stopped.into());
                }
                tell(News::Begun(i * self.places.len() + k + 1, format!("{} on {}", c.name, place.name())));
                let judge = match &judge {
                    Some(judge) => judge,
                    None => judge.insert(Judge::new(self, c)?),
                };
                tell(News::Made(Box::new(judge.measured(c.name, (k, place), self.repeats)?)));
            }
        }
        Ok(())
    }
}

/// One measurement: a point of speed against error.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Nanoseconds per tap: of the fastest run, and of the median one.
    times: [f64; 2],
    /// (slowest − fastest)/median of the runs; `None` of one.
    pub spread: Option<f64>,
    /// Its taps against the reference.
    pub line: Line,
}

impl Measured {
    /// Its row of work_precision.csv, on this backend. Taps that the reference solved and this did not have failed: what is fast because it fails.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let (line, tolerance, failed) = (&self.line, backend.tolerance, self.line.odd(Odd::Unsolved));
        let error = |f: fn(&Figures) -> f64| Field::from(line.errors[0].as_ref().map(f));
        let (kernel, sweeps) =
            (tolerance.map_or("reference", |_| "exact"), tolerance.map(|_| line.sweeps[0]));
        let mut fields: Vec<Field> = vec![line.configuration.clone().into()];
        fields.extend(of_backend(backend));
        fields.extend([kernel.into(), tolerance.into(), (line.compared + failed).into(), failed.into()]);
        fields.extend([self.times[0].into(), self.times[1].into(), sweeps.into()]);
        fields.extend([error(|e| e.median), error(|e| e.p99), error(|e| e.worst), self.spread.into()]);
        fields
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

/// The taps of a configuration with the answers of the reference.
struct Judge {
    compared: Taps,
    answers: Vec<Outcome>,
    seconds: Vec<f64>,
    /// Taps on which kernels are timed, of which the first are compared.
    timed: Taps,
}

impl Judge {
    fn new(bench: &Bench, c: &Configuration) -> Result<Self, Error> {
        let compared = taps(c, bench.compared);
        let (answers, seconds) = repeat(1, || compared.answers(Method::Reference))?;
        // Fewer with friction, whose taps take tens of sweeps.
        let friction = c.setup.model.contact != Contact::Frictionless;
        let timed = (bench.timed / if friction { 8 } else { 1 }).max(answers.len());
        Ok(Self { compared, answers, seconds, timed: taps(c, timed) })
    }

    /// Times taps at a `place` and compares what it finds. The reference itself is compared with cpu f64 as far as that goes: two methods that share
    /// nothing.
    fn measured(&self, name: &str, (k, place): (usize, &Place), repeats: usize) -> Result<Measured, Error> {
        let model = &self.timed.setup.model;
        let (found, mut seconds) = if place.backend().tolerance.is_some() {
            let mut evaluator = Evaluator::new(&self.timed.setup, place.choice.open(model)?);
            let mut run = || evaluator.run(&self.timed.designs, &self.timed.tasks);
            // The first run pays for pipelines and buffers.
            run()?;
            repeat(repeats, run)?
        } else {
            let cpu = (BackendChoice::Cpu, Precision::F64, None);
            let finest = smallest_tolerance(Precision::F64);
            let finest = Place::new(&RunOptions::default(), cpu, None)?.at(finest)?;
            (self.compared.answers(finest.choice.open(model)?)?, self.seconds.clone())
        };
        let median = reduce::median(&mut seconds);
        seconds.sort_by(f64::total_cmp);
        let [best, slowest] = [seconds[0], seconds[seconds.len() - 1]];
        let (per, found) = (1e9 / found.len() as f64, &found[..self.answers.len()]);
        let compared = compare(&self.compared, &self.answers, found, f64::INFINITY);
        let at = (k, f64::INFINITY);
        let line = Line::new(name.to_owned(), at, &self.compared, &compared, [&self.answers, found]);
        let spread = (seconds.len() > 1).then(|| (slowest - best) / median);
        Ok(Measured { times: [per * best, per * median], spread, line })
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
