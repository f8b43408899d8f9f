//! Which backend runs: what was asked, what the machine has, and why the one was taken.

#[cfg(unix)]
mod crash;
mod drivers;
mod listed;
mod pays;
mod verdicts;

use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;

use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::kernel::{
    Effects, Job, Rung, Solver,
    cpu::Cpu,
    gpu::{self, Adapter, Fault, Gpu, Log, Watched, quietly},
    rule::smallest_tolerance,
};
use crate::scene::{
    BackendChoice, Contact, Geometry, Material, Model, Precision, RunOptions, Setup, Written,
};
#[cfg(unix)]
pub use crash::tell_crashes;
pub use drivers::{Found, Seen, adapters, answer, ask_by, found, look};
pub use listed::listed;
use listed::{names, no_hardware};
pub use pays::Work;
pub use verdicts::VARIABLE as SELF_CHECK;

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
    /// What was checked of the device, and what it did wrong.
    #[serde(skip_serializing_if = "Log::is_empty")]
    pub device: Log,
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
    /// Whether a device that fails is opened again and its work handed over; what of it is known.
    watched: Option<Arc<verdicts::Cache>>,
    /// What `auto` was asked, which may take the CPU instead.
    auto: Option<RunOptions>,
    /// The device, once it has been opened.
    opened: Mutex<Option<Watched>>,
    /// Rungs for a material, whose charts need not be made twice.
    rungs: Mutex<Option<(Material, Vec<Rung>)>>,
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

impl Backend {
    /// The warnings of a spec and what its device did wrong.
    pub fn warnings(&self, of_spec: &[String]) -> Vec<String> {
        [of_spec, &self.device.get().words[..]].concat()
    }

    /// What the comparison of its device with the CPU found, and what the device did wrong, a line each; nothing without a device.
    pub fn compared(&self) -> String {
        let told = self.device.get();
        let mut text = String::new();
        if told.compared_taps > 0 {
            let (taps, worst) = (told.compared_taps, told.compared_worst);
            let _ = writeln!(
                text,
                "{taps} taps of the GPU compared with the CPU: strain errors up to {worst:.2} of the tolerance"
            );
        }
        told.words.iter().for_each(|words| text += &format!("GPU: {words}\n"));
        text
    }
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

    /// As [`Self::new`], and [checked](Self::check) for taps of `setup`; `auto` takes the CPU where a device does not pay for the `work`.
    pub fn for_taps(options: &RunOptions, setup: &Setup, work: Work) -> Result<Self, Error> {
        let begun = Instant::now();
        let free = matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none();
        if free && work.0 < pays::PAYS && gpu::forked().is_none() {
            return Self::instead(options, "too short a run to look for a GPU".into());
        }
        let mut choice = Self::found(options)?;
        choice.check(setup)?;
        Ok(Self { seconds: begun.elapsed().as_secs_f64(), ..choice })
    }

    fn found(options: &RunOptions) -> Result<Self, Error> {
        let asked = options.backend.unwrap_or(BackendChoice::Auto);
        let wanted = asked == BackendChoice::Gpu || asked == BackendChoice::Auto && options.adapter.is_some();
        if let Some(why) = gpu::forked().filter(|_| wanted) {
            return Err(Error::Run(why.into()));
        }
        match asked {
            BackendChoice::Cpu | BackendChoice::Reference => Self::among(options, &[]),
            BackendChoice::Gpu => Ok(Self::among(options, &adapters(true)?)?.watched()),
            BackendChoice::Auto if options.adapter.is_some() => {
                Self::among(options, &adapters(true)?)?.opened(options)
            }
            BackendChoice::Auto => {
                if let Some(why) = cramped().or(gpu::forked().map(str::to_owned)) {
                    return Self::instead(options, why);
                }
                // Without hardware this process asks no driver.
                if let Some(found) = found().filter(|found| found.adapters.iter().all(|a| a.software)) {
                    let software = found.adapters.iter().map(|a| a.name.as_str());
                    return Self::instead(options, no_hardware(software, &found.faults));
                }
                let (adapters, faults) = look();
                if adapters.iter().all(|a| a.software) {
                    let software = adapters.iter().map(|a| a.name.as_str());
                    return Self::instead(options, no_hardware(software, &faults));
                }
                faults.iter().for_each(|why| gpu::hear(why));
                Self::among(options, &adapters)?.opened(options)
            }
        }
    }

