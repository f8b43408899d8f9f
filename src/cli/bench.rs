//! `vibrissa bench`.

use std::cell::RefCell;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::bench::{
    self, Measured, Part, Settings, Watch,
    noise::Noise,
    place::{Place, places},
    work::Solved,
};
use vibrissa::error::{Error, InputError};
use vibrissa::kernel::rule::smallest_tolerance;
use vibrissa::report::answer_of;
use vibrissa::scene::{BackendChoice, Precision, RunOptions};
use vibrissa::sink::folder::Written;

use super::args::Bench;
use super::progress::Steps;
use super::reply::Reply;
use super::say::rough;
use super::{apart, interrupt, say};

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
        places.retain(|p| !p.choice.backend.software);
    }
    let settings = Settings::new(args.quick, options.tolerance, rayon::current_num_threads());
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("results/bench"));
    if options.plan == Some(true) {
        return Ok(planned(&settings, &places, out));
    }
    let force = options.force == Some(true);
    let folder = bench::open(&settings, &places, &out, force)?;
    let (begun, steps) = (Instant::now(), settings.steps(&places));
    let (settings, places) = (Arc::new(settings), Arc::new(places));
    let scratch = folder.scratch()?;
    let (measured, done) = measured(&settings, &places, &scratch, &Steps::new(steps as u64, quiet))?;
    drop(scratch);
    let stopped = (done < steps).then_some([done, steps]);
    let kept = stopped.is_none() || (!measured.is_empty() && (force || !interrupt::is_whole(folder.older())));
    let noise = Noise::of(&measured, &places);
    say::warnings(quiet, noise.warning());
    let mut text = summary(&measured, &places);
    let (mut files, mut removed) = (Vec::new(), Vec::new());
    if kept {
        Written { files, removed, .. } =
            bench::write(folder, &settings, &places, &measured, (begun, stopped))?;
        let _ = writeln!(text, "wrote {} in {:.1} s", super::listed(&files), begun.elapsed().as_secs_f64());
    }
    let what = format!("{done} of {steps} measurements");
    Ok(Reply {
        answer: if kept { answer_of(&out) } else { String::new() },
        text,
        counts: bench::counts(&measured),
        seconds: json!({ "total": begun.elapsed().as_secs_f64() }),
        backend: backends(&places),
        result: result(&measured, &noise, &places),
        broken: stopped.map(|_| interrupt::last_words(&what, measured.is_empty(), kept, &out)),
        out: Some(out),
        files,
        quiet,
        ..Reply::default()
    }
    .removing(&removed))
}

/// What was measured, and in how many steps: in all, or in those before a signal.
fn measured(
    settings: &Arc<Settings>,
    places: &Arc<Vec<Place>>,
    scratch: &Path,
    shown: &Steps,
) -> Result<(Measured, usize), Error> {
    let (stop, path) = (interrupt::stop_and_keep(), scratch.to_owned());
    let (mut measured, mut done, of) = (Measured::default(), 0, settings.steps(places));
    let (settings, places, steps) = (Arc::clone(settings), Arc::clone(places), shown.clone());
    let work = move |tell: &mut dyn FnMut(News)| {
        let tell = RefCell::new(tell);
        let mut step = |n: usize, of: usize, what: &str| {
            steps.at(n, of, what);
            (tell.borrow_mut())(News::Begun(n));
        };
        let mut each = |part| (tell.borrow_mut())(News::Part(part));
        bench::measure(&settings, &places, &path, &mut Watch::new(&mut step, &mut each, stop))
    };
    let ended = apart::apart(work, |news| match news {
        News::Begun(n) => done = n - 1,
        News::Part(part) => measured.add(part),
    });
    shown.finish();
    match ended? {
        Some(Ok(())) => done = of,
        Some(Err(e)) if !interrupt::asked() => return Err(e),
        _ => {}
    }
    Ok((measured, done))
}

/// What the measuring tells.
enum News {
    /// A step begins, from 1.
    Begun(usize),
    /// A measurement is made.
    Part(Part),
}

fn backends(places: &[Place]) -> Value {
    json!(places.iter().map(|p| json!(p.choice.backend)).collect::<Vec<_>>())
}

fn planned(settings: &Settings, places: &[Place], out: PathBuf) -> Reply {
    let (steps, taps, seconds) = (settings.steps(places), settings.taps(places), settings.seconds(places));
    let (about, time) = (rough(taps as f64), rough(seconds));
    let on = places.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
    let of = settings.configurations.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
    let Settings { quick, compared, timed, repeats, sizes, threads, .. } = settings;
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
                 whole sweeps    {sizes:?} taps\n  \
                 threads         {threads:?}\n  \
                 tables, figures and run.json go to {to}"
            )
        })
    }
}

/// The ladder at every tolerance, in one line each.
fn summary(m: &Measured, places: &[Place]) -> String {
    let mut text = "configuration   backend        kernel       tolerance  ns per tap  spread     taps/s       p99     worst  failed\n".to_owned();
    for p in m.points.iter().filter(|p| !matches!(p.solved, Solved::Nodes(_))) {
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.1e}"));
        let (name, backend, kernel, failed) =
            (p.configuration, &places[p.place].name, p.solved.name(), p.failed);
        let tolerance = p.tolerance.map_or(String::new(), |t| format!("{t:e}"));
        let (ns, rate) = (p.whole.best, 1e9 / p.whole.best);
        let spread = p.whole.spread.map_or(String::new(), |s| format!("{:.0} %", 100.0 * s));
        let [p99, worst] = [p.errors.map(|e| e.p99), p.errors.map(|e| e.worst)].map(number);
        let _ = writeln!(
            text,
            "{name:<15} {backend:<14} {kernel:<12} {tolerance:>9} {ns:>11.1} {spread:>7} {rate:>10.2e} {p99:>9} {worst:>9} {failed:>7}"
        );
    }
    text.push_str(
        "ns per tap: the fastest of the repeats; spread: (slowest − fastest) / median of them; p99, worst: strain error against the\n\
         reference, 99 of 100 taps are not worse, and the worst tap; failed: taps that only the reference solves.\n",
    );
    text
}

fn result(measured: &Measured, noise: &Noise, places: &[Place]) -> Value {
    let point = |p: &bench::work::Point| {
        json!({
            "configuration": p.configuration, "backend": places[p.place].name, "kernel": p.solved.name(),
            "nodes": match p.solved { Solved::Nodes(n) => Some(n), _ => None },
            "tolerance": p.tolerance, "taps": p.taps, "failed": p.failed,
            "ns_per_tap": p.whole.best, "ns_per_tap_median": p.whole.median, "spread": p.whole.spread, "taps_per_second": 1e9 / p.whole.best,
            "strain_error_median": p.errors.map(|e| e.median), "strain_error_p99": p.errors.map(|e| e.p99),
            "strain_error_max": p.errors.map(|e| e.worst),
        })
    };
    let points: Vec<Value> = measured.points.iter().map(point).collect();
    json!({ "machine": bench::machine(), "noise": noise.json(), "points": points })
}
