//! `vibrissa sweep SPEC.toml`.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Value, json};
use vibrissa::backend::{Backend, Choice, Work};
use vibrissa::curve::both::TAPS;
use vibrissa::error::Error;
use vibrissa::needed::{ComparedRows, Needed};
use vibrissa::plan::Plan;
use vibrissa::report::answer::of_best;
use vibrissa::scene::{Column, Geometry, Listed, RunOptions, Space, Spec};
use vibrissa::sink::rows::TableFormat;
use vibrissa::sink::run_json;
use vibrissa::sink::table::{LARGEST, Table};
use vibrissa::sweep::{Kept, Report, Target};
use vibrissa::{files, spec};

use super::args::Sweep;
use super::number::{grouped, rough};
use super::progress::Shown;
use super::reply::{self, Reply};
use super::say;
use super::{best, explain, interrupt};

/// Reads the spec and runs it, says what would run, or explains it (`--explain` overrules `plan` in the spec).
pub fn run(args: &Sweep) -> Result<Reply, Error> {
    let mut spec = spec::read(&args.spec)?;
    let options = args.common.over(&spec.run);
    let quiet = options.quiet == Some(true);
    reply::in_json(options.json == Some(true));
    threads(&options)?;
    if !quiet {
        spec.warnings.iter().for_each(say::warning);
        if args.shard.is_none() && std::env::var_os("SLURM_ARRAY_TASK_ID").is_some() {
            say::warning(
                "this is a task of a Slurm array, and does the whole sweep; --shard slurm does one part",
            );
        }
    }
    if args.explain {
        return explain::run(&spec, &options, &args.leave_off);
    }
    let out = super::folder(options.out.as_ref(), &spec.name, "sweep");
    let out = args.shard.map_or(out.clone(), |shard| out.join(shard.folder()));
    let choice = Choice::for_taps(&options, &spec.study.setup, Work::of_study(&spec.study, &options))?;
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
    if !quiet && let Some(warning) = beyond_curve(&spec, &report) {
        say::warning(warning);
    }
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

/// Sets the number of CPU threads that was asked for.
pub(super) fn threads(options: &RunOptions) -> Result<(), Error> {
    let Some(n) = options.threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new().num_threads(n).build_global().map_err(|e| Error::Run(e.to_string()))
}

fn headline(spec: &Spec, plan: &Plan, b: &Backend) -> String {
    let model =
        if spec.study.setup.model.geometry == Geometry::Linear { "linear theory" } else { "exact rod" };
    format!(
        "{}: {} taps of {} designs, {model}, on {}",
        spec.name,
        grouped(plan.taps),
        grouped(plan.designs),
        where_and_why(b)
    )
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
        let _ = writeln!(
            text,
            "  {name:<14} {}",
            if rows > 0 { format!("{} rows", grouped(rows)) } else { "not written".into() }
        );
    }
    let _ = writeln!(
        text,
        "  about {} bytes in {}, about {} s, {}; nothing was run",
        rough(plan.bytes * format.share()),
        out.display(),
        rough(seconds),
        way.name()
    );
    if let Some(needed) = needed {
        text += &needed.sentence();
    }
    if let Some(full) = full {
        let _ = writeln!(text, "  with the full model about {} s", rough(full));
    }
    if plan.curves > 0 {
        let _ = writeln!(
            text,
            "  theory \"exact\": the model's own curve of each of {} designs rows too, some 12 to 16 taps more for each",
            plan.curves
        );
    }
    if plan.both > 0 {
        let _ = writeln!(
            text,
            "  theory \"exact\" with two gauges: {TAPS} taps more for each, from whose strains its distance and tilt are told"
        );
    }
    if let Space::File(file) = &spec.study.space {
        let _ = writeln!(text, "  warning: {}", large(file));
    }
    if let Some(fit) = &spec.material_fit {
        let ([c10, c20, c30], [min, max]) = (fit.coefficients, fit.range);
        let _ = writeln!(
            text,
            "  material fitted to {}: yeoh = [{c10}, {c20}, {c30}] MPa, rms {:.3e} MPa over {} points, strain {min} … {max}",
            fit.file, fit.rms, fit.points
        );
    }
    let _ = writeln!(text, "values in force:");
    for (key, value, written) in &spec.in_force {
        let _ = writeln!(text, "  {key} = {value}{}", if *written { "" } else { "    (default)" });
    }
    Ok(Reply {
        text,
        out: Some(out),
        counts: json!({ "taps": plan.taps, "designs_total": plan.designs, "tuples": plan.rows[0], "designs": plan.rows[1], "distances": plan.rows[2], "bytes": plan.bytes * format.share(), "curves": plan.curves }),
        seconds: json!({ "expected": seconds, "way": way.name(), "expected_full": full }),
        backend: json!(b),
        result: json!({ "in_force": run_json::in_force(spec), "material_fit": run_json::material_fit(spec, None), "model_error": needed.map(|n| n.summary(seconds)) }),
        ..Reply::default()
    })
}

