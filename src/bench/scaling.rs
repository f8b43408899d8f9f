//! Cost against work: whole sweeps of growing size, and the same taps on more threads.

use std::path::Path;

use super::place::Place;
use super::stopwatch::{Times, repeat};
use super::taps::{Taps, exact, gridded, independent};
use super::{Part, Settings, Watch};
use crate::error::Error;
use crate::evaluate::Evaluator;
use crate::plan::Plan;
use crate::progress::Silent;
use crate::scene::Spec;
use crate::sweep::{self, Target};

/// What the taps of a sweep share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Every whisker has its own tap angle.
    Independent,
    /// A grid of whiskers, distances and 100 tap angles.
    Gridded,
}

impl Shape {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Gridded => "gridded",
        }
    }
}

/// A whole sweep, from its spec to the last byte of its tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaled {
    /// What its taps share.
    pub shape: Shape,
    /// Place, by number.
    pub place: usize,
    /// Taps evaluated.
    pub taps: u64,
    /// Taps solved by a kernel.
    pub solved: u64,
    /// Taps interpolated.
    pub interpolated: u64,
    /// Taps that no solution was found for: what is fast because it fails.
    pub failed: u64,
    /// Seconds, opening the device and making charts included.
    pub seconds: Times,
}

/// The same taps on some threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threaded {
    /// Place, by number.
    pub place: usize,
    /// CPU threads.
    pub threads: usize,
    /// Nanoseconds per tap.
    pub times: Times,
    /// Best time on one thread over best time on these.
    pub speedup: f64,
}

/// Sweeps of all sizes, reduced to the best designs, into folders in `scratch`.
///
/// # Errors
/// A device or a folder that fails, or a request to stop.
pub fn sizes(
    settings: &Settings,
    places: &[Place],
    scratch: &Path,
    watch: &mut Watch<'_>,
) -> Result<(), Error> {
    let hooke = exact()[0];
    for (place, p) in places.iter().enumerate() {
        for shape in [Shape::Independent, Shape::Gridded] {
            for taps in settings.sizes(p) {
                watch.next(&format!("sweep of {taps} {} taps on {}", shape.name(), p.name))?;
                let study = match shape {
                    Shape::Independent => independent(&hooke, taps / super::taps::DISTANCES as u64)?,
                    Shape::Gridded => gridded(&hooke, taps)?,
                };
                let spec = Spec::of(shape.name(), study.clone());
                // Long runs vary little; short ones are repeated.
                let repeats = if taps > 1_000_000 { 1 } else { settings.repeats };
                let (report, seconds) = repeat(repeats, || {
                    let folder = tempfile::tempdir_in(scratch).map_err(|e| Error::io(scratch, e))?;
                    let plan = Plan::new(&study, &p.choice)?;
                    let out = folder.path().join("sweep");
                    sweep::run(&spec, &plan, &p.choice, &Target::new(&out, watch.stop), &mut Silent)
                })?;
                let c = &report.counts;
                let (taps, solved, interpolated) = (c.taps, c.solved, c.interpolated);
                let failed = c.status.get("not_converged").copied().unwrap_or(0);
                let scaled = Scaled { shape, place, taps, solved, interpolated, failed, seconds };
                (watch.each)(Part::Scaled(scaled));
            }
        }
    }
    Ok(())
}

/// The taps of the simplest configuration on 1, 2, … threads of the CPU.
///
/// # Errors
/// Threads that do not start, or a request to stop.
pub fn threads(settings: &Settings, places: &[Place], watch: &mut Watch<'_>) -> Result<(), Error> {
    let hooke = exact()[0];
    for (place, p) in places.iter().enumerate().filter(|(_, p)| p.adapter.is_none()) {
        let count = if p.is_reference() { settings.compared.min(1000) } else { settings.timed };
        let taps = Taps::new(&hooke, count)?;
        let mut alone = f64::NAN;
        for &threads in &settings.threads {
            watch.next(&format!("{} on {threads} thread{}", p.name, if threads == 1 { "" } else { "s" }))?;
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .map_err(|e| Error::Run(e.to_string()))?;
            let mut evaluator = Evaluator::new(&taps.setup, p.choice.open(&taps.setup.model)?);
            let mut run = || pool.install(|| evaluator.run(&taps.designs, &taps.tasks)).map_err(Error::from);
            run()?;
            let (_, times) = repeat(settings.repeats, run)?;
            let times = times.per(taps.tasks.len());
            if threads == 1 {
                alone = times.best;
            }
            (watch.each)(Part::Threaded(Threaded { place, threads, times, speedup: alone / times.best }));
        }
    }
    Ok(())
}
