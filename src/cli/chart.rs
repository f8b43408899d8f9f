//! `vibrissa chart SPEC.toml`.

use std::time::Instant;

use serde_json::json;
use vibrissa::chart::{self, document::document, scope::Summary};
use vibrissa::error::Error;
use vibrissa::progress::NEVER;
use vibrissa::sink::folder::{Folder, Question};
use vibrissa::sink::run_json;
use vibrissa::spec;

use super::args::Chart;
use super::interrupt::begun;
use super::reply::Reply;

const FILE: &str = "chart.json";

/// Writes the charts of a spec's distances.
pub fn run(args: &Chart) -> Result<Reply, Error> {
    let start = Instant::now();
    let spec = spec::read(&args.spec)?;
    spec.one_rig()?;
    let (options, quiet) = begun(&args.common, &spec)?;
    let out = super::folder(options.out.as_ref(), &spec.name, "chart");
    let at = |e: Error| match e {
        Error::Input(e) => e.at(args.spec.display().to_string(), None).into(),
        other => other,
    };
    let (distances, directions) = chart::places(&spec.study).map_err(|e| at(e.into()))?;
    let (setup, tolerance) = (&spec.study.setup, options.tolerance.unwrap_or(chart::TOLERANCE));
    if options.plan == Some(true) {
        let charts = distances.len() * directions.len();
        return Ok(Reply::planned(out, |to| format!("{}: {charts} charts to {to}", spec.name)));
    }
    let found = chart::of_study(&spec.study, tolerance, &NEVER).map_err(at)?;
    let question = Question::of_scene("chart", &spec, json!({ "tolerance": tolerance }));
    let mut folder = Folder::open(&out, question, &[FILE], options.force == Some(true))?;
    folder.put(FILE, document(setup, &found).to_string().as_bytes())?;
    let summary = Summary::of(&found, setup.drive);
    let lacks = |a: &f64| found.iter().filter(|c| c.a == *a).count() < directions.len();
    let without: Vec<f64> = distances.iter().copied().filter(lacks).collect();
    let counts = json!({ "charts": summary, "without": without });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let body = json!({
        "in_force": run_json::in_force(&spec), "warnings": spec.warnings, "tolerance": tolerance,
        "counts": counts, "seconds": seconds,
    });
    let document = run_json::document("chart", run_json::spec(&spec), body);
    let Summary { charts, coefficients, solved, strain_error: error, .. } = summary;
    let none = if directions.len() > 1 { "not all" } else { "none" };
    let lacking = if without.is_empty() { String::new() } else { format!("; {none} at a = {without:?} mm") };
    let text = format!(
        "{charts} charts, {coefficients} coefficients from {solved} taps, strain error {error:.1e} at their checking points{lacking}\n"
    );
    let (all, with) = (distances.len(), distances.len() - without.len());
    let answer = format!(
        "Taps at {with} of {all} distances are read from charts, with a strain error of {error:.1e} at most where that was checked."
    );
    let reply = Reply { answer, text, counts, seconds, quiet, ..Reply::default() };
    reply.filed(folder, &document, (out, start))
}
