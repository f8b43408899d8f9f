//! Speed against error: what an answer of a given accuracy costs, on every backend, kernel and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status; the share of the kernel is told apart. Every measurement is repeated: the best is what the machine
//! can do, the median what it did, their spread how much else it did ([`noise`]).
//!
//! [`work`] makes the work–precision points, with the sweeps of the solver that each takes, [`scaling`] the cost of whole sweeps and of
//! threads; [`tables`] show them, and [`crate::report`] draws its figures from these.

pub mod noise;
pub mod place;
pub mod probe;
pub mod scaling;
pub mod settings;
pub mod stopwatch;
pub mod tables;
pub mod taps;
pub mod work;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::{Value, json};

use crate::error::Error;
use crate::figure::{self, Format, Style};
use crate::report;
use crate::sink::{
    folder::{Folder, Question, Written, hash},
    run_json,
};
use noise::Noise;
use place::Place;
use scaling::{Scaled, Threaded};
pub use settings::Settings;
use work::Point;

/// Every file of a benchmark; a figure without points is left out.
const FILES: [&str; 11] = [
    "work_precision.csv",
    "scaling.csv",
    "threads.csv",
    "work_precision.svg",
    "work_precision.png",
    "configurations.svg",
    "configurations.png",
    "scaling.svg",
    "scaling.png",
    "threads.svg",
    "threads.png",
];

/// Everything that was measured.
#[derive(Debug, Default)]
pub struct Measured {
    /// Work–precision points.
    pub points: Vec<Point>,
    /// Whole sweeps of growing size.
    pub scaled: Vec<Scaled>,
    /// The same taps on 1, 2, … threads.
    pub threaded: Vec<Threaded>,
}

impl Measured {
    /// Adds a part.
    pub fn add(&mut self, part: Part) {
        match part {
            Part::Point(point) => self.points.push(point),
            Part::Scaled(scaled) => self.scaled.push(scaled),
            Part::Threaded(threaded) => self.threaded.push(threaded),
        }
    }

    /// Number of parts.
    pub fn len(&self) -> usize {
        self.points.len() + self.scaled.len() + self.threaded.len()
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One measurement.
#[derive(Debug, Clone)]
pub enum Part {
    /// A work–precision point.
    Point(Point),
    /// A whole sweep.
    Scaled(Scaled),
    /// Taps on some threads.
    Threaded(Threaded),
}

/// How a benchmark tells what it does and has measured, and hears that it should stop.
pub struct Watch<'a> {
    /// Called with each step: its number, the number of all, and what is measured.
    pub step: &'a mut dyn FnMut(usize, usize, &str),
    /// Handed each measurement as it is made.
    pub each: &'a mut dyn FnMut(Part),
    /// Set from outside to stop early.
    pub stop: &'a AtomicBool,
    done: usize,
    all: usize,
}

impl<'a> Watch<'a> {
    /// Reports through `step` and `each` until `stop` is set.
    pub fn new(
        step: &'a mut dyn FnMut(usize, usize, &str),
        each: &'a mut dyn FnMut(Part),
        stop: &'a AtomicBool,
    ) -> Self {
        Self { step, each, stop, done: 0, all: 0 }
    }

    /// The next step; an error when asked to stop.
    fn next(&mut self, what: &str) -> Result<(), Error> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Error::Run("interrupted".into()));
        }
        self.done += 1;
        (self.step)(self.done, self.all, what);
        Ok(())
    }
}

/// The folder for what is measured.
///
/// # Errors
/// A folder that holds something else, unless `force`.
pub fn open(settings: &Settings, places: &[Place], out: &Path, force: bool) -> Result<Folder, Error> {
    let question = Question::new("bench", "bench", json!({ "settings": hash(&settings.text(places)) }));
    Folder::open(out, question, &FILES, force)
}

/// Measures everything in `settings` on `places`; whole sweeps write into `scratch`.
///
/// # Errors
/// A device or a file that fails, or `watch.stop`.
pub fn measure(
    settings: &Settings,
    places: &[Place],
    scratch: &Path,
    watch: &mut Watch<'_>,
) -> Result<(), Error> {
    watch.all = settings.steps(places);
    work::measure(settings, places, watch)?;
    scaling::threads(settings, places, watch)?;
    scaling::sizes(settings, places, scratch, watch)
}

/// Writes tables, figures and `run.json`; of a run that was `stopped` after so many of its steps no figures, which would take their time.
///
/// # Errors
/// A file that fails.
pub fn write(
    mut folder: Folder,
    settings: &Settings,
    places: &[Place],
    measured: &Measured,
    (start, stopped): (Instant, Option<[usize; 2]>),
) -> Result<Written, Error> {
    let texts = tables::all(measured, places)?;
    for (name, text) in &texts {
        folder.put(name, text.as_bytes())?;
    }
    if stopped.is_none() {
        for figure in report::of_bench(&texts)? {
            for (name, bytes) in figure::files(&figure, &Style::default(), &[Format::Svg, Format::Png])? {
                folder.put(&name, &bytes)?;
            }
        }
    }
    let text = settings.text(places);
    folder.run_json(&run_json::document(
        "bench",
        json!({ "name": "bench", "hash": hash(&text), "text": text }),
        json!({
            "machine": machine(),
            "backends": places.iter().map(|p| json!(p.choice.backend)).collect::<Vec<_>>(),
            "settings": settings.json(),
            "yardstick": "the reference: adaptive f64 shooting; its own row is its difference from cpu f64 at the smallest tolerance",
            "error": "|strain - reference| / max(|reference|, 1e-3 theta f_max)",
            "counts": counts(measured),
            "noise": Noise::of(measured, places).json(),
            "stopped": stopped.map(|[steps, of]| json!({ "steps": steps, "of": of })),
            "seconds": { "total": start.elapsed().as_secs_f64() },
        }),
    ))?;
    folder.finish()
}

/// How much was measured.
pub fn counts(m: &Measured) -> Value {
    json!({
        "points": m.points.len(),
        "taps": m.points.iter().map(|p| p.taps).sum::<usize>(),
        "failed": m.points.iter().map(|p| p.failed).sum::<usize>(),
        "scaling": m.scaled.len(),
        "threads": m.threaded.len(),
    })
}

/// The processor in its own words, and its cores.
pub fn machine() -> Value {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split(':').nth(1));
    json!({
        "processor": model.map(str::trim),
        "cores": std::thread::available_parallelism().ok().map(|n| n.get()),
        "os": std::env::consts::OS,
        "architecture": std::env::consts::ARCH,
    })
}
