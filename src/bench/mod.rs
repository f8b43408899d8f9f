//! Speed against error: what an answer of a given accuracy costs, on every backend, kernel and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status; the share of the kernel is told apart. Every measurement is repeated: the best is what the machine
//! can do, the median what it did.
//!
//! [`work`] makes the work–precision points, [`scaling`] the cost of whole sweeps and of threads, [`roofline`] compares counted
//! operations with measured peaks; [`tables`] and [`figures`] show them.

mod figure;
pub mod figures;
pub mod place;
mod probe;
pub mod roofline;
pub mod scaling;
pub mod settings;
pub mod stopwatch;
pub mod tables;
pub mod taps;
pub mod work;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::{Value, json};

use crate::error::Error;
use crate::sink::{
    folder::{Folder, Question, Written, hash},
    run_json,
};
use place::Place;
use roofline::{Load, Peak};
use scaling::{Scaled, Threaded};
pub use settings::Settings;
use work::Point;

/// Every file of a benchmark; a figure without points is left out.
const FILES: [&str; 15] = [
    "work_precision.csv",
    "scaling.csv",
    "threads.csv",
    "peaks.csv",
    "roofline.csv",
    "work_precision.svg",
    "work_precision.png",
    "configurations.svg",
    "configurations.png",
    "scaling.svg",
    "scaling.png",
    "threads.svg",
    "threads.png",
    "roofline.svg",
    "roofline.png",
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
    /// What the machine can do.
    pub peaks: Vec<Peak>,
    /// What the kernels ask of it.
    pub loads: Vec<Load>,
}

/// A finished benchmark.
#[derive(Debug)]
pub struct Report {
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<PathBuf>,
    /// What they hold.
    pub measured: Measured,
    /// Seconds it took.
    pub seconds: f64,
}

/// How a benchmark tells what it does, and hears that it should stop.
pub struct Watch<'a> {
    /// Called with each step: its number, the number of all, and what is measured.
    pub step: &'a mut dyn FnMut(usize, usize, &str),
    /// Set from outside to stop early.
    pub stop: &'a AtomicBool,
    done: usize,
    all: usize,
}

impl<'a> Watch<'a> {
    /// Reports through `step` until `stop` is set.
    pub fn new(step: &'a mut dyn FnMut(usize, usize, &str), stop: &'a AtomicBool) -> Self {
        Self { step, stop, done: 0, all: 0 }
    }

    /// The next step; an error when asked to stop.
    fn next(&mut self, what: &str) -> Result<(), Error> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Error::Run("stopped; nothing was written".into()));
        }
        self.done += 1;
        (self.step)(self.done, self.all, what);
        Ok(())
    }
}

/// Measures everything in `settings` on `places` and writes tables, figures and `run.json` to `out`.
///
/// # Errors
/// A device or a file that fails, or `watch.stop`; a folder that holds something else, unless `force`.
pub fn run(
    settings: &Settings,
    places: &[Place],
    (out, force): (&Path, bool),
    watch: &mut Watch<'_>,
) -> Result<Report, Error> {
    let start = Instant::now();
    let text = settings.text(places);
    let question = Question::new("bench", "bench", json!({ "settings": hash(&text) }));
    let mut folder = Folder::open(out, question, &FILES, force)?;
    watch.all = settings.steps(places);
    let points = work::measure(settings, places, watch)?;
    let (peaks, loads) = roofline::measure(settings, places, watch)?;
    let threaded = scaling::threads(settings, places, watch)?;
    let scaled = scaling::sizes(settings, places, watch)?;
    let measured = Measured { points, scaled, threaded, peaks, loads };
    for (name, text) in tables::all(&measured, places)? {
        write(&mut folder, name, text.as_bytes())?;
    }
    for (name, bytes) in figures::all(&measured, places)? {
        write(&mut folder, &name, &bytes)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    folder.run_json(&document(settings, places, &text, &measured, seconds))?;
    let Written { files, removed, .. } = folder.finish()?;
    Ok(Report { files, removed, measured, seconds })
}

fn write(folder: &mut Folder, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let mut file = folder.file(name)?;
    file.write(bytes)?;
    file.close()
}

fn document(settings: &Settings, places: &[Place], text: &str, m: &Measured, seconds: f64) -> Value {
    run_json::document(
        "bench",
        json!({ "name": "bench", "hash": hash(text), "text": text }),
        json!({
            "machine": machine(),
            "backends": places.iter().map(|p| json!(p.choice.backend)).collect::<Vec<_>>(),
            "settings": settings.json(),
            "yardstick": "the reference: adaptive f64 shooting; its own row is its difference from cpu f64 at the smallest tolerance",
            "error": "|strain - reference| / max(|reference|, 1e-3 theta f_max)",
            "counts": counts(m),
            "seconds": { "total": seconds },
        }),
    )
}

/// How much was measured.
pub fn counts(m: &Measured) -> Value {
    json!({
        "points": m.points.len(),
        "taps": m.points.iter().map(|p| p.taps).sum::<usize>(),
        "failed": m.points.iter().map(|p| p.failed).sum::<usize>(),
        "scaling": m.scaled.len(),
        "threads": m.threaded.len(),
        "roofline": m.loads.len(),
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
