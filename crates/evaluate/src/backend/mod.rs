//! The choice of the backend, from the options and the machine, with its reason.

mod drivers;

use std::fmt::Write;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::kernel::{
    Solver,
    cpu::Cpu,
    gpu::{self, Adapter, Gpu, Log},
    rule::smallest_tolerance,
};
use crate::scene::{BackendChoice, Model, Precision, RunOptions};
use drivers::found;
pub use drivers::{adapters, answer, ask_by, look};

/// The chosen backend; part of `run.json`.
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
    /// Bound on the strain error; None for the reference, which ignores it.
    pub tolerance: Option<f64>,
    /// CPU threads.
    pub threads: usize,
    /// Instruction set of the CPU kernels.
    pub instructions: Option<&'static str>,
    /// True if the adapter runs on the CPU.
    #[serde(skip)]
    pub software: bool,
    /// Checks and faults of the device.
    #[serde(skip_serializing_if = "Log::is_empty")]
    pub device: Log,
}

/// A backend chosen but not opened.
#[derive(Debug)]
pub struct Choice {
    /// The backend that will run.
    pub backend: Backend,
    /// Seconds spent looking for adapters and opening one.
    pub seconds: f64,
    precision: Precision,
    adapter: Option<Adapter>,
    /// True if the device is compared with the CPU and hands over to it.
    watched: bool,
    opened: Mutex<Option<Gpu>>,
}

/// Least work for a driver, in seconds of all CPU threads: starting one takes 0.5 to 2 s on an H100 (results/2026-11-27-h100/before.md).
pub const PAYS: f64 = 2.0;

/// Address space below which `auto` uses no driver, bytes: at its limit they fail, abort or crash, lavapipe from some 1 GB on with two threads.
const ROOM: u64 = 8 << 30;

/// Why no driver may be used: the address space is limited (`ulimit -v`).
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
    /// The warnings of a spec, and the faults of its device.
    pub fn warnings(&self, of_spec: &[String]) -> Vec<String> {
        [of_spec, &self.device.get().words[..]].concat()
    }

    /// The comparison of its device with the CPU, and the device's faults, a line each; empty without a device.
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
    /// Tolerance of charts in place of the kernel; `None` if each tap must be solved: by the reference, and in f64.
    pub fn chart_tolerance(&self) -> Option<f64> {
        self.backend.tolerance.filter(|_| self.precision == Precision::F32)
    }

    /// Decides from the options; looks for adapters only where one may be used. `auto` opens a device, or takes the CPU if that fails.
    pub fn new(options: &RunOptions) -> Result<Self, Error> {
        let begun = Instant::now();
        let choice = Self::found(options)?;
        Ok(Self { seconds: begun.elapsed().as_secs_f64(), ..choice })
    }

    /// [`Self::new`], but `auto` takes the CPU if a device does not pay for `work`, seconds of all CPU threads, or if there is none for it.
    pub fn for_work(options: &RunOptions, work: Option<f64>) -> Result<Self, Error> {
        let free = matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none();
        let why = match work {
            None => "such taps are solved on the CPU",
            Some(seconds) if seconds < PAYS => "too short a run to look for a GPU",
            Some(_) => return Self::new(options),
        };
        if free && gpu::forked().is_none() { Self::instead(options, why.into()) } else { Self::new(options) }
    }

    fn found(options: &RunOptions) -> Result<Self, Error> {
        let asked = options.backend.unwrap_or(BackendChoice::Auto);
        let wanted = asked == BackendChoice::Gpu || asked == BackendChoice::Auto && options.adapter.is_some();
        if let Some(why) = gpu::forked().filter(|_| wanted) {
            return Err(Error::Run(why.into()));
        }
        match asked {
            _ if wanted => Self::among(options, &adapters(true)?)?.opened(),
            BackendChoice::Cpu | BackendChoice::Reference => Self::among(options, &[]),
            BackendChoice::Auto | BackendChoice::Gpu => {
                if let Some(why) = cramped().or(gpu::forked().map(str::to_owned)) {
                    return Self::instead(options, why);
                }
                if let Some((seen, faults)) = found()
                    && seen.iter().all(|(.., software)| *software)
                {
                    let software = seen.iter().map(|(name, ..)| name.as_str());
                    return Self::instead(options, no_hardware(software, faults));
                }
                let (adapters, faults) = look();
                if adapters.iter().all(|a| a.software) {
                    let software = adapters.iter().map(|a| a.name.as_str());
                    return Self::instead(options, no_hardware(software, &faults));
                }
                faults.iter().for_each(|why| gpu::hear(why));
                let opened = Self::among(options, &adapters)?.opened();
                opened.or_else(|why| Self::instead(options, format!("the GPU does not open: {why}")))
            }
        }
    }

    fn instead(options: &RunOptions, why: String) -> Result<Self, Error> {
        let mut cpu = Self::among(&RunOptions { adapter: None, ..options.clone() }, &[])?;
        cpu.backend.reason = why;
        Ok(cpu)
    }

    /// Opens its device, if it has one, watched: compared with the CPU, which takes over at a fault.
    fn opened(self) -> Result<Self, Error> {
        let watched = Self { watched: true, ..self };
        let opened = watched.adapter.as_ref().map(|adapter| watched.device(adapter)).transpose()?;
        Ok(Self { opened: Mutex::new(opened), ..watched })
    }

    fn device(&self, adapter: &Adapter) -> Result<Gpu, Error> {
        let gpu = Gpu::new(adapter.clone(), self.precision)?;
        Ok(if self.watched { gpu.watched(self.backend.device.clone()) } else { gpu })
    }

    /// [`Self::new`] on a machine with these adapters. The device is not watched: a fault ends the run, or shows.
    pub fn among(options: &RunOptions, adapters: &[Adapter]) -> Result<Self, Error> {
        let asked = options.backend.unwrap_or(BackendChoice::Auto);
        let precision = options.precision.unwrap_or(Precision::F32);
        let name = options.adapter.as_deref();
        let found = gpu::pick(adapters, name);
        if let (Some(name), None, BackendChoice::Auto | BackendChoice::Gpu) = (name, &found, asked) {
            let error = InputError::new("no adapter has this in its name").allowed(names(adapters));
            return Err(error.key("--adapter").value(name).into());
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
        let opened = Mutex::default();
        Ok(Self { backend, seconds: 0.0, precision, adapter, watched: false, opened })
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
        let Some(adapter) = &self.adapter else { return Ok(Box::new(Cpu::new(self.precision))) };
        let opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner).take();
        Ok(Box::new(opened.map_or_else(|| self.device(adapter), Ok)?))
    }

    /// Solves taps of `model` with `solver` from [`Self::solver`]; the reference uses none.
    pub fn method(&self, solver: Box<dyn Solver>, model: &Model) -> Method {
        match self.backend.tolerance {
            Some(tolerance) => Method::fast(solver, self.precision, &model.material, tolerance),
            None => Method::Reference,
        }
    }
}

