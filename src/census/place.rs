//! Where taps are solved: the CPU kernels and every adapter, in each precision they have.

use crate::backend::{Backend, Choice, adapters, cramped};
use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::kernel::gpu::Adapter;
use crate::scene::{BackendChoice, Model, Precision, RunOptions};

/// Largest strain error of a kernel over its tolerance: what is promised, and for f64, whose tolerance comes near the error of
/// two independent codes, twice that.
fn share(precision: Precision) -> f64 {
    if precision == Precision::F32 { 1.0 } else { 2.0 }
}

/// One backend in one precision, and what its answers may be wrong by.
pub struct Place {
    /// What is asked of the machine.
    options: RunOptions,
    /// The adapter, for a GPU.
    pub adapter: Option<Adapter>,
    /// Type of its numbers.
    pub precision: Precision,
    /// As a sweep would take it.
    pub choice: Choice,
    /// Bound on the strain error.
    pub bound: f64,
}

impl Place {
    /// `backend` in `precision`, and what else the `options` say.
    ///
    /// # Errors
    /// A tolerance that the precision cannot reach, an adapter without it.
    pub fn new(
        options: &RunOptions,
        (backend, precision, adapter): (BackendChoice, Precision, Option<&Adapter>),
        bound: Option<f64>,
    ) -> Result<Self, Error> {
        let options = RunOptions { backend: Some(backend), precision: Some(precision), ..options.clone() };
        let choice = Choice::among(&options, adapter.map_or(&[], std::slice::from_ref))?;
        let bound = bound.unwrap_or(share(precision) * choice.backend.tolerance.unwrap_or_default());
        Ok(Self { options, adapter: adapter.cloned(), precision, choice, bound })
    }

    /// This place at `tolerance`.
    ///
    /// # Errors
    /// A tolerance that the precision cannot reach.
    pub fn at(&self, tolerance: f64) -> Result<Choice, Error> {
        let options = RunOptions { tolerance: Some(tolerance), ..self.options.clone() };
        Choice::among(&options, self.adapter.as_slice())
    }

    /// Which backend it is.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// Whether this is the reference.
    pub fn is_reference(&self) -> bool {
        self.backend().tolerance.is_none()
    }

    /// `cpu f32`, `gpu f64`.
    pub fn label(&self) -> String {
        format!("{} {}", self.backend().name, self.backend().precision)
    }

    /// Tolerance of a chart that stands in for the CPU kernel where designs are ranked; `None` where there is none.
    pub(super) fn chart_tolerance(&self) -> Option<f64> {
        self.choice.chart_tolerance().filter(|_| self.backend().name == "cpu")
    }

    /// What solves taps of `model`, on a device of its own.
    pub fn method(&self, model: &Model) -> Result<Method, Error> {
        self.choice.open(model)
    }
}

/// Every fast backend that `options` leave: the CPU kernels and each adapter, in each precision they have. `bound` replaces the
/// bounds that follow from the tolerance.
///
/// # Errors
/// Where the options leave none, or name one that the machine lacks.
pub fn present(options: &RunOptions, bound: Option<f64>) -> Result<Vec<Place>, Error> {
    if let Some(b) = bound.filter(|b| !(*b > 0.0 && b.is_finite())) {
        let error = InputError::new("a bound on an error must be a positive number");
        return Err(error.key("--bound").value(b).allowed("> 0").into());
    }
    let asked = options.backend.unwrap_or(BackendChoice::Auto);
    let name = options.adapter.as_deref().unwrap_or_default().to_lowercase();
    let free = asked == BackendChoice::Auto && name.is_empty();
    let precisions = options.precision.map_or_else(|| vec![Precision::F32, Precision::F64], |p| vec![p]);
    let mut places = Vec::new();
    if free || asked == BackendChoice::Cpu {
        for &precision in &precisions {
            places.push(Place::new(options, (BackendChoice::Cpu, precision, None), bound)?);
        }
    }
    if matches!(asked, BackendChoice::Auto | BackendChoice::Gpu) {
        let present = if free && cramped().is_some() { Vec::new() } else { adapters(!free)? };
        let wanted: Vec<&Adapter> =
            present.iter().filter(|a| a.name.to_lowercase().contains(&name)).collect();
        if wanted.is_empty() && !free {
            // It fails, in the words of a sweep.
            let asked = RunOptions { backend: Some(BackendChoice::Gpu), ..options.clone() };
            Choice::among(&RunOptions { precision: None, tolerance: None, ..asked }, &present)?;
        }
        for adapter in wanted {
            for &precision in &precisions {
                let absent = precision == Precision::F64 && !adapter.f64;
                if !absent || options.precision.is_some() && asked != BackendChoice::Auto {
                    places.push(Place::new(options, (BackendChoice::Gpu, precision, Some(adapter)), bound)?);
                }
            }
        }
    }
    if places.is_empty() && asked != BackendChoice::Reference {
        let error = InputError::new("no adapter of this name has f64 in its shaders");
        let error = error.key("--precision").value("f64");
        return Err(error.allowed("f32, or --backend cpu --precision f64").into());
    }
    Ok(places)
}
