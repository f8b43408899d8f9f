//! Who may write into a folder, and what gives way to a new result.

use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::PREFIX;
use super::disk::{Identity, hash_file, names_in, open_regular};
use super::hidden::WORK;
use super::question::Question;
use super::record::{Listed, RUN, Record};
use crate::error::{Error, InputError};
use crate::shard::Shard;

/// A result that took longer is not replaced by another question without `--force`, seconds.
pub(super) const LONG: f64 = 60.0;

/// What is there of an older result, and gives way.
#[derive(Debug, Default)]
pub(super) struct Old {
    /// Its files as they were found, `run.json` among them.
    pub files: Vec<Listed>,
    /// Where a `run.json` that lists nothing is kept.
    pub aside: Option<String>,
    /// Whether only `--force` makes it give way.
    pub forced: bool,
    /// The `run.json` of a result of the same command.
    pub run: Option<Value>,
}

/// A refusal to write to `target`; what is there is kept.
pub(super) fn refuse(target: &Path, why: impl std::fmt::Display, allowed: &str) -> Error {
    let error = InputError::new(format!("{why}; nothing was changed"));
    error.key("--out").value(target.display()).allowed(allowed).into()
}

/// Decides whether a result with files `names` may replace what is in `folder`.
///
/// `begun`: a run of the same identity was stopped here. What it began is its own, whatever was put beside it since.
pub(super) fn judge(
    folder: &Path,
    question: &Question,
    names: &[String],
    (begun, force): (bool, bool),
) -> Result<Old, Error> {
    let elsewhere = "another folder; or move this file away";
    let refuse = |why: String, allowed: &str| refuse(folder, why, allowed);
    let at = |name: &str| folder.join(name);
    for name in names {
        if at(name).symlink_metadata().is_ok_and(|m| !m.is_file()) && !leads_to_input(&at(name), question) {
            let why = format!("{} is in the way and no regular file", at(name).display());
            return Err(refuse(why, elsewhere));
        }
    }
    let hidden = folder.join(WORK).canonicalize();
    let inside = |input: &&PathBuf| {
        hidden.as_ref().is_ok_and(|hidden| input.canonicalize().is_ok_and(|input| input.starts_with(hidden)))
    };
    if let Some(input) = question.inputs.iter().find(inside) {
        let why = format!(
            "{} is read by this command and lies in the hidden folder of its result",
            input.display()
        );
        return Err(refuse(why, "another folder"));
    }
    inputs(folder, question, names)?;
    let record = Record::read(folder)?;
    let listed = record.files();
    inputs(folder, question, &listed.iter().map(|f| f.name.clone()).collect::<Vec<_>>())?;
    let strange = |name: &&String| {
        *name != RUN && at(name).symlink_metadata().is_ok() && !listed.iter().any(|f| f.name == **name)
    };
    if let Some(name) = names.iter().find(strange) {
        let whose = match record {
            Record::Result { .. } => "the result in this folder did not write it",
            _ => "no result in this folder says that it wrote it",
        };
        let why = format!("{} is in the way: {whose}", at(name).display());
        return Err(refuse(why, elsewhere));
    }
    let ask =
        |why: String| refuse(why, "the same command on the same file, an empty or new folder, or --force");
    let objection = objection(folder, &record, (question, begun))?;
    if let Some(why) = objection.as_ref().filter(|_| !force) {
        return Err(ask(why.clone()));
    }
    let mut old = Old { forced: objection.is_some(), ..Old::default() };
    for file in listed {
        let Some(found) = look(&at(&file.name))? else { continue };
        if found != *file {
            let why = format!("{} was edited since it was written", at(&file.name).display());
            if !force {
                return Err(ask(why));
            }
            old.forced = true;
        }
        old.files.push(found);
    }
    match record {
        Record::Nothing => {}
        Record::Unlisted => old.aside = Some(free_name(folder)),
        Record::Result { command, run, .. } => {
            old.files.extend(look(&at(RUN))?);
            old.run = (command == question.command).then_some(run);
        }
    }
    Ok(old)
}

/// Why the result in `folder` is not simply replaced.
fn objection(
    folder: &Path,
    record: &Record,
    (question, begun): (&Question, bool),
) -> Result<Option<String>, Error> {
    Ok(match record {
        Record::Nothing => {
            let cut = matches!(question.command, "sweep" | "optimise");
            let part = |name: &str| cut && Shard::of_folder(name).is_some();
            let strange = |name: &str| !name.starts_with(PREFIX) && !part(name);
            let mut names = names_in(folder).map_err(|e| Error::io(folder, e))?.into_iter();
            (!begun && names.any(|name| strange(&name.to_string_lossy())))
                .then(|| "this folder is not empty and holds no result of this program".to_owned())
        }
        Record::Unlisted => Some("the run.json in this folder lists no files of a result".to_owned()),
        Record::Result { command, name, .. }
            if (command.as_str(), name) != (question.command, &question.name) =>
        {
            Some(format!("this folder holds another result, {command} of {name}"))
        }
        Record::Result { seconds, run, .. } if *seconds > LONG => {
            let changed = question.changed(run);
            (!changed.is_empty()).then(|| {
                let keys = changed[..changed.len().min(3)].join(", ");
                format!("the result in this folder took {seconds:.0} s, with other values of {keys}")
            })
        }
        Record::Result { .. } => None,
    })
}

/// Refuses to write over or remove a file that is read.
fn inputs(folder: &Path, question: &Question, names: &[String]) -> Result<(), Error> {
    let is_read = |name: &&String| leads_to_input(&folder.join(name), question);
    match names.iter().find(is_read) {
        None => Ok(()),
        Some(name) => {
            let why =
                format!("{} is read by this command and would be replaced", folder.join(name).display());
            Err(refuse(folder, why, "another folder"))
        }
    }
}

fn leads_to_input(path: &Path, question: &Question) -> bool {
    if path.symlink_metadata().is_err() {
        return false;
    }
    let here = Identity::of(path);
    question.inputs.iter().any(|input| Identity::of(input).is(&here))
}

/// A file as it is now; `None` where there is none.
pub(super) fn look(path: &Path) -> Result<Option<Listed>, Error> {
    let mut file = match open_regular(path, OpenOptions::new().read(true)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(_) if path.symlink_metadata().is_ok_and(|m| !m.is_file()) => {
            let why = format!("{} is no regular file any more", path.display());
            return Err(refuse(path.parent().unwrap_or(path), why, "another folder; or move this away"));
        }
        other => other.map_err(|e| Error::io(path, e))?,
    };
    let failed = |e| Error::io(path, e);
    let m = file.metadata().map_err(failed)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let blake3 = hash_file(&mut file).map_err(failed)?;
    Ok(Some(Listed { name, blake3, bytes: m.len() }))
}

/// A name for a `run.json` that is kept.
fn free_name(folder: &Path) -> String {
    let names = (1..).map(|n| if n == 1 { "run.old.json".to_owned() } else { format!("run.old-{n}.json") });
    let mut free = names.filter(|name| folder.join(name).symlink_metadata().is_err());
    free.next().expect("a folder has finitely many files")
}
