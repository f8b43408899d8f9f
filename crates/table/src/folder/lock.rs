//! One writer at a time: a lock that dies with its process, and is gone with it after a normal end.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::super::unfinished::Unfinished;
use super::disk::{open_regular, place};

/// Times that a file which comes and goes is asked for, the last of them a millisecond apart.
const TRIES: u32 = 300;

/// A held lock; released, and its file removed, when it is dropped.
#[derive(Debug)]
pub(super) struct Lock {
    /// Whose it is, by name.
    pub owner: String,
    /// Whether the file system has locks at all.
    pub firm: bool,
    place: PathBuf,
    path: PathBuf,
    _unfinished: Unfinished,
    file: File,
}

/// What came of asking for a lock.
#[derive(Debug)]
pub(super) enum Asked {
    Held(Lock),
    /// Another run has it: its process, if that is known.
    Taken(Option<u32>),
}

impl Lock {
    /// The lock of the run that is called `owner` in the folder `place`.
    pub fn ask(place: &Path, owner: &str) -> io::Result<Asked> {
        let path = place.join(format!("{}{owner}.lock", super::PREFIX));
        let mut tries = 0;
        loop {
            tries += 1;
            if tries > TRIES / 10 {
                std::thread::sleep(Duration::from_millis(1));
            }
            let mut options = OpenOptions::new();
            let mut file =
                match open_regular(&path, options.read(true).write(true).create(true).truncate(false)) {
                    // Its last holder removed it after it was seen.
                    Err(e) if e.kind() == io::ErrorKind::NotFound && place.is_dir() && tries < TRIES => {
                        continue;
                    }
                    other => other?,
                };
            let firm = match file.try_lock() {
                Ok(()) => true,
                Err(TryLockError::WouldBlock) => {
                    let mut pid = String::new();
                    let _ = file.take(20).read_to_string(&mut pid);
                    return Ok(Asked::Taken(pid.trim().parse().ok()));
                }
                // A file system without locks: nobody can be asked.
                Err(TryLockError::Error(_)) => false,
            };
            if !is_at(&file, &path) {
                if tries < TRIES {
                    continue;
                }
                return Err(io::Error::other(format!("{} does not stay where it is", path.display())));
            }
            if !is_a_lock(&mut file)? {
                let why = format!("{} is no lock of this program; move it away", path.display());
                return Err(io::Error::other(why));
            }
            let (owner, place) = (owner.to_owned(), place.to_owned());
            let _unfinished = Unfinished::new(&path);
            // From here on it goes with this, also where a full disk does not take its few bytes.
            let mut lock = Self { owner, firm, place, path, _unfinished, file };
            lock.file.set_len(0)?;
            lock.file.rewind()?;
            writeln!(lock.file, "{}", std::process::id())?;
            return Ok(Asked::Held(lock));
        }
    }

    /// The folder in which it lies.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// As [`Self::ask`], but waits a moment: whoever clears up after a dead run holds its lock that long.
    pub fn wait(place: &Path, owner: &str) -> io::Result<Asked> {
        for _ in 0..10 {
            if let held @ Asked::Held(_) = Self::ask(place, owner)? {
                return Ok(held);
            }
            std::thread::sleep(Duration::from_millis(30));
        }
        Self::ask(place, owner)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is still locked, so that nobody takes a lock on a file that is about to go.
        let _ = fs::remove_file(&self.path);
    }
}

/// Whether `file` has no other name and holds nothing but the number of a process, so that it may be written to.
fn is_a_lock(file: &mut File) -> io::Result<bool> {
    #[cfg(unix)]
    if std::os::unix::fs::MetadataExt::nlink(&file.metadata()?) != 1 {
        return Ok(false);
    }
    let mut text = Vec::new();
    file.take(32).read_to_end(&mut text)?;
    Ok(text.len() < 32 && text.iter().all(|b| b.is_ascii_digit() || b.is_ascii_whitespace()))
}

/// Whether `path` still leads to `file`.
fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), path.symlink_metadata()) {
        (Ok(a), Ok(b)) => place(&a) == place(&b),
        _ => false,
    }
}