/// What to expect of a tuple file that is not held in memory: some 45 bytes a row are, and every reading of it takes time.
fn large(file: &Listed) -> String {
    let rows = file.len() as f64;
    format!(
        "the tuple file has {rows:.1e} rows: it takes about {:.0} MB of memory and is read two to four times, about {:.0} s each",
        150.0 + 45e-6 * rows,
        (rows / 3e6).ceil()
    )
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
    let shown = spec.study.setup.directions;
    for (column, angle, shown) in
        [("tilt_deg", k.direction.tilt, shown.tilt), ("lean_deg", k.direction.lean, shown.lean)]
    {
        if shown {
            value[column] = angle.into();
        }
    }
    value[spec.study.setup.drive.column()] = k.drive.into();
    let unit = if spec.study.setup.estimate.convention == vibrissa::scene::Convention::Elongation {
        "_mm"
    } else {
        ""
    };
    value[format!("K_mean{unit}")] = json!(k.row.mean.map(|m| (1.0 + m) * k.unit));
    value[format!("K_sd{unit}")] = json!(k.row.sd.map(|s| s * k.unit));
    value
}

/// The best row in a sentence.
fn answer(spec: &Spec, report: &Report) -> String {
    let whisker = [
        Column::BaseDiameter,
        Column::TipDiameter,
        Column::Length,
        Column::GaugePosition,
        Column::GridLength,
    ];
    let several = |column: &Column| spec.study.space.axis(*column).is_none_or(|axis| axis.len() > 1);
    let rigs = spec.study.setup.rigs.iter().flat_map(|rigs| rigs.properties.iter().map(|p| p.about().column));
    let angles = spec.study.setup.directions;
    let angles =
        [(angles.tilt, "tilt_deg"), (angles.lean, "lean_deg")].into_iter().filter(|a| a.0).map(|a| a.1);
    let names = whisker
        .into_iter()
        .zip(["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm"])
        .filter(|(c, _)| several(c))
        .map(|c| c.1);
    let varying: Vec<&str> = names.chain(rigs).chain(angles).collect();
    let elongation = spec.study.setup.estimate.convention == vibrissa::scene::Convention::Elongation;
    let sd = if elongation { "K_sd_mm" } else { "K_sd" };
    let by = spec.study.listed_by().name();
    of_best(
        &report.highlights.iter().map(|k| row(spec, k)).collect::<Vec<_>>(),
        &varying,
        [sd, by, spec.study.setup.drive.column()],
        report.ranked,
    )
}

fn summary(spec: &Spec, report: &Report, needed: Option<&Needed>) -> String {
    let mut text = best::table(spec, report);
    let c = &report.counts;
    let words: Vec<_> = c.status.iter().map(|(word, n)| format!("{} {word}", grouped(*n))).collect();
    let words = if words.is_empty() { "no taps".to_owned() } else { words.join(", ") };
    let _ = writeln!(text, "status of {} taps: {words}", grouped(c.taps));
    if let (Some(kept), Some(complete), Some(top)) = (c.kept, c.complete, spec.study.output.top) {
        let (kept, complete) = (grouped(kept), grouped(complete));
        let _ = writeln!(text, "kept {kept} of {complete} complete rows (top = {top})");
    }
    text += &needed.map_or_else(String::new, Needed::sentence);
    let files: Vec<_> = report.files.iter().map(|p| p.display().to_string()).collect();
    let _ = writeln!(text, "wrote {} in {:.2} s", files.join(", "), report.seconds.total);
    text
}
