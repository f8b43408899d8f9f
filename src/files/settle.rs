//! What a run took, in the terms of its spec.

use std::path::Path;

use crate::backend::Backend;
use crate::scene::{BackendChoice, Precision, RunOptions, Spec};

/// Puts the `[run]` values that are really in force into `spec`: those of `options` (spec and command line) where they
/// decide, else what `backend` took. A value counts as written only if it was typed as it stands.
pub fn settle(spec: &mut Spec, options: &RunOptions, backend: &Backend, out: &Path) {
    let text = |s: &str| toml::Value::from(s).to_string();
    let typed = |choice: Option<BackendChoice>| choice.is_some_and(|c| c != BackendChoice::Auto);
    let precision = options.precision.map(|p| if p == Precision::F32 { "f32" } else { "f64" });
    let flag = |f: Option<bool>| Some((f.unwrap_or(false).to_string(), f.is_some()));
    let run = [
        ("out", Some((text(&out.display().to_string()), options.out.is_some()))),
        ("force", flag(options.force)),
        ("backend", Some((text(backend.name), typed(options.backend)))),
        ("adapter", backend.adapter.as_deref().map(|a| (text(a), options.adapter.is_some()))),
        ("precision", Some((text(backend.precision), precision == Some(backend.precision)))),
        ("tolerance", backend.tolerance.map(|t| (format!("{t:?}"), options.tolerance.is_some()))),
        ("threads", Some((backend.threads.to_string(), options.threads == Some(backend.threads)))),
        ("plan", flag(options.plan)),
        ("quiet", flag(options.quiet)),
        ("json", flag(options.json)),
    ];
    spec.in_force.retain(|(key, ..)| !key.starts_with("run."));
    let entries = run.into_iter().filter_map(|(key, entry)| {
        let (value, written) = entry?;
        Some((format!("run.{key}"), value, written))
    });
    spec.in_force.extend(entries);
}
