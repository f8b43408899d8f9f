//! `report`: figures and a page from a result folder.
//!
//! [`Source`] reads the folder and refuses damaged files; one file per command makes [`mod@content`] (figures as data, rows of the page);
//! [`crate::figure`] draws. Nothing is recomputed: figures show the tables.

pub mod answer;
mod calibrate;
mod census;
pub mod content;
mod designs;
mod located;
pub mod quantity;
mod search;
mod shape;
mod sweep;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{
    hash_file, is_finishing, is_result_name, look, names_in, open_of_result, read_run,
};
use crate::sink::run_json::FORMAT;
use crate::sink::{Frame, read};
use content::Content;

pub const PAGE: &str = "report.html";

/// The drawing of a table; none if it lacks a column.
type Drawn<T = crate::figure::Figure> = Result<T, InputError>;
/// x and y.
type Point = (f64, f64);

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

#[derive(Debug)]
pub struct Source {
    pub folder: PathBuf,
    pub run: Value,
    /// Command that made the result.
    pub command: String,
    /// Name of the spec or the data.
    pub name: String,
    /// BLAKE3 of `run.json` in hex; it contains the hashes of the other files.
    pub hash: String,
    /// Notes for the reader: edited files, a stopped run.
    pub notes: Vec<String>,
}

impl Source {
    /// Reads `run.json` of `folder` and checks the files that it lists.
    /// Errors: no finished result; a damaged run.json; a listed file that is missing or, unless `force`, edited.
    pub fn open(folder: &Path, force: bool) -> Result<Self, Error> {
        let refuse = |why: &str, allowed: &str| {
            Err(InputError::new(why).key("DIR").value(folder.display()).allowed(allowed).into())
        };
        let needed = "the folder of a finished result: run.json and the tables that it lists";
        if !folder.is_dir() {
            let why = if folder.exists() { "this is a file" } else { "there is no such folder" };
            return refuse(why, needed);
        }
        if is_finishing(folder) {
            let why = "a run was stopped while it put a new result in its place here";
            return refuse(why, "the folder after the command of that run, which ends it");
        }
        let path = folder.join("run.json");
        let Some(text) = read_run(folder)? else {
            return match names_in(folder).is_ok_and(|names| names.is_empty()) {
                true => refuse("the folder is empty", needed),
                false => refuse("there is no run.json: no finished result of this program", needed),
            };
        };
        let damaged =
            |why: &str, line: Option<usize>| InputError::new(why).at(path.display().to_string(), line);
        let torn = |e: serde_json::Error| {
            damaged(&format!("this is not the run.json of a result: {e}"), Some(e.line()))
        };
        let run: Value = serde_json::from_str(&text).map_err(torn)?;
        let format = run["format"].as_u64();
        if format != Some(FORMAT.into()) {
            let other = "this result is of another version of the program";
            let why = format.map_or("this is not the run.json of a result", |_| other);
            let error = damaged(why, None).key("format").allowed(FORMAT.to_string());
            return Err(InputError { value: format.map(|format| format.to_string()), ..error }.into());
        }
        let unsaid = || damaged("it does not say which command made it", None).key("command");
        let command = run["command"].as_str().ok_or_else(unsaid)?;
        let name = run["name"].as_str().or(run["spec"]["name"].as_str()).unwrap_or(command).to_owned();
        let mut notes = Vec::new();
        match run["files"].as_array() {
            None => notes
                .push("run.json lists no files: nobody can say whether they are what was written".to_owned()),
            Some(files) => files.iter().try_for_each(|f| checked(folder, f, force, &mut notes))?,
        }
        let stopped = &run["stopped"];
        if let Some(of) = stopped["of"].as_u64() {
            let done = stopped["taps"].as_u64().or(stopped["steps"].as_u64()).unwrap_or(0);
            notes.push(format!("the run was stopped after {done} of {of}: this is a part of the result"));
        }
        let hash = hash_file(text.as_bytes()).map_err(|e| Error::io(&path, e))?;
        Ok(Self { folder: folder.to_owned(), command: command.to_owned(), name, hash, notes, run })
    }

    /// The table `name` (with its CSV name), or an error if it is missing.
    pub fn table(&self, name: &str) -> Result<Frame, Error> {
        self.maybe(name)?.ok_or_else(|| {
            let error = InputError::new("the result does not have this table");
            let path = self.folder.join(name).display().to_string();
            error.at(path, None).allowed("a result with this table").into()
        })
    }

    /// The table `name`, if there is one.
    pub fn maybe(&self, name: &str) -> Result<Option<Frame>, Error> {
        let path = self.folder.join(name);
        let parquet = path.with_extension("parquet");
        for path in [path, parquet] {
            if let Some(file) = open_of_result(&path)? {
                return read::table(&path, file).map(Some);
            }
        }
        Ok(None)
    }

    /// All files in the folder, which are read.
    pub fn inputs(&self) -> Result<Vec<PathBuf>, Error> {
        let names = names_in(&self.folder).map_err(|e| Error::io(&self.folder, e))?;
        Ok(names.into_iter().map(|name| self.folder.join(name)).collect())
    }

    /// The value in force of `key`, as written in a spec.
    pub fn in_force(&self, key: &str) -> Option<&str> {
        let entries = self.run["in_force"].as_array()?;
        entries.iter().find(|e| e["key"] == key)?["value"].as_str()
    }
}

/// Compares a file with its entry in `run.json`.
fn checked(folder: &Path, listed: &Value, force: bool, notes: &mut Vec<String>) -> Result<(), Error> {
    let Some(name) = listed["name"].as_str() else { return Ok(()) };
    if !is_result_name(name) {
        let error = InputError::new("this run.json lists a file that is not in its folder");
        let error = error.at(folder.join("run.json").display().to_string(), None).key("files").value(name);
        return Err(error.allowed("names of files in this folder").into());
    }
    let refuse = |why: &str| InputError::new(why).at(folder.join(name).display().to_string(), None);
    let other = |key: &str, value: Value| !listed[key].is_null() && listed[key] != value;
    // A file of another size need not be read.
    let seen = std::fs::symlink_metadata(folder.join(name)).ok().filter(|file| file.is_file());
    let changed = seen.is_some_and(|file| other("bytes", file.len().into())) || {
        let found = look(folder, name)?.ok_or_else(|| {
            let error = refuse("run.json lists this file, and it is not there: the result is not whole");
            error.allowed("the files of the result as they were written")
        })?;
        other("bytes", found.bytes.into()) || other("blake3", found.blake3.into())
    };
    if changed {
        if !force {
            let allowed = "the file as it was written; or --force, which draws it as it is";
            return Err(refuse("this file was changed since it was written").allowed(allowed).into());
        }
        notes.push(format!("{name} was changed since it was written"));
    }
    Ok(())
}