    /// The device, opened, which `auto` takes; else the CPU.
    fn opened(self, options: &RunOptions) -> Result<Self, Error> {
        let choice = self.watched();
        match choice.solves() {
            Ok(()) => Ok(Self { auto: Some(options.clone()), ..choice }),
            Err(why) => Self::instead(options, format!("the GPU does not open: {why}")),
        }
    }

    /// The CPU where `auto` cannot take a GPU, as `why` says.
    fn instead(options: &RunOptions, why: String) -> Result<Self, Error> {
        let mut cpu = Self::among(&RunOptions { adapter: None, ..options.clone() }, &[])?;
        cpu.backend.reason = why;
        Ok(cpu)
    }

    /// With a device that is watched: it has to pass self-checks, and what it fails to do is done again or handed over to the CPU.
    pub fn watched(self) -> Self {
        let watched = self.adapter.as_ref().map(|adapter| Arc::new(verdicts::Cache::of(adapter)));
        Self { watched, ..self }
    }

    /// [`Self::watched`] without what earlier runs know, and leaving nothing for later ones.
    pub fn watched_anew(self) -> Self {
        let watched = self.adapter.as_ref().map(|adapter| Arc::new(verdicts::Cache::at(None, adapter, "")));
        Self { watched, ..self }
    }

    /// Opens the device and keeps it for [`Self::solver`].
    fn solves(&self) -> Result<(), String> {
        let (Some(adapter), Some(verdicts)) = (&self.adapter, &self.watched) else { return Ok(()) };
        let gpu = quietly(|| Gpu::new(adapter.clone(), self.precision))?.map_err(|e| e.to_string())?;
        let watched = Watched::new(gpu, verdicts.clone(), self.backend.device.clone());
        self.opened.lock().unwrap_or_else(PoisonError::into_inner).replace(watched);
        Ok(())
    }

    /// Refuses a device whose kernels for taps of `setup` give wrong answers: `auto` then takes the CPU, and says why.
    ///
    /// # Errors
    /// A GPU that was asked for and is refused, with figures.
    pub fn check(&mut self, setup: &Setup) -> Result<(), Error> {
        let Err(why) = self.admits(setup) else { return Ok(()) };
        if let Some(options) = &self.auto {
            let (seconds, device) = (self.seconds, self.backend.device.clone());
            *self = Self { seconds, ..Self::instead(options, format!("the GPU is refused: {why}"))? };
            self.backend.device = device;
            return Ok(());
        }
        if let Fault::Slow(_) = why {
            // It gives no wrong answers, and has been given up: its work is handed over, as that of one that hangs later.
            return Ok(());
        }
        let name = self.backend.adapter.as_deref().unwrap_or("the GPU");
        Err(InputError::new(format!("{name} is refused: {why}"))
            .key("--backend")
            .value("gpu")
            .allowed(format!("cpu, reference, auto; {SELF_CHECK}=off takes it unchecked"))
            .into())
    }

    /// Whether the kernels for taps of `setup` are right on the device, as far as they are surely used; the others are checked when they are.
    pub fn admits(&self, setup: &Setup) -> Result<(), Fault> {
        let (Some(_), Some(tolerance), Geometry::Exact) =
            (&self.watched, self.backend.tolerance, setup.model.geometry)
        else {
            return Ok(());
        };
        if self.opened.lock().unwrap_or_else(PoisonError::into_inner).is_none() {
            self.solves().map_err(Fault::Lost)?;
        }
        let rungs = self.rungs(&setup.model.material, tolerance);
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(device) = opened.as_mut() else { return Ok(()) };
        let grips: &[bool] = match setup.model.contact {
            // What rolls on a pole is solved on the CPU.
            Contact::Stick if setup.model.pole_radius > 0.0 => &[],
            Contact::Coulomb(f64::MIN_POSITIVE..) if setup.model.pole_radius > 0.0 => &[false],
            Contact::Stick => &[true],
            Contact::Coulomb(f64::MIN_POSITIVE..) => &[true, false],
            _ => &[false],
        };
        grips.iter().try_for_each(|&stick| {
            let effects = Effects::new(&setup.model, setup.gauge.side, stick);
            let (rule, chart) = (&rungs[0].rule, rungs[0].chart());
            device.admit(&Job { effects, rule, tolerance, chart })
        })
    }

