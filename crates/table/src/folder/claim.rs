//! Who may write into a folder, and what gives way to a new result.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::files::{Listed, PREFIX, RUN, is_result_name, look, names_in, read_run};
use super::question::Question;
use super::work::WORK;
use crate::error::{Error, InputError};
use crate::run_json::FORMAT;
use crate::shard::Shard;

/// A result that took longer is not replaced by another question without `--force`, seconds.
pub(super) const LONG: f64 = 60.0;

/// What is there of an older result, and gives way.
#[derive(Debug)]
pub(super) struct Old {
    /// Its files as they were found, `run.json` among them.
    pub files: Vec<Listed>,
    /// Whether only `--force` makes it give way.
    pub forced: bool,
    /// Its `run.json`; null where there is none.
    pub run: Value,
}

/// What a refusal says of the folder.
pub(super) const NOTHING: &str = "nothing was changed";

/// A refusal to write to `target`; what is there is kept.
pub(super) fn refuse(target: &Path, why: impl std::fmt::Display, allowed: &str) -> Error {
    let error = InputError::new(format!("{why}; {NOTHING}"));
    error.key("--out").value(target.display()).allowed(allowed).into()
}

/// Decides whether a result with files `names` may replace what is in `folder`.
///
/// `begun`: a run of the same identity was stopped here. What it began is its own, whatever was put beside it since.
pub(super) fn judge(
    folder: &Path,
    question: &Question,
    names: &[&str],
    (begun, force): (bool, bool),
) -> Result<Old, Error> {
    let its_run = folder.join(RUN).canonicalize().ok();
    let (run, listed) = match record(folder) {
        // It is read, which is told below.
        Err(_) if question.inputs.iter().any(|input| input.canonicalize().ok() == its_run) => {
            Default::default()
        }
        record => record?,
    };
    in_the_way(folder, question, names, &listed)?;
    let mut objection = objection(folder, &run, (question, begun))?;
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
    match objection.filter(|_| !force) {
        Some(why) => {
            Err(refuse(folder, why, "the same command on the same file, an empty or new folder, or --force"))
        }
        None => {
            files.extend(look(folder, RUN)?);
            Ok(Old { files, forced, run })
        }
    }
}

/// The `run.json` in `folder`, and the files that it lists; null and none where there is none.
fn record(folder: &Path) -> Result<(Value, Vec<Listed>), Error> {
    let Some(text) = read_run(folder)? else { return Ok((Value::Null, Vec::new())) };
    let run: Value = serde_json::from_str(&text).unwrap_or_default();
    let whole = run["format"] == FORMAT
        && [&run["command"], &run["name"]].iter().all(|word| word.is_string())
        && run["seconds"]["total"].is_number();
    let listed = serde_json::from_value(run["files"].clone()).ok().filter(|_| whole);
    match listed.filter(|files: &Vec<Listed>| files.iter().all(|file| is_result_name(&file.name))) {
        Some(files) => Ok((run, files)),
        None => {
            let why = "the run.json in this folder lists no files of a result";
            Err(refuse(folder, why, "another folder; or move this file away"))
        }
    }
}

/// Refuses to write over a file that is read, and over what the old result does not list.
fn in_the_way(folder: &Path, question: &Question, names: &[&str], listed: &[Listed]) -> Result<(), Error> {
    let read: Vec<PathBuf> = question.inputs.iter().filter_map(|input| input.canonicalize().ok()).collect();
    let is_read = |path: &Path| path.canonicalize().is_ok_and(|path| read.contains(&path));
    let is_listed = |name: &str| name == RUN || listed.iter().any(|file| file.name == name);
    let all = names.iter().copied().chain(listed.iter().map(|file| &*file.name)).chain([RUN]);
    let why = all.map(|name| (name, folder.join(name))).find_map(|(name, path)| {
        let what = match path.symlink_metadata().ok()? {
            _ if is_read(&path) => "is read by this command and would be replaced",
            there if !there.is_file() => "is in the way and no regular file",
            _ if !is_listed(name) => "is in the way: no result in this folder says that it wrote it",
            _ => return None,
        };
        Some(format!("{} {what}", path.display()))
    });
    let hidden = folder.join(WORK).canonicalize();
    let inside = read.iter().find(|path| hidden.as_ref().is_ok_and(|hidden| path.starts_with(hidden)));
    let inside =
        inside.map(|path| format!("{} is read, and lies in the hidden folder of the result", path.display()));
    let refused = |why| Err(refuse(folder, why, "another folder; or move this file away"));
    why.or(inside).map_or(Ok(()), refused)
}

/// Why the result in `folder`, of which `run` is the `run.json`, is not simply replaced.
fn objection(
    folder: &Path,
    run: &Value,
    (question, begun): (&Question, bool),
) -> Result<Option<String>, Error> {
    if run.is_null() {
        let part =
            |name: &str| matches!(question.command, "sweep" | "optimise") && Shard::of_folder(name).is_some();
        let strange = |name: &str| !name.starts_with(PREFIX) && !part(name);
        let mut names = names_in(folder).map_err(|e| Error::io(folder, e))?.into_iter();
        let foreign = !begun && names.any(|name| strange(&name.to_string_lossy()));
        return Ok(foreign.then(|| "this folder is not empty and holds no result of this program".to_owned()));
    }
    let [command, name] = ["command", "name"].map(|key| run[key].as_str().unwrap_or_default());
    if (command, name) != (question.command, &*question.name) {
        return Ok(Some(format!("this folder holds another result, {command} of {name}")));
    }
    let seconds = run["seconds"]["total"].as_f64().filter(|seconds| *seconds > LONG);
    Ok(seconds.map(|seconds| (seconds, question.changed(run))).filter(|(_, keys)| !keys.is_empty()).map(
        |(seconds, keys)| {
            let keys = keys[..keys.len().min(3)].join(", ");
            format!("the result in this folder took {seconds:.0} s, with other values of {keys}")
        },
    ))
}
