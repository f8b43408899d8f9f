//! Taps of the whole space that a device is compared on before the first row: what it gets wrong there, each part of a sweep finds alike.

use std::sync::atomic::AtomicBool;

use crate::backend::Choice;
use crate::census::{Taps, sample};
use crate::error::Error;
use crate::evaluate::{Evaluator, Method};
use crate::scene::{Space, Study};

/// Taps.
const TAPS: u32 = 32;

/// The method of `choice`, whose device has been compared with the CPU on taps of `study`. Kernels of cones have known taps instead.
///
/// # Errors
/// A device that does not open.
pub(super) fn first(study: &Study, choice: &Choice, stop: &AtomicBool) -> Result<Method, Error> {
    let (setup, method) = (&study.setup, choice.open(&study.setup.model)?);
    if choice.backend.adapter.is_none() || setup.built.is_none() || matches!(study.space, Space::File(_)) {
        return Ok(method);
    }
    let taps = Taps::of(setup, &sample::random(&study.space, TAPS, 0)?);
    // Taps that are the reference's are compared with nothing.
    let mut evaluator = Evaluator::new(setup, method).stopping(stop).sparing(usize::MAX);
    evaluator.run(&taps.designs, &taps.tasks)?;
    Ok(evaluator.into_method())
}
