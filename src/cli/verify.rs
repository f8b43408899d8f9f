//! `vibrissa verify [SPEC.toml]`: the census of every backend against the reference.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;
use vibrissa::backend::Backend;
use vibrissa::census::compare::Line;
use vibrissa::census::verify::{self, Case, Verified};
use vibrissa::census::{Place, present};
use vibrissa::error::{Error, InputError};
use vibrissa::scene::{BackendChoice, RunOptions, Spec};
use vibrissa::sink::folder::{Folder, Question, Written};
use vibrissa::spec;

use super::args::Verify;
use super::progress::Shown;
use super::reply::{self, Reply};
use super::say;
use super::{apart, interrupt};

/// Taps that the reference solves in a second on one core, to the order of magnitude; only for `--plan`.
const REFERENCE_RATE: f64 = 500.0;

/// Seconds that an adapter takes to compile the kernels of one model; only for `--plan`.
const COMPILE: f64 = 0.7;

/// What was asked, in force.
struct VerifyOptions {
    spec: Option<Spec>,
    options: RunOptions,
    out: PathBuf,
    samples: u32,
    seed: u64,
    quick: bool,
}

/// Verifies, or says what would be verified; a bound that is broken is told beside the result.
pub fn run(args: &Verify) -> Result<Reply, Error> {
    let start = Instant::now();
    let asked = asked(args)?;
    let options = &asked.options;
    let quiet = options.quiet == Some(true);
    reply::in_json(options.json == Some(true));
    super::interrupt::threads(options)?;
    let places = places(args, options)?;
    say::warnings(quiet, asked.spec.iter().flat_map(|s| &s.warnings));
    if options.backend.is_none() && !places.iter().any(|p| p.backend().name == "gpu") {
        say::unless(quiet)("no Vulkan, Metal or DirectX 12 adapter: only the CPU kernels are verified");
    }
    if options.plan == Some(true) {
        return Ok(planned(&asked, &places));
    }
    let on: Vec<String> = places.iter().map(Place::label).collect();
    let of = json!({ "quick": asked.quick, "samples": asked.samples, "seed": asked.seed, "bound": format!("{:?}", args.bound), "places": &on });
    let question = match &asked.spec {
        Some(spec) => Question::of_scene("verify", spec, of),
        None => Question::new("verify", "verify", of),
    };
    let force = options.force == Some(true);
    let mut folder = Folder::open(&asked.out, question, &["verify.csv"], force)?;
    let cases = cases(&asked);
    let taps = cases.iter().map(|c| c.tuples.len() as u64).sum();
    if !quiet {
        say::line(headline(&asked, cases.len(), taps, &places));
    }
    let backends: Vec<Backend> = places.iter().map(|p| p.backend().clone()).collect();
    let (lines, done) = solved(cases, places, &Shown::new(taps, quiet))?;
    let stopped = (done < taps).then_some([done, taps]);
    let kept = stopped.is_none() || (!lines.is_empty() && (force || !interrupt::is_whole(folder.older())));
    let verified = Verified {
        spec: asked.spec.as_ref(),
        samples: asked.samples,
        seed: asked.seed,
        backends: &backends,
        lines: &lines,
        stopped,
        seconds: start.elapsed().as_secs_f64(),
    };
    let what = format!("{done} of {taps} taps");
    let cut = stopped.map(|_| interrupt::last_words(&what, lines.is_empty(), kept, &asked.out));
    let faults = [cut, broken(&lines, &on)].into_iter().flatten().collect::<Vec<_>>();
    let reply = Reply {
        text: table(&lines, &on, args.all || asked.spec.is_some()),
        counts: verified.counts(),
        seconds: json!({ "total": verified.seconds }),
        backend: json!(backends),
        result: json!({ "census": verified.census() }),
        quiet,
        broken: (!faults.is_empty()).then(|| faults.join("\n")),
        ..Reply::default()
    };
    let out = asked.out.clone();
    if !kept {
        return Ok(Reply { out: Some(out), ..reply });
    }
    let table = verified.table()?;
    folder.put(&table.file, &table.csv()?)?;
    folder.run_json(&verified.document())?;
    let Written { files, removed } = folder.finish()?;
    Ok(reply.with_files(out, (files, removed), (start.elapsed().as_secs_f64(), quiet)).answered())
}

