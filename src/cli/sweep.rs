//! `vibrissa sweep SPEC.toml`.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Value, json};
use vibrissa::backend::{Backend, Choice, Work};
use vibrissa::census::needed::Needed;
use vibrissa::census::sample::ComparedRows;
use vibrissa::curve::both::TAPS;
use vibrissa::error::Error;
use vibrissa::plan::Plan;
use vibrissa::report::answer::{Recommended, of_best};
use vibrissa::scene::{Direction, Geometry, MaterialFit, Spec};
use vibrissa::sink::rows::TableFormat;
use vibrissa::sink::run_json;
use vibrissa::sink::table::{LARGEST, Table};
use vibrissa::sweep::{Kept, Report, Target};
use vibrissa::tap::k_names;
use vibrissa::{files, spec};

use super::args::Sweep;
use super::interrupt::begun;
use super::progress::Shown;
use super::reply::Reply;
use super::say;
use super::say::{grouped, rough};
use super::{best, explain, interrupt};

/// Reads the spec and runs it, says what would run, or explains it (`--explain` overrules `plan` in the spec).
pub fn run(args: &Sweep) -> Result<Reply, Error> {
    let mut spec = spec::read(&args.spec)?;
    let (options, quiet) = begun(&args.common, &spec)?;
    if args.shard.is_none() && std::env::var_os("SLURM_ARRAY_TASK_ID").is_some() {
        let why = "this is a task of a Slurm array, and does the whole sweep; --shard slurm does one part";
        say::unless(quiet)(why);
    }
    if args.explain {
        return explain::run(&spec, &options, &args.leave_off);
    }
    let out = super::folder(options.out.as_ref(), &spec.name, "sweep");
    let out = args.shard.map_or(out.clone(), |shard| out.join(shard.folder()));
    let choice = Choice::for_work(&options, Work::of_study(&spec.study, &options))?;
    let bound = files::model_error(args.model_error, &spec, &choice)?;
    if bound.is_some() {
        vibrissa::sweep::whole(args.shard, &spec.study)?;
    }
    let fewer = |e| Needed::new(&spec.study.setup, ComparedRows::of_study(&spec.study)?, e);
    let mut needed = bound.map(fewer).transpose()?;
    files::settle(&mut spec, &options, &choice.backend, &out);
    files::settle_model_error(&mut spec, bound);
    let planning = options.plan == Some(true);
    let full = match &needed {
        Some(needed) if planning && !needed.left().is_empty() => {
            Some(vibrissa::sweep::seconds(&spec.study, &Plan::new(&spec.study, &choice)?, &choice)?)
        }
        _ => None,
    };
    if let Some(needed) = &needed {
        spec.study.setup = needed.setup().clone();
    }
    let plan = Plan::new(&spec.study, &choice)?;
    if planning {
        return planned(&spec, &plan, &choice, (needed.as_ref(), full), out);
    }
    if !quiet {
        say::line(headline(&spec, &plan, &choice.backend));
        if let Some(shard) = args.shard {
            let (designs, taps) = (shard.designs(plan.designs), grouped(plan.taps_of(args.shard)));
            let (from, to) = (grouped(designs.start + 1), grouped(designs.end));
            let which =
                if designs.is_empty() { "no design".to_owned() } else { format!("designs {from} to {to}") };
            say::line(format_args!("part {shard}: {which}, {taps} taps"));
        }
    }
    let mut progress = Shown::new(plan.taps_of(args.shard), quiet);
    let target = Target {
        out: &out,
        force: options.force == Some(true),
        stop: interrupt::stop(),
        shard: args.shard,
        every: args.keep_every,
    };
    let report = match &mut needed {
        None => vibrissa::sweep::run(&spec, &plan, &choice, &target, &mut progress),
        Some(needed) => vibrissa::sweep::run_needed(&mut spec, plan, &choice, &target, &mut progress, needed),
    };
    progress.finish();
    let report = report?;
    say::warnings(quiet, beyond_curve(&spec, &report));
    Ok(Reply {
        answer: answer(&spec, &report),
        text: summary(&spec, &report, needed.as_ref()),
        out: Some(out),
        counts: run_json::counts(&report.counts),
        seconds: json!(report.seconds),
        backend: json!(report.backend),
        result: json!({
            "best": report.highlights.iter().map(|k| row(&spec, k)).collect::<Vec<_>>(),
            "by": spec.study.listed_by().name(),
            "ranked_rows": report.ranked,
            "model_error": report.model_error,
        }),
        files: report.files,
        quiet,
        ..Reply::default()
    }
    .removing(&report.removed))
}

