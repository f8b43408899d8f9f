//! `vibrissa bench`: speed against error.

use std::path::PathBuf;

use clap::Args as Flags;
use serde_json::{Value, json};

use super::aligned::{aligned, header};
use super::apart::{apart, cut};
use super::{Common, Context, Reply, rough};
use crate::census::Place;
use crate::census::bench::{self, Measured, News, Settings, name, places};
use crate::census::compare::Figures;
use crate::error::{Error, InputError};
use crate::figure::{self, Format, Style};
use crate::kernel::rule::smallest_tolerance;
use crate::report;
use crate::scene::{BackendChoice, Precision};
use crate::sink::folder::{Question, hash};
use crate::sink::heading::heading;
use crate::sink::values::named;

/// Largest spread of repeats that says nothing about the machine: backends and tolerances are compared where they differ by tens of percent.
const QUIET: f64 = 0.15;

/// Figures of the result; one without points is left out.
const FIGURES: [&str; 4] =
    ["work_precision.svg", "work_precision.png", "configurations.svg", "configurations.png"];

/// Measure speed against error. Without --backend or --precision: everything that this machine has, at several tolerances. Ctrl-C
/// keeps what was measured.
#[derive(Debug, Flags)]
pub struct BenchRequest {
    /// Few configurations, few taps: seconds instead of minutes; software adapters only with --backend gpu or --adapter
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    pub common: Common,
}

pub fn run(asked: &BenchRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    if let Some(t) = options.tolerance {
        let least = smallest_tolerance(options.precision.unwrap_or(Precision::F64));
        if !(least..1.0).contains(&t) {
            let error = InputError::new("no kernel keeps such a tolerance").key("--tolerance").value(t);
            return Err(error.allowed(format!("{least:e} … 1 (exclusive)")).into());
        }
    }
    let mut places = places(&options)?;
    if asked.quick && matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none()
    {
        // They compile for a minute what the CPU has compiled.
        places.retain(|p| !p.backend().software);
    }
    let settings = Settings::new(asked.quick, options.tolerance);
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("results/bench"));
    let backends = json!(places.iter().map(Place::backend).collect::<Vec<_>>());
    let names: Vec<String> = (0..places.len()).map(|k| name(&places, k)).collect();
    let steps = settings.steps(&places);
    if options.plan == Some(true) {
        let cost = settings.cost(&steps, &places);
        return Ok(Reply { backend: backends, ..planned(&settings, &names, (steps.len(), cost), out) });
    }
    let of = steps.len() as u64;
    let described = settings.json();
    let text = format!("{}\n", json!({ "bench": described, "places": names }));
    let question = Question::new("bench", "bench", json!({ "settings": hash(&text) }));
    let columns = heading("work_precision");
    let files = [&[&*columns.file], &FIGURES[..]].concat();
    let mut destination = context.open(&out, question, &files, options.force)?;
    let of_places: Vec<_> = places.iter().map(|p| p.backend().clone()).collect();
    let mut measured: Vec<Measured> = Vec::new();
    apart(
        context,
        move |stop, tell| bench::measure(&settings, steps, &places, stop, tell),
        |news| match news {
            News::Begun(n, what) => context.line(format!("[{n:>3} of {of}] {what}")),
            News::Made(one) => measured.push(*one),
        },
    )?;
    let done = measured.len() as u64;
    let (kept, broken) = cut(([done, of], "measurements"), &destination, (options.force, &out));
    // (slowest − fastest)/median of the repeats: on a quiet machine it is some percent.
    let spread = measured.iter().filter_map(|m| m.spread).fold(0.0, f64::max);
    if spread > QUIET {
        context.warn(&format!("repeats of a measurement differ by up to {:.0} %: this machine does something else too, and its figures may be too slow", 100.0 * spread));
    }
    let rows = || measured.iter().map(|m| m.fields(&of_places[m.step.place]));
    let point = |(m, row): (&Measured, _)| {
        let mut point = named(columns.names_as(&[]), row);
        point["backend"] = names[m.step.place].as_str().into();
        point["taps_per_second"] = (1e9 / m.times[0]).into();
        point
    };
    let points: Vec<Value> = measured.iter().zip(rows()).map(point).collect();
    let counts = json!({
        "points": measured.len(),
        "taps": measured.iter().map(Measured::taps).sum::<usize>(),
        "failed": measured.iter().map(Measured::failed).sum::<usize>(),
    });
    let (machine, stopped) = (machine(), broken.is_some());
    let reply = Reply {
        text: summary(&measured, &names),
        counts,
        seconds: context.seconds(),
        backend: backends.clone(),
        result: json!({ "machine": machine, "spread": spread, "points": points }),
        broken,
        quiet: context.is_quiet(),
        ..Reply::default()
    };
    if !kept {
        return Ok(Reply { out: Some(out), ..reply });
    }
    let mut table = columns.frame(&[]);
    rows().try_for_each(|row| table.row(row))?;
    // A run that was stopped has no time for figures.
    let figures = if stopped { Vec::new() } else { report::of_bench(&table, None)? };
    destination.table(table)?;
    for figure in figures {
        for (name, bytes) in figure::files(&figure, &Style::default(), &[Format::Svg, Format::Png])? {
            destination.put(&name, bytes)?;
        }
    }
    let body = json!({
        "machine": machine,
        "backends": backends,
        "settings": described,
        "yardstick": "the reference: adaptive f64 shooting; its own row is its difference from cpu f64 at the smallest tolerance",
        "error": "|strain - reference| / max(|reference|, 1e-3 theta f_max)",
        "spread": spread,
        "stopped": stopped.then(|| json!({ "steps": done, "of": of })),
    });
    let of = json!({ "name": "bench", "hash": hash(&text), "text": text });
    Ok(reply.filed(destination, of, body, context)?.answered())
}