/// The lines of the census and the number of taps that were solved everywhere: all, or those before a signal.
fn solved(cases: Vec<Case>, places: Vec<Place>, progress: &Shown) -> Result<(Vec<Line>, u64), Error> {
    let (stop, mut shown) = (interrupt::stop_and_keep(), progress.clone());
    let mut lines: Vec<Line> = Vec::new();
    let work = move |each: &mut dyn FnMut(Line)| verify::run(&cases, &places, stop, &mut shown, each);
    let done = apart::apart(work, |line| lines.push(line));
    progress.finish();
    let done = match done? {
        Some(done) => done?,
        // Left behind in the middle of a configuration.
        None => lines.iter().filter(|l| l.place == 0).map(|l| l.taps as u64).sum(),
    };
    Ok((lines, done))
}

/// The backends; the reference is none of them.
fn places(args: &Verify, options: &RunOptions) -> Result<Vec<Place>, Error> {
    if options.backend == Some(BackendChoice::Reference) {
        let error = InputError::new("the reference is what the other backends are compared with");
        return Err(error.key("--backend").value("reference").allowed("auto (all), gpu, cpu").into());
    }
    present(options, args.bound)
}

/// Reads the spec, if any. Its `out` is where a sweep of it goes: the census goes beside it.
fn asked(args: &Verify) -> Result<VerifyOptions, Error> {
    let mut spec = args.spec.as_deref().map(spec::read).transpose()?;
    spec.iter().try_for_each(|spec| spec.one_rig())?;
    let written = spec.as_ref().map_or_else(RunOptions::default, |s| s.run.clone());
    let options = args.common.over(&written);
    let beside = |path: &Path| {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push("-verify");
        path.with_file_name(name)
    };
    let out = match (&args.common.out, &written.out, &spec) {
        (Some(out), ..) => out.clone(),
        (None, Some(out), _) => beside(out),
        (None, None, Some(spec)) => beside(&Path::new("results").join(&spec.name)),
        (None, None, None) => PathBuf::from("results/verify"),
    };
    if let Some(spec) = &mut spec {
        spec.in_force.retain(|(key, ..)| !key.starts_with("run."));
    }
    let quick = args.quick;
    let samples = args.samples.unwrap_or(verify::samples(spec.is_some(), quick));
    Ok(VerifyOptions { spec, options, out, samples, seed: args.seed, quick })
}

fn cases(asked: &VerifyOptions) -> Vec<Case> {
    match &asked.spec {
        Some(spec) => vec![Case::of_study(&spec.name, spec.study.clone(), asked.samples, asked.seed)],
        None => Case::built_in(asked.samples, asked.seed, asked.quick),
    }
}

fn headline(asked: &VerifyOptions, cases: usize, taps: u64, places: &[Place]) -> String {
    let what = match &asked.spec {
        Some(spec) => format!("{}: {taps} of its taps", spec.name),
        None => format!("{taps} taps of {cases} configurations"),
    };
    let on: Vec<_> = places
        .iter()
        .map(|p| match &p.backend().adapter {
            Some(name) => format!("{} ({name})", p.label()),
            None => p.label(),
        })
        .collect();
    format!("{what}, each on the reference and on {}", on.join(", "))
}

fn planned(asked: &VerifyOptions, places: &[Place]) -> Reply {
    let cases = cases(asked);
    let taps = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let gpus = places.iter().filter(|p| p.backend().adapter.is_some()).count();
    let seconds = taps as f64 / (REFERENCE_RATE * rayon::current_num_threads() as f64)
        + COMPILE * (gpus * cases.len()) as f64;
    let mut text = headline(asked, cases.len(), taps, places) + "\n";
    for case in &cases {
        let _ = writeln!(text, "  {:<22} {} taps", case.name, case.tuples.len());
    }
    let (rows, out) = (cases.len() * places.len(), asked.out.display());
    let _ = writeln!(
        text,
        "  verify.csv would have {rows} rows, in {out}; about {seconds:.0} s; nothing was run"
    );
    Reply {
        text,
        out: Some(asked.out.clone()),
        counts: json!({ "configurations": cases.len(), "taps": taps, "lines": rows }),
        seconds: json!({ "expected": seconds }),
        backend: json!(places.iter().map(Place::backend).collect::<Vec<_>>()),
        result: json!({ "samples": asked.samples, "seed": asked.seed }),
        ..Reply::default()
    }
}

