//! The result folder: whose it is, nothing half-written under a final name, one writer at a time.
//!
//! A folder belongs to one command and one spec or data file, by the `run.json` in it, which lists the files of the result with their hashes.
//! Only these files give way to a new result, and only while they are what was written. A run writes in a hidden folder inside it; when
//! all is written and durable, it is moved file by file.

mod claim;
mod files;
mod hash;
mod place;
mod question;
mod state;
mod work;

use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::PoisonError;

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::Error;
use crate::kernel::gpu::hear;
use claim::{LONG, NOTHING, Old, judge, refuse};
use files::{Closed, RUN, create, make_durable};
pub use files::{
    Listed, Output, is_result_name, is_sealed, look, names_in, open_of_result, read_run, sealed,
};
pub use hash::{Hashing, hash, hash_all, hash_file};
use place::{FINISHED, carry_through, decide};
pub use question::Question;
pub use state::{Left, pack, unpack};
pub use work::{WORK, end_all};
use work::{Work, clear, completing};

/// A result folder that is being written.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    question: Question,
    old: Old,
    /// What a stopped run of the same identity left, from which the result continues.
    pub left: Option<Left>,
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
        let target = target.to_owned();
        Self::judged(work, target, question, (names, force))
            .map_err(|e| if moved { after_moving(e) } else { e })
    }

    fn judged(
        work: Work,
        target: PathBuf,
        question: Question,
        (names, force): (&[&str], bool),
    ) -> Result<Self, Error> {
        let (mut left, mut damage) = (None, None);
        match Left::read(&work.0) {
            Ok(found) => left = found,
            Err(e) => damage = Some(format!("cannot be gone on with ({e})")),
        }
        let is_own = |left: &Left| question.identity.as_ref() == Some(&left.identity);
        let begun = left.as_ref().is_some_and(is_own);
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
        let closed = Closed::default();
        let mut folder = Self { target, question, old, left, warnings: Vec::new(), closed, work };
        match damage {
            Some(why) => folder.begin_anew(&why)?,
            None if folder.left.is_none() => folder.clear()?,
            None => {}
        }
        Ok(folder)
    }

    /// Warns that `what` of a stopped run's files is not as it was written, and removes them all, to begin anew.
    pub fn damaged(&mut self, what: &str) -> Result<(), Error> {
        self.begin_anew(&format!("is damaged: {what} is not what was written"))
    }

    fn begin_anew(&mut self, why: &str) -> Result<(), Error> {
        let folder = self.target.display();
        let words = format!("the unfinished run in {folder} {why}; it begins anew");
        hear(&words);
        self.warnings.push(words);
        self.clear()
    }

    fn clear(&self) -> Result<(), Error> {
        clear(&self.work.0).map_err(|e| Error::io(&self.work.0, e))
    }

    /// Keeps what is complete, so that a run that stops from now on continues with it: `left`, which knows the files as they are now.
    pub fn keep(&mut self, left: &Left) -> Result<(), Error> {
        left.write(&self.work.0).map_err(|e| Error::io(&self.work.0, e))
    }

    /// Words for the user: what is kept if the run ends now.
    pub fn words(&self) -> Option<String> {
        Some(Left::read(&self.work.0).ok()??.words(&self.target))
    }

    /// The `run.json` of the older result of the same command that gives way, if there is one.
    pub fn older(&self) -> Option<&Value> {
        Some(&self.old.run).filter(|run| run["command"] == self.question.command)
    }

    /// A new file of the result.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
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

    /// A file of the result that a stopped run began; `None` where its bytes are not those that `mark` knows.
    pub fn file_again(&mut self, name: &str, mark: &Listed) -> Result<Option<Output>, Error> {
        let path = self.work.0.join(name);
        let file = files::open_regular(&path, OpenOptions::new().read(true).write(true));
        let again = |file| Output::new(file, self.target.join(name), self.closed.clone()).again(mark);
        match file.and_then(again) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            other => other.map_err(|e| Error::io(&path, e)),
        }
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
        completing(true, || decide(work, &files, &self.old.files)).map_err(|e| Error::io(&self.target, e))?;
        carry_through(&self.target, work)?;
        let at = |file: &Listed| self.target.join(&file.name);
        let removed = self.old.files.iter().filter(|_| self.old.forced).map(at).collect();
        Ok(Written { files: files.iter().map(at).collect(), removed })
    }
}

/// Says of a refusal that before it a finished result was moved to its place.
fn after_moving(e: Error) -> Error {
    let Error::Input(mut error) = e else { return e };
    let moved = "the result that an earlier run had finished was put in its place, nothing else was changed";
    error.message = error.message.replace(NOTHING, moved);
    error.into()
}

/// True if a finished result in the folder `target` has not been moved to its final names yet. The same command does it.
pub fn is_finishing(target: &Path) -> bool {
    target.join(WORK).join(FINISHED).exists()
}
