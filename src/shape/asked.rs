//! By what shapes are solved, and what is told of them.

use serde_json::{Value, json};

use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::locate::locator::opener;
use crate::scene::{BackendChoice, Geometry, Model, RunOptions, Setup, Spec};
use crate::sink::run_json;

/// Refuses a model without shapes.
///
/// # Errors
/// That.
pub fn check(setup: &Setup) -> Result<(), InputError> {
    if setup.model.geometry != Geometry::Linear {
        return Ok(());
    }
    let message = "linear theory has a deflection but no shape: its whisker would grow longer";
    Err(InputError::new(message).key("model.geometry").value("linear").allowed("exact"))
}

/// What solves the taps of which shapes are asked, and its word in run.json: they are few, so the reference unless `options` say otherwise.
///
/// # Errors
/// A backend that fails.
pub fn method(options: &RunOptions, model: &Model) -> Result<(Method, &'static str), Error> {
    let free = options.backend.is_none() && options.precision.is_none() && options.adapter.is_none();
    let method = match options.backend {
        Some(BackendChoice::Reference) => Method::Reference,
        _ if free => Method::Reference,
        _ => opener(options)(model)?,
    };
    let by = if matches!(method, Method::Reference) { "reference" } else { "kernel" };
    Ok((method, by))
}

/// run.json of the shapes of `spec`, solved `by` this.
pub fn document(spec: &Spec, by: &str, counts: &Value, seconds: &Value) -> Value {
    let body = json!({
        "in_force": run_json::in_force(spec), "material_fit": run_json::material_fit(spec, None), "warnings": spec.warnings,
        "solved_by": by, "counts": counts, "seconds": seconds,
    });
    run_json::document("shape", run_json::spec(spec), body)
}