fn headline(spec: &Spec, plan: &Plan, b: &Backend) -> String {
    let model =
        if spec.study.setup.model.geometry == Geometry::Linear { "linear theory" } else { "exact rod" };
    let (name, taps, designs) = (&spec.name, grouped(plan.taps), grouped(plan.designs));
    format!("{name}: {taps} taps of {designs} designs, {model}, on {}", where_and_why(b))
}

/// What to say when the gauge saw more strain than the curve of the material holds.
fn beyond_curve(spec: &Spec, report: &Report) -> Option<String> {
    let fit = spec.material_fit.as_ref()?;
    let strain = report.counts.strain.get().filter(|e| !fit.covers(*e))?;
    let [min, max] = fit.range;
    Some(format!(
        "the largest gauge strain, {strain:.4}, lies outside the data of {}, {min} … {max}: the material is extrapolated",
        fit.file
    ))
}

/// The backend, why it was taken, its precision and tolerance.
pub(super) fn where_and_why(b: &Backend) -> String {
    let place = match &b.adapter {
        Some(name) => format!("gpu {name}"),
        None => format!("{} with {} threads", b.name, b.threads),
    };
    let tolerance = b.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
    format!("{place} ({}; {}{tolerance})", b.reason, b.precision)
}

/// What would run; `needed` says which effects are left off, and how long it would take with them.
fn planned(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    (needed, full): (Option<&Needed>, Option<f64>),
    out: PathBuf,
) -> Result<Reply, Error> {
    let (b, way) = (&choice.backend, plan.way);
    let seconds = vibrissa::sweep::seconds(&spec.study, plan, choice)?;
    let mut text = headline(spec, plan, b) + "\n";
    let format = TableFormat::of(spec);
    for (name, rows) in Table::ALL.map(|table| table.file(format)).iter().zip(plan.rows) {
        let rows = if rows > 0 { format!("{} rows", grouped(rows)) } else { "not written".into() };
        let _ = writeln!(text, "  {name:<14} {rows}");
    }
    let (bytes, curves) = (plan.bytes * format.share(), plan.curves);
    let (size, to, time, by) = (rough(bytes), out.display(), rough(seconds), way.name());
    let _ = writeln!(text, "  about {size} bytes in {to}, about {time} s, {by}; nothing was run");
    text += &needed.map_or_else(String::new, Needed::sentence);
    if let Some(full) = full {
        let _ = writeln!(text, "  with the full model about {} s", rough(full));
    }
    if curves > 0 {
        let _ = writeln!(
            text,
            "  theory \"exact\": the model's own curve of each of {curves} designs rows too, some 12 to 36 taps more for each"
        );
    }
    if plan.both > 0 {
        let _ = writeln!(
            text,
            "  theory \"exact\" with two gauges: {TAPS} taps more for each, from whose strains its distance and tilt are told"
        );
    }
    if let Some(fit) = &spec.material_fit {
        let MaterialFit { file, points, coefficients: [c10, c20, c30], rms, range: [min, max] } = fit;
        let _ = writeln!(
            text,
            "  material fitted to {file}: yeoh = [{c10}, {c20}, {c30}] MPa, rms {rms:.3e} MPa over {points} points, strain {min} … {max}"
        );
    }
    let _ = write!(text, "values in force:\n{}", super::in_force(spec));
    Ok(Reply {
        text,
        out: Some(out),
        counts: json!({ "taps": plan.taps, "designs_total": plan.designs, "tuples": plan.rows[0], "designs": plan.rows[1], "distances": plan.rows[2], "bytes": bytes, "curves": curves }),
        seconds: json!({ "expected": seconds, "way": way.name(), "expected_full": full }),
        backend: json!(b),
        result: json!({ "in_force": run_json::in_force(spec), "material_fit": run_json::material_fit(spec, None), "model_error": needed.map(|n| n.summary(seconds)) }),
        ..Reply::default()
    })
}

