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

use super::pack::Packer;
use crate::error::Error;
use crate::kernel::gpu::hear;
use claim::{LONG, Old, judge, refuse};
use files::{Closed, RUN, create, make_durable};
pub use files::{Listed, Mark, Output, is_result_name, names_in, open_of_result, read_run};
pub use hash::{Hashing, hash, hash_all, hash_file};
use place::{FINISHED, carry_through, decide};
pub use question::Question;
pub use state::Left;
use state::Saving;
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
    closed: Closed,
    saving: Saving,
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
        carry_through(target, &work.0)?;
        let left = Left::read(&work.0);
        let is_own = |left: &Left| question.identity.as_ref() == Some(&left.identity);
        let begun = matches!(&left, Ok(Some(left)) if is_own(left));
        let old = judge(target, &question, names, (begun, force))?;
        let left = left.unwrap_or_else(|why| {
            let folder = target.display();
            hear(&format!("the unfinished run in {folder} cannot be gone on with ({why}): it begins anew"));
            None
        });
        // Files of any other run give way: at once if it was short or has no state, else with `force` only.
        if let Some(Left { seconds, done, .. }) =
            left.as_ref().filter(|left| !begun && !force && left.seconds > LONG)
        {
            let why = format!(
                "this folder holds an unfinished run of {seconds:.0} s ({done}) of another command, with other values or on another backend"
            );
            let allowed = "the command that began it, --force to discard it, or another folder";
            return Err(refuse(target, why, allowed));
        }
        let left = left.filter(|left| is_own(left) && !force);
        if left.is_none() {
            clear(&work.0).map_err(|e| Error::io(&work.0, e))?;
        }
        let (target, closed, saving) = (target.to_owned(), Closed::default(), Saving::default());
        Ok(Self { target, question, old, left, closed, saving, work })
    }

    /// Warns that `what` of a stopped run's files is not as it was written, and removes them all, to begin anew.
    pub fn damaged(&mut self, what: &str) -> Result<(), Error> {
        let folder = self.target.display();
        hear(&format!(
            "the unfinished run in {folder} is damaged: {what} is not what was written; it begins anew"
        ));
        clear(&self.work.0).map_err(|e| Error::io(&self.work.0, e))
    }

    /// Keeps what is complete, so that a run that stops from now on is gone on with: `head`, and what `fill` says of the files as they are now and of the
    /// run. This happens while the run goes on; `wait` waits for it. Whether it was begun: not while the last time is under way.
    ///
    /// # Errors
    /// What cannot be written, this time or the last time.
    pub fn keep(
        &mut self,
        head: &Left,
        wait: bool,
        fill: impl FnOnce(&mut Packer<'_>) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        if self.saving.busy() && !wait {
            return Ok(false);
        }
        self.saved()?;
        self.saving.start(&self.work.0, head, fill)?;
        if wait {
            self.saved()?;
        }
        Ok(true)
    }

    /// Waits until what is kept is durable.
    fn saved(&mut self) -> Result<(), Error> {
        self.saving.wait().map_err(|e| Error::io(&self.target, e))
    }

    /// Words for the user: what is kept if the run ends now.
    pub fn words(&mut self) -> Option<String> {
        let _ = self.saved();
        Some(Left::read(&self.work.0).ok()??.words())
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
    pub fn file_again(&mut self, name: &str, mark: &Mark) -> Result<Option<Output>, Error> {
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
        self.put(RUN, format!("{document:#}\n").as_bytes())
    }

    /// Puts all files in their final place by renames that are always carried through: if not by this run, then by the next one in this folder.
    ///
    /// # Errors
    /// A disk that fails, before or after; a file that came in the way meanwhile. The result is kept then.
    pub fn finish(mut self) -> Result<Written, Error> {
        self.saved()?;
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

/// True if a finished result in the folder `target` has not been moved to its final names yet. The same command does it.
pub fn is_finishing(target: &Path) -> bool {
    target.join(WORK).join(FINISHED).exists()
}
