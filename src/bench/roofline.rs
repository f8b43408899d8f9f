//! How much of the machine the kernels use: counted operations and bytes of a tap against measured peaks.

use super::place::Place;
use super::probe::Probe;
use super::stopwatch::{Times, repeat};
use super::taps::Taps;
use super::{Part, Settings, Watch};
use crate::error::Error;
use crate::evaluate::{Evaluator, Method};
use crate::kernel::{Solution, Tap, cpu, gpu::Gpu};
use crate::scene::Precision;
use crate::verify::configuration::Configuration;
use vibrissa_count::{Counter, Operations};

/// What a place can do at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Place, by number.
    pub place: usize,
    /// Flops per second of fused multiply–adds.
    pub flops: f64,
    /// Bytes per second of a triad (CPU) or copy (GPU).
    pub bytes: f64,
}

/// What a configuration asks of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Configuration.
    pub configuration: &'static str,
    /// Place, by number.
    pub place: usize,
    /// Tolerance.
    pub tolerance: f64,
    /// Sweeps per tap, all rungs together.
    pub sweeps: f64,
    /// Taps on which the operations were counted.
    pub counted: usize,
    /// Operations on those taps.
    pub operations: Operations,
    /// Bytes that a tap and its solution have.
    pub bytes: usize,
    /// Nanoseconds per tap in the kernel, transfers included.
    pub kernel: Times,
}

impl Load {
    /// Floating-point operations of a tap.
    pub fn flops(&self) -> f64 {
        self.operations.flops() as f64 / self.counted as f64
    }

    /// Flops per second, as fast as it went.
    pub fn flops_per_second(&self) -> f64 {
        self.flops() / self.kernel.best * 1e9
    }

    /// Bytes per second, as fast as it went.
    pub fn bytes_per_second(&self) -> f64 {
        self.bytes as f64 / self.kernel.best * 1e9
    }
}

/// Taps whose operations are counted; counting is slow.
const COUNTED: usize = 2048;

/// Peaks of every fast place, and the load of every configuration on it at its default tolerance.
///
/// # Errors
/// A device that fails, or a request to stop.
pub fn measure(settings: &Settings, places: &[Place], watch: &mut Watch<'_>) -> Result<(), Error> {
    for (place, p) in places.iter().enumerate().filter(|(_, p)| !p.is_reference()) {
        watch.next(&format!("peaks of {}", p.name))?;
        let peak = peak(place, p, settings.repeats)?;
        (watch.each)(Part::Peak(peak));
        for c in &settings.configurations {
            watch.next(&format!("operations of {} on {}", c.name, p.name))?;
            let load = load(c, place, p, settings)?;
            (watch.each)(Part::Load(load));
        }
    }
    Ok(())
}

fn peak(place: usize, p: &Place, repeats: usize) -> Result<Peak, Error> {
    Ok(match &p.adapter {
        Some(adapter) => {
            let gpu = Gpu::new(adapter.clone(), p.precision)?;
            let found = gpu.peaks(repeats)?;
            Peak { place, flops: found.flops, bytes: found.bytes }
        }
        None => Peak { place, flops: cpu::flops(p.precision, repeats), bytes: cpu::bandwidth(repeats) },
    })
}

fn load(c: &Configuration, place: usize, p: &Place, settings: &Settings) -> Result<Load, Error> {
    let taps = Taps::new(c, settings.timed_of(c))?;
    let Method::Fast { solver, rungs, tolerance } = p.choice.open(&taps.setup.model)? else {
        return Err(Error::Run("the reference has no kernel".into()));
    };
    let (probe, account) = Probe::new(solver, None);
    let method = Method::Fast { solver: Box::new(probe), rungs: rungs.clone(), tolerance };
    let mut evaluator = Evaluator::new(&taps.setup, method);
    let mut spent = Vec::new();
    // The first run pays for pipelines and buffers.
    repeat(settings.repeats + 1, || {
        let outcomes = evaluator.run(&taps.designs, &taps.tasks);
        spent.push(account.take());
        outcomes
    })?;
    let n = taps.tasks.len();
    let kernel = Times::of(spent[1..].iter().map(|s| s.seconds).collect()).per(n);
    let sweeps = spent[1].sweeps / n as f64;

    let few = Taps::new(c, COUNTED.min(settings.timed))?;
    let counter = Counter::default();
    let method = Method::Fast { solver: Box::new(counter.clone()), rungs, tolerance };
    Evaluator::new(&few.setup, method).run(&few.designs, &few.tasks)?;
    // The CPU kernels read and write f64 whatever they compute in; a GPU is sent its own numbers.
    let word = if p.adapter.is_some() && p.precision == Precision::F32 { 4 } else { 8 };
    let bytes = word * (Tap::<f32>::FIELDS.len() + Solution::<f32>::words(false));
    let operations = counter.total();
    let configuration = c.name;
    Ok(Load { configuration, place, tolerance, sweeps, counted: few.tasks.len(), operations, bytes, kernel })
}
