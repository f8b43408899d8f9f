//! `vibrissa tap SPEC.toml`.

use std::fmt::Write;

use serde_json::json;
use vibrissa::census::needed::Needed;
use vibrissa::error::{Error, SolveError};
use vibrissa::optimise::blame::bias;
use vibrissa::progress::Progress;
use vibrissa::report::answer::of_tap;
use vibrissa::report::quantity::short;
use vibrissa::scene::search::Objective;
use vibrissa::scene::{Spec, Theory};
use vibrissa::sink::run_json;
use vibrissa::sink::table::drive_unit;
use vibrissa::tap::{self, Report, Sample};
use vibrissa::{files, spec};

use super::args::{Tap, TapObjective};
use super::interrupt;
use super::interrupt::begun;
use super::progress::Shown;
use super::reply::Reply;
use super::say;
use super::sweep::where_and_why;

/// What to say of a run that a signal ended.
const STOPPED: &str = "interrupted; nothing was written, an older result is as it was";

/// Reads the spec and finds its best drive. Few taps: in f64 on the CPU unless something else is asked for.
pub fn run(args: &Tap) -> Result<Reply, Error> {
    let objective = match args.objective {
        TapObjective::Distance => Objective::Distance,
        TapObjective::Sd => Objective::Sd,
    };
    let (mut spec, ends) = spec::read_tap(&args.spec, objective.needs_distance())?;
    let (options, quiet) = begun(&args.common, &spec)?;
    let choice = tap::choice(&options, &spec.study)?;
    let out = super::folder(options.out.as_ref(), &spec.name, "tap");
    let bound = files::model_error(args.model_error, &spec, &choice)?;
    files::settle(&mut spec, &options, &choice.backend, &out);
    files::settle_model_error(&mut spec, bound);
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let (name, [from, to], on) = (&spec.name, ends, where_and_why(&choice.backend));
    let head = format!("{name}: best {symbol} of {from}…{to}{unit}, on {on}");
    if options.plan == Some(true) {
        let needed = bound.map(|e| tap::needed(&spec.study, ends, e)).transpose()?;
        let left = needed.as_ref().map_or_else(String::new, Needed::sentence);
        let planned = Reply::planned(out, |to| format!("{head}\n  tap.csv with at most 1001 rows into {to}"));
        let mut result = json!({ "in_force": run_json::in_force(&spec) });
        if let Some(needed) = needed {
            result["model_error"] = needed.summary(0.0);
        }
        return Ok(Reply {
            text: format!("{}{left}values in force:\n{}", planned.text, super::in_force(&spec)),
            counts: json!({}),
            seconds: json!({}),
            backend: json!(choice.backend),
            result,
            ..planned
        });
    }
    if !quiet {
        say::line(head);
    }
    let target = (out.as_path(), options.force == Some(true));
    let taps = spec.study.space.layout().map_or(0, |layout| tap::taps(&layout));
    let mut progress = Shown::new(taps, quiet);
    let watched = (bound, interrupt::stop(), &mut progress as &mut dyn Progress);
    let report = tap::run(&spec, ends, objective, &choice, target, watched);
    progress.finish();
    let report = report.map_err(|e| match e {
        Error::Solve(SolveError::Stopped) => Error::Run(STOPPED.to_owned()),
        Error::Input(e) if e.file.is_none() && e.key.as_deref() != Some("--out") => {
            e.at(args.spec.display().to_string(), None).into()
        }
        other => other,
    })?;
    let result = tap::result(&spec.study, &report);
    let [_, sd] = tap::k_names(&spec.study.setup);
    Ok(Reply {
        answer: of_tap(&result, spec.study.setup.drive.column(), sd),
        text: summary(&spec, &report),
        out: Some(out),
        counts: json!({ "evaluations": report.evaluations, "rows": report.curve.len() }),
        seconds: json!({ "total": report.seconds }),
        backend: json!(report.backend),
        result: super::with_model_error(result, report.model_error.as_ref()),
        files: report.files,
        quiet,
        ..Reply::default()
    }
    .removing(&report.removed))
}

fn summary(spec: &Spec, report: &Report) -> String {
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let number = |x: Option<f64>| x.map_or("none".to_owned(), short);
    let signal = spec.study.setup.signal.word();
    let line = |name: &str, Sample { drive, row, .. }: &Sample, theory: Theory, end: &str| {
        let [total, noise, sd, most] =
            [row.total_rms(), row.noise_rms(), row.deviation.sd(), row.strain_max()].map(number);
        let bias = bias(theory, row.error_rms(), &number);
        let mean = row.deviation.mean().map_or("none".to_owned(), |m| format!("{:.6}", 1.0 + m));
        format!(
            "{name} {symbol} {drive:.4}{unit}{end}: total {total} mm (bias {bias}, noise {noise}), K_mean {mean}, K_sd {sd}, {signal} {most}\n"
        )
    };
    let own = spec.study.setup.estimate.theory;
    let mut text = line("best", &report.optimum, own, "");
    if report.unconstrained.drive != report.optimum.drive {
        text += &line("whatever the strain,", &report.unconstrained, own, "");
    }
    let _ = writeln!(text, "limited by {}: {}", report.limited_by.name().replace('_', " "), report.why);
    if let Some(other) = &report.other {
        let [this, that] = [own, other.theory].map(Theory::estimator);
        let end = if other.at_bound { ", where the interval ends" } else { "" };
        text += &format!("this holds for locate --estimator {this}; with --estimator {that} ");
        text += &match &other.optimum {
            Ok(s) => line("it would be", s, other.theory, end),
            Err(why) => format!("there is no answer: {why}\n"),
        };
    }
    text += report.model_error.as_ref().map_or("", |(_, told)| told);
    let _ = writeln!(text, "wrote {} in {:.2} s", super::listed(&report.files), report.seconds);
    text
}
