//! The hidden folder [`WORK`] inside a result folder, in which one run at a time writes: its lock, its state, and how it ends.
//!
//! A folder with a state stays when its run ends, for the same command goes on with it, and so does one whose result is finished and not yet in
//! place. Everything else goes with the run, also where a signal ends the process.
//!
//! Files only grow. A state is written under another name, after all files are durable, and then takes the place of the last one. So at any
//! moment the state is whole, and what it counts on is on the disk.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::FINISHED;
use super::claim::refuse;
use super::files::{Listed, commit, names_in, open_regular};
use crate::error::Error;

/// Name of the hidden folder.
pub const WORK: &str = ".vibrissa-unfinished";
/// Name of the lock, which the writing run holds. The file names its process and thread.
const LOCK: &str = ".lock";
/// Name of the state.
const STATE: &str = ".state";
/// Characters of the hash with which a state begins.
const HASH: usize = 64;
/// Attempts to take the lock, 10 ms apart: removing the files of a dead run takes about that long.
const TRIES: u32 = 30;

/// A hidden folder that this process has locked.
struct Open {
    path: PathBuf,
    /// Folders that this run made, the innermost first: the result folder and those above it.
    made: Vec<PathBuf>,
    lock: File,
}

/// All of them, so that a process that ends at once leaves them in order. Whoever makes something complete holds this: the process does not end in between.
static OPEN: Mutex<Vec<Open>> = Mutex::new(Vec::new());
/// Whether a result is whole, and goes or has gone to its place.
static PLACED: AtomicBool = AtomicBool::new(false);

fn all() -> MutexGuard<'static, Vec<Open>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The hidden folder of a run, at this path.
#[derive(Debug)]
pub(super) struct Work(pub PathBuf);

impl Work {
    /// The hidden folder in `target`; both are made where they are not there.
    pub fn hold(target: &Path) -> Result<Self, Error> {
        let (path, mut made) = (target.join(WORK), Vec::new());
        for _ in 0..TRIES {
            let missing = |at: &&Path| !at.as_os_str().is_empty() && at.symlink_metadata().is_err();
            made.extend(target.ancestors().take_while(missing).map(Path::to_owned));
            // The result folder itself may be a link to one.
            let in_the_way = |at: &&Path| {
                at.symlink_metadata().is_ok_and(|m| !m.is_dir()) && (*at == path || !target.is_dir())
            };
            if let Some(at) = [target, &path].into_iter().find(in_the_way) {
                let why = format!("{} is in the way: it is no folder", at.display());
                return Err(refuse(target, why, "another folder; or move this away"));
            }
            // The process does not end before it is known which folders were made.
            let mut open = all();
            fs::create_dir_all(target).map_err(|e| Error::io(target, e))?;
            match lock(&path) {
                Ok(Some(lock)) => {
                    open.push(Open { path: path.clone(), made, lock });
                    return Ok(Self(path));
                }
                Err(e) if e.kind() == ErrorKind::Unsupported => {
                    let why = "another run writes here, or was killed; this file system has no locks that tell which";
                    let lock = path.join(LOCK);
                    let allowed =
                        format!("another folder; or, if that run is over, remove {}", lock.display());
                    return Err(refuse(target, why, &allowed));
                }
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(&path, e)),
                // Another run has it, or removes it just now.
                _ => {}
            }
            drop(open);
            std::thread::sleep(Duration::from_millis(10));
        }
        let owner = fs::read_to_string(path.join(LOCK)).unwrap_or_default();
        let process = owner.split(' ').next().filter(|process| !process.is_empty());
        let process = process.map_or(String::new(), |process| format!(" (process {process})"));
        let allowed = "another folder; or wait until that run ends";
        Err(refuse(target, format!("another run{process} is writing to this folder"), allowed))
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        let mut all = all();
        all.extract_if(.., |open| open.path == self.0).for_each(leave);
    }
}

/// The lock file in the hidden folder `path`, locked; `None` where another run has it.
fn lock(path: &Path) -> io::Result<Option<File>> {
    fs::create_dir(path).or_else(|e| if e.kind() == ErrorKind::AlreadyExists { Ok(()) } else { Err(e) })?;
    let (at, mut write) = (path.join(LOCK), OpenOptions::new());
    let (mut file, new) = match write.write(true).clone().create_new(true).open(&at) {
        Err(e) if e.kind() == ErrorKind::AlreadyExists => (open_regular(&at, &write)?, false),
        other => (other?, true),
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Ok(None),
        // On a file system without locks, the run that created the file holds it.
        Err(TryLockError::Error(_)) if !new => return Err(ErrorKind::Unsupported.into()),
        _ => {}
    }
    // On a full disk the owner is missing; the lock holds all the same.
    file.set_len(0)?;
    let owner = format!("{} {:?}", std::process::id(), std::thread::current().id());
    let owner = file.write_all(owner.as_bytes()).map_or(String::new(), |()| owner);
    // The run that had it may have removed the file in between, and another one may have made it anew.
    match fs::read_to_string(&at) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Ok(found) if found != owner => Ok(None),
        _ => Ok(Some(file)),
    }
}

