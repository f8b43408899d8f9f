//! `vibrissa sweep SPEC.toml`: a design space.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Content, Context, Reply, explain, folder, grouped, in_force, number, rough, shard};
use crate::backend::{Backend, Choice};
use crate::census::{needed::Needed, sample};
use crate::curve::both::TAPS;
use crate::digits::short;
use crate::error::Error;
use crate::plan::{self, Plan};
use crate::progress::Progress;
use crate::report::answer::{Recommended, of_best};
use crate::scene::{Geometry, MaterialFit, Per, RankBy, RunOptions, Spec};
use crate::sink::{Shard, Table, TableFormat, Written, drive_unit, run_json};
use crate::sweep::{self, Kept, Report, Target};
use crate::tap::k_names;

/// Evaluate a design space.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa sweep sweeps/prototypes.toml")]
pub struct SweepRequest {
    /// The spec: whisker, gauge, tap, model (TOML; mm, degrees, MPa, N)
    pub spec: PathBuf,
    /// Show what each effect of the model changes, in % of strain; write nothing
    #[arg(long, conflicts_with_all = ["plan", "out", "force"])]
    #[serde(skip)]
    pub explain: bool,
    /// Leave off the effects whose joint change of strain stays within E, relative as --tolerance is, over the spec's space: measured
    /// against the full model; run.json has the effects and their size (docs/effects.md) [default: nothing is left off]
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with = "explain", value_parser = number)]
    pub model_error: Option<f64>,
    /// Run only part i of n, of whole designs, into <out>/shard-i-of-n; `vibrissa merge` joins the parts. `slurm`: read the part from the
    /// Slurm array task
    #[arg(long, value_name = "i/n", value_parser = shard, conflicts_with = "explain")]
    #[serde(skip)]
    pub shard: Option<Shard>,
    /// Seconds between states on the disk, from which the same command continues if the run is stopped or killed
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = seconds)]
    #[serde(skip)]
    pub keep_every: Duration,
}

/// Parses seconds, from 0 to a day.
fn seconds(text: &str) -> Result<Duration, &'static str> {
    let seconds = text.parse().ok().filter(|s| (0.0..=86400.0).contains(s));
    seconds.map(Duration::from_secs_f64).ok_or("allowed: 0 … 86400 s")
}

pub fn run(asked: &Asked<SweepRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.spec(&asked.spec)?;
    spec.inputs.extend(context.inputs());
    let options = context.begun(&asked.common, &mut spec)?;
    if asked.explain {
        return explain::run(&spec, &options, context);
    }
    let alone = asked.shard.is_none() && !context.is_in_memory();
    if alone && std::env::var_os("SLURM_ARRAY_TASK_ID").is_some() {
        context
            .warn("this is a task of a Slurm array, and does the whole sweep; --shard slurm does one part");
    }
    let out = folder(options.out.as_ref(), &spec.name, "sweep");
    let out = asked.shard.map_or(out.clone(), |shard| out.join(shard.folder()));
    let bounded = RunOptions { model_error: asked.model_error.or(options.model_error), ..options.clone() };
    let choice = Choice::for_work(&options, plan::of_study(&spec.study, &bounded))?;
    let bound = context.model_error(asked.model_error, &spec, &choice)?;
    if bound.is_some() {
        sweep::whole(asked.shard, &spec.study)?;
    }
    let fewer = |e| Needed::new(&spec.study.setup, &sample::choosing(&spec.study), e);
    let mut needed = bound.map(fewer).transpose()?;
    context.settle(&mut spec, &options, (&choice.backend, bound, &out));
    let planning = options.plan == Some(true);
    let full = match &needed {
        Some(needed) if planning && !needed.left().is_empty() => {
            Some(sweep::seconds(&spec.study, &Plan::new(&spec.study, &choice)?, &choice)?)
        }
        _ => None,
    };
    if let Some(needed) = &needed {
        spec.study.setup = needed.setup.clone();
    }
    let plan = Plan::new(&spec.study, &choice)?;
    if planning {
        return planned(&spec, &plan, &choice, (needed.as_ref(), full), out);
    }
    context.line(headline(&spec, &plan, &choice.backend));
    if let Some(shard) = asked.shard {
        let (designs, taps) = (shard.designs(plan.designs), grouped(plan.taps_of(asked.shard)));
        let (from, to) = (grouped(designs.start + 1), grouped(designs.end));
        let which =
            if designs.is_empty() { "no design".to_owned() } else { format!("designs {from} to {to}") };
        context.line(format!("part {shard}: {which}, {taps} taps"));
    }
    let mut progress = context.progress();
    let (to, force) = (Some(&*out).filter(|_| !context.is_in_memory()), options.force == Some(true));
    let (stop, shard, every) = (context.host.stop(false), asked.shard, asked.keep_every);
    let target = Target { out: to, force, stop, shard, every };
    let steered = (&target, &mut *progress as &mut dyn Progress);
    let (report, tables) = sweep::run_needed(&mut spec, plan, &choice, steered, needed.as_mut())?;
    drop(progress);
    if context.is_in_memory() {
        let kept = Table::ALL
            .into_iter()
            .zip(tables)
            .filter_map(|(table, frame)| Some((table.word().to_owned(), Content::Table(frame?))));
        return Ok(Reply { kept: kept.collect(), document: report.document(&spec), ..Reply::default() });
    }
    context.warn_all(beyond_curve(&spec, &report));
    let reply = Reply {
        answer: answer(&spec, &report),
        text: summary(&spec, &report, needed.as_ref()),
        counts: run_json::counts(&report.counts),
        seconds: json!(report.seconds),
        backend: json!(report.backend),
        result: json!({
            "best": report.highlights.iter().map(|k| k.at.json(&spec.study.setup)).collect::<Vec<_>>(),
            "by": spec.study.listed_by().word(),
            "ranked_rows": report.ranked,
            "model_error": report.model_error,
        }),
        ..Reply::default()
    };
    let written = Written { files: report.files, removed: report.removed };
    Ok(reply.with_files(out, written, (report.seconds.total, context.is_quiet())))
}