    /// Rungs for `material`, with the charts that have been made of it.
    fn rungs(&self, material: &Material, tolerance: f64) -> Vec<Rung> {
        let mut kept = self.rungs.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some((of, rungs)) if of == material => rungs.clone(),
            _ => {
                let rungs = Rung::ladder(self.precision, material, tolerance);
                // A chart made through the copy that is kept is there for the next.
                if let Some(first) = rungs.first().filter(|_| self.watched.is_some()) {
                    first.chart();
                }
                kept.replace((*material, rungs.clone()));
                rungs
            }
        }
    }

    /// As [`Self::new`] on a machine with these adapters, of which the one taken is not watched: what it does wrong ends the run, or shows.
    pub fn among(options: &RunOptions, adapters: &[Adapter]) -> Result<Self, Error> {
        let asked = options.backend.unwrap_or(BackendChoice::Auto);
        let precision = options.precision.unwrap_or(Precision::F32);
        let name = options.adapter.as_deref();
        let found = gpu::pick(adapters, name);
        if let (Some(name), None, BackendChoice::Auto | BackendChoice::Gpu) = (name, &found, asked) {
            let error = InputError::new("no adapter has this in its name").allowed(names(adapters));
            return Err(placed(error, "adapter", name, options.adapter_at.as_ref()).into());
        }
        let usable = |a: &Adapter| precision == Precision::F32 || a.f64;
        let (name, adapter, reason) = match (asked, found) {
            (BackendChoice::Reference, _) => ("reference", None, "asked for".to_owned()),
            (BackendChoice::Cpu, _) => ("cpu", None, "asked for".to_owned()),
            (BackendChoice::Gpu, None) => {
                let why = "no Vulkan, Metal or DirectX 12 adapter was found on this machine";
                let allowed = "auto, cpu, reference; or install a driver (Debian: mesa-vulkan-drivers)";
                return Err(InputError::new(why).key("--backend").value("gpu").allowed(allowed).into());
            }
            (BackendChoice::Gpu, Some(a)) if !usable(&a) => {
                let error = InputError::new(format!("the shaders of {} have no f64", a.name));
                let error = error.key("--precision").value("f64");
                return Err(error.allowed("f32, or --backend cpu --precision f64").into());
            }
            (BackendChoice::Gpu, Some(a)) => ("gpu", Some(a), "asked for".to_owned()),
            (BackendChoice::Auto, None) => ("cpu", None, no_hardware([].into_iter(), &[])),
            // One that is named is asked for.
            (BackendChoice::Auto, Some(a)) if a.software && options.adapter.is_none() => {
                ("cpu", None, no_hardware(adapters.iter().map(|a| a.name.as_str()), &[]))
            }
            (BackendChoice::Auto, Some(a)) if !usable(&a) => ("cpu", None, format!("{} has no f64", a.name)),
            (BackendChoice::Auto, Some(a)) => {
                let reason = if options.adapter.is_some() { "asked for" } else { "hardware adapter" };
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
            device: Log::default(),
        };
        let (opened, rungs) = (Mutex::default(), Mutex::default());
        Ok(Self { backend, seconds: 0.0, precision, adapter, watched: None, auto: None, opened, rungs })
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
        let Some(adapter) = &self.adapter else { return Ok(Box::new(Cpu::new(self.precision))) };
        if let Some(device) = opened {
            return Ok(Box::new(device));
        }
        let gpu = Gpu::new(adapter.clone(), self.precision)?;
        Ok(match &self.watched {
            Some(verdicts) => Box::new(Watched::new(gpu, verdicts.clone(), self.backend.device.clone())),
            None => Box::new(gpu),
        })
    }

    /// Solves taps of `model` with `solver`, which [`Self::solver`] has opened; the reference takes none.
    pub fn method(&self, solver: Box<dyn Solver>, model: &Model) -> Method {
        match self.backend.tolerance {
            Some(tolerance) => {
                let rungs = self.rungs(&model.material, tolerance);
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
        return Err(placed(error, "tolerance", t, options.tolerance_at.as_ref()));
    }
    Ok(t)
}

/// `error` of an option that was written in a spec, or on the command line.
fn placed(
    error: InputError,
    option: &str,
    value: impl std::fmt::Display,
    at: Option<&Written>,
) -> InputError {
    match at {
        None => error.key(format!("--{option}")).value(value),
        Some(Written { file, text, line, span }) => error
            .key(format!("run.{option}"))
            .value(&text[span.clone()])
            .at(file, Some(*line))
            .snippet(text, span.clone()),
    }
}
