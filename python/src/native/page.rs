//! `vibrissa.explore` and `vibrissa.report`.

use std::path::PathBuf;
use std::time::Instant;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::error::InputError;
use vibrissa::explore::document::document;
use vibrissa::explore::{bake_asked, page, remark};
use vibrissa::figure::{Format, Style};
use vibrissa::report as drawn;
use vibrissa::sink::run_json;
use vibrissa::spec;

use super::error::keywords;
use super::job;
use super::spec::UnreadSpec;
use super::words::meant;

/// The page with sliders of the spec in `path` with the sections of `text` over it: HTML, run.json, what should be known.
#[pyfunction]
pub fn explore(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
) -> PyResult<(String, String, Vec<String>)> {
    job::whole(py, None, None, move |_, _| {
        let start = Instant::now();
        let asked = UnreadSpec::new(path, text, "explore")?;
        let spec = asked.read(spec::parse)?;
        spec.one_rig()?;
        let (baked, _) = bake_asked(&spec, spec.run.tolerance)?;
        let html = page::html(&document(&spec, &baked)?);
        let census = &baked.census;
        let body = json!({
            "in_force": run_json::in_force(&spec),
            "counts": { "taps_checked": census.taps, "taps_outside": census.outside, "bytes": html.len() },
            "result": { "strain_error": census.strain, "deviation_error": census.deviation },
            "seconds": { "total": start.elapsed().as_secs_f64() },
        });
        let run = run_json::document("explore", run_json::spec(&spec), body);
        let warnings = spec.warnings.iter().cloned().chain(remark(&spec.study.setup)).collect();
        Ok((html, run.to_string(), warnings))
    })
}

/// How a result is drawn.
#[derive(FromPyObject)]
pub struct Drawn {
    out: Option<PathBuf>,
    figures: Vec<String>,
    width: f64,
    font_size: f64,
    font: Option<PathBuf>,
    force: bool,
}

/// Draws the result in `folder`: what it says, where it was drawn, names of figures, files, notes.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn report(
    py: Python<'_>,
    folder: PathBuf,
    said: Drawn,
) -> PyResult<(String, PathBuf, Vec<String>, Vec<PathBuf>, Vec<String>)> {
    job::whole(py, None, None, move |_, _| {
        let format = |word: &String| {
            meant(("word", "figures"), word, Format::WORDS.map(|(word, format, _)| (word, format)))
        };
        let mut formats = said.figures.iter().map(format).collect::<Result<Vec<_>, InputError>>()?;
        formats.sort();
        formats.dedup();
        let style = Style::asked(said.width, said.font_size, said.font.as_deref(), ["width", "font_size"])?;
        let out = said.out.unwrap_or_else(|| folder.join("report"));
        let made = drawn::run(&folder, &out, &style, &formats, said.force)?;
        let notes = made.notes.iter().map(|note| keywords(note)).collect();
        Ok((made.answer, out, made.figures, made.written.files.clone(), notes))
    })
}
