//! `report`: figures and a page from a result folder.
//!
//! [`source`] reads the folder and refuses damaged files; one file per command makes [`mod@content`] (figures as data, rows of the page);
//! [`crate::figure`] draws; [`page`] makes the page. Nothing is recomputed: figures show the tables.

pub mod answer;
mod calibrate;
mod census;
pub mod content;
mod designs;
mod located;
pub mod quantity;
mod search;
mod shape;
pub mod source;
mod sweep;

use std::path::Path;

use crate::error::{Error, InputError};
use content::Content;
use source::Source;

pub const PAGE: &str = "report.html";

type Draw = fn(&Source) -> Result<Content, Error>;

const DRAWN: [(&str, Draw); 9] = [
    ("sweep", sweep::content),
    ("optimise", search::of_optimise),
    ("tap", search::of_tap),
    ("calibrate", calibrate::content),
    ("locate", located::of_readings),
    ("contour", located::of_contour),
    ("bench", census::of_bench),
    ("verify", census::of_verify),
    ("shape", shape::content),
];

pub fn content(source: &Source) -> Result<Content, Error> {
    if let Some((_, content)) = DRAWN.iter().find(|(command, _)| *command == source.command) {
        return content(source);
    }
    let error = InputError::new("there are no figures of results of this command");
    let file = source.folder.join("run.json").display().to_string();
    let error = error.at(file, None).key("command").value(&source.command);
    Err(error.allowed(DRAWN.map(|(command, _)| command).join(", ")).into())
}

/// The answer of the result in `folder`; empty if it has no report.
pub fn answer_of(folder: &Path) -> String {
    Source::open(folder, false)
        .and_then(|source| content(&source))
        .map_or(String::new(), |content| content.answer)
}

pub use census::figures as of_bench;
pub use located::figure as of_contour;
