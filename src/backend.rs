//! Which backend runs: what was asked, what the machine has, and why the one was taken.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{Error, InputError, SolveError};
use crate::evaluate::Method;
use crate::kernel::{
    Rung, Solver,
    cpu::Cpu,
    gpu::{self, Adapter, Gpu},
    rule::smallest_tolerance,
};
use crate::scene::{BackendChoice, Model, Precision, RunOptions, Written};

/// The backend taken, in words and numbers; part of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Backend {
    /// gpu, cpu or reference.
    pub name: &'static str,
    /// Why this one.
    pub reason: String,
    /// Adapter's name.
    pub adapter: Option<String>,
    /// Driver and version.
    pub driver: Option<String>,
    /// f32 or f64.
    pub precision: &'static str,
    /// Bound on the strain error; none for the reference, which ignores it.
    pub tolerance: Option<f64>,
    /// CPU threads.
    pub threads: usize,
    /// Instruction set of the CPU kernels.
    pub instructions: Option<&'static str>,
    /// Whether the adapter runs on the CPU.
    #[serde(skip)]
    pub software: bool,
}

/// A backend chosen but not opened.
#[derive(Debug)]
pub struct Choice {
    /// What will run.
    pub backend: Backend,
    /// Seconds it took to look for adapters and to open one.
    pub seconds: f64,
    precision: Precision,
    adapter: Option<Adapter>,
    /// The device that `auto` opened to see whether it opens.
    opened: Mutex<Option<Gpu>>,
}

/// Address space below which `auto` asks no driver, bytes: where it ends they fail, abort or crash, lavapipe from some 1 GB on
/// with two threads and with more of each.
const ROOM: u64 = 8 << 30;

/// Why no driver is to be asked: the address space is limited (`ulimit -v`).
pub fn cramped() -> Option<String> {
    // Only Linux has the file, and only there the limit matters.
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|l| l.strip_prefix("Max address space"))?;
    let bytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    let room = bytes as f64 / 1e9;
    (bytes < ROOM).then(|| {
        format!("the address space is limited to {room:.1} GB (ulimit -v), too little for a GPU driver")
    })
}

/// Why `auto` does not take a GPU.
#[derive(Debug, thiserror::Error)]
enum Refused {
    /// The driver panicked; what it said.
    #[error("{0}")]
    Panic(String),
    /// The device does not open.
    #[error(transparent)]
    Device(#[from] SolveError),
}

/// The value of `f`, or its panic.
fn quietly<T>(f: impl FnOnce() -> T) -> Result<T, Refused> {
    // What the driver's panic would print on stderr is told as the reason instead.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let done = catch_unwind(AssertUnwindSafe(f));
    std::panic::set_hook(hook);
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("the driver panicked");
        Refused::Panic(text.to_owned())
    })
}

impl Choice {
    /// Tolerance of a chart that stands in for the kernel; `None` where each tap must be solved: by the reference, and in f64.
    pub fn chart_tolerance(&self) -> Option<f64> {
        self.backend.tolerance.filter(|_| self.precision == Precision::F32)
    }

    /// Decides from the options; looks for adapters only where one may be used. What `auto` takes has been opened: where that
    /// fails it is the CPU, and the reason says why.
    pub fn new(options: &RunOptions) -> Result<Self, Error> {
        let begun = Instant::now();
        let choice = Self::found(options)?;
        Ok(Self { seconds: begun.elapsed().as_secs_f64(), ..choice })
    }

    fn found(options: &RunOptions) -> Result<Self, Error> {
        match options.backend.unwrap_or(BackendChoice::Auto) {
            BackendChoice::Cpu | BackendChoice::Reference => Self::among(options, &[]),
            BackendChoice::Gpu => Self::among(options, &gpu::adapters()),
            BackendChoice::Auto => {
                let instead = |why: String| {
                    let mut cpu = Self::among(&RunOptions { adapter: None, ..options.clone() }, &[])?;
                    cpu.backend.reason = why;
                    Ok(cpu)
                };
                if let Some(why) = cramped().filter(|_| options.adapter.is_none()) {
                    return instead(why);
                }
                let adapters = match quietly(gpu::adapters) {
                    Ok(adapters) => adapters,
                    Err(why) => return instead(format!("looking for adapters failed: {why}")),
                };
                let choice = Self::among(options, &adapters)?;
                match choice.solves() {
                    Ok(()) => Ok(choice),
                    Err(why) => instead(format!("the GPU does not open: {why}")),
                }
            }
        }
    }

    /// Opens the device and keeps it for [`Self::solver`].
    fn solves(&self) -> Result<(), Refused> {
        let Some(adapter) = &self.adapter else { return Ok(()) };
        let gpu = quietly(|| Gpu::new(adapter.clone(), self.precision))??;
        self.opened.lock().unwrap_or_else(PoisonError::into_inner).replace(gpu);
        Ok(())
    }

