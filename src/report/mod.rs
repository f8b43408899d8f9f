//! `report`: a result folder → figures, and one page that holds them and its tables.
//!
//! [`source`] reads the folder back and refuses what is damaged; one file for each command makes [`mod@content`] (figures as data, rows
//! for the page) of its tables; [`crate::figure`] draws; [`crate::page`] makes the page. Nothing is computed again: what is drawn is what
//! the tables say.

pub mod answer;
mod bench;
mod bins;
mod calibrate;
pub mod content;
mod contour;
mod designs;
mod locate;
mod optimise;
mod outliers;
mod page;
pub mod quantity;
mod shape;
pub mod source;
mod sweep;
mod tap;
mod verify;

use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::{Error, InputError};
use crate::figure::{self, Figure, Format, Style};
use crate::sink::folder::{Folder, Question, Written};
use crate::sink::frame::Frame;
use crate::sink::run_json;
use content::Content;
use source::Source;

/// Name of the page.
pub const PAGE: &str = "report.html";

/// Commands whose results are drawn.
pub const COMMANDS: [&str; 9] =
    ["sweep", "optimise", "tap", "calibrate", "locate", "contour", "bench", "verify", "shape"];

/// Figures and rows of a result.
///
/// # Errors
/// A result of another command; tables that are missing or damaged.
pub fn content(source: &Source) -> Result<Content, Error> {
    match source.command.as_str() {
        "sweep" => sweep::content(source),
        "optimise" => optimise::content(source),
        "tap" => tap::content(source),
        "calibrate" => calibrate::content(source),
        "locate" => locate::content(source),
        "contour" => contour::content(source),
        "bench" => bench::content(source),
        "verify" => verify::content(source),
        "shape" => shape::content(source),
        other => {
            let error = InputError::new("there are no figures of results of this command");
            let file = source.folder.join("run.json").display().to_string();
            Err(error.at(file, None).key("command").value(other).allowed(COMMANDS.join(", ")).into())
        }
    }
}

/// The answer of the result in `folder`, with which its report begins; empty where it has none.
pub fn answer_of(folder: &Path) -> String {
    Source::open(folder, false)
        .and_then(|source| content(&source))
        .map_or(String::new(), |content| content.answer)
}

/// The figures of a benchmark with this work_precision.csv.
///
/// # Errors
/// A table that is damaged.
pub fn of_bench(table: &Frame) -> Result<Vec<Figure>, Error> {
    Ok(bench::figures(table, None)?)
}

pub use contour::figure as of_contour;

/// What was drawn.
#[derive(Debug)]
pub struct Report {
    /// Files of the report.
    pub written: Written,
    /// What the result says, in one sentence.
    pub answer: String,
    /// Their figures.
    pub figures: Vec<String>,
    /// What was left out, and what is to be minded.
    pub notes: Vec<String>,
    /// Bytes of the page.
    pub bytes: usize,
    /// Of the whole command.
    pub seconds: f64,
}

/// Draws the result in `folder` into the folder `out`.
///
/// # Errors
/// A result that is not whole, or of a command that has no figures; a folder that holds something else.
pub fn run(
    folder: &Path,
    out: &Path,
    style: &Style,
    formats: &[Format],
    force: bool,
) -> Result<Report, Error> {
    let start = Instant::now();
    let source = Source::open(folder, force)?;
    let mut content = content(&source)?;
    content.notes.splice(0..0, source.notes.iter().cloned());
    let pieces: Vec<Vec<(String, Vec<u8>)>> =
        content.figures.par_iter().map(|f| figure::files(f, style, formats)).collect::<Result<_, _>>()?;
    let page = page::page(&source, &content);
    let names: Vec<String> =
        pieces.iter().flatten().map(|(name, _)| name.clone()).chain([PAGE.to_owned()]).collect();
    let listed: Vec<&str> = names.iter().map(String::as_str).collect();
    let words: Vec<&str> = formats.iter().map(|f| f.ending()).collect();
    let asked = json!({
        "drawn": source.hash, "figures": words, "width_mm": style.width, "font_size_pt": style.size, "font": style.font.family,
    });
    let inputs = source.inputs()?.into_iter().chain(style.font.file.clone()).collect();
    let question = Question { inputs, ..Question::new("report", source.name.clone(), asked) };
    let mut target = Folder::open(out, question, &listed, force)?;
    for (name, bytes) in pieces.into_iter().flatten() {
        target.put(&name, &bytes)?;
    }
    target.put(PAGE, page.as_bytes())?;
    let figures: Vec<String> = content.figures.iter().map(|f| f.name.clone()).collect();
    let body = json!({
        "of": { "command": source.command, "run_json_blake3": source.hash, "version": source.run["version"], "commit": source.run["commit"] },
        "figures": content.figures.iter().map(|f| json!({ "name": f.name, "title": f.title, "caption": f.caption })).collect::<Vec<Value>>(),
        "answer": content.answer,
        "notes": content.notes,
        "seconds": { "total": start.elapsed().as_secs_f64() },
    });
    target.run_json(&run_json::document("report", source.run["spec"].clone(), body))?;
    let written = target.finish()?;
    Ok(Report {
        written,
        answer: content.answer,
        figures,
        notes: content.notes,
        bytes: page.len(),
        seconds: start.elapsed().as_secs_f64(),
    })
}
