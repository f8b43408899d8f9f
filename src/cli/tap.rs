//! `vibrissa tap SPEC.toml`.

use std::fmt::Write;

use serde_json::json;
use vibrissa::error::Error;
use vibrissa::needed::Needed;
use vibrissa::optimise::why::bias;
use vibrissa::report::answer::of_tap;
use vibrissa::report::quantity::short;
use vibrissa::scene::search::Objective;
use vibrissa::scene::{Convention, Spec, Theory};
use vibrissa::sink::run_json;
use vibrissa::sink::table::drive_unit;
use vibrissa::tap::{self, Report, Sample};
use vibrissa::{files, spec};

use super::args::{Tap, TapObjective};
use super::needed;
use super::reply::{self, Reply};
use super::say;
use super::sweep::{threads, where_and_why};

/// Reads the spec and finds its best drive. Few taps: in f64 on the CPU unless something else is asked for.
pub fn run(args: &Tap) -> Result<Reply, Error> {
    let objective = match args.objective {
        TapObjective::Distance => Objective::Distance,
        TapObjective::Sd => Objective::Sd,
    };
    let (mut spec, ends) = spec::read_tap(&args.spec, objective.needs_distance())?;
    let options = args.common.over(&spec.run);
    let quiet = options.quiet == Some(true);
    reply::in_json(options.json == Some(true));
    threads(&options)?;
    if !quiet {
        spec.warnings.iter().for_each(say::warning);
    }
    let choice = tap::choice(&options, &spec.study)?;
    let out = super::folder(options.out.as_ref(), &spec.name, "tap");
    let bound = files::model_error(args.model_error, &spec, &choice)?;
    files::settle(&mut spec, &options, &choice.backend, &out);
    files::settle_model_error(&mut spec, bound);
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let head = format!(
        "{}: best {symbol} of {}…{}{unit}, on {}",
        spec.name,
        ends[0],
        ends[1],
        where_and_why(&choice.backend)
    );
    if options.plan == Some(true) {
        let needed = bound.map(|e| tap::needed(&spec.study, ends, e)).transpose()?;
        let mut text = format!(
            "{head}\n  tap.csv with at most 1001 rows into {}; nothing was run\n{}values in force:\n",
            out.display(),
            needed.as_ref().map_or_else(String::new, Needed::sentence)
        );
        for (key, value, written) in &spec.in_force {
            let _ = writeln!(text, "  {key} = {value}{}", if *written { "" } else { "    (default)" });
        }
        let mut result = json!({ "in_force": run_json::in_force(&spec) });
        if let Some(needed) = needed {
            result["model_error"] = needed.summary(0.0);
        }
        return Ok(Reply {
            text,
            out: Some(out),
            files: vec![],
            counts: json!({}),
            seconds: json!({}),
            backend: json!(choice.backend),
            result,
            ..Reply::default()
        });
    }
    if !quiet {
        say::line(head);
    }
    let target = (out.as_path(), options.force == Some(true));
    let report = tap::run(&spec, ends, objective, &choice, target, bound).map_err(|e| match e {
        Error::Input(e) if e.file.is_none() && e.key.as_deref() != Some("--out") => {
            e.at(args.spec.display().to_string(), None).into()
        }
        other => other,
    })?;
    let result = tap::result(&spec.study, &report);
    let elongation = spec.study.setup.estimate.convention == Convention::Elongation;
    let sd = if elongation { "K_sd_mm" } else { "K_sd" };
    Ok(Reply {
        answer: of_tap(&result, spec.study.setup.drive.column(), sd),
        text: summary(&spec, &report),
        out: Some(out),
        counts: json!({ "evaluations": report.evaluations, "rows": report.curve.len() }),
        seconds: json!({ "total": report.seconds }),
        backend: json!(report.backend),
        result: needed::with_model_error(result, report.model_error.as_ref()),
        files: report.files,
        quiet,
        ..Reply::default()
    }
    .removing(&report.removed))
}

fn summary(spec: &Spec, report: &Report) -> String {
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let number = |x: Option<f64>| x.map_or("none".to_owned(), short);
    let line = |name: &str, s: &Sample, theory: Theory, end: &str| {
        format!(
            "{name} {symbol} {:.4}{unit}{end}: total {} mm (bias {}, noise {}), K_mean {}, K_sd {}, {} {}\n",
            s.drive,
            number(s.row.total_rms()),
            bias(theory, s.row.error_rms(), &number),
            number(s.row.noise_rms()),
            s.row.deviation.mean().map_or("none".to_owned(), |m| format!("{:.6}", 1.0 + m)),
            number(s.row.deviation.sd()),
            spec.study.setup.signal.word(),
            number(s.row.strain_max()),
        )
    };
    let own = spec.study.setup.estimate.theory;
    let mut text = line("best", &report.optimum, own, "");
    if report.unconstrained.drive != report.optimum.drive {
        text += &line("whatever the strain,", &report.unconstrained, own, "");
    }
    let _ = writeln!(text, "limited by {}: {}", report.limited_by.name().replace('_', " "), report.why);
    if let Some(other) = &report.other {
        let _ = write!(
            text,
            "this holds for locate --estimator {}; with --estimator {} ",
            spec.study.setup.estimate.theory.estimator(),
            other.theory.estimator()
        );
        match &other.optimum {
            Ok(s) => {
                let end = if other.at_bound { ", where the interval ends" } else { "" };
                text += &line("it would be", s, other.theory, end);
            }
            Err(why) => {
                let _ = writeln!(text, "there is no answer: {why}");
            }
        }
    }
    text += report.model_error.as_ref().map_or("", |(_, told)| told);
    let files: Vec<_> = report.files.iter().map(|p| p.display().to_string()).collect();
    let _ = writeln!(text, "wrote {} in {:.2} s", files.join(", "), report.seconds);
    text
}
