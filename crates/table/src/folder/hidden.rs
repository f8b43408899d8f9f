//! The hidden folder [`WORK`] inside a result folder, in which one run at a time writes.
//!
//! It holds the files so far, a lock, and perhaps a state: how far the files are complete and what the run knows by then. Files only grow, and a
//! state is made durable under another name, after them, before it takes the place of the last one: at any moment the state there is whole,
//! and what it counts on is on the disk. What a file holds beyond it is cut off. A folder with a state stays when its run ends, and the same
//! command goes on in it; so does one whose result is finished and not yet in place ([`super::replace`]).

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::claim::{LONG, refuse};
use super::disk::{names_in, open_regular, place, remove_folder, sync};
use super::replace::FINISHED;
use crate::error::Error;
use crate::kernel::gpu::hear;
use crate::pack::{Packer, checked};
use crate::unfinished::{self, Unfinished};

/// Name of the hidden folder.
pub const WORK: &str = ".vibrissa-unfinished";
/// Name of the state: how far the files are complete.
const STATE: &str = ".state";
/// Name under which a state is written before it takes the place of the last one.
const NEXT: &str = ".state-next";
/// Name of the lock, which the writing run holds. The file contains the number of its process.
pub(crate) const LOCK: &str = ".lock";
/// Attempts to take the lock, 10 ms apart: removing the files of a dead run takes about that long.
const TRIES: u32 = 30;

/// The first line of a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Version of the format.
    pub format: u32,
    /// Everything of which the bytes of the result are a function, hashed.
    pub identity: String,
    /// What is complete, of how many, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work so far.
    pub seconds: f64,
}

/// Version of the states.
const FORMAT: u32 = 1;

/// The state of a stopped run.
#[derive(Debug)]
pub struct Left {
    /// Its first line.
    pub head: Head,
    /// The rest, as the sweep packed it.
    pub state: Vec<u8>,
}

/// The hidden folder, locked by this process.
#[derive(Debug)]
pub(super) struct Hidden {
    path: PathBuf,
    /// Paths to remove if the process ends before a state is kept: this folder, and those that this run made.
    noted: Vec<Unfinished>,
    /// Folders that this run made, the innermost first: the result folder and those above it.
    made: Vec<PathBuf>,
    /// The lock file, closed before the folder is removed: NFS keeps an open file.
    lock: Option<File>,
}