/// The processor in its own words, and its cores.
fn machine() -> Value {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split(':').nth(1));
    json!({
        "processor": model.map(str::trim),
        "cores": std::thread::available_parallelism().ok().map(|n| n.get()),
        "os": std::env::consts::OS,
        "architecture": std::env::consts::ARCH,
    })
}

fn planned(
    settings: &Settings,
    places: &[String],
    (steps, (taps, seconds)): (usize, (u64, f64)),
    out: PathBuf,
) -> Reply {
    let (about, time, on) = (rough(taps as f64), rough(seconds), places.join(", "));
    let of = settings.configurations.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
    let Settings { quick, compared, timed, repeats, .. } = settings;
    let kind = if *quick { "quick benchmark" } else { "benchmark" };
    Reply {
        counts: json!({ "measurements": steps, "taps": taps }),
        seconds: json!({ "expected": seconds }),
        result: settings.json(),
        ..Reply::planned(out, |to| {
            format!(
                "{kind}: {steps} measurements, about {about} taps, about {time} s\n  \
                 backends        {on}\n  \
                 configurations  {of}\n  \
                 taps compared   {compared} with the reference, each\n  \
                 taps timed      {timed}, {repeats} times\n  \
                 table, figures and run.json go to {to}"
            )
        })
    }
}

/// Every measurement, in one line each.
fn summary(measured: &[Measured], places: &[String]) -> String {
    let line = |m: &Measured| {
        let error =
            |f: fn(&Figures) -> f64| m.errors().as_ref().map_or(String::new(), |e| format!("{:.1e}", f(e)));
        let (step, best) = (&m.step, m.times[0]);
        let tolerance = step.tolerance.map_or(String::new(), |t| format!("{t:e}"));
        let spread = m.spread.map_or(String::new(), |s| format!("{:.0} %", 100.0 * s));
        let of = [step.configuration.name.to_owned(), places[step.place].clone(), step.solved.name().into()];
        let times = [tolerance, format!("{best:.1}"), spread, format!("{:.2e}", 1e9 / best)];
        let errors = [error(|e| e.p99), error(|e| e.worst), m.failed().to_string()];
        of.into_iter().chain(times).chain(errors).collect()
    };
    let names = header("configuration,backend,kernel,tolerance,ns per tap,spread,taps/s,p99,worst,failed");
    let rows: Vec<Vec<String>> = [names].into_iter().chain(measured.iter().map(line)).collect();
    aligned(&rows, &[0, 1, 2])
        + "ns per tap: the fastest of the repeats; spread: (slowest − fastest) / median of them; p99, worst: strain error against the\n\
           reference, 99 of 100 taps are not worse, and the worst tap; failed: taps that only the reference solves.\n"
}