/// True if the hidden folder `path` must stay: it holds a state to continue from, or a finished result.
fn is_complete(path: &Path) -> bool {
    [STATE, FINISHED].iter().any(|name| path.join(name).symlink_metadata().is_ok())
}

/// Removes everything in the hidden folder `path` but the lock: first the state, which counts on the files; last the marker of a finished result,
/// without which the state would be taken for one to go on with.
pub(super) fn clear(path: &Path) -> io::Result<()> {
    let mut names = names_in(path)?;
    names.retain(|name| name != LOCK);
    names.sort_by_key(|name| (name == FINISHED, name != STATE));
    let mut paths = names.iter().map(|name| path.join(name));
    paths.try_for_each(|path| fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path)))
}

/// Ends the work in a folder: what is complete stays; all else goes, with the folders that were made for it.
fn leave(open: Open) {
    let stays = is_complete(&open.path);
    if !stays {
        // A file that is being written may need a second look.
        (0..3).for_each(|_| drop(clear(&open.path)));
    }
    // While it is still locked; then closed before the folder is removed: NFS keeps an open file.
    let _ = fs::remove_file(open.path.join(LOCK));
    drop(open.lock);
    if !stays {
        std::iter::once(&open.path).chain(&open.made).for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

/// Does `make`, after which a state counts, or a result that is `placed`; no end of the process comes between.
pub(super) fn completing(placed: bool, make: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    let _all = all();
    make()?;
    PLACED.fetch_or(placed, Ordering::Relaxed);
    Ok(())
}

/// For a process that is about to end without unwinding: leaves all hidden folders in order. What stays of the result, in words that follow
/// "interrupted". A thread that is about to make something complete waits for ever then.
pub fn end_all() -> String {
    let mut all = all();
    if PLACED.load(Ordering::Relaxed) {
        return " after the result was written".to_owned();
    }
    let left = all.iter().find_map(|open| Left::words(&open.path));
    all.extract_if(.., |open| !is_complete(&open.path)).for_each(leave);
    std::mem::forget(all);
    format!("; {}", left.as_deref().unwrap_or(UNCHANGED))
}

/// What a run leaves that ends before anything of it is complete.
pub(super) const UNCHANGED: &str = "nothing was written, an older result is as it was";

/// How far a stopped run came. All but the bytes is a line of JSON in the file, behind the hash of what follows.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Left {
    /// Everything of which the bytes of the result are a function, hashed.
    pub(super) identity: String,
    /// What is complete, of how many, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work so far.
    pub seconds: f64,
    /// The files of the result so far.
    pub(super) files: Vec<Listed>,
    /// What the run knew, as [`pack`] made it.
    #[serde(skip)]
    pub(super) state: Vec<u8>,
}

/// A value as bytes, exactly.
pub fn pack(value: &impl Serialize) -> io::Result<Vec<u8>> {
    postcard::to_stdvec(value).map_err(io::Error::other)
}

/// The values that were packed, one behind the other; `None` where the bytes are something else.
pub fn unpack<T: DeserializeOwned>(mut bytes: &[u8]) -> Option<Vec<T>> {
    let mut all = Vec::new();
    while !bytes.is_empty() {
        let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
        // A value without bytes would come for ever.
        if rest.len() == bytes.len() {
            return None;
        }
        all.push(value);
        bytes = rest;
    }
    Some(all)
}

impl Left {
    /// What the hidden folder `work` holds, if anything.
    pub(super) fn read(work: &Path) -> io::Result<Option<Self>> {
        let mut bytes = Vec::new();
        match open_regular(&work.join(STATE), OpenOptions::new().read(true)) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            other => other?.read_to_end(&mut bytes)?,
        };
        let wrong = || io::Error::other("its state is damaged, or of another version of this program");
        Self::parse(&bytes).ok_or_else(wrong).map(Some)
    }

    fn parse(bytes: &[u8]) -> Option<Self> {
        let (check, body) = bytes.split_at_checked(HASH)?;
        let (head, state) = body.split_at_checked(body.iter().position(|b| *b == b'\n')? + 1)?;
        let left: Self = serde_json::from_slice(head).ok()?;
        (blake3::hash(body).to_hex().as_bytes() == check).then(|| Self { state: state.to_vec(), ..left })
    }

    /// Makes the files in `work` durable as they are, and then this their state.
    pub(super) fn write(&self, work: &Path) -> io::Result<()> {
        for path in names_in(work)?.iter().map(|name| work.join(name)) {
            // Folders and links that were put there are not of this run.
            if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
                OpenOptions::new().write(true).open(path)?.sync_data()?;
            }
        }
        let body = [&serde_json::to_vec(self)?[..], b"\n", &self.state].concat();
        let whole = [blake3::hash(&body).to_hex().as_bytes(), &body].concat();
        completing(false, || commit(work, STATE, &whole))
    }

    /// What the hidden folder `work` keeps, in words; `None` where that is nothing.
    pub(super) fn words(work: &Path) -> Option<String> {
        let (left, target) = (Self::read(work).ok()??, work.parent()?.display());
        Some(format!("{} are kept in {target}, and the same command goes on with them", left.done))
    }
}
