//! The result folder: whose it is, nothing half-written under a final name, one writer at a time.
//!
//! A folder belongs to one command and one spec or data file, by the `run.json` in it, which lists the files of the result with their hashes.
//! Only these files give way to a new result, and only while they are what was written. A run writes in a hidden folder inside it; when
//! all is written and durable, it is moved file by file.

mod claim;
mod disk;
mod hidden;
mod output;
mod question;
mod record;
mod replace;

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::pack::Packer;
use super::unfinished;
use crate::error::Error;
use crate::kernel::gpu::hear;
use claim::{Old, judge};
pub use disk::{
    Hashing, Identity, hash, hash_all, hash_file, names_in, open_of_result, open_regular, remove_folder,
};
pub use hidden::{Head, Left, WORK, is_finishing};
use hidden::{Hidden, Saving};
pub(crate) use hidden::{LOCK, is_complete, remove_all_but_lock};
pub use output::{Mark, Output};
pub use question::Question;
use record::RUN;
pub use record::{Listed, is_result_name, read_run};

/// Start of the names that this program uses for itself in result folders.
const PREFIX: &str = ".vibrissa-";

/// A result folder that is being written.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    question: Question,
    old: Old,
    names: Vec<String>,
    closed: output::Closed,
    /// Words for the user: what is kept if the run ends now.
    words: Option<String>,
    saving: Saving,
    // Dropped last: the next run that takes the lock may remove everything.
    hidden: Hidden,
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
    /// A folder that another run is writing to; one that holds another result or anything else, unless `force`; a file in
    /// the way.
    pub fn open(target: &Path, question: Question, names: &[&str], force: bool) -> Result<Self, Error> {
        Self::with(target, question, (names, None), force).map(|(folder, _)| folder)
    }

    /// As [`Self::open`]; also the state of a stopped run of the same `identity`, from which the result continues.
    ///
    /// # Errors
    /// As [`Self::open`]; a long stopped run with another identity, without `force`.
    pub fn open_again(
        target: &Path,
        question: Question,
        names: &[&str],
        identity: &str,
        force: bool,
    ) -> Result<(Self, Option<Left>), Error> {
        Self::with(target, question, (names, Some(identity)), force)
    }

    fn with(
        target: &Path,
        question: Question,
        (names, identity): (&[&str], Option<&str>),
        force: bool,
    ) -> Result<(Self, Option<Left>), Error> {
        let mut hidden = Hidden::hold(target)?;
        replace::recover(target, hidden.path())?;
        let all: Vec<String> = names.iter().chain(&[RUN]).map(|&n| n.to_owned()).collect();
        let begun = identity.is_some_and(|identity| hidden.holds(identity));
        let old = judge(target, &question, &all, (begun, force))?;
        let left = hidden.look(target, identity, force)?;
        let words = left.as_ref().map(|left| left.head.words(target));
        if let Some(words) = &words {
            unfinished::keeping(words.clone());
            hidden.keep();
        }
        let (target, names, closed) = (target.to_owned(), Vec::new(), output::Closed::default());
        let folder = Self { target, question, old, names, closed, words, saving: Saving::default(), hidden };
        Ok((folder, left))
    }

    /// Warns that `what` of a stopped run's files is not as it was written, and begins anew.
    ///
    /// # Errors
    /// What cannot be removed.
    pub fn damaged(&mut self, what: &str) -> Result<(), Error> {
        let folder = self.target.display();
        hear(&format!(
            "the unfinished run in {folder} is damaged: {what} is not what was written; it begins anew"
        ));
        self.begin_anew()
    }

    /// Removes the files of a stopped run, to begin anew.
    ///
    /// # Errors
    /// What cannot be removed.
    pub fn begin_anew(&mut self) -> Result<(), Error> {
        self.names.clear();
        self.words = None;
        unfinished::forget();
        self.hidden.clear()
    }

    /// Keeps what is complete, so that a run that stops from now on is gone on with: `files`, as they are now, and what `fill` says of them and
    /// of the run. This happens while the run goes on; `wait` waits for it. Whether it was begun: not while the last time is under way.
    ///
    /// # Errors
    /// What cannot be written, this time or the last time.
    pub fn keep(
        &mut self,
        head: &Head,
        files: Vec<fs::File>,
        wait: bool,
        fill: impl FnOnce(&mut Packer<'_>) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        if self.saving.busy() && !wait {
            return Ok(false);
        }
        self.kept()?;
        self.saving.start(self.hidden.path(), head, files, fill)?;
        if wait {
            self.kept()?;
        }
        Ok(true)
    }

    /// Waits until what is kept is durable.
    fn kept(&mut self) -> Result<(), Error> {
        if let Some(words) = self.saving.wait().map_err(|e| Error::io(&self.target, e))? {
            self.hidden.keep();
            self.words = Some(words);
        }
        Ok(())
    }

    /// Words for the user: what is kept if the run ends now.
    pub fn words(&mut self) -> Option<String> {
        let _ = self.kept();
        self.words.clone()
    }

    /// The `run.json` of the older result of the same command that gives way, if there is one.
    pub fn older(&self) -> Option<&Value> {
        self.old.run.as_ref()
    }

    /// A new file of the result.
    ///
    /// # Errors
    /// A file that cannot be made.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
        let path = self.hidden.path().join(name);
        if !self.hidden.path().is_dir() {
            let why = format!(
                "{}: the hidden folder of this run is gone: it was removed or moved while the run wrote in it; there is no new result",
                self.hidden.path().display()
            );
            return Err(Error::Run(why));
        }
        // A stopped run may have left a file of this name that its state does not count.
        let _ = fs::remove_file(&path);
        let file = fs::File::create_new(&path).map_err(|e| Error::io(&path, e))?;
        self.names.push(name.to_owned());
        Ok(Output::new(file, name, self.target.join(name), self.closed.clone()))
    }

    /// A whole file of the result.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn put(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let mut file = self.file(name)?;
        file.write(bytes)?;
        file.close()
    }

    /// A file of the result that a stopped run began; `None` where its bytes are not those that `mark` knows.
    ///
    /// # Errors
    /// What the system says.
    pub fn file_again(&mut self, name: &str, mark: &Mark) -> Result<Option<Output>, Error> {
        let path = self.hidden.path().join(name);
        let open = || open_regular(&path, fs::OpenOptions::new().read(true).write(true));
        let again = |file| Output::again(file, name, self.target.join(name), self.closed.clone(), mark);
        let output = match open().and_then(again) {
            Err(e) if e.kind() == ErrorKind::NotFound => None,
            other => other.map_err(|e| Error::io(&path, e))?,
        };
        if output.is_some() {
            self.names.push(name.to_owned());
        }
        Ok(output)
    }

    /// Writes run.json, from which the result is known again, after all other files.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn run_json(&mut self, document: &Value) -> Result<(), Error> {
        let mut document = document.clone();
        document["name"] = json!(self.question.name);
        document["asked"] = self.question.asked.clone();
        document["files"] = json!(self.closed.sorted());
        self.put(RUN, format!("{document:#}\n").as_bytes())
    }

    /// Puts all files in their final place by renames that are always carried through: if not by this run, then by the next one in this folder.
    ///
    /// # Errors
    /// A disk that fails, before or after; a file that came in the way meanwhile. The result is kept then.
    pub fn finish(mut self) -> Result<Written, Error> {
        self.kept()?;
        let at = |name: &String| self.target.join(name);
        let removed = self.old.files.iter().filter(|_| self.old.forced).map(|f| at(&f.name)).collect();
        let files = self.names.iter().map(at).collect();
        self.closed.end(self.hidden.path())?;
        let decide = || replace::decide(self.hidden.path(), &self.names, &self.old);
        unfinished::placing(decide).map_err(|e| Error::io(&self.target, e))?;
        self.hidden.keep();
        replace::recover(&self.target, self.hidden.path())?;
        Ok(Written { files, removed })
    }
}
