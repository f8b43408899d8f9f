//! `vibrissa verify [SPEC.toml]`: the census of every backend against the reference.

use std::path::{Display, Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::apart::{apart, cut};
use super::reply::{aligned, cell, framed, objects, shown};
use super::{Asked, Context, Reply, folder, number, whole};
use crate::backend::Backend;
use crate::census::compare::{Line, QUANTITIES};
use crate::census::verify::{self, Case, CensusNews};
use crate::census::{Place, present};
use crate::error::{Error, InputError};
use crate::report::quantity::grouped;
use crate::scene::BackendChoice;
use crate::sink::run_json::{in_force, material_fit};
use crate::sink::{Frame, Question, hash};
use crate::spec;

/// Columns of the census that people are shown.
const COLUMNS: &str = "configuration,backend,precision,taps,compared,referred,bound,strain_error_worst,strain_error_p99,strain_over,sweeps_mean,sweeps_max,verdict";

/// Compare every backend with the reference. Ctrl-C keeps the lines so far.
#[derive(Debug, Flags, Deserialize)]
pub struct VerifyRequest {
    /// A spec, from which the taps are taken [default: built-in configurations and hard cases]
    pub spec: Option<PathBuf>,
    /// Few taps of few configurations: seconds instead of half a minute
    #[arg(long)]
    pub quick: bool,
    /// Print every line of the census, not only those that break a bound
    #[arg(long)]
    #[serde(default)]
    pub all: bool,
    /// Random taps: of the spec [default: 1000; with --quick 100], or of each built-in configuration beside its hard
    /// cases [default: 24; with --quick 4]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000))]
    pub samples: Option<u32>,
    /// Seed of the random taps
    #[arg(long, value_name = "S", default_value_t = 1, allow_hyphen_values = true, value_parser = whole::<u64>(0..=u64::MAX))]
    pub seed: u64,
    /// Largest strain error that passes, relative as --tolerance is [default: the tolerance with f32, twice the tolerance with f64]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = number)]
    pub bound: Option<f64>,
}

/// Verifies, or says what would be verified; a bound that is broken is told beside the result.
pub fn run(asked: &Asked<VerifyRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    // In memory `[run]` alone is no spec: it says what the built-in configurations are verified on.
    let parse = |label: &str, text: &str, base: &Path| {
        let keys = || text.parse::<toml::Table>().ok()?.keys().all(|key| key == "run").then_some(());
        match context.is_in_memory() && keys().is_some() {
            true => Ok((spec::parse_listed(label, text, base, None)?, false)),
            false => Ok((spec::parse(label, text, base)?, true)),
        }
    };
    let mut read = asked.spec.as_deref().map(|path| context.read(path, "spec", parse)).transpose()?;
    read.iter().try_for_each(|(spec, _)| spec.one_rig())?;
    let written = read.as_ref().and_then(|(spec, _)| spec.run.out.clone());
    let options = context.prepared(&asked.common, read.as_mut().map(|(spec, _)| spec))?;
    let mut spec = read.filter(|(_, whole)| *whole).map(|(spec, _)| spec);
    if options.backend == Some(BackendChoice::Reference) {
        let error = InputError::new("the reference is what the other backends are compared with");
        return Err(error.key("--backend").value("reference").allowed("auto (all), gpu, cpu").into());
    }
    let places = present(&options, asked.bound)?;
    context.warn_all(spec.iter().flat_map(|s| &s.warnings));
    if options.backend.is_none() && !places.iter().any(|p| p.backend().name == "gpu") {
        context.line("warning: no Vulkan, Metal or DirectX 12 adapter: only the CPU kernels are verified");
    }
    // The `out` of a spec is where a sweep of it goes: the census goes beside it.
    let out = asked.common.out.clone().unwrap_or_else(|| {
        let Some(spec) = &spec else { return PathBuf::from("results/verify") };
        let path = folder(written.as_ref(), &spec.name, "sweep");
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push("-verify");
        path.with_file_name(name)
    });
    if let Some(spec) = &mut spec {
        spec.in_force.retain(|(key, ..)| !key.starts_with("run."));
    }
    let [many, few] = if spec.is_some() { [1000, 100] } else { [24, 4] };
    let samples = asked.samples.unwrap_or(if asked.quick { few } else { many });
    let cases = match &spec {
        Some(spec) => vec![Case::of_study(&spec.name, spec.study.clone(), samples, asked.seed)],
        None => Case::built_in(samples, asked.seed, asked.quick),
    };
    let taps: u64 = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let what = match &spec {
        Some(spec) => format!("{}: {taps} of its taps", spec.name),
        None => format!("{taps} taps of {} configurations", cases.len()),
    };
    let on: Vec<String> = places.iter().map(Place::name).collect();
    let headline = format!("{what}, each on the reference and on {}", on.join(", "));
    let backends: Vec<Backend> = places.iter().map(|p| p.backend().clone()).collect();
    if options.plan == Some(true) {
        // Some 500 taps a second and core by the reference, and 0.7 s in which an adapter compiles a model.
        let models = cases.len() * places.iter().filter(|p| p.adapter.is_some()).count();
        let seconds = taps as f64 / (500.0 * rayon::current_num_threads() as f64) + 0.7 * models as f64;
        let rows = cases.len() * places.len();
        let planned = |to: Display<'_>| {
            format!("{headline}\n  verify.csv would have {rows} rows, in {to}; about {seconds:.0} s")
        };
        return Ok(Reply {
            counts: json!({ "configurations": cases.len(), "taps": taps, "lines": rows }),
            seconds: json!({ "expected": seconds }),
            backend: json!(backends),
            result: json!({ "samples": samples, "seed": asked.seed }),
            ..Reply::planned(out, planned)
        });
    }
    let of = json!({ "quick": asked.quick, "samples": samples, "seed": asked.seed, "bound": format!("{:?}", asked.bound), "places": &on });
    let question = match &spec {
        Some(spec) => Question::of_scene("verify", spec, of),
        None => Question::new("verify", "verify", of),
    };
    let mut destination = context.open(&out, question, &["verify.csv"], options.force)?;
    context.line(headline);
    let (mut lines, mut done, mut progress) = (Vec::new(), 0, context.progress());
    apart(
        context,
        move |stop, tell| verify::run(&cases, &places, stop, tell),
        |news| match news {
            CensusNews::Done(done) => progress.at(done, taps),
            CensusNews::Lines(with, more) => {
                done = with;
                lines.extend(more);
            }
        },
    )?;
    drop(progress);
    let (kept, words) = cut(([done, taps], "taps"), &destination);
    let table = framed("verify", &[], lines.iter().map(|line: &Line| line.fields(&backends[line.place])))?;
    let faults: Vec<String> = words.clone().into_iter().chain(broken(&table)).collect();
    let census = objects(&table);
    let (name, text) = spec.as_ref().map_or(("verify", ""), |s| (&s.name, &s.text));
    let of = json!({ "name": name, "hash": hash(text), "text": text });
    let body = json!({
        "in_force": spec.as_ref().map(in_force),
        "material_fit": spec.as_ref().map(|s| material_fit(s, None)),
        "warnings": spec.as_ref().map_or(&[][..], |s| &s.warnings),
        "samples": samples,
        "seed": asked.seed,
        "backends": backends,
        "stopped": words.map(|_| json!({ "taps": done, "of": taps })),
        "census": census,
    });
    let rows = if asked.all || spec.is_some() { table.rows(|_| true) } else { bad(&table) };
    let sum = |name: &str| (0..table.len()).map(|r| table.number(name, r) as u64).sum::<u64>();
    let reply = Reply {
        text: summary(&table) + &if rows.is_empty() { String::new() } else { shown(&table, &rows, COLUMNS) },
        counts: json!({
            "comparisons": sum("taps"),
            "compared": sum("compared"),
            "strain_over": sum("strain_over"),
            "lines": table.len(),
            "broken_lines": bad(&table).len(),
        }),
        seconds: context.seconds(),
        backend: json!(backends),
        result: json!({ "census": census }),
        quiet: context.is_quiet(),
        broken: (!faults.is_empty()).then(|| faults.join("\n")),
        ..Reply::default()
    };
    if !kept {
        return Ok(Reply { out: Some(out), ..reply });
    }
    destination.table(table)?;
    Ok(reply.filed(destination, of, body)?.answered())
}

