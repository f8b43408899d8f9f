//! `vibrissa optimise SPEC.toml`.

use std::fmt::Write;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::json;
use vibrissa::backend::{Choice, Work};
use vibrissa::census::needed::Needed;
use vibrissa::error::Error;
use vibrissa::optimise::report::Design;
use vibrissa::optimise::{
    self, Ended, Report, Step, Target, Watch,
    blame::{bias, why},
    write,
};
use vibrissa::report::answer_of;
use vibrissa::report::quantity::short;
use vibrissa::scene::Spec;
use vibrissa::scene::search::{Objective, Search};
use vibrissa::sink::run_json;
use vibrissa::sink::table::drive_unit;
use vibrissa::{files, spec};

use super::args::Optimise;
use super::interrupt;
use super::interrupt::begun;
use super::reply::Reply;
use super::say;
use super::say::{grouped, rough};
use super::sweep::where_and_why;

/// What to say of a search that a signal ended.
const KEPT: &str = "interrupted; the best so far is written";

/// Reads the spec and searches, or says what would be searched.
pub fn run(args: &Optimise) -> Result<Reply, Error> {
    let (mut spec, mut search) = spec::read_search(&args.spec)?;
    if let Some(shard) = args.shard {
        search.seed = search.seed.wrapping_add(u64::from(shard.index) - 1);
        let seed = spec.in_force.iter_mut().find(|(key, ..)| key == "optimise.seed");
        seed.into_iter().for_each(|(_, value, _)| *value = search.seed.to_string());
    }
    let (options, quiet) = begun(&args.common, &spec)?;
    let out = super::folder(options.out.as_ref(), &spec.name, "optimise");
    let out = args.shard.map_or(out.clone(), |shard| out.join(shard.folder()));
    let work = Work::of_search(&search, &spec.study.space, &spec.study.setup, &options);
    let choice = Choice::for_work(&options, work)?;
    let bound = files::model_error(args.model_error, &spec, &choice)?;
    files::settle(&mut spec, &options, &choice.backend, &out);
    files::settle_model_error(&mut spec, bound);
    let needed = bound.map(|e| optimise::run::needed(&spec, &search, e)).transpose()?;
    if options.plan == Some(true) {
        return Ok(planned(&spec, &search, &choice, needed.as_ref(), out));
    }
    if !quiet {
        say::line(headline(&spec, &search, &choice));
    }
    let target = Target { out: &out, force: options.force == Some(true), stop: interrupt::stop_and_keep() };
    let asked = (&choice, &options, needed);
    let report = optimise::run_needed(&spec, &search, asked, &target, &mut Shown::new(quiet))?;
    Ok(Reply {
        answer: answer_of(&out),
        text: summary(&spec, &search, &report),
        out: Some(out),
        counts: write::counts(&report),
        seconds: write::seconds(&report),
        backend: json!(report.backends[0]),
        result: super::with_model_error(write::result(&spec, &search, &report), report.model_error.as_ref()),
        broken: (report.ended == Ended::Interrupted || interrupt::asked()).then(|| KEPT.to_owned()),
        files: report.files,
        quiet,
        ..Reply::default()
    }
    .removing(&report.removed))
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

/// What is made small.
fn sought(search: &Search) -> &'static str {
    match search.objective {
        Objective::Sd => "K_sd",
        Objective::Distance => "total_rms_mm (bias and noise)",
        Objective::Weighted => "weighted sum of K_sd/K_mean and total_rms_mm/L_a",
        Objective::Pareto => "K_sd and total_rms_mm, one against the other,",
    }
}

/// Why a search ended, in words.
fn ending(ended: Ended) -> &'static str {
    match ended {
        Ended::Converged => "ended because several starts found the same, or all starts were made",
        Ended::Evaluations => "ended with its evaluations spent: a larger budget searches on",
        Ended::Seconds => "ended with its seconds spent: a larger budget searches on",
        Ended::Interrupted => "ended by a signal",
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
    let left = needed.map_or_else(String::new, Needed::sentence);
    Reply {
        text: format!("{}{left}values in force:\n{}", planned.text, super::in_force(spec)),
        counts: json!({ "evaluations": evaluations, "variables": search.variables.len() }),
        seconds: json!({ "budget": seconds }),
        backend: json!(choice.backend),
        result: json!({ "in_force": run_json::in_force(spec), "model_error": needed.map(|n| n.summary(0.0)) }),
        ..planned
    }
}

fn summary(spec: &Spec, search: &Search, report: &Report) -> String {
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let (d, row) = (&report.best.point, &report.best.row);
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
    let mean = row.deviation.mean().map_or(f64::NAN, |m| (1.0 + m) * report.best.unit);
    let sd = number(row.deviation.sd().map(|s| s * report.best.unit), "");
    let [total, noise] = [row.total_rms(), row.noise_rms()].map(|x| number(x, " mm"));
    let bias = bias(theory, row.error_rms(), &|x| number(x, " mm"));
    let (word, most, force) = (signal.word(), number(row.strain_max(), &read), number(row.force_max(), " N"));
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
    let (evaluations, starts, [all, own]) = (grouped(report.evaluations), report.starts, report.seconds);
    let ended = ending(report.ended);
    let _ = writeln!(text, "{evaluations} evaluations in {starts} starts, {own:.2} s; {ended}");
    text += report.model_error.as_ref().map_or("", |(_, told)| told);
    let _ = writeln!(text, "wrote {} in {all:.2} s", super::listed(&report.files));
    text
}

/// Best, evaluations and rate on stderr: one line that is rewritten on a terminal, a line now and then elsewhere.
struct Shown {
    quiet: bool,
    terminal: bool,
    begun: Instant,
    last: Instant,
}

impl Shown {
    fn new(quiet: bool) -> Self {
        let now = Instant::now();
        Self { quiet, terminal: std::io::stderr().is_terminal(), begun: now, last: now }
    }
}

impl Watch for Shown {
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>) {
        let every = Duration::from_millis(if self.terminal { 200 } else { 5000 });
        if self.quiet || self.last.elapsed() < every {
            return;
        }
        self.last = Instant::now();
        let rate = step.evaluations as f64 / self.begun.elapsed().as_secs_f64();
        let best =
            if feasible { format!("best {value:.6e}") } else { "no design keeps the limits yet".to_owned() };
        let left = left.map_or(String::new(), |n| format!(", {n} left"));
        let (evaluations, rate) = (grouped(step.evaluations), rough(rate));
        let (start, stage) = (step.start + 1, step.stage.name());
        let line = format!("{best}; {evaluations} evaluations{left}, {rate}/s, start {start}, {stage}");
        if self.terminal {
            say::part(format_args!("\r\x1b[2K{line}"));
        } else {
            say::line(line);
        }
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        if self.terminal && !self.quiet {
            say::part("\r\x1b[2K");
        }
    }
}
