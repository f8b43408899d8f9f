//! Which result a folder belongs to, who may write there, and which old files a new result replaces.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::files::{Listed, PREFIX, RUN, hash_numbers, listed, look, names_in, read_run};
use super::hidden::WORK;
use crate::error::{Error, InputError};
use crate::run_json::{self, FORMAT};
use crate::scene::{Space, Spec, Study, Tuple};
use crate::shard::Shard;

const FREE: [&str; 6] = ["run.out", "run.force", "run.plan", "run.quiet", "run.json", "run.threads"];

/// The question that a result answers. Command and name identify it; the values in force may change.
#[derive(Debug, Clone)]
pub struct Question {
    /// The command.
    pub command: &'static str,
    /// Stem of the spec or data file.
    pub name: String,
    /// Values in force, as in `run.json`; null without a spec.
    pub in_force: Value,
    /// Other inputs of the result: options of the command, hashes of data; a null value never equals another.
    pub asked: Value,
    /// Files that are read.
    pub inputs: Vec<PathBuf>,
    /// Hash of everything that determines the bytes of the result; a stopped run with the same hash is continued. `None`: never continued.
    pub identity: Option<String>,
}

impl Question {
    /// For a command without a spec.
    pub fn new(command: &'static str, name: impl Into<String>, asked: Value) -> Self {
        let (name, in_force) = (name.into(), Value::Null);
        Self { command, name, in_force, asked, inputs: Vec::new(), identity: None }
    }

    /// For a command on a spec.
    pub fn of_scene(command: &'static str, spec: &Spec, asked: Value) -> Self {
        let mut asked = if asked.is_object() { asked } else { json!({}) };
        if let Some(digest) = digest(&spec.study) {
            asked["tuples"] = digest.into();
        }
        if let Some(fit) = &spec.material_fit {
            asked["curve"] = format!("{:?}", fit.coefficients).into();
        }
        let (in_force, inputs) = (run_json::in_force(spec), spec.inputs.clone());
        Self { in_force, inputs, ..Self::new(command, &spec.name, asked) }
    }

    /// The values in force that affect the result, with their keys.
    pub fn lasting(&self) -> Value {
        lasting(&self.in_force).map(|(key, value)| json!({ "key": key, "value": value })).collect()
    }

    fn changed(&self, older: &Value) -> Vec<String> {
        // Parsed back from text, so that it compares with what a file holds.
        let now = json!({ "in_force": self.in_force, "asked": self.asked }).to_string();
        let (now, then) = (values(&now.parse().expect("what was written can be read")), values(older));
        let differ = |key: &&String| now.get(*key) != then.get(*key) || now[*key].is_null();
        let gone = then.keys().filter(|key| !now.contains_key(*key));
        now.keys().filter(differ).chain(gone).cloned().collect()
    }
}

fn digest(study: &Study) -> Option<String> {
    let Space::List(listed) = &study.space else { return None };
    let rigs = study.setup.rigs.as_deref();
    let of_rows = listed.iter().filter(|_| rigs.is_some()).map(|t| t.rig as f64);
    let values = rigs.into_iter().flat_map(|rigs| (0..rigs.count()).flat_map(|rig| rigs.values(rig)));
    Some(hash_numbers(listed.iter().flat_map(Tuple::to_array).chain(of_rows).chain(values)))
}

fn lasting(in_force: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let entries = in_force.as_array().into_iter().flatten();
    entries.filter_map(|e| Some((e["key"].as_str()?, &e["value"]))).filter(|(key, _)| !FREE.contains(key))
}

fn values(run: &Value) -> Map<String, Value> {
    let written = lasting(&run["in_force"]).map(|(key, value)| (key.to_owned(), value.clone()));
    written.chain(run["asked"].as_object().cloned().unwrap_or_default()).collect()
}

/// Seconds; a result that took longer is replaced by another question only with `--force`.
pub(super) const LONG: f64 = 60.0;

#[derive(Debug)]
pub(super) struct Old {
    pub files: Vec<Listed>,
    /// True if only `--force` allows replacing it.
    pub forced: bool,
    /// Its `run.json`, or null.
    pub run: Value,
}

pub(super) const NOTHING: &str = "nothing was changed";

pub(super) fn refuse(target: &Path, why: impl std::fmt::Display, allowed: &str) -> Error {
    let error = InputError::new(format!("{why}; {NOTHING}"));
    error.key("--out").value(target.display()).allowed(allowed).into()
}

