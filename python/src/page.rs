//! `vibrissa.explore` and `vibrissa.report`.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::error::{Error, InputError};
use vibrissa::explore::document::document;
use vibrissa::explore::{TOLERANCE, bake, page, sound};
use vibrissa::figure::{Format, Style};
use vibrissa::report as drawn;
use vibrissa::sink::run_json;
use vibrissa::spec;

use crate::error::keywords;
use crate::job::{self, Far};
use crate::spec::UnreadSpec;

/// The page with sliders of the spec in `path` with the sections of `text` over it: HTML, run.json, what should be known.
#[pyfunction]
pub fn explore(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
) -> PyResult<(String, String, Vec<String>)> {
    let work = move |_: &AtomicBool, _: &mut dyn FnMut(Far)| {
        let start = Instant::now();
        let asked = UnreadSpec::new(path, text, "explore")?;
        let spec = asked.read(spec::parse)?;
        spec.one_rig()?;
        let baked = bake(&spec, sound(spec.run.tolerance.unwrap_or(TOLERANCE))?)?;
        let html = page::html(&document(&spec, &baked)?);
        let census = &baked.census;
        let body = json!({
            "in_force": run_json::in_force(&spec),
            "counts": { "taps_checked": census.taps, "taps_outside": census.outside, "bytes": html.len() },
            "result": { "strain_error": census.strain, "deviation_error": census.deviation },
            "seconds": { "total": start.elapsed().as_secs_f64() },
        });
        let run = run_json::document("explore", run_json::spec(&spec), body);
        Ok((html, run.to_string(), spec.warnings))
    };
    let (found, interrupt) = job::run(py, None, work, job::shown(None))?;
    interrupt.map_or(Ok(found), Err)
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
    let work = move |_: &AtomicBool, _: &mut dyn FnMut(Far)| {
        let known = Format::WORDS.map(|(word, ..)| word);
        let mut formats = Vec::new();
        for word in &said.figures {
            let Some(k) = known.iter().position(|known| known == word) else {
                let wrong = InputError::new("there is no such word").key("figures").value(word);
                return Err(Error::from(wrong.allowed(known.join(", "))));
            };
            formats.push(Format::WORDS[k].1);
        }
        formats.sort();
        formats.dedup();
        let style = Style::asked(said.width, said.font_size, said.font.as_deref(), ["width", "font_size"])?;
        let out = said.out.unwrap_or_else(|| folder.join("report"));
        let made = drawn::run(&folder, &out, &style, &formats, said.force)?;
        let notes = made.notes.iter().map(|note| keywords(note)).collect();
        Ok((made.answer, out, made.figures, made.written.files.clone(), notes))
    };
    let (found, interrupt) = job::run(py, None, work, job::shown(None))?;
    interrupt.map_or(Ok(found), Err)
}
