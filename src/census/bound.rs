//! The bound of `--model-error`, as it was typed or as the spec has it.

use crate::backend::Choice;
use crate::error::{Error, InputError};
use crate::scene::Spec;

/// Smallest bound that two solutions in f64 can be judged by.
const LEAST: f64 = 2e-8;

/// The bound that was asked for, if the backend of `choice` is accurate enough to judge effects of this size.
///
/// # Errors
/// A bound by which nothing can be judged.
pub fn bound(asked: Option<f64>, spec: &Spec, choice: &Choice) -> Result<Option<f64>, Error> {
    let Some(bound) = asked else { return Ok(None) };
    if let Some(rigs) = &spec.study.setup.rigs {
        let names: Vec<&str> = rigs.properties.iter().map(|property| property.name()).collect();
        let names = names.join(", ");
        let why = format!("{names} differ from design to design: which effects they need is not one answer");
        let error = InputError::new(why).key("--model-error").value(bound);
        return Err(error.allowed("one rig, or no --model-error").into());
    }
    let least = LEAST.max(2.0 * choice.backend.tolerance.unwrap_or(0.0));
    if bound >= least && bound < 1.0 {
        return Ok(Some(bound));
    }
    let allowed = match choice.backend.tolerance {
        Some(t) if 2.0 * t > LEAST => format!("{least:e} ≤ E < 1: at least twice the tolerance, {t:e}"),
        _ => format!("{least:e} ≤ E < 1"),
    };
    let error = InputError::new("no effect can be judged by this").key("--model-error").value(bound);
    Err(error.allowed(allowed).into())
}
