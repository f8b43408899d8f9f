//! `vibrissa explore SPEC.toml`: a page with sliders.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Asked, Context, Reply};
use crate::error::{Error, InputError};
use crate::explore::page::{HEAD, document, html};
use crate::explore::{TOLERANCE, bake_asked, remark, sound};
use crate::sink::folder::Question;
use crate::spec;

const FILE: &str = "explore.html";

/// One page with sliders: strain, K, its spread and the error budget by the exact model. It needs no network.
#[derive(Debug, Flags, Deserialize)]
#[command(
    after_help = "Here --out names a file, not a folder [default: explore.html]. Example: vibrissa explore sweeps/prototypes.toml"
)]
pub struct ExploreRequest {
    /// The spec: its ranges of whisker, gauge, drive and distances become those of the sliders (a single number gets a range around it)
    pub spec: PathBuf,
}

pub fn run(asked: &Asked<ExploreRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    spec.one_rig()?;
    let options = context.begun(&asked.common, &mut spec)?;
    let tolerance = sound(options.tolerance.unwrap_or(TOLERANCE))?;
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from(FILE));
    if !context.is_in_memory() {
        free(&out, &[spec.inputs.clone(), context.inputs()].concat(), options.force == Some(true))?;
    }
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |to| format!("{}: one chart to {tolerance:e}, as {to}", spec.name)));
    }
    context.warn_all(remark(&spec.study.setup));
    let (baked, held) = bake_asked(&spec, options.tolerance)?;
    context.warn_all((held != tolerance).then(|| {
        format!(
            "the model is not smooth enough over these ranges for a chart to {tolerance:e}: it holds {held:e}"
        )
    }));
    let page = html(&document(&spec, &baked)?);
    let (census, chart) = (baked.census, &baked.chart);
    let coefficients = chart.coefficients(spec.study.setup.signal);
    let counts = json!({ "coefficients": coefficients, "taps_checked": census.taps, "taps_outside": census.outside, "bytes": page.len() });
    let (domain, d) = (&baked.domain, &baked.domain.whiskers);
    let domain = json!({ "D_mm": d.D, "d_tip_mm": d.d, "L_a_mm": d.L_a, "x_ss_mm": d.x_ss, "l_mm": d.l, "hub_mm": domain.hub, "a_mm": domain.a, "drive": d.drive });
    let result =
        json!({ "strain_error": census.strain, "deviation_error": census.deviation, "domain": domain });
    if context.is_in_memory() {
        let question = Question::of_scene("explore", &spec, Value::Null);
        let mut destination = context.open(&out, question, &[], None)?;
        destination.put(FILE, page.into_bytes())?;
        let body = json!({ "result": result });
        return Reply { counts, result, ..Reply::default() }.filed_of(&spec, destination, body);
    }
    write(&out, &page)?;
    let (signal, taps, error) = (spec.study.setup.signal.word(), census.taps, census.strain);
    let outside = match census.outside {
        0 => String::new(),
        n => format!(", {n} more lie outside the chart"),
    };
    let (to, size, time) = (out.display(), page.len().div_ceil(1000), context.elapsed());
    let text = format!(
        "one chart of every distance, {coefficients} coefficients; {signal} right to {error:.1e} at {taps} whiskers of the ranges{outside}\n\
         wrote {to} ({size} kB) in {time:.2} s\n"
    );
    let (files, seconds, quiet) = (vec![out.clone()], context.seconds(), context.is_quiet());
    Ok(Reply { text, out: Some(out), files, counts, seconds, result, quiet, ..Reply::default() })
}

/// Checks that `out` may be written: not a folder, not an input, and only an older page is replaced unless forced.
fn free(out: &Path, inputs: &[PathBuf], force: bool) -> Result<(), Error> {
    let ours = || {
        let mut start = Vec::new();
        let read = File::open(out).and_then(|file| file.take(HEAD.len() as u64).read_to_end(&mut start));
        read.is_ok() && start == HEAD.as_bytes()
    };
    let (why, allowed) = if out.is_dir() {
        ("this is a folder; a page is one file", "the name of a file, such as explore.html")
    } else if inputs.iter().any(|input| same_file::is_same_file(out, input).unwrap_or(false)) {
        ("this is an input", "another file")
    } else if out.exists() && !out.is_file() {
        ("this is a pipe or a device; a page is a file", "the name of a file")
    } else if out.exists() && !force && !ours() {
        ("this file is no page of `vibrissa explore`", "another file, or --force to replace it")
    } else {
        return Ok(());
    };
    Err(InputError::new(why).key("--out").value(out.display()).allowed(allowed).into())
}

fn write(out: &Path, page: &str) -> Result<(), Error> {
    let failed = |e: std::io::Error| Error::io(out.display().to_string(), e);
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let beside = folder.join(format!(".vibrissa-{}-{name}", std::process::id()));
    let written = File::create(&beside)
        .and_then(|mut file| file.write_all(page.as_bytes()).and_then(|()| file.sync_all()))
        .and_then(|()| std::fs::rename(&beside, out));
    written.map_err(|e| {
        let _ = std::fs::remove_file(&beside);
        failed(e)
    })
}