impl Hidden {
    /// The hidden folder in `target`, which is made where it is not there.
    ///
    /// # Errors
    /// Another run that has it; something else under its name; what cannot be made.
    pub fn hold(target: &Path) -> Result<Self, Error> {
        if let Ok(there) = target.symlink_metadata()
            && !target.is_dir()
        {
            let why = if there.is_symlink() {
                "this link leads to no folder"
            } else {
                "this is a file, not a folder"
            };
            return Err(refuse(target, why, "a folder"));
        }
        let path = target.join(WORK);
        let mut made = Vec::new();
        for _ in 1..TRIES {
            made.extend(make(target)?);
            if let Some(lock) = ask(target, &path)? {
                let folders = made.iter().map(|folder| Unfinished::if_empty(folder));
                let noted = std::iter::once(Unfinished::new(&path)).chain(folders).collect();
                return Ok(Self { path, noted, made, lock: Some(lock) });
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let mut pid = String::new();
        let _ = open_regular(&path.join(LOCK), OpenOptions::new().read(true))
            .and_then(|file| file.take(20).read_to_string(&mut pid));
        let who = match pid.trim() {
            "" => "another run".to_owned(),
            pid => format!("another run (process {pid})"),
        };
        let allowed = "another folder; or wait until that run ends";
        Err(refuse(target, format!("{who} is writing to this folder"), allowed))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps its files if the process ends now.
    pub fn keep(&mut self) {
        self.noted.clear();
    }

    /// Removes all but the lock.
    ///
    /// # Errors
    /// What the system says.
    pub fn clear(&self) -> Result<(), Error> {
        remove_all_but_lock(&self.path).map_err(|e| Error::io(&self.path, e))
    }

    /// True if it holds the state of a stopped run of this `identity`.
    pub fn holds(&self, identity: &str) -> bool {
        matches!(read(&self.path), Ok(Some(left)) if left.head.identity == identity)
    }

    /// The state of a stopped run of this `identity`, if there is one. Files of any other run are removed: at once if it was short or has no state, else
    /// with `force` only.
    ///
    /// # Errors
    /// A long run with another identity, without `force`.
    pub fn look(&self, target: &Path, identity: Option<&str>, force: bool) -> Result<Option<Left>, Error> {
        let head = match read(&self.path) {
            Ok(Some(left)) if Some(&*left.head.identity) == identity => return Ok(Some(left)),
            Ok(Some(left)) if left.head.seconds > LONG && !force => left.head,
            Ok(_) => return self.clear().map(|()| None),
            Err(why) => {
                hear(&format!(
                    "the unfinished run in {} cannot be gone on with ({why}): it begins anew",
                    target.display()
                ));
                return self.clear().map(|()| None);
            }
        };
        let Head { seconds, done, .. } = head;
        let why = match identity {
            Some(_) => format!(
                "this folder holds an unfinished run of {seconds:.0} s ({done}) with other values or on another backend"
            ),
            None => format!("this folder holds an unfinished sweep of {seconds:.0} s ({done})"),
        };
        Err(refuse(target, why, "the command that began it, --force to discard it, or another folder"))
    }
}

impl Drop for Hidden {
    fn drop(&mut self) {
        let stays = is_complete(&self.path);
        if !stays {
            let _ = self.clear();
        }
        // While it is still locked, so that no other run takes a lock file that is about to be removed.
        let _ = fs::remove_file(self.path.join(LOCK));
        drop(self.lock.take());
        if !stays {
            let _ = fs::remove_dir(&self.path);
            self.made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
        }
    }
}

/// True if the hidden folder `path` must stay: it holds a state to continue from, or a finished result.
pub(crate) fn is_complete(path: &Path) -> bool {
    [STATE, FINISHED].iter().any(|name| path.join(name).symlink_metadata().is_ok())
}

/// True if a finished result in the folder `target` has not been moved to its final names yet. The same command does it.
pub fn is_finishing(target: &Path) -> bool {
    target.join(WORK).join(FINISHED).exists()
}

/// Removes everything in the hidden folder `path` but the lock. The state is removed first, so that no state counts on removed files.
pub(crate) fn remove_all_but_lock(path: &Path) -> io::Result<()> {
    let mut names = names_in(path)?;
    names.sort_by_key(|name| name != STATE);
    names
        .iter()
        .filter(|name| *name != LOCK)
        .map(|name| path.join(name))
        .try_for_each(|path| fs::remove_file(&path).or_else(|_| remove_folder(&path)))
}

/// Makes the folder `target`; those that were not there, the innermost first.
fn make(target: &Path) -> Result<Vec<PathBuf>, Error> {
    let there = |folder: &&Path| !folder.as_os_str().is_empty() && folder.symlink_metadata().is_err();
    let missing = target.ancestors().take_while(there).map(Path::to_owned).collect();
    fs::create_dir_all(target).map_err(|e| Error::io(target, e))?;
    Ok(missing)
}

/// The lock file in the hidden folder `path`, locked; `None` if another run has it or has just removed it.
fn ask(target: &Path, path: &Path) -> Result<Option<File>, Error> {
    let gone = |e: &io::Error| e.kind() == ErrorKind::NotFound;
    match fs::create_dir(path) {
        Err(e) if gone(&e) => return Ok(None),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
        other => other.map_err(|e| Error::io(path, e))?,
    }
    if path.symlink_metadata().is_ok_and(|m| !m.is_dir()) {
        let why = format!("{} is in the way and no folder of this program", path.display());
        return Err(refuse(target, why, "another folder; or move this away"));
    }
    let at = path.join(LOCK);
    let (mut file, new) = match open_regular(&at, OpenOptions::new().write(true).create_new(true)) {
        Ok(file) => (file, true),
        Err(e) if gone(&e) => return Ok(None),
        Err(_) => match open_regular(&at, OpenOptions::new().read(true).write(true)) {
            Ok(file) => (file, false),
            Err(e) if gone(&e) => return Ok(None),
            Err(e) => return Err(Error::io(&at, e)),
        },
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Ok(None),
        // On a file system without locks, the run that created the file holds it.
        Err(TryLockError::Error(_)) if !new => {
            let why = "another run writes here, or was killed; this file system has no locks that tell which";
            let allowed = format!("another folder; or, if that run is over, remove {}", at.display());
            return Err(refuse(target, why, &allowed));
        }
        _ => {}
    }
    let there = |m: io::Result<fs::Metadata>| m.ok().as_ref().and_then(place);
    if there(file.metadata()) != there(at.symlink_metadata()) {
        return Ok(None);
    }
    // The lock file of a dead run is removed, never written to: it may be a hard link to a file of the user.
    if !new {
        fs::remove_file(&at).map_err(|e| Error::io(&at, e))?;
        return Ok(None);
    }
    // On a full disk the number is missing; the lock holds all the same.
    let _ = writeln!(file, "{}", std::process::id());
    Ok(Some(file))
}

/// The state in the folder `work`, if there is one.
fn read(work: &Path) -> io::Result<Option<Left>> {
    let mut bytes = Vec::new();
    match open_regular(&work.join(STATE), OpenOptions::new().read(true)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        other => other?.read_to_end(&mut bytes)?,
    };
    let torn = || io::Error::other("its state is damaged");
    let body = checked(&bytes).ok_or_else(torn)?;
    let end = body.iter().position(|b| *b == b'\n').ok_or_else(torn)?;
    let head: Head = serde_json::from_slice(&body[..end]).map_err(|_| torn())?;
    if head.format != FORMAT {
        return Err(io::Error::other("its state is of another version of this program"));
    }
    Ok(Some(Left { head, state: body[end + 1..].to_vec() }))
}

/// Writes states to the disk in a thread of its own, one at a time, while the run continues.
#[derive(Debug, Default)]
pub(super) struct Saving(Option<JoinHandle<io::Result<String>>>);

impl Drop for Saving {
    fn drop(&mut self) {
        let _ = self.wait();
    }
}

impl Saving {
    /// True while a state is being written.
    pub fn busy(&self) -> bool {
        self.0.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for the state that is being written, if any; what is kept then, in words.
    pub fn wait(&mut self) -> io::Result<Option<String>> {
        let Some(thread) = self.0.take() else { return Ok(None) };
        thread.join().unwrap_or_else(|_| Err(io::Error::other("saving panicked"))).map(Some)
    }

    /// Writes a state into `work` and makes it durable after `files`, in a thread of its own.
    pub fn start(
        &mut self,
        work: &Path,
        head: &Head,
        files: Vec<File>,
        fill: impl FnOnce(&mut Packer<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let next = work.join(NEXT);
        let failed = |e| Error::io(&next, e);
        let _ = fs::remove_file(&next);
        let mut file = BufWriter::new(File::create_new(&next).map_err(failed)?);
        let mut packer = Packer::new(&mut file);
        packer.raw(&serde_json::to_vec(head).map_err(|e| Error::Run(e.to_string()))?);
        packer.raw(b"\n");
        fill(&mut packer)?;
        packer.finish().map_err(failed)?;
        file.flush().map_err(failed)?;
        let file = file.into_inner().map_err(|e| failed(e.into_error()))?;
        let words = head.words(work.parent().unwrap_or(Path::new(".")));
        let work = work.to_owned();
        self.0 = Some(std::thread::spawn(move || {
            files.iter().try_for_each(File::sync_data)?;
            file.sync_all()?;
            unfinished::kept_by(|| fs::rename(work.join(NEXT), work.join(STATE)), &words)?;
            sync(&work)?;
            Ok(words)
        }));
        Ok(())
    }
}

impl Head {
    /// What is kept in `target`, in words.
    pub(super) fn words(&self, target: &Path) -> String {
        format!("{} are kept in {}, and the same command goes on with them", self.done, target.display())
    }

    /// Of the run `identity`.
    pub fn new(identity: &str, done: String, seconds: f64) -> Self {
        Self { format: FORMAT, identity: identity.to_owned(), done, seconds }
    }
}