fn headline(spec: &Spec, plan: &Plan, b: &Backend) -> String {
    let model =
        if spec.study.setup.model.geometry == Geometry::Linear { "linear theory" } else { "exact rod" };
    let (name, taps, designs) = (&spec.name, grouped(plan.taps), grouped(plan.designs));
    format!("{name}: {taps} taps of {designs} designs, {model}, on {}", super::where_and_why(b))
}

fn beyond_curve(spec: &Spec, report: &Report) -> Option<String> {
    let fit = spec.material_fit.as_ref()?;
    let strain = report.counts.strain.filter(|e| !fit.covers(*e))?;
    let [min, max] = fit.range;
    Some(format!(
        "the largest gauge strain, {strain:.4}, lies outside the data of {}, {min} … {max}: the material is extrapolated",
        fit.file
    ))
}

/// The reply to `--plan`; `needed`: effects left off; `full`: seconds without leaving any off.
fn planned(
    spec: &Spec,
    plan: &Plan,
    choice: &Choice,
    (needed, full): (Option<&Needed>, Option<f64>),
    out: PathBuf,
) -> Result<Reply, Error> {
    let (b, way) = (&choice.backend, plan.way);
    let seconds = sweep::seconds(&spec.study, plan, choice)?;
    let mut text = headline(spec, plan, b) + "\n";
    let format = TableFormat::of(spec);
    for (name, rows) in Table::ALL.map(|table| table.file(format)).iter().zip(plan.rows) {
        let rows = if rows > 0 { format!("{} rows", grouped(rows)) } else { "not written".into() };
        let _ = writeln!(text, "  {name:<14} {rows}");
    }
    let (bytes, curves) = (plan.bytes * format.share(), plan.curves);
    let (size, to, time, by) = (rough(bytes), out.display(), rough(seconds), way.word());
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
    let _ = write!(text, "values in force:\n{}", in_force(spec));
    Ok(Reply {
        text,
        out: Some(out),
        counts: json!({ "taps": plan.taps, "designs_total": plan.designs, "tuples": plan.rows[0], "designs": plan.rows[1], "distances": plan.rows[2], "bytes": bytes, "curves": curves }),
        seconds: json!({ "expected": seconds, "way": way.word(), "expected_full": full }),
        backend: json!(b),
        result: json!({ "in_force": run_json::in_force(spec), "material_fit": run_json::material_fit(spec, None), "model_error": needed.map(Needed::summary) }),
        ..Reply::default()
    })
}

