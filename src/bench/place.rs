//! Where taps are solved: every backend of the machine in every precision it has.

use crate::backend::{Choice, adapters};
use crate::error::{Error, InputError};
use crate::kernel::{Solver, gpu};
use crate::scene::{BackendChoice, Precision, RunOptions};

/// One backend in one precision.
#[derive(Debug)]
pub struct Place {
    /// gpu, cpu or reference.
    pub backend: BackendChoice,
    /// Type of its numbers.
    pub precision: Precision,
    /// The adapter, for a GPU.
    pub adapter: Option<gpu::Adapter>,
    /// As `sweep` would take it, at its default tolerance.
    pub choice: Choice,
    /// Name in tables and legends, such as "cpu f32"; with the adapter's where there are several.
    pub name: String,
}

impl Place {
    /// This place at `tolerance`.
    ///
    /// # Errors
    /// A tolerance that the precision cannot reach.
    pub fn at(&self, tolerance: f64) -> Result<Choice, Error> {
        chosen(self.backend, self.precision, self.adapter.as_ref(), Some(tolerance))
    }

    /// Its solver; none for the reference.
    ///
    /// # Errors
    /// A device that does not open.
    pub fn solver(&self) -> Result<Option<Box<dyn Solver>>, Error> {
        if self.is_reference() { Ok(None) } else { self.choice.solver().map(Some) }
    }

    /// Whether this is the reference.
    pub fn is_reference(&self) -> bool {
        self.backend == BackendChoice::Reference
    }

    /// Column values: backend and precision.
    pub fn words(&self) -> [&'static str; 2] {
        [self.choice.backend.name, self.choice.backend.precision]
    }
}

/// What leads to a place at `tolerance`, or at the default.
pub(super) fn chosen(
    backend: BackendChoice,
    precision: Precision,
    adapter: Option<&gpu::Adapter>,
    tolerance: Option<f64>,
) -> Result<Choice, Error> {
    let (backend, precision) = (Some(backend), Some(precision));
    let name = adapter.map(|a| a.name.clone());
    let options = RunOptions { backend, precision, adapter: name, tolerance, ..RunOptions::default() };
    Choice::among(&options, adapter.map_or(&[], std::slice::from_ref))
}

/// All places that `options` leave: those of one backend, one adapter, one precision, or all of the machine. The reference is
/// always among them, for it is the yardstick.
///
/// # Errors
/// An adapter that is not there, or no place but the reference.
pub fn places(options: &RunOptions) -> Result<Vec<Place>, Error> {
    use BackendChoice::{Auto, Cpu, Gpu, Reference};
    let wants = |b| matches!(options.backend, None | Some(Auto)) || options.backend == Some(b);
    let named = options.adapter.as_deref().unwrap_or_default().to_lowercase();
    let needed = options.backend == Some(Gpu) || !named.is_empty();
    let adapters = if wants(Gpu) { adapters(needed)? } else { Vec::new() };
    let mut taken: Vec<gpu::Adapter> = Vec::new();
    for a in adapters.iter().filter(|a| a.name.to_lowercase().contains(&named)) {
        // The same device may be there under two interfaces.
        if taken.iter().all(|c| c.name != a.name) {
            taken.push(a.clone());
        }
    }
    if taken.is_empty() && (options.backend == Some(Gpu) || !named.is_empty()) {
        // The same words as those of every other command.
        Choice::among(&RunOptions { backend: Some(Gpu), ..options.clone() }, &adapters)?;
    }
    let mut found = Vec::new();
    let mut add = |backend, precision, adapter: Option<&gpu::Adapter>| -> Result<(), Error> {
        if backend != Reference && options.precision.is_some_and(|p| p != precision) {
            return Ok(());
        }
        let bits = if precision == Precision::F32 { "f32" } else { "f64" };
        let name = match (backend, adapter) {
            (Reference, _) => "reference f64".to_owned(),
            (_, Some(a)) if taken.len() > 1 => format!("gpu {bits}, {}", a.name),
            (_, Some(_)) => format!("gpu {bits}"),
            _ => format!("cpu {bits}"),
        };
        let choice = chosen(backend, precision, adapter, None)?;
        found.push(Place { backend, precision, adapter: adapter.cloned(), choice, name });
        Ok(())
    };
    for a in &taken {
        add(Gpu, Precision::F32, Some(a))?;
        if a.f64 {
            add(Gpu, Precision::F64, Some(a))?;
        }
    }
    if wants(Cpu) && named.is_empty() {
        add(Cpu, Precision::F32, None)?;
        add(Cpu, Precision::F64, None)?;
    }
    add(Reference, Precision::F64, None)?;
    if found.len() == 1 && options.backend != Some(Reference) {
        let error = InputError::new("nothing on this machine computes like this");
        return Err(error.key("--precision").value("f64").allowed("f32 on this adapter").into());
    }
    Ok(found)
}
