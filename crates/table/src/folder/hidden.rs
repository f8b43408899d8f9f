//! The hidden folder [`WORK`] inside a result folder, where one run at a time writes. It stays after the run if it holds a state to continue from, or
//! a finished result that is not in place yet; otherwise it is removed, also after a signal. Files only grow. A state is written after all files are
//! synced, then replaces the last one: at any moment the state is whole and the files that it lists are on the disk.

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
const LOCK: &str = ".lock";
const STATE: &str = ".state";
/// Length of the hash at the start of a state, in characters.
const HASH: usize = 64;
/// Attempts to lock, 10 ms apart: removing the files of a dead run takes about this long.
const TRIES: u32 = 30;

struct Open {
    path: PathBuf,
    /// Folders that this run created, the innermost first.
    made: Vec<PathBuf>,
    lock: File,
}

/// All locked folders, so that an aborting process can clean up. Held while something is made complete, so that the process does not end in between.
static OPEN: Mutex<Vec<Open>> = Mutex::new(Vec::new());
/// True once a result is complete and moved, or being moved, to its place.
static PLACED: AtomicBool = AtomicBool::new(false);

fn all() -> MutexGuard<'static, Vec<Open>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug)]
pub(super) struct Work(pub PathBuf);

impl Work {
    /// Creates and locks the hidden folder in `target`.
    pub fn hold(target: &Path) -> Result<Self, Error> {
        let (path, mut made) = (target.join(WORK), Vec::new());
        for _ in 0..TRIES {
            let missing = |at: &&Path| !at.as_os_str().is_empty() && at.symlink_metadata().is_err();
            made.extend(target.ancestors().take_while(missing).map(Path::to_owned));
            // The result folder itself may be a link to a folder.
            let in_the_way = |at: &&Path| {
                at.symlink_metadata().is_ok_and(|m| !m.is_dir()) && (*at == path || !target.is_dir())
            };
            if let Some(at) = [target, &path].into_iter().find(in_the_way) {
                let why = format!("{} is in the way: it is no folder", at.display());
                return Err(refuse(target, why, "another folder; or move this away"));
            }
            // Locked, so that the process does not end before the list of created folders is known.
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

fn lock(path: &Path) -> io::Result<Option<File>> {
    fs::create_dir(path).or_else(|e| if e.kind() == ErrorKind::AlreadyExists { Ok(()) } else { Err(e) })?;
    let (at, mut write) = (path.join(LOCK), OpenOptions::new());
    let (mut file, new) = match write.write(true).clone().create_new(true).open(&at) {
        Err(e) if e.kind() == ErrorKind::AlreadyExists => (open_regular(&at, &write)?, false),
        other => (other?, true),
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Ok(None),
        // On a file system without locks, the run that created the file owns it.
        Err(TryLockError::Error(_)) if !new => return Err(ErrorKind::Unsupported.into()),
        _ => {}
    }
    // On a full disk the owner's name is missing; the lock still holds.
    file.set_len(0)?;
    let owner = format!("{} {:?}", std::process::id(), std::thread::current().id());
    let owner = file.write_all(owner.as_bytes()).map_or(String::new(), |()| owner);
    // The previous run may have removed the file in between, and another run may have created it again.
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

/// Removes everything in the hidden folder `path` but the lock: first the state, which needs the files; last the marker of a finished result,
/// because without it the state would look like one to continue from.
pub(super) fn clear(path: &Path) -> io::Result<()> {
    let mut names = names_in(path)?;
    names.retain(|name| name != LOCK);
    names.sort_by_key(|name| (name == FINISHED, name != STATE));
    let mut paths = names.iter().map(|name| path.join(name));
    paths.try_for_each(|path| fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path)))
}

/// Ends the work in a folder: keeps what is complete, removes the rest and the folders that were created for it.
fn leave(open: Open) {
    let stays = is_complete(&open.path);
    if !stays {
        // Repeated: another thread may still be creating a file.
        (0..3).for_each(|_| drop(clear(&open.path)));
    }
    // Removed while locked; closed before the folder is removed, because NFS keeps an open file.
    let _ = fs::remove_file(open.path.join(LOCK));
    drop(open.lock);
    if !stays {
        std::iter::once(&open.path).chain(&open.made).for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

/// Runs `make`, after which a state or a placed result counts; the process cannot end during it.
pub(super) fn completing(placed: bool, make: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    let _all = all();
    make()?;
    PLACED.fetch_or(placed, Ordering::Relaxed);
    Ok(())
}

/// Cleans up all hidden folders before the process ends without unwinding. Returns words that follow "interrupted". Threads that would complete
/// something then block forever.
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

pub(super) const UNCHANGED: &str = "nothing was written, an older result is as it was";

/// Progress of a stopped run. Everything but `state` is one line of JSON in the file, after the hash of what follows.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Left {
    pub(super) identity: String,
    /// Finished part, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work until now.
    pub seconds: f64,
    pub(super) files: Vec<Listed>,
    /// Internal state of the run, made by [`pack`].
    #[serde(skip)]
    pub(super) state: Vec<u8>,
}

/// Serializes a value to bytes, exactly.
pub fn pack(value: &impl Serialize) -> io::Result<Vec<u8>> {
    postcard::to_stdvec(value).map_err(io::Error::other)
}

/// Deserializes consecutive packed values; `None` if the bytes are something else.
pub fn unpack<T: DeserializeOwned>(mut bytes: &[u8]) -> Option<Vec<T>> {
    let mut all = Vec::new();
    while !bytes.is_empty() {
        let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
        // A value of zero bytes would repeat forever.
        if rest.len() == bytes.len() {
            return None;
        }
        all.push(value);
        bytes = rest;
    }
    Some(all)
}

impl Left {
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

    pub(super) fn write(&self, work: &Path) -> io::Result<()> {
        for path in names_in(work)?.iter().map(|name| work.join(name)) {
            // Skip folders and links: they are not of this run.
            if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
                OpenOptions::new().write(true).open(path)?.sync_data()?;
            }
        }
        let body = [&serde_json::to_vec(self)?[..], b"\n", &self.state].concat();
        let whole = [blake3::hash(&body).to_hex().as_bytes(), &body].concat();
        completing(false, || commit(work, STATE, &whole))
    }

    pub(super) fn words(work: &Path) -> Option<String> {
        let (left, target) = (Self::read(work).ok()??, work.parent()?.display());
        Some(format!("{} are kept in {target}, and the same command goes on with them", left.done))
    }
}
