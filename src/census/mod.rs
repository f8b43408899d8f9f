//! A census: taps of a space, answered in several ways and compared with one of them.
//!
//! [`sample`] has the taps: rows of a space, or random ones; [`cases`] the configurations and those that are hard to solve. A way to answer them is a setup (whisker, rig,
//! model) and what solves it: a [`Place`] is a backend in a precision, an [`effect`] is switched in the setup. [`Taps`] are made ready for a setup,
//! [`compare`] compares the answers and reduces them to a line of a table. The views: [`verify`] compares backends with the reference, `bench`
//! measures the time of it too, [`explain`] switches effects of the model one by one, [`needed`] leaves off those that change less than a bound.

#[cfg(feature = "commands")]
pub mod bench;
pub mod cases;
pub mod compare;
pub mod effect;
pub mod explain;
pub mod needed;
pub mod sample;
pub mod verify;

use rayon::prelude::*;
use serde::{Serialize, Serializer};

use crate::backend::{Backend, Choice, adapters, cramped};
use crate::design::Design;
use crate::error::{Error, InputError, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::kernel::gpu::Adapter;
use crate::scene::{BackendChoice, Drive, Precision, RunOptions, Setup, Tuple};
pub use effect::{Effect, Setting};
pub use sample::Row;

/// Taps made ready for a setup.
#[derive(Debug)]
pub struct Taps {
    pub setup: Setup,
    pub designs: Vec<Design>,
    /// Taps, those of one whisker after another.
    pub tasks: Vec<Task>,
}

impl Taps {
    /// The taps of `rows`, each of a whisker of its own.
    pub fn of_rows(setup: &Setup, rows: &[Row]) -> Self {
        let designs = rows.par_iter().map(|row| Design::new(setup, row.point)).collect();
        let tasks = (0..).zip(rows).flat_map(|(k, row)| row.taps().map(move |t| Task::of(k, &t))).collect();
        Self { setup: setup.clone(), designs, tasks }
    }

    /// The taps `tuples`, each of a whisker of its own.
    pub fn of(setup: &Setup, tuples: &[Tuple]) -> Self {
        let rows: Vec<Row> = tuples.iter().map(|t| Row::new(*t, [t.a].into())).collect();
        Self::of_rows(setup, &rows)
    }

    /// The answers of `method`.
    pub fn answers(&self, method: Method) -> Result<Vec<Outcome>, SolveError> {
        Evaluator::new(&self.setup, method).run(&self.designs, &self.tasks)
    }

    pub fn design(&self, i: usize) -> &Design {
        &self.designs[self.tasks[i].design as usize]
    }

    fn tuple(&self, i: usize) -> Tuple {
        let Task { a, direction, drive, .. } = self.tasks[i];
        Tuple { a, drive, ..self.design(i).tuple }.towards(direction)
    }

    /// 1e-3 θ f_max of tap `i`: a strain error is relative to the strain, or to this where the strain is smaller.
    pub fn least(&self, i: usize) -> f64 {
        let peak = self.design(i).shared.as_ref().map_or(0.0, |s| s.peak);
        1e-3 * peak * self.tasks[i].driven(&self.setup).size()
    }
}

/// `apart` over `size`; 0 where nothing is apart.
fn relative(apart: f64, size: f64) -> f64 {
    if apart == 0.0 { 0.0 } else { apart / size }
}

/// A tap that stands out. It is written by the names of columns, of an upright pole without its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At(pub Drive, pub Tuple);

impl Serialize for At {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Self(drive, t) = *self;
        let lengths =
            [("D_mm", t.D), ("d_tip_mm", t.d), ("L_a_mm", t.L_a), ("x_ss_mm", t.x_ss), ("l_mm", t.l)];
        let contact = [("a_mm", t.a), (drive.column(), t.drive)];
        let pole = [("tilt_deg", t.tilt), ("lean_deg", t.lean)].into_iter().filter(|(_, x)| x.abs() > 0.0);
        to.collect_map(lengths.into_iter().chain(contact).chain(pole))
    }
}

/// One backend in one precision, and what its answers may be wrong by.
pub struct Place {
    /// What is asked of the machine.
    options: RunOptions,
    pub adapter: Option<Adapter>,
    pub precision: Precision,
    /// As a sweep would take it.
    pub choice: Choice,
    pub bound: f64,
}

impl Place {
    /// `backend` in `precision`, and what else the `options` say. The bound on its strain error, if nothing else is said, is its tolerance; in f64, whose
    /// tolerance comes near the error of two independent codes, twice that.
    /// Errors: a tolerance that the precision cannot reach, an adapter without it.
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
    /// Errors: a tolerance that the precision cannot reach.
    pub fn at(&self, tolerance: f64) -> Result<Self, Error> {
        let options = RunOptions { tolerance: Some(tolerance), ..self.options.clone() };
        let backend = if self.adapter.is_some() { BackendChoice::Gpu } else { BackendChoice::Cpu };
        Self::new(&options, (backend, self.precision, self.adapter.as_ref()), None)
    }

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
/// Errors: where the options leave none, or name one that the machine lacks.
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