fn row(spec: &Spec, k: &Kept) -> Value {
    let d = &k.design;
    let mut value = json!({
        "D_mm": d.D, "d_mm": d.d, "L_a_mm": d.L_a, "x_ss_mm": d.x_ss, "l_mm": d.l,
        "n": k.row.n,
        "error_rms_mm": k.row.error_rms,
        "error_max_mm": k.row.error_max,
        "noise_rms_mm": k.row.noise_rms,
        "total_rms_mm": k.row.total_rms(),
        (LARGEST.of(&spec.study.setup)): k.row.strain_max,
        "force_max_N": k.row.force_max,
        "status": k.row.status.to_string(),
    });
    if let Some(rigs) = &spec.study.setup.rigs {
        for (property, x) in rigs.properties.iter().zip(rigs.values(d.rig)) {
            value[property.about().column] = x.into();
        }
    }
    for (column, angle) in angles(spec, k.direction) {
        value[column] = angle.into();
    }
    value[spec.study.setup.drive.column()] = k.drive.into();
    let [mean, sd] = k_names(&spec.study.setup);
    value[mean] = json!(k.row.mean.map(|m| (1.0 + m) * k.unit));
    value[sd] = json!(k.row.sd.map(|s| s * k.unit));
    value
}

/// Columns of the pole's direction that are shown, and their angles.
fn angles(spec: &Spec, of: Direction) -> impl Iterator<Item = (&'static str, f64)> {
    let shown = spec.study.setup.directions;
    let tilt = shown.tilt.then_some(("tilt_deg", of.tilt));
    tilt.into_iter().chain(shown.lean.then_some(("lean_deg", of.lean)))
}

/// The recommended row in a sentence.
fn answer(spec: &Spec, report: &Report) -> String {
    let setup = &spec.study.setup;
    let ([_, sd], by) = (k_names(setup), spec.study.listed_by().name());
    let best = report.highlights.first().map(|k| row(spec, k));
    let Some((best, standing)) = best.zip(report.standing) else { return String::new() };
    of_best(&Recommended {
        number: &|name| best[name].as_f64(),
        varying: &run_json::varying(&spec.study),
        names: [sd, by, setup.drive.column()],
        complete: report.ranked,
        kept: report.counts.kept,
        standing,
    })
}

fn summary(spec: &Spec, report: &Report, needed: Option<&Needed>) -> String {
    let mut text = best::table(spec, report);
    let c = &report.counts;
    let words = c.combinations.told(grouped);
    let part = c.chart.as_ref().is_some_and(|chart| chart.get("words").is_some());
    let rest = if part { "; other words are told of the listed rows only" } else { "" };
    let _ = writeln!(text, "status of {} taps: {words}{rest}", grouped(c.taps));
    if let (Some(kept), Some(complete), Some(top)) = (c.kept, c.complete, spec.study.output.top) {
        let (kept, complete) = (grouped(kept), grouped(complete));
        let _ = writeln!(text, "kept {kept} of {complete} complete rows (top = {top})");
    }
    text += &needed.map_or_else(String::new, Needed::sentence);
    text += &report.backend.compared();
    let _ = writeln!(text, "wrote {} in {:.2} s", super::listed(&report.files), report.seconds.total);
    text
}
