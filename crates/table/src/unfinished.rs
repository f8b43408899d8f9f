//! Folders in which results are being written, and their locks, so that a process that ends in the middle can take them away.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::folder::{LOCK, is_complete, remove_all_but_lock};

static PATHS: Mutex<Vec<Noted>> = Mutex::new(Vec::new());
/// Whether a result is whole and goes, or has gone, to its place.
static PLACED: AtomicBool = AtomicBool::new(false);

/// What of an unfinished result is kept, in words.
static KEPT: Mutex<Option<String>> = Mutex::new(None);

/// Notes what is complete and stays, in words, if the run ends now.
pub fn keeping(words: String) {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).replace(words);
}

/// Makes something complete by `make`, and notes it in words; no end of the process comes between.
///
/// # Errors
/// What `make` says.
pub fn kept_by<E>(make: impl FnOnce() -> Result<(), E>, words: &str) -> Result<(), E> {
    with(|_| {
        make()?;
        keeping(words.to_owned());
        Ok(())
    })
}

/// What is complete and stays, in words; `None` of nothing.
pub fn kept() -> Option<String> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Nothing is unfinished any more.
pub fn forget() {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).take();
}

/// Decides by `decide` that a result is put in its place, which an end of the process from then on leaves to the next run.
///
/// # Errors
/// What `decide` says: then nothing was decided.
pub fn placing<E>(decide: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
    with(|_| {
        decide()?;
        PLACED.store(true, Ordering::Relaxed);
        Ok(())
    })
}

/// Whether a result is in its place, or will be.
pub fn is_placed() -> bool {
    PLACED.load(Ordering::Relaxed)
}

/// A folder or file that goes if the process ends before this does.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

/// A path, and true if it is a folder to remove only when it is empty.
type Noted = (PathBuf, bool);

impl Unfinished {
    /// Notes `path`.
    pub fn new(path: &Path) -> Self {
        with(|all| Self::note(all, path, false))
    }

    /// Notes the folder `path`, to remove only if it is empty.
    pub fn if_empty(path: &Path) -> Self {
        with(|all| Self::note(all, path, true))
    }

    /// Makes something and notes it, so that no end of the process comes between.
    ///
    /// # Errors
    /// What `make` says.
    pub fn make<T: AsRef<Path>, E>(make: impl FnOnce() -> Result<T, E>) -> Result<(T, Self), E> {
        with(|all| {
            let made = make()?;
            let noted = Self::note(all, made.as_ref(), false);
            Ok((made, noted))
        })
    }

    fn note(all: &mut Vec<Noted>, path: &Path, if_empty: bool) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        all.push((path.clone(), if_empty));
        Self(path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        with(|all| all.retain(|(path, _)| *path != self.0));
    }
}

/// Removes them all but what is complete, for a process that is about to end without unwinding. Whoever is about to put its result in place waits
/// until that is done, and whoever is about to make one waits for ever.
pub fn remove_all() {
    let mut all = lock();
    if !is_placed() {
        for (path, if_empty) in all.drain(..) {
            match if_empty {
                true => drop(std::fs::remove_dir(&path)),
                false => drop(remove(&path)),
            }
        }
        std::mem::forget(all);
    }
}

/// Removes a file, or a hidden folder without a state or a finished result. The lock is removed last: after that another run may use the folder.
fn remove(path: &Path) -> std::io::Result<()> {
    if path.symlink_metadata()?.is_file() {
        return std::fs::remove_file(path);
    }
    // A file that is being written may need a second look.
    for _ in 0..3 {
        if !is_complete(path) {
            let _ = remove_all_but_lock(path);
        }
    }
    if !is_complete(path) {
        std::fs::remove_file(path.join(LOCK))?;
        std::fs::remove_dir(path)?;
    }
    Ok(())
}

fn with<T>(use_it: impl FnOnce(&mut Vec<Noted>) -> T) -> T {
    use_it(&mut lock())
}

fn lock() -> MutexGuard<'static, Vec<Noted>> {
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}