fn answer(spec: &Spec, report: &Report) -> String {
    let setup = &spec.study.setup;
    let ([_, sd], by) = (k_names(setup), spec.study.listed_by().word());
    let best = report.highlights.first().map(|k| k.at.json(setup));
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
    let mut text = best_rows(spec, report);
    let c = &report.counts;
    let words = c.combinations.told(grouped);
    let _ = writeln!(text, "status of {} taps: {words}", grouped(c.taps));
    if let (Some(kept), Some(complete), Some(top)) = (c.kept, c.complete, spec.study.output.top) {
        let (kept, complete) = (grouped(kept), grouped(complete));
        let _ = writeln!(text, "kept {kept} of {complete} complete rows (top = {top})");
    }
    text += &needed.map_or_else(String::new, Needed::sentence);
    text + &report.backend.compared()
}

/// The best rows with the ranking column; with a noise of the gauge also bias and noise combined.
fn best_rows(spec: &Spec, report: &Report) -> String {
    let (setup, output, by) = (&spec.study.setup, &spec.study.output, spec.study.listed_by());
    if report.highlights.is_empty() {
        return format!(
            "no complete row to rank by {}: in a complete row every distance counts, and this column has a value\n",
            by.word()
        );
    }
    let noisy = setup.is_noisy() == Some(true);
    let mut columns = vec![RankBy::KSd, RankBy::ErrorRms];
    columns.extend([RankBy::NoiseRms, RankBy::TotalRms].into_iter().filter(|_| noisy));
    columns.extend((!columns.contains(&by)).then_some(by));
    let (symbol, unit) = drive_unit(setup.drive);
    let (shown, ranked, by_name) = (report.highlights.len(), grouped(report.ranked), by.word());
    let what = match (output.top, output.per) {
        _ if report.by_design => {
            format!("{shown} designs of {ranked} complete rows, each at its best drive,")
        }
        (Some(_), Per::Design) => format!("{shown} of {ranked} designs, each at its best drive,"),
        _ => format!("{shown} of {ranked} complete rows"),
    };
    let angle = |x: f64, unit| {
        let x = format!("{x:.4}");
        format!("{}{unit}", x.trim_end_matches('0').trim_end_matches('.'))
    };
    let plain = |x: f64| x == 0.0 || (1e-2..1e5).contains(&x.abs());
    let sized = |x: f64| if plain(x) { format!("{x:.4}") } else { format!("{x:.2e}") };
    let value = |k: &Kept, column| k.at.row.value(column, k.at.unit).map_or(String::new(), short);
    // Width, name and value of each column.
    let cells = |k: &Kept| -> Vec<(usize, &str, String)> {
        let (d, [tilt, lean]) = (&k.at.design, setup.directions);
        let sizes = [("D_mm", d.D), ("d_tip_mm", d.d), ("L_a_mm", d.L_a), ("x_ss_mm", d.x_ss)];
        let mut cells = sizes.map(|(name, x)| (8, name, format!("{x:.4}"))).to_vec();
        cells.push((6, "l_mm", format!("{:.3}", d.l)));
        let rig = setup.rigs.iter().flat_map(|rigs| rigs.properties.iter().zip(rigs.values(d.rig)));
        cells.extend(rig.map(|(property, x)| (9, property.name(), sized(x))));
        let poses = [(tilt, "tilt", d.tilt), (lean, "lean", d.lean)].into_iter().filter(|x| x.0);
        cells.extend(poses.map(|(_, name, x)| (8, name, angle(x, "°"))));
        let mean = k.at.row.mean.map_or(String::new(), |m| format!("{:.6}", (1.0 + m) * k.at.unit));
        cells.extend([(8, symbol, angle(d.drive, unit)), (12, "K_mean", mean)]);
        cells.extend(columns.iter().map(|column| (12, column.word(), value(k, *column))));
        cells
    };
    let names = cells(&report.highlights[0]).into_iter().map(|(width, name, _)| format!(" {name:>width$}"));
    let mut text = format!("best {what} by {by_name}:\n {}\n", names.collect::<String>());
    for k in &report.highlights {
        let values = cells(k).into_iter().map(|(width, _, value)| format!(" {value:>width$}"));
        let end = if k.at.row.status.is_strained() { "  beyond the strain limit" } else { "" };
        text += &format!(" {}{end}\n", values.collect::<String>());
    }
    text += "error_rms_mm is the bias of the distance";
    if columns.contains(&RankBy::TotalRms) {
        text += ", noise_rms_mm what the noise of the gauge adds, total_rms_mm both in quadrature";
    }
    // The ranking ignores an existing noise without being asked to.
    if noisy && by != RankBy::TotalRms && !output.by_said {
        text += &format!(
            "\n{by_name} holds no noise: `by = \"total_rms_mm\"` in [output] ranks by bias and noise"
        );
    }
    text + "\n"
}
