//! `vibrissa chart SPEC.toml`: smooth functions in place of taps, for other programs.

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Context, Reply, folder};
use crate::chart::{self, document::document, scope::Summary};
use crate::error::Error;
use crate::sink::folder::Question;
use crate::spec;

const FILE: &str = "chart.json";

/// Charts of a spec's model over its ranges.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa chart sweeps/practical.toml")]
pub struct ChartRequest {
    /// The spec: ranges of whisker, gauge and drive, its distances (one chart each, 64 at most), its model
    pub spec: PathBuf,
}

pub fn run(asked: &Asked<ChartRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    spec.one_rig()?;
    let options = context.begun(&asked.common, &mut spec)?;
    let out = folder(options.out.as_ref(), &spec.name, "chart");
    let (distances, directions) = chart::places(&spec.study)?;
    let (setup, tolerance) = (&spec.study.setup, options.tolerance.unwrap_or(chart::TOLERANCE));
    if options.plan == Some(true) {
        let charts = distances.len() * directions.len();
        return Ok(Reply::planned(out, |to| format!("{}: {charts} charts to {to}", spec.name)));
    }
    let found = chart::of_study(&spec.study, tolerance, context.host.stop(false))?;
    let question = Question::of_scene("chart", &spec, json!({ "tolerance": tolerance }));
    let mut destination = context.open(&out, question, &[FILE], options.force)?;
    destination.put(FILE, document(setup, &found).to_string().into_bytes())?;
    let summary = Summary::of(&found, setup.drive);
    let lacks = |a: &f64| found.iter().filter(|c| c.a == *a).count() < directions.len();
    let without: Vec<f64> = distances.iter().copied().filter(lacks).collect();
    let counts = json!({ "charts": summary, "without": without });
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
    let reply = Reply { answer, text, counts, ..Reply::default() };
    reply.filed_of(&spec, destination, json!({ "tolerance": tolerance }))
}
