//! `vibrissa optimise SPEC.toml`: the best design.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Asked, Context, Reply, folder, grouped, number, where_and_why, with_model_error};
use crate::backend::Choice;
use crate::census::needed::Needed;
use crate::digits::short;
use crate::error::Error;
use crate::optimise::report::{self, Design, bias, why};
use crate::optimise::{self, Ended, Report, best};
use crate::scene::{Objective, RunOptions, Search, Spec};
use crate::sink::{Question, drive_unit};
use crate::{plan, spec};

const KEPT: &str = "interrupted; the best so far is written";

/// Search for the best design.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa optimise sweeps/design.toml")]
pub struct OptimiseRequest {
    /// The spec: whisker, gauge, tap, model, and [optimise] with objective, variables and limits
    pub spec: PathBuf,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the ranges of the variables: measured
    /// against the full model; run.json has the effects, their size and the time saved (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub model_error: Option<f64>,
}

pub fn run(asked: &Asked<OptimiseRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let (mut spec, search) = context.read(&asked.spec, "spec", spec::parse_search)?;
    let options = context.begun(&asked.common, &mut spec)?;
    let out = folder(options.out.as_ref(), &spec.name, "optimise");
    let bounded = RunOptions { model_error: asked.model_error.or(options.model_error), ..options.clone() };
    let work = plan::of_search(&search, &spec.study.space, &spec.study.setup, &bounded);
    let choice = Choice::for_work(&options, work)?;
    let bound = context.model_error(asked.model_error, &spec, &choice)?;
    context.settle(&mut spec, &options, (&choice.backend, bound, &out));
    let needed = bound.map(|e| optimise::needed(&spec, &search, e)).transpose()?;
    if options.plan == Some(true) {
        return Ok(planned(&spec, &search, &choice, needed.as_ref(), out));
    }
    context.line(headline(&spec, &search, &choice));
    let fresh = !out.exists();
    let done = searched((&spec, &search), (&choice, &options, needed), &out, context);
    if done.is_err() && fresh && !context.is_in_memory() {
        let _ = std::fs::remove_dir(&out);
    }
    done
}

fn searched(
    (spec, search): (&Spec, &Search),
    (choice, options, needed): (&Choice, &RunOptions, Option<Needed>),
    out: &Path,
    context: &Context<'_>,
) -> Result<Reply, Error> {
    let question = Question::of_scene("optimise", spec, Value::Null);
    let names = report::names(search.objective);
    let mut destination = context.open(out, question, &names, options.force)?;
    let mut progress = context.progress();
    let stop = context.host.stop(true);
    let report = optimise::find(spec, search, (choice, options, needed), stop, progress.as_mut())?;
    drop(progress);
    destination.put("best.toml", best::text(spec, search, &report)?.into_bytes())?;
    report::tables(spec, &report)?.into_iter().try_for_each(|table| destination.table(table))?;
    let interrupted = report.ended == Ended::Interrupted || stop.load(std::sync::atomic::Ordering::Relaxed);
    let result = report::result(spec, search, &report);
    let mut body = json!({
        "warnings": report.backends[0].warnings(&spec.warnings),
        "backend": report.backends[0], "backend_polish": report.backends[1], "result": result,
    });
    if let Some(front) = body["result"]["front"].as_object_mut() {
        front.remove("rows");
    }
    let reply = Reply {
        text: summary(spec, search, &report),
        counts: report::counts(&report),
        seconds: report::seconds(&report),
        backend: json!(report.backends[0]),
        result: with_model_error(result, report.model_error.as_ref()),
        broken: interrupted.then(|| KEPT.to_owned()),
        ..Reply::default()
    };
    let body = with_model_error(body, report.model_error.as_ref());
    Ok(reply.filed_of(spec, destination, body)?.answered())
}

fn headline(spec: &Spec, search: &Search, choice: &Choice) -> String {
    let drive = spec.study.setup.drive;
    let over = search.variables.iter().map(|v| format!("{} {}…{}", v.quantity.name(drive), v.min, v.max));
    let over = over.collect::<Vec<_>>().join(", ");
    let samples =
        search.robust.as_ref().map_or(String::new(), |r| format!(", over {} sampled whiskers", r.samples));
    let (name, sought, on) = (&spec.name, sought(search), where_and_why(&choice.backend));
    format!("{name}: looking for the smallest {sought} over {over}{samples}, on {on}")
}

fn sought(search: &Search) -> &'static str {
    match search.objective {
        Objective::Sd => "K_sd",
        Objective::Distance => "total_rms_mm (bias and noise)",
        Objective::Weighted => "weighted sum of K_sd/K_mean and total_rms_mm/L_a",
        Objective::Pareto => "K_sd and total_rms_mm, one against the other,",
    }
}

