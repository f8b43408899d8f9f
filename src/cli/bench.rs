//! `vibrissa bench`.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::census::bench::{self, Measured, News, Settings, Solved, name, places, spread};
use vibrissa::census::{Figures, Place};
use vibrissa::error::{Error, InputError};
use vibrissa::kernel::rule::smallest_tolerance;
use vibrissa::scene::{BackendChoice, Precision, RunOptions};

use super::args::Bench;
use super::progress::Steps;
use super::reply::Reply;
use super::say::rough;
use super::{apart, interrupt, say};

/// Largest spread of repeats that says nothing about the machine: backends and tolerances are compared where they differ by tens of percent.
const QUIET: f64 = 0.15;

/// Measures, or says what would be measured.
pub fn run(args: &Bench) -> Result<Reply, Error> {
    let options = args.common.over(&RunOptions::default());
    let quiet = options.quiet == Some(true);
    super::interrupt::threads(&options)?;
    if let Some(t) = options.tolerance {
        let least = smallest_tolerance(options.precision.unwrap_or(Precision::F64));
        if !(least..1.0).contains(&t) {
            let error = InputError::new("no kernel keeps such a tolerance").key("--tolerance").value(t);
            return Err(error.allowed(format!("{least:e} … 1 (exclusive)")).into());
        }
    }
    let mut places = places(&options)?;
    if args.quick && matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none()
    {
        // They compile for a minute what the CPU has compiled.
        places.retain(|p| !p.backend().software);
    }
    let settings = Settings::new(args.quick, options.tolerance);
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("results/bench"));
    if options.plan == Some(true) {
        return Ok(planned(&settings, &places, out));
    }
    let force = options.force == Some(true);
    let folder = bench::open(&settings, &places, &out, force)?;
    let (begun, steps) = (Instant::now(), settings.steps(&places).len());
    let (settings, places) = (Arc::new(settings), Arc::new(places));
    let (measured, done) = measured(&settings, &places, &Steps::new(steps as u64, quiet))?;
    let stopped = (done < steps).then_some([done, steps]);
    let kept = stopped.is_none() || (!measured.is_empty() && (force || !interrupt::is_whole(folder.older())));
    let differ = spread(&measured);
    say::warnings(quiet, (differ > QUIET).then(|| {
        format!("repeats of a measurement differ by up to {:.0} %: this machine does something else too, and its figures may be too slow", 100.0 * differ)
    }));
    let what = format!("{done} of {steps} measurements");
    let reply = Reply {
        text: summary(&measured, &places),
        counts: bench::counts(&measured),
        seconds: json!({ "total": begun.elapsed().as_secs_f64() }),
        backend: backends(&places),
        result: result(&measured, &places),
        broken: stopped.map(|_| interrupt::last_words(&what, measured.is_empty(), kept, &out)),
        quiet,
        ..Reply::default()
    };
    if !kept {
        return Ok(Reply { out: Some(out), ..reply });
    }
    let written = bench::write(folder, (&settings, &places), &measured, (begun, stopped))?;
    let seconds = begun.elapsed().as_secs_f64();
    Ok(reply.with_files(out, (written.files, written.removed), (seconds, quiet)).answered())
}

/// What was measured, and in how many steps: in all, or in those before a signal.
fn measured(
    settings: &Arc<Settings>,
    places: &Arc<Vec<Place>>,
    shown: &Steps,
) -> Result<(Vec<Measured>, usize), Error> {
    let stop = interrupt::stop_and_keep();
    let (mut measured, mut done, of) = (Vec::new(), 0, settings.steps(places).len());
    let (settings, places) = (Arc::clone(settings), Arc::clone(places));
    let work = move |tell: &mut dyn FnMut(News)| bench::measure(&settings, &places, stop, tell);
    let ended = apart::apart(work, |news| match news {
        News::Begun(n, what) => {
            shown.at(n, of, &what);
            done = n - 1;
        }
        News::Made(one) => measured.push(*one),
    });
    shown.finish();
    match ended? {
        Some(Ok(())) => done = of,
        Some(Err(e)) if !interrupt::asked() => return Err(e),
        _ => {}
    }
    Ok((measured, done))
}

fn backends(places: &[Place]) -> Value {
    json!(places.iter().map(Place::backend).collect::<Vec<_>>())
}

fn planned(settings: &Settings, places: &[Place], out: PathBuf) -> Reply {
    let steps = settings.steps(places);
    let (taps, seconds) = settings.cost(&steps, places);
    let steps = steps.len();
    let (about, time) = (rough(taps as f64), rough(seconds));
    let on = (0..places.len()).map(|k| name(places, k)).collect::<Vec<_>>().join(", ");
    let of = settings.configurations.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
    let Settings { quick, compared, timed, repeats, .. } = settings;
    let kind = if *quick { "quick benchmark" } else { "benchmark" };
    Reply {
        counts: json!({ "measurements": steps, "taps": taps }),
        seconds: json!({ "expected": seconds }),
        backend: backends(places),
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

/// The ladder at every tolerance, in one line each.
fn summary(measured: &[Measured], places: &[Place]) -> String {
    let mut text = "configuration   backend        kernel       tolerance  ns per tap  spread     taps/s       p99     worst  failed\n".to_owned();
    for m in measured.iter().filter(|m| !matches!(m.step.solved, Solved::Nodes(_))) {
        let number =
            |f: fn(&Figures) -> f64| m.errors.as_ref().map_or(String::new(), |e| format!("{:.1e}", f(e)));
        let (configuration, failed) = (m.step.configuration.name, m.failed);
        let (backend, kernel) = (name(places, m.step.place), m.step.solved.name());
        let tolerance = m.step.tolerance.map_or(String::new(), |t| format!("{t:e}"));
        let (ns, rate) = (m.times.best, 1e9 / m.times.best);
        let spread = m.times.spread.map_or(String::new(), |s| format!("{:.0} %", 100.0 * s));
        let (p99, worst) = (number(|e| e.p99), number(|e| e.worst));
        let _ = writeln!(
            text,
            "{configuration:<15} {backend:<14} {kernel:<12} {tolerance:>9} {ns:>11.1} {spread:>7} {rate:>10.2e} {p99:>9} {worst:>9} {failed:>7}"
        );
    }
    text + "ns per tap: the fastest of the repeats; spread: (slowest − fastest) / median of them; p99, worst: strain error against the\n\
            reference, 99 of 100 taps are not worse, and the worst tap; failed: taps that only the reference solves.\n"
}

fn result(measured: &[Measured], places: &[Place]) -> Value {
    let point = |m: &Measured| {
        let mut point = bench::point(m, places);
        point["backend"] = name(places, m.step.place).into();
        point["taps_per_second"] = (1e9 / m.times.best).into();
        point
    };
    let points: Vec<Value> = measured.iter().map(point).collect();
    json!({ "machine": bench::machine(), "spread": spread(measured), "points": points })
}
