//! Backends to verify: all that the machine has, or those that the options name.

use crate::backend::{Backend, Choice, adapters, cramped};
use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::kernel::Solver;
use crate::kernel::gpu::Adapter;
use crate::scene::{BackendChoice, Model, Precision, RunOptions};

/// Largest strain error of a kernel over its tolerance: what is promised, and for f64, whose tolerance comes near the error of
/// two independent codes, twice that.
fn share(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1.0,
        Precision::F64 => 2.0,
    }
}

/// One backend in one precision, and what its answers may be wrong by.
pub struct Place {
    choice: Choice,
    /// Bound on the strain error.
    pub bound: f64,
    solver: Option<Box<dyn Solver>>,
}

impl Place {
    fn new(choice: Choice, precision: Precision, bound: Option<f64>) -> Self {
        let tolerance = choice.backend.tolerance.unwrap_or_default();
        Self { bound: bound.unwrap_or(share(precision) * tolerance), choice, solver: None }
    }

    /// Which backend it is.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// `cpu f32`, `gpu f64`.
    pub fn label(&self) -> String {
        format!("{} {}", self.choice.backend.name, self.choice.backend.precision)
    }

    /// Tolerance of a chart that stands in for the CPU kernel where designs are ranked; `None` where there is none.
    pub(super) fn chart_tolerance(&self) -> Option<f64> {
        self.choice.chart_tolerance().filter(|_| self.backend().name == "cpu")
    }

    /// What solves taps of `model`, on a device of its own.
    ///
    /// # Errors
    /// Where the device does not open.
    pub fn method(&self, model: &Model) -> Result<Method, Error> {
        self.choice.open(model)
    }

    /// What solves taps of `model`; the device is opened on first use and kept.
    pub(super) fn open(&mut self, model: &Model) -> Result<Method, Error> {
        let solver = self.solver.take().map_or_else(|| self.choice.solver(), Ok)?;
        Ok(self.choice.method(solver, model))
    }

    /// Takes the device back.
    pub(super) fn keep(&mut self, method: Method) {
        if let Method::Fast { solver, .. } = method {
            self.solver = Some(solver);
        }
    }
}

/// Every backend that `options` leave: the CPU kernels and each adapter, in each precision they have. `bound` replaces the
/// bounds that follow from the tolerance.
///
/// # Errors
/// Where the options leave none, or name one that the machine lacks.
pub fn present(options: &RunOptions, bound: Option<f64>) -> Result<Vec<Place>, Error> {
    let asked = options.backend.unwrap_or(BackendChoice::Auto);
    if asked == BackendChoice::Reference {
        let error = InputError::new("the reference is what the other backends are compared with");
        return Err(error.key("--backend").value("reference").allowed("auto (all), gpu, cpu").into());
    }
    let named = options.adapter.is_some() && asked == BackendChoice::Auto;
    let mut places = Vec::new();
    if asked != BackendChoice::Gpu && !named {
        for precision in precisions(options) {
            let options = narrowed(options, BackendChoice::Cpu, precision);
            places.push(Place::new(Choice::among(&options, &[])?, precision, bound));
        }
    }
    if asked != BackendChoice::Cpu {
        let cramped = asked == BackendChoice::Auto && !named && cramped().is_some();
        let needed = asked == BackendChoice::Gpu || named;
        let present = if cramped { Vec::new() } else { adapters(needed)? };
        let adapters = wanted(&present, options)?;
        for adapter in &adapters {
            for precision in precisions(options) {
                let absent = precision == Precision::F64 && !adapter.f64;
                if absent && (options.precision.is_none() || asked == BackendChoice::Auto) {
                    continue;
                }
                let options = narrowed(options, BackendChoice::Gpu, precision);
                let choice = Choice::among(&options, std::slice::from_ref(adapter))?;
                places.push(Place::new(choice, precision, bound));
            }
        }
    }
    if places.is_empty() {
        let error = InputError::new("no adapter of this name has f64 in its shaders");
        let error = error.key("--precision").value("f64");
        return Err(error.allowed("f32, or --backend cpu --precision f64").into());
    }
    Ok(places)
}

fn precisions(options: &RunOptions) -> Vec<Precision> {
    options.precision.map_or_else(|| vec![Precision::F32, Precision::F64], |p| vec![p])
}

fn narrowed(options: &RunOptions, backend: BackendChoice, precision: Precision) -> RunOptions {
    RunOptions { backend: Some(backend), precision: Some(precision), ..options.clone() }
}

/// The adapters whose name holds what was asked for; an error, in the words of a sweep, where one is asked for and none is there.
fn wanted(adapters: &[Adapter], options: &RunOptions) -> Result<Vec<Adapter>, Error> {
    let name = options.adapter.as_deref().unwrap_or_default().to_lowercase();
    let found: Vec<Adapter> =
        adapters.iter().filter(|a| a.name.to_lowercase().contains(&name)).cloned().collect();
    if found.is_empty() && (options.backend == Some(BackendChoice::Gpu) || options.adapter.is_some()) {
        let gpu = narrowed(options, BackendChoice::Gpu, Precision::F32);
        Choice::among(&RunOptions { tolerance: None, ..gpu }, adapters)?;
    }
    Ok(found)
}