fn tolerance(options: &RunOptions, precision: Precision) -> Result<f64, InputError> {
    let (single, least) = (precision == Precision::F32, smallest_tolerance(precision));
    let default = if single { 1e-5 } else { 1e-8 };
    let t = options.tolerance.unwrap_or(default);
    let reference = options.backend == Some(BackendChoice::Reference);
    if !reference && !(least..1.0).contains(&t) {
        let hint = if single { "; --precision f64 reaches 1e-10" } else { "" };
        let error =
            InputError::new("this precision cannot keep such a tolerance").key("--tolerance").value(t);
        return Err(error.allowed(format!("{least:e} … 1 (exclusive){hint}")));
    }
    Ok(t)
}

/// Why `auto` takes the CPU on a machine without a hardware adapter: its `software` ones, and driver faults.
fn no_hardware<'a>(software: impl Iterator<Item = &'a str>, faults: &[String]) -> String {
    let software: Vec<&str> = software.collect();
    let mut why: Vec<String> = faults.to_vec();
    match software[..] {
        [] if faults.is_empty() => why.push("no Vulkan, Metal or DirectX 12 adapter".to_owned()),
        [] => {}
        _ => {
            let all = software.join(" or ");
            why.push(format!("no hardware adapter; --backend gpu takes the software adapter {all}"));
        }
    }
    why.join("; ")
}

/// The devices as JSON: `adapters`, the CPU, and driver faults.
pub fn listed(adapters: &[Adapter], faults: &[String]) -> Value {
    let cpu = json!({ "threads": rayon::current_num_threads(), "instructions": Cpu::instructions() });
    json!({ "adapters": adapters, "faults": faults, "cpu": cpu })
}

fn names(adapters: &[Adapter]) -> String {
    match adapters {
        [] => "nothing: this machine has no adapter".to_owned(),
        some => some.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(", "),
    }
}