/// A line for each backend.
fn summary(census: &Frame) -> String {
    let place = |row| ["backend", "precision"].map(|name| census.word(name, row)).join(" ");
    let excess = |row| census.number("strain_error_worst", row) / census.number("bound", row);
    let mut places = grouped(0..census.len(), place);
    places.sort_unstable_keys();
    let head = "backend,configurations,taps,compared,largest strain error of its bound,in,left to the reference,verdict";
    let line = |(name, rows): (String, Vec<usize>)| {
        let worst = rows.iter().copied().filter(|r| excess(*r).is_finite());
        let worst = worst.max_by(|p, q| excess(*p).total_cmp(&excess(*q)));
        let sum = |column| rows.iter().map(|r| census.number(column, *r)).sum::<f64>().to_string();
        let broken = rows.iter().filter(|r| census.word("verdict", **r) != "ok").count();
        let (share, at) = worst.map_or_else(Default::default, |r| {
            (format!("{:.1} %", 100.0 * excess(r)), census.word("configuration", r))
        });
        let verdict = if broken == 0 { "ok".to_owned() } else { format!("{broken} break a bound") };
        let n = rows.len().to_string();
        vec![name, n, sum("taps"), sum("compared"), share, at, sum("referred"), verdict]
    };
    aligned(head, places.into_iter().map(line))
}

/// The lines of the census that break a bound.
fn bad(census: &Frame) -> Vec<usize> {
    census.rows(|r| census.word("verdict", r) != "ok")
}

/// Which bounds are broken, and where: three lines.
fn broken(census: &Frame) -> Option<String> {
    let bad = bad(census);
    let mut told = format!("{} of {} lines of the census break a bound", bad.len(), census.len());
    for row in bad.iter().take(3) {
        let word = |name: &str| cell(census, name, *row);
        let [name, backend, precision, verdict, other] =
            ["configuration", "backend", "precision", "verdict", "other_words"].map(word);
        let broken = |quantity: &str| census.number(&format!("{quantity}_over"), *row) > 0.0;
        let error = |q| {
            format!(
                "{q} error up to {} on {} of {} taps",
                word(&format!("{q}_error_worst")),
                word(&format!("{q}_over")),
                word("compared")
            )
        };
        let errors: Vec<String> = QUANTITIES.into_iter().filter(|q| broken(q)).map(error).collect();
        let (errors, bound) = (errors.join(", "), word("bound"));
        let place = census.names.iter().skip_while(|c| *c != "D_mm").take_while(|c| *c != "verdict");
        let at = place.map(|c| format!(" {c}={}", word(c))).filter(|at| !at.ends_with('='));
        let at: String = at.collect();
        let line = format!(
            "\n  {name} on {backend} {precision} ({verdict}, bound of the strain {bound}): {errors}, worst at{at}; {other}"
        );
        told += line.trim_end_matches("; ");
    }
    if bad.len() > 3 {
        told += &format!("\n  and {} more: see the column verdict of verify.csv", bad.len() - 3);
    }
    (!bad.is_empty()).then_some(told)
}