fn planned(spec: &Spec, search: &Search, choice: &Choice, needed: Option<&Needed>, out: PathBuf) -> Reply {
    let (evaluations, seconds) = (search.budget.evaluations, search.budget.seconds);
    let most = evaluations.map(|n| format!("{n} evaluations"));
    let most: Vec<String> = most.into_iter().chain(seconds.map(|s| format!("{s} s"))).collect();
    let most = match most.is_empty() {
        true => format!("{} starts", optimise::global::STARTS),
        false => most.join(" or "),
    };
    let head = headline(spec, search, choice);
    let planned = Reply::planned(out, |to| {
        format!("{head}\n  until several starts agree, at most {most}\n  into {to}")
    });
    let counts = json!({ "evaluations": evaluations, "variables": search.variables.len() });
    let (seconds, backend) = (json!({ "budget": seconds }), json!(choice.backend));
    Reply { counts, seconds, backend, ..planned.of_spec(spec, needed) }
}

fn summary(spec: &Spec, search: &Search, report: &Report) -> String {
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let (d, row) = (&report.best.point, report.best.row.figures());
    let title = match search.objective {
        Objective::Pareto => "point of the front with the least total",
        _ => "best design",
    };
    let mut text = format!("{title}:\n");
    let rigs = spec.study.setup.rigs.iter();
    let properties = rigs.flat_map(|rigs| rigs.properties.iter().zip(rigs.values(d.rig)));
    let properties: String = properties
        .map(|(property, x)| {
            let unit = property.about().unit;
            format!("{} {x:.4}{}{unit}, ", property.name(), if unit.is_empty() { "" } else { " " })
        })
        .collect();
    let _ = writeln!(
        text,
        "  D {:.4} mm, d {:.4} mm, L_a {:.4} mm, x_ss {:.4} mm, l {:.4} mm, {properties}{symbol} {:.4}{unit}",
        d.D, d.d, d.L_a, d.x_ss, d.l, d.drive
    );
    let number = |x: Option<f64>, unit: &str| x.map_or("none".to_owned(), |x| short(x) + unit);
    let (signal, theory) = (spec.study.setup.signal, spec.study.setup.estimate.theory);
    let read = if signal.unit().is_empty() { String::new() } else { format!(" {}", signal.unit()) };
    let mean = row.mean.map_or(f64::NAN, |m| (1.0 + m) * report.best.unit);
    let sd = number(row.sd.map(|s| s * report.best.unit), "");
    let [total, noise] = [row.total_rms(), row.noise_rms].map(|x| number(x, " mm"));
    let bias = bias(theory, row.error_rms, &|x| number(x, " mm"));
    let (word, most, force) = (signal.word(), number(row.strain_max, &read), number(row.force_max, " N"));
    let _ = writeln!(
        text,
        "  K_mean {mean:.6}, K_sd {sd}, total {total} (bias {bias}, noise {noise}), largest {word} {most}, largest force {force}"
    );
    if let Some(robust) = &search.robust {
        let ([sd, total, _], n) = (report.best.score.figures.map(short), robust.samples);
        let _ = writeln!(text, "  over {n} sampled whiskers: K_sd {sd}, total {total} mm");
    }
    let _ = writeln!(text, "  {}", why(&spec.study.setup, search, report));
    if let Some(other) = &report.other {
        let total = |d: &Design| number(Some(d.score.figures[1]).filter(|t| t.is_finite()), " mm");
        let (this, that, error) = (theory.estimator(), other.theory.estimator(), total(&other.here));
        let best = |d| format!(", and {} at its best {symbol}, {:.4}{unit}", total(d), d.point.drive);
        let best = other.best.as_ref().map_or(String::new(), best);
        let _ = writeln!(
            text,
            "  this holds for locate --estimator {this}; with --estimator {that} the error of this design would be {error}{best}"
        );
    }
    if let Some(front) = &report.front {
        let (points, volume) = (front.points.len(), short(front.hypervolume));
        let _ = writeln!(text, "front of {points} points, hypervolume {volume}");
    }
    let (evaluations, starts, own) = (grouped(report.evaluations), report.starts, report.seconds[1]);
    let ended = match report.ended {
        Ended::Converged => "because several starts found the same, or all starts were made",
        Ended::Evaluations => "with its evaluations spent: a larger budget searches on",
        Ended::Seconds => "with its seconds spent: a larger budget searches on",
        Ended::Interrupted => "by a signal",
    };
    let _ = writeln!(text, "{evaluations} evaluations in {starts} starts, {own:.2} s; ended {ended}");
    text + report.model_error.as_ref().map_or("", |(_, told)| told)
}