/// Decides if a result with files `names` may replace what is in `folder`.
/// `begun`: a run of the same identity was stopped here, so foreign files in the folder are no objection.
pub(super) fn judge(
    folder: &Path,
    question: &Question,
    names: &[&str],
    (begun, force): (bool, bool),
) -> Result<Old, Error> {
    let in_the_way = |path: &Path, what: &str| {
        refuse(folder, format!("{} {what}", path.display()), "another folder; or move this file away")
    };
    let read: Vec<PathBuf> = question.inputs.iter().filter_map(|input| input.canonicalize().ok()).collect();
    let is_free = |name: &str, listed: bool| {
        let path = folder.join(name);
        let what = match path.symlink_metadata() {
            Ok(_) if path.canonicalize().is_ok_and(|path| read.contains(&path)) => {
                "is read by this command and would be replaced"
            }
            Ok(there) if !there.is_file() => "is in the way and no regular file",
            Ok(_) if !listed => "is in the way: no result in this folder says that it wrote it",
            _ => return Ok(()),
        };
        Err(in_the_way(&path, what))
    };
    is_free(RUN, true)?;
    let (run, listed) = record(folder)?;
    names.iter().try_for_each(|name| is_free(name, listed.iter().any(|file| file.name == *name)))?;
    listed.iter().try_for_each(|file| is_free(&file.name, true))?;
    let hidden = folder.join(WORK).canonicalize();
    let is_hidden = |path: &&PathBuf| hidden.as_ref().is_ok_and(|hidden| path.starts_with(hidden));
    if let Some(path) = read.iter().find(is_hidden) {
        return Err(in_the_way(path, "is read, and lies in the hidden folder of the result"));
    }
    let mut objection = objection(folder, &run, question, begun)?;
    let mut files = Vec::new();
    for file in &listed {
        let Some(found) = look(folder, &file.name)? else { continue };
        if found != *file {
            let path = folder.join(&file.name);
            objection.get_or_insert(format!("{} was edited since it was written", path.display()));
        }
        files.push(found);
    }
    let forced = objection.is_some();
    if let Some(why) = objection.filter(|_| !force) {
        let allowed = "the same command on the same file, an empty or new folder, or --force";
        return Err(refuse(folder, why, allowed));
    }
    files.extend(look(folder, RUN)?);
    Ok(Old { files, forced, run })
}

fn record(folder: &Path) -> Result<(Value, Vec<Listed>), Error> {
    let Some(text) = read_run(folder)? else { return Ok((Value::Null, Vec::new())) };
    let run: Value = text.parse().unwrap_or_default();
    let whole = run["format"] == FORMAT
        && [&run["command"], &run["name"]].iter().all(|word| word.is_string())
        && run["seconds"]["total"].is_number();
    let Some(files) = listed(&run).filter(|_| whole) else {
        let why = "the run.json in this folder lists no files of a result";
        return Err(refuse(folder, why, "another folder; or move this file away"));
    };
    Ok((run, files))
}

/// The reason why the result in `folder`, with the `run.json` in `run`, needs `--force` to be replaced.
fn objection(folder: &Path, run: &Value, question: &Question, begun: bool) -> Result<Option<String>, Error> {
    if run.is_null() {
        let shards = question.command == "sweep";
        let is_own = |name: &str| name.starts_with(PREFIX) || shards && Shard::of_folder(name).is_some();
        let mut names = names_in(folder).map_err(|e| Error::io(folder, e))?.into_iter();
        let foreign = !begun && names.any(|name| !is_own(&name.to_string_lossy()));
        return Ok(foreign.then(|| "this folder is not empty and holds no result of this program".to_owned()));
    }
    let [command, name] = ["command", "name"].map(|key| run[key].as_str().unwrap_or_default());
    if (command, name) != (question.command, &*question.name) {
        return Ok(Some(format!("this folder holds another result, {command} of {name}")));
    }
    let (seconds, keys) = (run["seconds"]["total"].as_f64().unwrap_or(0.0), question.changed(run));
    Ok((seconds > LONG && !keys.is_empty()).then(|| {
        let keys = keys[..keys.len().min(3)].join(", ");
        format!("the result in this folder took {seconds:.0} s, with other values of {keys}")
    }))
}