/// Which bounds are broken, and where: the three worst lines in full.
fn broken(lines: &[Line], places: &[String]) -> Option<String> {
    let mut bad: Vec<&Line> = lines.iter().filter(|l| !l.faults().is_empty()).collect();
    let excess = |l: &Line| l.errors[0].map_or(0.0, |f| f.worst / l.bound);
    bad.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    let mut text = format!("{} of {} lines of the census break a bound", bad.len(), lines.len());
    for line in bad.iter().take(3) {
        let faults: Vec<String> = line.faults().into_iter().map(|(_, words)| words).collect();
        let _ = write!(text, "\n  {} on {}: {}", line.configuration, places[line.place], faults.join("; "));
    }
    if bad.len() > 3 {
        let _ = write!(text, "\n  and {} more: see the column verdict of verify.csv", bad.len() - 3);
    }
    (!bad.is_empty()).then_some(text)
}

/// The census for people: one line per backend, and of each configuration that breaks a bound, or of `all`.
fn table(lines: &[Line], places: &[String], all: bool) -> String {
    let mut text = String::new();
    let number = |x: f64| if x.is_nan() { "-".into() } else { format!("{x:.1e}") };
    if !all {
        text += "backend  configurations   taps  compared  worst strain error, of the bound  left to the reference  verdict\n";
        for (n, place) in places.iter().enumerate() {
            let these = || lines.iter().filter(|l| l.place == n);
            let near = |l: &&Line| l.errors[0].map_or(0.0, |f| f.worst / l.bound);
            let Some(worst) = these().max_by(|a, b| near(a).total_cmp(&near(b))) else { continue };
            let sum = |f: fn(&Line) -> usize| these().map(f).sum::<usize>();
            let bad = these().filter(|l| !l.faults().is_empty()).count();
            let verdict = if bad == 0 { "ok".to_owned() } else { format!("{bad} break a bound") };
            let (share, name) = (100.0 * near(&worst), &worst.configuration);
            let (of, taps, both, left) =
                (these().count(), sum(|l| l.taps), sum(|l| l.compared), sum(|l| l.referred));
            let _ = writeln!(
                text,
                "{place:<8} {of:>14} {taps:>6} {both:>9}  {share:>6.1} %  {name:<25} {left:>21}  {verdict}"
            );
        }
    }
    let mut shown = lines.iter().filter(|l| all || !l.faults().is_empty()).peekable();
    if shown.peek().is_none() {
        return text;
    }
    text += "configuration          backend   taps   strain   median      p99  over        K    force      arc unsolved sweeps   max  verdict\n";
    for line in shown {
        let Line { configuration, taps, unsolved, sweeps: (mean, most), .. } = line;
        let (place, first) = (&places[line.place], line.errors[0]);
        let over = first.map_or(0, |f| f.over);
        let [strain, k, force, arc] = line.errors.map(|f| number(f.map_or(f64::NAN, |f| f.worst)));
        let [median, p99] =
            [first.map(|f| f.median), first.map(|f| f.p99)].map(|x| number(x.unwrap_or(f64::NAN)));
        let _ = writeln!(
            text,
            "{configuration:<22} {place:<8} {taps:>5} {strain:>8} {median:>8} {p99:>8} {over:>5} {k:>8} {force:>8} {arc:>8} {unsolved:>8} {mean:>6.1} {most:>5}  {}",
            line.verdict()
        );
    }
    text + "strain, K, force, arc: largest error against the reference; over: taps above the bound; unsolved: taps that only the\n\
            reference solves; sweeps: mean and largest number of a tap.\n"
}
