//! `vibrissa bench`.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Value, json};
use vibrissa::bench::{
    self, Report, Settings, Watch,
    place::{Place, places},
    work::Solved,
};
use vibrissa::error::Error;
use vibrissa::error::InputError;
use vibrissa::kernel::rule::smallest_tolerance;
use vibrissa::scene::{Precision, RunOptions};

use super::args::Bench;
use super::interrupt;
use super::reply::Reply;
use super::say;

/// Measures, or says what would be measured.
pub fn run(args: &Bench) -> Result<Reply, Error> {
    let options = args.common.over(&RunOptions::default());
    let quiet = options.quiet == Some(true);
    if let Some(n) = options.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build_global()
            .map_err(|e| Error::Run(e.to_string()))?;
    }
    if let Some(t) = options.tolerance {
        let least = smallest_tolerance(options.precision.unwrap_or(Precision::F64));
        if !(least..1.0).contains(&t) {
            return Err(InputError::new("no kernel keeps such a tolerance")
                .key("--tolerance")
                .value(t)
                .allowed(format!("{least:e} … 1 (exclusive)"))
                .into());
        }
    }
    let places = places(&options)?;
    let settings = Settings::new(args.quick, options.tolerance, rayon::current_num_threads());
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("results/bench"));
    if options.plan == Some(true) {
        return Ok(planned(&settings, &places, out));
    }
    let mut step = |n: usize, of: usize, what: &str| {
        if !quiet {
            say::line(format_args!("[{n:>3} of {of}] {what}"));
        }
    };
    let force = options.force == Some(true);
    let report =
        bench::run(&settings, &places, (&out, force), &mut Watch::new(&mut step, interrupt::stop()))?;
    Ok(Reply {
        text: summary(&report, &places),
        out: Some(out),
        counts: bench::counts(&report.measured),
        seconds: json!({ "total": report.seconds }),
        backend: backends(&places),
        result: result(&report, &places),
        files: report.files,
        quiet,
        ..Reply::default()
    }
    .removing(&report.removed))
}

fn backends(places: &[Place]) -> Value {
    json!(places.iter().map(|p| json!(p.choice.backend)).collect::<Vec<_>>())
}

fn planned(settings: &Settings, places: &[Place], out: PathBuf) -> Reply {
    let (steps, taps, seconds) = (settings.steps(places), settings.taps(places), settings.seconds(places));
    let names = |list: Vec<&str>| list.join(", ");
    let mut text = String::new();
    let kind = if settings.quick { "quick benchmark" } else { "benchmark" };
    let _ = writeln!(text, "{kind}: {steps} measurements, about {taps:.1e} taps, about {seconds:.1e} s");
    let _ = writeln!(text, "  backends        {}", names(places.iter().map(|p| p.name.as_str()).collect()));
    let configurations = settings.configurations.iter().map(|c| c.name).collect();
    let _ = writeln!(text, "  configurations  {}", names(configurations));
    let _ = writeln!(text, "  taps compared   {} with the reference, each", settings.compared);
    let _ = writeln!(text, "  taps timed      {}, {} times", settings.timed, settings.repeats);
    let _ = writeln!(text, "  whole sweeps    {:?} taps", settings.sizes);
    let _ = writeln!(text, "  threads         {:?}", settings.threads);
    let _ = writeln!(text, "  tables, figures and run.json go to {}; nothing was run", out.display());
    Reply {
        text,
        out: Some(out),
        files: Vec::new(),
        counts: json!({ "measurements": steps, "taps": taps }),
        seconds: json!({ "expected": seconds }),
        backend: backends(places),
        result: settings.json(),
        ..Reply::default()
    }
}

/// The ladder at every tolerance, in one line each.
fn summary(report: &Report, places: &[Place]) -> String {
    let mut text = String::new();
    let m = &report.measured;
    let _ = writeln!(
        text,
        "{:<15} {:<14} {:<12} {:>9} {:>11} {:>10} {:>9} {:>9} {:>7}",
        "configuration", "backend", "kernel", "tolerance", "ns per tap", "taps/s", "p99", "worst", "failed"
    );
    for p in m.points.iter().filter(|p| !matches!(p.solved, Solved::Nodes(_))) {
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.1e}"));
        let _ = writeln!(
            text,
            "{:<15} {:<14} {:<12} {:>9} {:>11.1} {:>10.2e} {:>9} {:>9} {:>7}",
            p.configuration,
            places[p.place].name,
            p.solved.name(),
            p.tolerance.map_or(String::new(), |t| format!("{t:e}")),
            p.whole.best,
            1e9 / p.whole.best,
            number(p.errors.map(|e| e.p99)),
            number(p.errors.map(|e| e.worst)),
            p.failed,
        );
    }
    let files: Vec<_> = report.files.iter().map(|p| p.display().to_string()).collect();
    let _ = writeln!(text, "wrote {} in {:.1} s", files.join(", "), report.seconds);
    text
}

fn result(report: &Report, places: &[Place]) -> Value {
    let point = |p: &bench::work::Point| {
        json!({
            "configuration": p.configuration, "backend": places[p.place].name, "kernel": p.solved.name(),
            "nodes": match p.solved { Solved::Nodes(n) => Some(n), _ => None },
            "tolerance": p.tolerance, "taps": p.taps, "failed": p.failed,
            "ns_per_tap": p.whole.best, "ns_per_tap_median": p.whole.median, "taps_per_second": 1e9 / p.whole.best,
            "strain_error_median": p.errors.map(|e| e.median), "strain_error_p99": p.errors.map(|e| e.p99),
            "strain_error_max": p.errors.map(|e| e.worst),
        })
    };
    json!({ "machine": bench::machine(), "points": report.measured.points.iter().map(point).collect::<Vec<_>>() })
}
