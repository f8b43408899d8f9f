//! The result folder. Its `run.json` names its command and spec or data file, and lists the files with hashes; a new result replaces only these
//! files, and only if they are unchanged. One run at a time writes, into a hidden folder inside it. When all is synced, a marker there makes the new
//! result valid: from then on it is moved file by file, if necessary by the next run in the folder.

mod claim;
mod files;
mod hidden;

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::PoisonError;

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::error::{Error, SolveError};
use crate::kernel::gpu::hear;
pub use claim::Question;
use claim::{LONG, NOTHING, Old, judge, refuse};
use files::{Closed, RUN, commit, create, is_plain, make_durable, sync};
pub use files::{
    Listed, Output, hash, hash_file, is_result_name, is_sealed, listed, look, names_in, open_of_result,
    read_run, sealed,
};
pub use hidden::{Left, WORK, end_all, pack, unpack};
use hidden::{UNCHANGED, Work, clear, completing};

/// A result folder that is being written.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    question: Question,
    old: Old,
    left: Option<Left>,
    /// Files that the stopped run began, until they are requested.
    begun: Vec<Output>,
    warnings: Vec<String>,
    closed: Closed,
    // Dropped last: the next run that takes the lock may remove everything.
    work: Work,
}

/// A result in its final place.
#[derive(Debug)]
pub struct Written {
    /// The files, with `run.json` last.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `--force` removed or replaced.
    pub removed: Vec<PathBuf>,
}

impl Folder {
    /// Opens `target` for the answer to `question`, whose files will be some of `names`, and `run.json`.
    /// Errors: another run writes there; a file is in the way; or, without `force`, the folder holds something else or long work of another run.
    pub fn open(target: &Path, question: Question, names: &[&str], force: bool) -> Result<Self, Error> {
        let work = Work::hold(target)?;
        let moved = carry_through(target, &work.0)?;
        Self::judged(work, target.to_owned(), question, (names, force)).map_err(|e| match e {
            Error::Input(mut error) if moved => {
                let moved = "the result that an earlier run had finished was put in its place, nothing else was changed";
                error.message = error.message.replace(NOTHING, moved);
                error.into()
            }
            e => e,
        })
    }

    fn judged(
        work: Work,
        target: PathBuf,
        question: Question,
        (names, force): (&[&str], bool),
    ) -> Result<Self, Error> {
        let (left, damage) = Left::read(&work.0).map_or_else(|e| (None, Some(e)), |left| (left, None));
        let begun = left.as_ref().is_some_and(|left| question.identity.as_ref() == Some(&left.identity));
        let old = judge(&target, &question, names, (begun, force))?;
        // Work of any other run is discarded: directly if it was short or has no state, else only with `force`.
        let lost = left.as_ref().filter(|left| !begun && !force && left.seconds > LONG);
        if let Some(Left { seconds, done, .. }) = lost {
            let why = format!(
                "this folder holds an unfinished run of {seconds:.0} s ({done}) of another command, with other values or on another backend"
            );
            let allowed = "the command that began it, --force to discard it, or another folder";
            return Err(refuse(&target, why, allowed));
        }
        let left = left.filter(|_| begun && !force);
        let (closed, warnings, is_new) = (Closed::default(), Vec::new(), left.is_none());
        let mut folder = Self { target, question, old, left, begun: Vec::new(), warnings, closed, work };
        match damage {
            Some(e) => folder.begin_anew(&format!("cannot be gone on with ({e})"))?,
            None if is_new => folder.clear()?,
            None => {}
        }
        Ok(folder)
    }

    /// Progress and state of a stopped run of the same identity, whose files are then continued. Warns and starts anew if any is damaged.
    pub fn resume<T: DeserializeOwned>(&mut self) -> Result<Option<(Left, T)>, Error> {
        let Some(left) = self.left.take() else { return Ok(None) };
        let state = unpack(&left.state).and_then(|mut all| all.pop());
        let mut damaged = state.is_none().then_some("its state");
        for mark in &left.files {
            match self.file_again(mark)? {
                Some(file) => self.begun.push(file),
                None => damaged = damaged.or(Some(&mark.name)),
            }
        }
        if let Some(what) = damaged {
            self.begun.clear();
            self.begin_anew(&format!("is damaged: {what} is not what was written"))?;
        }
        Ok(state.filter(|_| damaged.is_none()).map(|state| (left, state)))
    }

