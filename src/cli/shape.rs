//! `vibrissa shape SPEC.toml`.

use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::error::{Error, InputError};
use vibrissa::evaluate::Method;
use vibrissa::locate::locator::opener;
use vibrissa::scene::{BackendChoice, Geometry};
use vibrissa::sink::folder::{Folder, Question};
use vibrissa::sink::run_json;
use vibrissa::{shape, spec};

use super::args::Shape;
use super::calibrate::prepared;
use super::reply::Reply;
use super::say;

/// Writes the shapes of a spec's taps: few, so by the reference unless something else is asked for.
pub fn run(args: &Shape) -> Result<Reply, Error> {
    let start = Instant::now();
    let spec = spec::read(&args.spec)?;
    let options = prepared(&args.common, &spec)?;
    let quiet = options.quiet == Some(true);
    if !quiet {
        spec.warnings.iter().for_each(say::warning);
    }
    let setup = &spec.study.setup;
    if setup.model.geometry == Geometry::Linear {
        let error =
            InputError::new("linear theory has a deflection but no shape: its whisker would grow longer")
                .at(args.spec.display().to_string(), None);
        return Err(error.key("model.geometry").value("linear").allowed("exact").into());
    }
    let out = super::folder(options.out.as_ref(), &spec.name, "shape");
    if options.plan == Some(true) {
        let text = format!(
            "{}: shapes with {} sections to {}; nothing was run\n",
            spec.name,
            args.nodes,
            out.display()
        );
        let result = json!({ "in_force": run_json::in_force(&spec) });
        return Ok(Reply { text, out: Some(out), result, ..Reply::default() });
    }
    let free = options.backend.is_none() && options.precision.is_none() && options.adapter.is_none();
    let method = match options.backend {
        Some(BackendChoice::Reference) => Method::Reference,
        _ if free => Method::Reference,
        _ => opener(&options)(&setup.model)?,
    };
    let by = if matches!(method, Method::Reference) { "reference" } else { "kernel" };
    let question = Question::of_scene("shape", &spec, json!({ "nodes": args.nodes, "solved_by": by }));
    let mut folder = Folder::open(&out, question, &shape::FILES, options.force == Some(true))?;
    let written = shape::write(&spec, method, args.nodes as usize, &mut folder).map_err(|e| match e {
        Error::Input(e) => e.at(args.spec.display().to_string(), None).into(),
        other => other,
    });
    let counts = written?;
    let counted = json!({ "taps": counts.taps, "shapes": counts.shapes });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let body = json!({
        "in_force": run_json::in_force(&spec), "material_fit": run_json::material_fit(&spec, None), "warnings": spec.warnings,
        "solved_by": by, "counts": counted, "seconds": seconds,
    });
    folder.run_json(&run_json::document("shape", run_json::spec(&spec), body))?;
    let written = folder.finish()?;
    let without = match counts.taps - counts.shapes {
        0 => String::new(),
        n => format!("; {n} taps have none, contacts.csv says why"),
    };
    let text = format!(
        "{} shapes of {} sections from clamp to contact{without}\nwrote {} in {:.2} s\n",
        counts.shapes,
        args.nodes,
        super::listed(&written.files),
        start.elapsed().as_secs_f64()
    );
    let (files, backend) = (written.files, Value::Null);
    Ok(Reply { text, out: Some(out), files, counts: counted, seconds, backend, quiet, ..Reply::default() }
        .removing(&written.removed))
}
