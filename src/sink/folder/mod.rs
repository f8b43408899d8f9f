//! The result folder: whose it is, nothing half-written under a final name, one writer at a time.
//!
//! A folder belongs to one command and one spec or data file, by the `run.json` in it, which lists the files of the
//! result with their hashes. Only these files give way to a new result, and only while they are what was written.

mod claim;
mod disk;
mod finish;
mod leftover;
mod lock;
mod output;
mod question;
mod record;
mod replace;
mod work;

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::pack::Packer;
use super::unfinished::{self, Unfinished};
use crate::error::Error;
use claim::{Old, judge, place, refuse};
pub use disk::{
    Hashing, Identity, hash, hash_all, hash_file, names_in, open_of_result, open_regular, remove_folder,
};
use lock::{Asked, Lock};
pub use output::{Mark, Output};
pub use question::{Question, digest};
use record::RUN;
pub use record::{Listed, is_result_name, read_run};
pub use work::{Head, Left, WORK};
use work::{Made, Partial, Saving};

/// Start of the names that this program uses for itself in and beside result folders.
const PREFIX: &str = ".vibrissa-";
/// Owner of what is written inside a folder that is there.
const RESULT: &str = "result";
/// Between the name of a result and six random characters: files of a run whose result did not come to its place.
const UNPLACED: &str = "-unplaced-";

/// A result folder that is being written in or beside its final place.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    question: Question,
    inside: bool,
    old: Old,
    names: Vec<String>,
    closed: output::Closed,
    /// What is kept if the run ends now.
    words: Option<String>,
    saving: Saving,
    partial: Partial,
    // Behind it: whoever has the lock may clear up.
    lock: Lock,
    /// The lock of where it began, where that was not the folder itself.
    _outer: Option<Lock>,
    made: Made,
}

/// A result in its final place. Until it is dropped, no other run writes there.
#[derive(Debug)]
pub struct Written {
    /// The files, `run.json` last.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `--force` removed or replaced.
    pub removed: Vec<PathBuf>,
    _lock: Lock,
}

impl Folder {
    /// A folder `target` for the answer to `question`, which will consist of some of the files `names` and `run.json`.
    ///
    /// # Errors
    /// A folder that another run is writing to; one that holds another result or anything else, unless `force`; a file in
    /// the way.
    pub fn open(target: &Path, question: Question, names: &[&str], force: bool) -> Result<Self, Error> {
        Self::with(target, locked(target)?, question, (names, None), force).map(|(folder, _)| folder)
    }

    /// As [`Self::open`], and what a stopped run of the same `identity` left there, which the result then begins with.
    pub fn open_again(
        target: &Path,
        question: Question,
        names: &[&str],
        identity: &str,
        force: bool,
    ) -> Result<(Self, Option<Left>), Error> {
        Self::with(target, locked(target)?, question, (names, Some(identity)), force)
    }

    /// As [`Self::open`], in a `target` that is made at once where it is not there.
    pub fn open_now(target: &Path, question: Question, names: &[&str], force: bool) -> Result<Self, Error> {
        let mut held = locked(target)?;
        if !target.is_dir() {
            fs::create_dir(target).map_err(|e| Error::io(target, e))?;
            // Beside it, too, nobody begins to write until the folder itself is locked.
            held = locked(target)?;
        }
        Self::with(target, held, question, (names, None), force).map(|(folder, _)| folder)
    }

    fn with(
        target: &Path,
        lock: Lock,
        question: Question,
        (names, identity): (&[&str], Option<&str>),
        force: bool,
    ) -> Result<(Self, Option<Left>), Error> {
        let inside = target.is_dir();
        if inside {
            replace::recover(target)?;
        }
        leftover::clear(lock.place(), &lock);
        if let Some(parent) = target.canonicalize().ok().as_deref().and_then(Path::parent) {
            leftover::clear(parent, &lock);
        }
        let mut old = Old::default();
        if inside {
            let names: Vec<String> = names.iter().chain(&[RUN]).map(|&n| n.to_owned()).collect();
            old = judge(target, &question, &names, force)?;
        }
        let left = match identity.filter(|_| inside) {
            Some(identity) => work::look(target, identity, force)?,
            None => None,
        };
        let partial = match left {
            Some(_) => Partial::again(target),
            None => Partial::new(beside(&lock)?),
        };
        let (target, names, closed) = (target.to_owned(), Vec::new(), output::Closed::default());
        let (saving, _outer, made) = (Saving::default(), None, Made(None));
        let words = left.as_ref().map(|left| left.head.words(&target));
        words.iter().for_each(|words| unfinished::keeping(words.clone()));
        let folder =
            Self { target, question, inside, old, names, closed, words, saving, partial, lock, _outer, made };
        Ok((folder, left))
    }

    /// What ends a run that finds `what` of a stopped one's files other than it was written.
    pub fn damaged(&self, what: &str) -> Error {
        let why = format!("the unfinished run in this folder is damaged: {what} is not what was written");
        refuse(&self.target, why, "--force to begin anew, or another folder")
    }

