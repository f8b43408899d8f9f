//! Where taps are solved: the CPU kernels and every adapter, in each precision they have.

use crate::backend::{Backend, Choice, adapters, cramped};
use crate::error::{Error, InputError};
use crate::kernel::gpu::Adapter;
use crate::scene::{BackendChoice, Precision, RunOptions};

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
    /// `backend` in `precision`, and what else the `options` say. The bound on its strain error, if nothing else is said, is its tolerance; in f64, whose
    /// tolerance comes near the error of two independent codes, twice that.
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
        let share = if precision == Precision::F32 { 1.0 } else { 2.0 };
        let bound = bound.unwrap_or(share * choice.backend.tolerance.unwrap_or_default());
        Ok(Self { options, adapter: adapter.cloned(), precision, choice, bound })
    }

    /// This place, not the reference, at `tolerance`.
    ///
    /// # Errors
    /// A tolerance that the precision cannot reach.
    pub fn at(&self, tolerance: f64) -> Result<Self, Error> {
        let options = RunOptions { tolerance: Some(tolerance), ..self.options.clone() };
        let backend = if self.adapter.is_some() { BackendChoice::Gpu } else { BackendChoice::Cpu };
        Self::new(&options, (backend, self.precision, self.adapter.as_ref()), None)
    }

    /// Which backend it is.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// `cpu f32`, `gpu f64`.
    pub fn label(&self) -> String {
        format!("{} {}", self.backend().name, self.backend().precision)
    }

    /// The same with its adapter, and the tolerance if one was asked for.
    pub fn name(&self) -> String {
        let adapter = self.backend().adapter.as_ref().map_or(String::new(), |name| format!(" ({name})"));
        let tolerance = self.options.tolerance.map_or(String::new(), |t| format!(" to {t:e}"));
        format!("{}{adapter}{tolerance}", self.label())
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
    let mut devices: Vec<Option<Adapter>> = Vec::new();
    if free || asked == BackendChoice::Cpu {
        devices.push(None);
    }
    if matches!(asked, BackendChoice::Auto | BackendChoice::Gpu) {
        let all = if free && cramped().is_some() { Vec::new() } else { adapters(!free)? };
        devices.extend(all.iter().filter(|a| a.name.to_lowercase().contains(&name)).cloned().map(Some));
        if devices.is_empty() {
            // It fails, in the words of a sweep.
            let asked = RunOptions { backend: Some(BackendChoice::Gpu), ..options.clone() };
            Choice::among(&RunOptions { precision: None, tolerance: None, ..asked }, &all)?;
        }
    }
    let precisions = options.precision.map_or_else(|| vec![Precision::F32, Precision::F64], |p| vec![p]);
    let mut places = Vec::new();
    for device in &devices {
        let backend = if device.is_some() { BackendChoice::Gpu } else { BackendChoice::Cpu };
        for &precision in &precisions {
            let absent = precision == Precision::F64 && device.as_ref().is_some_and(|a| !a.f64);
            if !absent || options.precision.is_some() && asked != BackendChoice::Auto {
                places.push(Place::new(options, (backend, precision, device.as_ref()), bound)?);
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