    fn file_again(&self, mark: &Listed) -> Result<Option<Output>, Error> {
        let path = self.work.0.join(&mark.name);
        let file = files::open_regular(&path, OpenOptions::new().read(true).write(true));
        let again = |file| Output::new(file, self.target.join(&mark.name), self.closed.clone()).again(mark);
        match file.and_then(again) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            other => other.map_err(|e| Error::io(&path, e)),
        }
    }

    fn begin_anew(&mut self, why: &str) -> Result<(), Error> {
        let words = format!("the unfinished run in {} {why}; it begins anew", self.target.display());
        hear(&words);
        self.warnings.push(words);
        self.clear()
    }

    fn clear(&self) -> Result<(), Error> {
        clear(&self.work.0).map_err(|e| Error::io(&self.work.0, e))
    }

    /// Saves the state of the run, from which a later run continues: `done` in words, the seconds of work, the `files` until now, and `state`.
    pub fn keep(
        &mut self,
        (done, seconds): (String, f64),
        files: Vec<Listed>,
        state: &impl Serialize,
    ) -> Result<(), Error> {
        let (identity, work) = (self.question.identity.clone().unwrap_or_default(), &self.work.0);
        let kept = pack(state).and_then(|state| Left { identity, done, seconds, files, state }.write(work));
        kept.map_err(|e| Error::io(work, e))
    }

    /// Adds to the error `e`, which ends the run, what is kept in the folder.
    pub fn explain(&self, e: Error) -> Error {
        match (Left::words(&self.work.0), e) {
            (_, e @ Error::Input(_)) => e,
            (Some(kept), e) => Error::Run(format!("{e}; {kept}")),
            (None, e @ Error::Solve(SolveError::Stopped)) => Error::Run(format!("{e}; {UNCHANGED}")),
            (None, e) => e,
        }
    }

    /// The `run.json` of the replaced result, if it is of the same command.
    pub fn older(&self) -> Option<&Value> {
        Some(&self.old.run).filter(|run| run["command"] == self.question.command)
    }

    /// Opens a file of the result: a new one, or the one that a stopped run began.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
        if let Some(at) = self.begun.iter().position(|file| file.name() == name) {
            return Ok(self.begun.swap_remove(at));
        }
        let path = self.work.0.join(name);
        let file = create(&path).map_err(|e| Error::io(&path, e))?;
        Ok(Output::new(file, self.target.join(name), self.closed.clone()))
    }

    /// Writes a whole file of the result.
    pub fn put(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let mut file = self.file(name)?;
        file.write(bytes)?;
        file.close()
    }

    fn closed(&self) -> Vec<Listed> {
        self.closed.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Writes `run.json`, which identifies the result, after all other files.
    pub fn run_json(&mut self, document: &Value) -> Result<(), Error> {
        let (mut document, mut files) = (document.clone(), self.closed());
        files.sort_by(|a, b| a.name.cmp(&b.name));
        document["name"] = json!(self.question.name);
        document["asked"] = self.question.asked.clone();
        document["files"] = json!(files);
        if !self.warnings.is_empty() {
            let told = document["warnings"].as_array().into_iter().flatten().cloned();
            document["warnings"] = told.chain(self.warnings.iter().map(|words| json!(words))).collect();
        }
        self.put(RUN, sealed(document).as_bytes())
    }

    /// Moves all files to their final place by renames that are always completed, if necessary by the next run in this folder.
    /// Errors: the disk fails, or a file came in the way meanwhile; the result is kept.
    pub fn finish(self) -> Result<Written, Error> {
        let (files, work) = (self.closed(), &self.work.0);
        // In parallel: syncing all takes about as long as syncing one.
        files.par_iter().try_for_each(|file| make_durable(&work.join(&file.name), file.bytes))?;
        let put = files.iter().map(|file| file.name.clone()).collect();
        let marker = serde_json::to_vec(&Marker { put, old: self.old.files.clone() });
        completing(true, || commit(work, FINISHED, &marker?)).map_err(|e| Error::io(&self.target, e))?;
        carry_through(&self.target, work)?;
        let at = |file: &Listed| self.target.join(&file.name);
        let removed = self.old.files.iter().filter(|_| self.old.forced).map(at).collect();
        Ok(Written { files: files.iter().map(at).collect(), removed })
    }
}

const FINISHED: &str = ".finished";

#[derive(Debug, Serialize, Deserialize)]
struct Marker {
    put: Vec<String>,
    old: Vec<Listed>,
}

/// Moves a finished result to its place, `run.json` last; returns false without one. Some of the renames may be done already.
fn carry_through(target: &Path, work: &Path) -> Result<bool, Error> {
    let path = work.join(FINISHED);
    let Some(file) = open_of_result(&path)? else { return Ok(false) };
    let text = io::read_to_string(file).map_err(|e| Error::io(&path, e))?;
    let marker = serde_json::from_str(&text).ok().filter(|Marker { put, old }| {
        put.iter().chain(old.iter().map(|file| &file.name)).all(|name| is_plain(name))
    });
    let Some(Marker { put, old }) = marker else {
        let why = format!("{} does not say what a run was about to put here", path.display());
        return Err(refuse(target, why, "another folder; or move this away: it holds files of a result"));
    };
    let waits = |name: &str| work.join(name).symlink_metadata().is_ok();
    let gone: Vec<&String> = old.iter().map(|file| &file.name).filter(|name| !put.contains(name)).collect();
    // `run.json` is moved last; without it here, all is done.
    if waits(RUN) {
        for name in gone.iter().copied().chain(put.iter().filter(|name| waits(name))) {
            let known = old.iter().find(|file| file.name == *name);
            if look(target, name)?.is_some_and(|found| known != Some(&found)) {
                let why = format!(
                    "{} was changed while the result was computed; the new result is kept, and the next run in this folder puts it in its place",
                    target.join(name).display()
                );
                return Err(refuse(target, why, "the folder without this file: move it away, or remove it"));
            }
        }
        let removed = gone.iter().map(|name| fs::remove_file(target.join(name)));
        let moved = put.iter().map(|name| fs::rename(work.join(name), target.join(name)));
        // A step that an earlier run has done gives NotFound, which is not an error.
        let failed = removed.chain(moved).filter_map(Result::err).find(|e| e.kind() != ErrorKind::NotFound);
        failed.map_or(Ok(()), Err).map_err(|e| Error::io(target, e))?;
    }
    sync(target).and_then(|()| clear(work)).map(|()| true).map_err(|e| Error::io(target, e))
}

/// True if the folder `target` holds a finished result that is not yet moved to its final names. The same command moves it.
pub fn is_finishing(target: &Path) -> bool {
    target.join(WORK).join(FINISHED).exists()
}
