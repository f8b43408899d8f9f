//! `vibrissa bench`: speed against error.

use std::path::PathBuf;

use clap::Args as Flags;
use serde_json::{Value, json};

use super::apart::{apart, cut};
use super::reply::{framed, objects, shown};
use super::{Asked, Context, Reply, rough};
use crate::backend::Backend;
use crate::census::bench::{Bench, Measured, News};
use crate::error::{Error, InputError};
use crate::figure::{self, Format, Style};
use crate::kernel::rule::smallest_tolerance;
use crate::report;
use crate::scene::Precision;
use crate::sink::folder::{Question, hash};

/// Largest spread of repeats that says nothing about the machine: backends and tolerances are compared where they differ by tens of percent.
const QUIET: f64 = 0.15;

/// Figures of the result; one without points is left out.
const FIGURES: [&str; 4] =
    ["work_precision.svg", "work_precision.png", "configurations.svg", "configurations.png"];

/// Columns of the measurements that people are shown.
const COLUMNS: &str =
    "configuration,backend,precision,tolerance,ns_per_tap,spread,strain_error_p99,strain_error_max,failed";

/// Measure speed against error. Without --backend or --precision: everything that this machine has, at several tolerances. Ctrl-C
/// keeps what was measured.
#[derive(Debug, Flags)]
pub struct BenchRequest {
    /// Few configurations, few taps: seconds instead of minutes; software adapters only with --backend gpu or --adapter
    #[arg(long)]
    pub quick: bool,
}

pub fn run(asked: &Asked<BenchRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    if let Some(t) = options.tolerance {
        let least = smallest_tolerance(options.precision.unwrap_or(Precision::F64));
        if !(least..1.0).contains(&t) {
            let error = InputError::new("no kernel keeps such a tolerance").key("--tolerance").value(t);
            return Err(error.allowed(format!("{least:e} … 1 (exclusive)")).into());
        }
    }
    let bench = Bench::new(&options, asked.quick)?;
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("results/bench"));
    let (of, (taps, seconds), described) = (bench.steps() as u64, bench.cost(), bench.json());
    let of_places: Vec<Backend> = bench.places.iter().map(|p| p.backend().clone()).collect();
    if options.plan == Some(true) {
        let (about, time) = (rough(taps as f64), rough(seconds));
        let settings =
            described.as_object().into_iter().flatten().map(|(name, x)| format!("  {name}: {x}\n"));
        let settings: String = settings.collect();
        return Ok(Reply {
            backend: json!(of_places),
            counts: json!({ "measurements": of, "taps": taps }),
            seconds: json!({ "expected": seconds }),
            result: described,
            ..Reply::planned(out, |to| {
                format!(
                    "{of} measurements, about {about} taps, about {time} s\n{settings}  table, figures and run.json go to {to}"
                )
            })
        });
    }
    let text = format!("{}\n", json!({ "bench": described }));
    let question = Question::new("bench", "bench", json!({ "settings": hash(&text) }));
    let files = [&["work_precision.csv"], &FIGURES[..]].concat();
    let mut destination = context.open(&out, question, &files, options.force)?;
    let mut measured: Vec<Measured> = Vec::new();
    apart(
        context,
        move |stop, tell| bench.measure(stop, tell),
        |news| match news {
            News::Begun(n, what) => context.line(format!("[{n:>3} of {of}] {what}")),
            News::Made(one) => measured.push(*one),
        },
    )?;
    let done = measured.len() as u64;
    let (kept, broken) = cut(([done, of], "measurements"), &destination);
    // (slowest − fastest)/median of the repeats: on a quiet machine it is some percent.
    let spread = measured.iter().filter_map(|m| m.spread).fold(0.0, f64::max);
    if spread > QUIET {
        context.warn(&format!("repeats of a measurement differ by up to {:.0} %: this machine does something else too, and its figures may be too slow", 100.0 * spread));
    }
    let table = framed("work_precision", &[], measured.iter().map(|m| m.fields(&of_places[m.line.place])))?;
    let sum = |name: &str| (0..table.len()).map(|r| table.number(name, r) as u64).sum::<u64>();
    let counts = json!({ "points": table.len(), "taps": sum("taps"), "failed": sum("failed") });
    let (machine, stopped) = (machine(), broken.is_some());
    let reply = Reply {
        text: shown(&table, &table.rows(|_| true), COLUMNS),
        counts,
        seconds: context.seconds(),
        backend: json!(of_places),
        result: json!({ "machine": machine, "spread": spread, "points": objects(&table) }),
        broken,
        quiet: context.is_quiet(),
        ..Reply::default()
    };
    if !kept {
        return Ok(Reply { out: Some(out), ..reply });
    }
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
        "backends": of_places,
        "settings": described,
        "yardstick": "the reference: adaptive f64 shooting; its own row is its difference from cpu f64 at the smallest tolerance",
        "error": "|strain - reference| / max(|reference|, 1e-3 theta f_max)",
        "spread": spread,
        "stopped": stopped.then(|| json!({ "steps": done, "of": of })),
    });
    let of = json!({ "name": "bench", "hash": hash(&text), "text": text });
    Ok(reply.filed(destination, of, body)?.answered())
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