    /// As [`Self::new`] on a machine with these adapters.
    pub fn among(options: &RunOptions, adapters: &[Adapter]) -> Result<Self, Error> {
        let asked = options.backend.unwrap_or(BackendChoice::Auto);
        let precision = options.precision.unwrap_or(Precision::F32);
        let name = options.adapter.as_deref();
        let found = gpu::pick(adapters, name);
        if let (Some(name), None, BackendChoice::Auto | BackendChoice::Gpu) = (name, &found, asked) {
            return Err(InputError::new("no adapter has this in its name")
                .key("--adapter")
                .value(name)
                .allowed(names(adapters))
                .into());
        }
        let usable = |a: &Adapter| precision == Precision::F32 || a.f64;
        let (name, adapter, reason) = match (asked, found) {
            (BackendChoice::Reference, _) => ("reference", None, "asked for".to_owned()),
            (BackendChoice::Cpu, _) => ("cpu", None, "asked for".to_owned()),
            (BackendChoice::Gpu, None) => {
                return Err(InputError::new(
                    "no Vulkan, Metal or DirectX 12 adapter was found on this machine",
                )
                .key("--backend")
                .value("gpu")
                .allowed("auto, cpu, reference; or install a driver (Debian: mesa-vulkan-drivers)")
                .into());
            }
            (BackendChoice::Gpu, Some(a)) if !usable(&a) => {
                return Err(InputError::new(format!("the shaders of {} have no f64", a.name))
                    .key("--precision")
                    .value("f64")
                    .allowed("f32, or --backend cpu --precision f64")
                    .into());
            }
            (BackendChoice::Gpu, Some(a)) => ("gpu", Some(a), "asked for".to_owned()),
            (BackendChoice::Auto, None) => ("cpu", None, "no Vulkan, Metal or DirectX 12 adapter".to_owned()),
            (BackendChoice::Auto, Some(a)) if !usable(&a) => ("cpu", None, format!("{} has no f64", a.name)),
            (BackendChoice::Auto, Some(a)) => {
                let reason =
                    if a.software { "software adapter, no hardware one" } else { "hardware adapter" };
                ("gpu", Some(a), reason.to_owned())
            }
        };
        let precision = if name == "reference" { Precision::F64 } else { precision };
        let tolerance = tolerance(options, precision).map(|t| Some(t).filter(|_| name != "reference"))?;
        let threads = rayon::current_num_threads();
        let backend = Backend {
            name,
            reason,
            adapter: adapter.as_ref().map(|a| a.name.clone()),
            driver: adapter.as_ref().map(|a| a.driver.clone()),
            precision: if precision == Precision::F32 { "f32" } else { "f64" },
            tolerance,
            threads,
            instructions: (name == "cpu").then(Cpu::instructions),
            software: adapter.as_ref().is_some_and(|a| a.software),
        };
        Ok(Self { backend, seconds: 0.0, precision, adapter, opened: Mutex::new(None) })
    }

    /// Opens the device for taps of `model`.
    pub fn open(&self, model: &Model) -> Result<Method, Error> {
        if self.backend.tolerance.is_none() {
            return Ok(Method::Reference);
        }
        Ok(self.method(self.solver()?, model))
    }

    /// Opens the device of a fast kernel; it serves any model.
    pub fn solver(&self) -> Result<Box<dyn Solver>, Error> {
        let opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner).take();
        Ok(match &self.adapter {
            Some(adapter) => match opened {
                Some(gpu) => Box::new(gpu),
                None => Box::new(Gpu::new(adapter.clone(), self.precision)?),
            },
            None => Box::new(Cpu::new(self.precision)),
        })
    }

    /// Solves taps of `model` with `solver`, which [`Self::solver`] has opened; the reference takes none.
    pub fn method(&self, solver: Box<dyn Solver>, model: &Model) -> Method {
        match self.backend.tolerance {
            Some(tolerance) => {
                let rungs = Rung::ladder(self.precision, &model.material, tolerance);
                Method::Fast { solver, rungs, tolerance }
            }
            None => Method::Reference,
        }
    }
}

/// The tolerance in force; an error for one that the precision cannot reach.
fn tolerance(options: &RunOptions, precision: Precision) -> Result<f64, InputError> {
    let (default, least) = match precision {
        Precision::F32 => (1e-5, smallest_tolerance(precision)),
        Precision::F64 => (1e-8, smallest_tolerance(precision)),
    };
    let t = options.tolerance.unwrap_or(default);
    let reference = options.backend == Some(BackendChoice::Reference);
    if !reference && !(least..1.0).contains(&t) {
        let hint = if precision == Precision::F32 { "; --precision f64 reaches 1e-10" } else { "" };
        let error = InputError::new("this precision cannot keep such a tolerance")
            .allowed(format!("{least:e} … 1 (exclusive){hint}"));
        return Err(match options.tolerance_at.clone() {
            None => error.key("--tolerance").value(t),
            Some(Written { file, text, line, span }) => error
                .key("run.tolerance")
                .value(&text[span.clone()])
                .at(&file, Some(line))
                .snippet(&file, &text, span),
        });
    }
    Ok(t)
}

/// What there is to compute on: `adapters`, and the CPU.
pub fn listed(adapters: &[Adapter]) -> Value {
    let one = |a: &Adapter| {
        json!({
            "name": a.name, "driver": a.driver, "api": a.api, "software": a.software, "f64": a.f64,
            "max_binding_bytes": a.max_binding, "max_workgroups": a.max_workgroups, "features": a.features,
        })
    };
    let cpu = json!({ "threads": rayon::current_num_threads(), "instructions": Cpu::instructions() });
    json!({ "adapters": adapters.iter().map(one).collect::<Vec<_>>(), "cpu": cpu })
}

fn names(adapters: &[Adapter]) -> String {
    match adapters {
        [] => "nothing: this machine has no adapter".to_owned(),
        some => some.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(", "),
    }
}