    /// Gives up what a stopped run left, to begin anew.
    pub fn begin_anew(&mut self) -> Result<(), Error> {
        self.names.clear();
        self.partial.clear().map_err(|e| Error::io(self.partial.path(), e))
    }

    /// Keeps what is complete, so that a run that stops from now on is gone on with: `files`, as they are now, and what `fill` says of them and
    /// of the run. This happens while the run goes on; `wait` waits for it. Whether it was begun: not while the last time is under way, and
    /// not where another run has come between.
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
        if !self.partial.is_work() && !self.stay()? {
            return Ok(false);
        }
        self.saving.start(self.partial.path(), head, files, fill)?;
        if wait {
            self.kept()?;
        }
        Ok(true)
    }

    /// Waits until what is kept is durable.
    fn kept(&mut self) -> Result<(), Error> {
        if let Some(words) = self.saving.wait().map_err(|e| Error::io(&self.target, e))? {
            self.partial.keep();
            self.words = Some(words);
        }
        Ok(())
    }

    /// What is kept if the run ends now, in words.
    pub fn words(&mut self) -> Option<String> {
        let _ = self.kept();
        self.words.clone()
    }

    /// Moves what is written to where the next run looks for it; whether nobody has come between.
    fn stay(&mut self) -> Result<bool, Error> {
        // There a folder whose files are open keeps its name.
        if cfg!(windows) {
            return Ok(false);
        }
        let failed = |e| Error::io(&self.target, e);
        if !self.inside {
            match fs::create_dir(&self.target) {
                Ok(()) => self.made = Made(Some(self.target.clone())),
                // Whoever made it in the meantime has it.
                Err(e) if e.kind() == ErrorKind::AlreadyExists => return Ok(false),
                Err(e) => return Err(failed(e)),
            }
            let Asked::Held(lock) = Lock::wait(&self.target, RESULT).map_err(failed)? else {
                return Ok(false);
            };
            self._outer = Some(std::mem::replace(&mut self.lock, lock));
            self.inside = true;
        }
        self.partial.rename(&self.target).map_err(failed)?;
        disk::sync(&self.target).map_err(failed)?;
        Ok(true)
    }

    /// A folder for what the run needs only while it lasts. What a killed run leaves there the next one removes.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn scratch(&self) -> Result<Scratch, Error> {
        let (folder, _unfinished) = beside(&self.lock)?;
        Ok(Scratch { _unfinished, folder: folder.keep() })
    }

    /// The `run.json` of the older result of the same command that gives way, if there is one.
    pub fn older(&self) -> Option<&Value> {
        self.old.run.as_ref()
    }

    /// A new file of the result.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
        let path = self.partial.path().join(name);
        if !self.partial.path().is_dir() {
            let why = format!(
                "{}: the hidden folder of this run is gone: it was removed or moved while the run wrote in it; there is no new result",
                self.partial.path().display()
            );
            return Err(Error::Run(why));
        }
        // What a run that stopped at its very end left under this name.
        if self.partial.is_work() && path.symlink_metadata().is_ok() {
            fs::remove_file(&path).map_err(|e| Error::io(&path, e))?;
        }
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
    pub fn file_again(&mut self, name: &str, mark: &Mark) -> Result<Option<Output>, Error> {
        let path = self.partial.path().join(name);
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
    pub fn run_json(&mut self, document: &Value) -> Result<(), Error> {
        let mut document = document.clone();
        document["name"] = json!(self.question.name);
        document["asked"] = self.question.asked.clone();
        document["files"] = json!(self.closed.sorted());
        self.put(RUN, format!("{document:#}\n").as_bytes())
    }
}

/// A folder that goes when this does.
#[derive(Debug)]
pub struct Scratch {
    folder: PathBuf,
    _unfinished: Unfinished,
}

impl Scratch {
    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.folder
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = remove_folder(&self.folder);
    }
}

/// A new folder in the place of `lock`, by whose name it is known whose it was.
fn beside(lock: &Lock) -> Result<(tempfile::TempDir, Unfinished), Error> {
    let mut builder = tempfile::Builder::new();
    let prefix = format!("{PREFIX}{}-", lock.owner);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.prefix(&prefix);
    Unfinished::make(|| builder.tempdir_in(lock.place())).map_err(|e| Error::io(lock.place(), e))
}

/// The lock in the place where a result for `target` is written.
fn locked(target: &Path) -> Result<Lock, Error> {
    loop {
        let (place, owner) = place(target)?;
        match Lock::wait(&place, &owner) {
            // Another run may have made the folder in the meantime.
            Ok(Asked::Held(lock)) if place == claim::place(target)?.0 => return Ok(lock),
            Ok(Asked::Held(_)) => {}
            Ok(Asked::Taken(pid)) => {
                let who = pid.map_or("another run".to_owned(), |pid| format!("another run (process {pid})"));
                let why = format!("{who} is writing to this folder");
                return Err(refuse(target, why, "another folder; or wait until that run ends"));
            }
            // The folder is gone again.
            Err(e) if e.kind() == ErrorKind::NotFound && !place.is_dir() => {}
            Err(e) => return Err(Error::io(&place, e)),
        }
    }
}
