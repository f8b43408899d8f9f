//! Commands: what each is asked, and what comes of it.
//!
//! A request is one struct that clap reads from flags and serde from Python's keywords; `run` answers it in a [`Context`] with a [`Reply`]. The
//! program and the Python package only fill in the request, and print or hand on the reply.

// The comments of flags are their help on the terminal: plain text, in which [model] is a section and <out> stands for a folder.
#![allow(rustdoc::broken_intra_doc_links, rustdoc::invalid_html_tags)]

mod apart;
pub mod array;
pub mod bench;
mod best;
pub mod calibrate;
pub mod chart;
mod common;
mod context;
pub mod contour;
pub mod explore;
pub mod next;
pub mod optimise;
pub mod plan;
mod reply;
pub mod report;
pub mod shape;
pub mod simulate;
pub mod sweep;
pub mod tap;
pub mod taps;
pub mod verify;
mod words;

pub use common::{Common, named, number, shard, whole, words};
pub use context::{Context, Destination, Held, HeldFile, Host, KeptFile, Measured};
pub use reply::Reply;
pub use words::{grouped, in_force, listed, rough, where_and_why, with_model_error};

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::error::{Error, InputError};
use crate::estimator::{ALL, Estimator};

/// Name of the file at `path` without its ending; `usual` where it has none.
pub fn stem(path: &Path, usual: &str) -> String {
    path.file_stem().map_or_else(|| usual.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Where a command writes: what was typed or stands in the spec, else `results/<name>` for a sweep and
/// `results/<name>-<command>` for the others.
pub fn folder(out: Option<&PathBuf>, name: &str, command: &str) -> PathBuf {
    let folder = if command == "sweep" { name.to_owned() } else { format!("{name}-{command}") };
    out.cloned().unwrap_or_else(|| Path::new("results").join(folder))
}

/// Refuses options that hold for one signal: each with whether it was given, and what is allowed.
pub fn of_one_signal(options: &[(&str, bool, &str)]) -> Result<(), InputError> {
    match options.iter().find(|(_, said, _)| *said) {
        Some((key, _, allowed)) => {
            let error = InputError::new("this is said of one signal, and the sensor has several channels");
            Err(error.key(*key).allowed(*allowed))
        }
        None => Ok(()),
    }
}

/// What stands beside the word `said` for `key` in `words`; `what` says what it is.
pub fn meant<T: Copy>(
    (what, key): (&str, &str),
    said: Option<&str>,
    words: &[(&'static str, T, &'static str)],
) -> Result<Option<T>, InputError> {
    let Some(said) = said else { return Ok(None) };
    let found = words.iter().find(|(word, ..)| *word == said).map(|(_, value, _)| *value);
    let wrong = || {
        let known: Vec<&str> = words.iter().map(|(word, ..)| *word).collect();
        InputError::new(format!("there is no such {what}")).key(key).value(said).allowed(known.join(", "))
    };
    found.map(Some).ok_or_else(wrong)
}

/// Estimators: name, and what they are.
pub fn estimators() -> [(&'static str, &'static dyn Estimator, &'static str); ALL.len()] {
    ALL.map(|e| (e.name(), e, e.help()))
}

/// The estimator of this name.
pub fn estimator(said: Option<&str>) -> Result<Option<&'static dyn Estimator>, InputError> {
    meant(("estimator", "--estimator"), said, &estimators())
}

/// Runs a command by its name, with a request that is given as TOML.
pub fn run(command: &str, request: &str, context: &Context<'_>) -> Result<Reply, Error> {
    fn read<T: DeserializeOwned>(request: &str) -> Result<T, Error> {
        toml::from_str(request).map_err(|e| Error::Run(e.to_string()))
    }
    match command {
        "array" => array::run(&read(request)?, context),
        "calibrate" => calibrate::run(&read(request)?, context),
        "chart" => chart::run(&read(request)?, context),
        "contour" => contour::run(&read(request)?, context),
        "explore" => explore::run(&read(request)?, context),
        "next" => next::run(&read(request)?, context),
        "optimise" => optimise::run(&read(request)?, context),
        "plan" => plan::run(&read(request)?, context),
        "report" => report::run(&read(request)?, context),
        "shape" => shape::run(&read(request)?, context),
        "simulate" => simulate::run(&read(request)?, context),
        "sweep" => sweep::run(&read(request)?, context),
        "tap" => tap::run(&read(request)?, context),
        "taps" => taps::run(&read(request)?, context),
        "verify" => verify::run(&read(request)?, context),
        other => Err(Error::Run(format!("there is no command {other}"))),
    }
}
