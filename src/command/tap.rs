//! `vibrissa tap SPEC.toml`: the best tap angle of one whisker.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Context, Reply, folder, meant, named, number, where_and_why, with_model_error};
use crate::digits::short;
use crate::error::Error;
use crate::optimise::report::bias;
use crate::report::answer::of_tap;
use crate::scene::{Objective, Spec, Theory};
use crate::sink::{Question, drive_unit, run_json};
use crate::spec;
use crate::tap::{self, Report, Sample};

const FILE: &str = "tap.csv";

/// Objectives: word, value, help.
const OBJECTIVES: [(&str, Objective, &str); 2] = [
    ("distance", Objective::Distance, "total_rms_mm: bias and noise of the distance"),
    ("sd", Objective::Sd, "K_sd: the spread of K"),
];

/// Find the best tap angle.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa tap sweeps/best-tap.toml")]
pub struct TapRequest {
    /// The spec of one whisker; the interval is that of [tap] theta (0.1 to 10 degrees if left out)
    pub spec: PathBuf,
    /// What to minimise: total_rms_mm, or K_sd
    #[arg(long, value_parser = named(OBJECTIVES), value_name = "WORD", default_value = "distance")]
    pub objective: String,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the interval of the drive: measured
    /// against the full model; run.json has the effects, their size and the time saved (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub model_error: Option<f64>,
}

pub fn run(asked: &Asked<TapRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let objective = meant(("word", "--objective"), Some(&asked.objective), &OBJECTIVES)?;
    let objective = objective.unwrap_or(Objective::Distance);
    let (mut spec, ends) = context.read(&asked.spec, "spec", |label, text, base| {
        spec::parse_tap(label, text, base, objective.needs_distance())
    })?;
    let options = context.begun(&asked.common, &mut spec)?;
    let choice = tap::choice(&options, &spec.study)?;
    let out = folder(options.out.as_ref(), &spec.name, "tap");
    let bound = context.model_error(asked.model_error, &spec, &choice)?;
    context.settle(&mut spec, &options, (&choice.backend, bound, &out));
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let (name, [from, to], on) = (&spec.name, ends, where_and_why(&choice.backend));
    let head = format!("{name}: best {symbol} of {from}…{to}{unit}, on {on}");
    if options.plan == Some(true) {
        let needed = bound.map(|e| tap::needed(&spec.study, ends, e)).transpose()?;
        let planned = Reply::planned(out, |to| format!("{head}\n  tap.csv with at most 1001 rows into {to}"));
        let backend = json!(choice.backend);
        let planned = planned.of_spec(&spec, needed.as_ref());
        return Ok(Reply { counts: json!({}), seconds: json!({}), backend, ..planned });
    }
    context.line(head);
    let question = Question::of_scene("tap", &spec, json!({ "objective": objective.word() }));
    let mut destination = context.open(&out, question, &[FILE], options.force)?;
    let begun = context.elapsed();
    let mut progress = context.progress();
    let (stop, study) = (context.host.stop(false), &spec.study);
    let mut report = tap::find(study, ends, objective, &choice, (bound, stop, progress.as_mut()))?;
    drop(progress);
    report.seconds = choice.seconds + context.elapsed() - begun;
    destination.table(tap::table(study, &report)?)?;
    let result = tap::result(study, &report);
    let [_, sd] = tap::k_names(&study.setup);
    // Hard taps are solved with another tolerance than planned.
    let (mut in_force, tolerance) = (run_json::in_force(&spec), report.backend.tolerance);
    for entry in in_force.as_array_mut().into_iter().flatten().filter(|e| e["key"] == "run.tolerance") {
        tolerance.iter().for_each(|tolerance| entry["value"] = format!("{tolerance:?}").into());
    }
    let body = json!({
        "in_force": in_force, "warnings": report.backend.warnings(&spec.warnings), "backend": report.backend, "result": result,
    });
    let body = with_model_error(body, report.model_error.as_ref());
    let reply = Reply {
        answer: of_tap(&result, study.setup.drive.column(), sd),
        text: summary(&spec, &report),
        counts: json!({ "evaluations": report.evaluations, "rows": report.curve.len() }),
        seconds: json!({ "total": report.seconds }),
        backend: json!(report.backend),
        result: with_model_error(result, report.model_error.as_ref()),
        ..Reply::default()
    };
    reply.filed_of(&spec, destination, body)
}

fn summary(spec: &Spec, report: &Report) -> String {
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let number = |x: Option<f64>| x.map_or("none".to_owned(), short);
    let signal = spec.study.setup.signal.word();
    let line = |name: &str, Sample { drive, row, .. }: &Sample, theory: Theory, end: &str| {
        let row = row.figures();
        let [total, noise, sd, most] = [row.total_rms(), row.noise_rms, row.sd, row.strain_max].map(number);
        let bias = bias(theory, row.error_rms, &number);
        let mean = row.mean.map_or("none".to_owned(), |m| format!("{:.6}", 1.0 + m));
        format!(
            "{name} {symbol} {drive:.4}{unit}{end}: total {total} mm (bias {bias}, noise {noise}), K_mean {mean}, K_sd {sd}, {signal} {most}\n"
        )
    };
    let own = spec.study.setup.estimate.theory;
    let mut text = line("best", &report.optimum, own, "");
    if report.unconstrained.drive != report.optimum.drive {
        text += &line("whatever the strain,", &report.unconstrained, own, "");
    }
    let _ = writeln!(text, "limited by {}: {}", report.limited_by.word().replace('_', " "), report.why);
    if let Some(other) = &report.other {
        let [this, that] = [own, other.theory].map(Theory::estimator);
        let end = if other.at_bound { ", where the interval ends" } else { "" };
        text += &format!("this holds for locate --estimator {this}; with --estimator {that} ");
        text += &match &other.optimum {
            Ok(s) => line("it would be", s, other.theory, end),
            Err(why) => format!("there is no answer: {why}\n"),
        };
    }
    text + report.model_error.as_ref().map_or("", |(_, told)| told)
}
