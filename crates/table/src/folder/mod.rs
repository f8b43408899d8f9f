//! The result folder: whose it is, nothing half-written under a final name, one writer at a time.
//!
//! A folder belongs to one command and one spec or data file, by the `run.json` in it, which lists the files of the result with their hashes.
//! Only these files give way to a new result, and only while they are what was written. A run writes in a hidden folder inside it; when
//! all is written and durable, a marker in the hidden folder decides: before it the old result stands, after it the new one, which is moved file by
//! file; if this run cannot, by the next one in the folder.

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
    Hashing, Listed, Output, hash, hash_file, is_result_name, is_sealed, listed, look, names_in,
    open_of_result, read_run, sealed,
};
pub use hidden::{Left, WORK, end_all, pack, unpack};
use hidden::{UNCHANGED, Work, clear, completing};

/// A result folder that is being written.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    question: Question,
    old: Old,
    /// How far a stopped run of the same identity came.
    left: Option<Left>,
    /// The files that it began, until they are asked for.
    begun: Vec<Output>,
    /// What was wrong with the work of a stopped run.
    warnings: Vec<String>,
    closed: Closed,
    // Dropped last: the next run that takes the lock may remove everything.
    work: Work,
}

/// A result in its final place.
#[derive(Debug)]
pub struct Written {
    /// The files, `run.json` last.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `--force` removed or replaced.
    pub removed: Vec<PathBuf>,
}

impl Folder {
    /// A folder `target` for the answer to `question`, which will consist of some of the files `names` and `run.json`.
    ///
    /// # Errors
    /// A folder that another run is writing to; one that holds another result or anything else, or long work of another run, unless `force`; a file
    /// in the way.
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
        let (left, damage) = match Left::read(&work.0) {
            Ok(left) => (left, None),
            Err(e) => (None, Some(format!("cannot be gone on with ({e})"))),
        };
        let begun = left.as_ref().is_some_and(|left| question.identity.as_ref() == Some(&left.identity));
        let old = judge(&target, &question, names, (begun, force))?;
        // Work of any other run gives way: at once if it was short or has no state, else with `force` only.
        if let Some(Left { seconds, done, .. }) =
            left.as_ref().filter(|left| !begun && !force && left.seconds > LONG)
        {
            let why = format!(
                "this folder holds an unfinished run of {seconds:.0} s ({done}) of another command, with other values or on another backend"
            );
            let allowed = "the command that began it, --force to discard it, or another folder";
            return Err(refuse(&target, why, allowed));
        }
        let left = left.filter(|_| begun && !force);
        let (closed, is_new) = (Closed::default(), left.is_none());
        let mut folder =
            Self { target, question, old, left, begun: Vec::new(), warnings: Vec::new(), closed, work };
        match damage {
            Some(why) => folder.begin_anew(&why)?,
            None if is_new => folder.clear()?,
            None => {}
        }
        Ok(folder)
    }

    /// What a stopped run of the same identity left, and what it knew: its files go on where it stopped. Where anything is not as it was written, this
    /// is warned of, and the run begins anew.
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

    /// A file that a stopped run began; `None` where its bytes are not those that `mark` knows.
    fn file_again(&self, mark: &Listed) -> Result<Option<Output>, Error> {
        let path = self.work.0.join(&mark.name);
        let file = files::open_regular(&path, OpenOptions::new().read(true).write(true));
        let again = |file| Output::new(file, self.target.join(&mark.name), self.closed.clone()).again(mark);
        match file.and_then(again) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            other => other.map_err(|e| Error::io(&path, e)),
        }
    }

    /// Warns that the work of a stopped run cannot be used, because it `why`, and removes it.
    fn begin_anew(&mut self, why: &str) -> Result<(), Error> {
        let words = format!("the unfinished run in {} {why}; it begins anew", self.target.display());
        hear(&words);
        self.warnings.push(words);
        self.clear()
    }

    fn clear(&self) -> Result<(), Error> {
        clear(&self.work.0).map_err(|e| Error::io(&self.work.0, e))
    }

    /// Keeps what is complete, so that a run that stops from now on continues with it: `files` so far, and `state`; in words so much is `done`, in so many
    /// seconds.
    pub fn keep(
        &mut self,
        (done, seconds): (String, f64),
        files: Vec<Listed>,
        state: &impl Serialize,
    ) -> Result<(), Error> {
        let identity = self.question.identity.clone().unwrap_or_default();
        let kept =
            pack(state).and_then(|state| Left { identity, done, seconds, files, state }.write(&self.work.0));
        kept.map_err(|e| Error::io(&self.work.0, e))
    }

    /// The error `e` with which the run ends, and what is kept then.
    pub fn explain(self, e: Error) -> Error {
        match (Left::words(&self.work.0), e) {
            (_, e @ Error::Input(_)) => e,
            (Some(kept), e) => Error::Run(format!("{e}; {kept}")),
            (None, e @ Error::Solve(SolveError::Stopped)) => Error::Run(format!("{e}; {UNCHANGED}")),
            (None, e) => e,
        }
    }

    /// The `run.json` of the older result of the same command that gives way, if there is one.
    pub fn older(&self) -> Option<&Value> {
        Some(&self.old.run).filter(|run| run["command"] == self.question.command)
    }

    /// A file of the result: new, or as far as a stopped run came that is gone on with.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
        if let Some(at) = self.begun.iter().position(|file| file.name() == name) {
            return Ok(self.begun.swap_remove(at));
        }
        let path = self.work.0.join(name);
        let file = create(&path).map_err(|e| Error::io(&path, e))?;
        Ok(Output::new(file, self.target.join(name), self.closed.clone()))
    }

    /// A whole file of the result.
    pub fn put(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let mut file = self.file(name)?;
        file.write(bytes)?;
        file.close()
    }

    fn closed(&self) -> Vec<Listed> {
        self.closed.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Writes run.json, from which the result is known again, after all other files.
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

    /// Puts all files in their final place by renames that are always carried through: if not by this run, then by the next one in this folder.
    ///
    /// # Errors
    /// A disk that fails, before or after; a file that came in the way meanwhile. The result is kept then.
    pub fn finish(self) -> Result<Written, Error> {
        let (files, work) = (self.closed(), &self.work.0);
        // All at once: a disk is waited for about as long as for one.
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

/// Name of the marker of a finished result, in the hidden folder. It lists the renames.
const FINISHED: &str = ".finished";

#[derive(Debug, Serialize, Deserialize)]
struct Marker {
    /// Files of the new result, `run.json` last.
    put: Vec<String>,
    /// Files of the old result, as they were found; they are replaced or removed.
    old: Vec<Listed>,
}

/// Puts a finished result in its place, if there is one, which is given: the renames, the `run.json` last; any number of them may have been done before.
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
    // Where the run.json has been moved, which comes last, all is done.
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
        // A step that an earlier run has done already is no error.
        let failed = removed.chain(moved).filter_map(Result::err).find(|e| e.kind() != ErrorKind::NotFound);
        failed.map_or(Ok(()), Err).map_err(|e| Error::io(target, e))?;
    }
    sync(target).and_then(|()| clear(work)).map(|()| true).map_err(|e| Error::io(target, e))
}

/// True if a finished result in the folder `target` has not been moved to its final names yet. The same command does it.
pub fn is_finishing(target: &Path) -> bool {
    target.join(WORK).join(FINISHED).exists()
}
