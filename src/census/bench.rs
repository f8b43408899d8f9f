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

use super::cases::{self, Configuration};
use super::compare::{Figures, Line, Odd, compare, of_backend};
use super::sample::point;
use super::{Place, Row, Taps, present};
use crate::backend::Backend;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method};
use crate::kernel::rule::smallest_tolerance;
use crate::reduce;
use crate::scene::{BackendChoice, Contact, Precision, RunOptions, Sampler};
use crate::sink::Field;

/// The configurations of model §5, all effects off to all on.
const EXACT: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

/// Seconds after which slow work is not repeated more often than twice.
const ENOUGH: f64 = 1.5;

/// The configurations of the exact rod, from the simplest to everything on.
pub fn exact() -> Vec<Configuration> {
    cases::all().into_iter().filter(|c| EXACT.contains(&c.name)).collect()
}

/// A benchmark: what is measured, as data, so that `--plan` tells what a run does.
pub struct Bench {
    quick: bool,
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
    /// Errors: an adapter that is not there, or no place but the reference.
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
    /// Errors: a device that fails; [`SolveError::Stopped`] once `stop` is set.
    pub fn measure(&self, stop: &AtomicBool, tell: &mut dyn FnMut(News)) -> Result<(), Error> {
        for (i, c) in self.configurations.iter().enumerate() {
            // Fewer with friction, whose taps take tens of sweeps.
            let share = if c.setup.model.contact != Contact::Frictionless { 8 } else { 1 };
            let compared = taps(c, self.compared);
            // Taps on which kernels are timed, of which the first are compared.
            let timed = taps(c, (self.timed / share).max(compared.tasks.len()));
            let (model, mut answers) = (&c.setup.model, Vec::new());
            for (k, place) in self.places.iter().enumerate() {
                if stop.load(Ordering::Relaxed) {
                    return Err(SolveError::Stopped.into());
                }
                tell(News::Begun(i * self.places.len() + k + 1, format!("{} on {}", c.name, place.name())));
                let (found, seconds) = if k == 0 {
                    let (known, seconds) = repeat(1, || compared.answers(Method::Reference))?;
                    answers = known;
                    // Compared with cpu f64 as far as that goes: two methods that share nothing.
                    let cpu = (BackendChoice::Cpu, Precision::F64, None);
                    let finest = Place::new(&RunOptions::default(), cpu, None)?;
                    let finest = finest.at(smallest_tolerance(Precision::F64))?;
                    (compared.answers(finest.choice.open(model)?)?, seconds)
                } else {
                    let mut evaluator = Evaluator::new(&timed.setup, place.choice.open(model)?);
                    let mut run = || evaluator.run(&timed.designs, &timed.tasks);
                    // The first run pays for pipelines and buffers.
                    run()?;
                    repeat(self.repeats, run)?
                };
                let per = 1e9 / found.len() as f64;
                let [expected, found] = [&answers[..], &found[..answers.len()]];
                let errors = compare(&compared, expected, found, f64::INFINITY);
                let at = (k, f64::INFINITY);
                let line = Line::new(c.name.to_owned(), at, &compared, &errors, [expected, found]);
                tell(News::Made(Box::new(Measured::new(seconds, per, line))));
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
    fn new(mut seconds: Vec<f64>, per: f64, line: Line) -> Self {
        let median = reduce::median(&mut seconds);
        seconds.sort_by(f64::total_cmp);
        let [best, slowest] = [seconds[0], seconds[seconds.len() - 1]];
        let spread = (seconds.len() > 1).then(|| (slowest - best) / median);
        Self { times: [per * best, per * median], spread, line }
    }

    /// Its row of work_precision.csv, on this backend. Taps that the reference solved and this did not have failed: what is fast because it fails.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let (line, tolerance, failed) =
            (&self.line, backend.tolerance, self.line.odd[Odd::Unsolved as usize]);
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
        let values = [at(0, 8.0, 12.0), at(1, 2.0, 7.0), 50.0, 5.0, 2.0, at(2, 0.5, 10.0)];
        Row::new(point(values), distances.clone())
    };
    let whiskers = count.div_ceil(distances.len()).max(1) as u32;
    Taps::of_rows(&c.setup, &(0..whiskers).map(row).collect::<Vec<_>>())
}

/// Progress of a benchmark.
pub enum News {
    /// A step begins: its number, from 1, and what it measures.
    Begun(usize, String),
    Made(Box<Measured>),
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
