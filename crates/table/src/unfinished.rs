//! Folders in which results are being written, and their locks, so that a process that ends in the middle can take them away.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::folder::remove_folder;

static PATHS: Mutex<Vec<Noted>> = Mutex::new(Vec::new());
/// Whether a result is whole and goes, or has gone, to its place.
static PLACED: AtomicBool = AtomicBool::new(false);

/// What of an unfinished result is kept, in words.
static KEPT: Mutex<Option<String>> = Mutex::new(None);

/// Notes what is complete and stays, in words, if the run ends now.
pub fn keeping(words: String) {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).replace(words);
}

/// What is complete and stays, in words; `None` of nothing.
pub fn kept() -> Option<String> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Nothing is unfinished any more.
pub fn forget() {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).take();
}

/// From now on a result is put in its place, which an end of the process leaves to the next run.
pub fn placing() {
    with(|_| PLACED.store(true, Ordering::Relaxed));
}

/// Whether a result is in its place, or will be.
pub fn is_placed() -> bool {
    PLACED.load(Ordering::Relaxed)
}

/// A folder or file that goes if the process ends before this does.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

/// What was noted: a path, and whether it goes only where it is an empty folder.
type Noted = (PathBuf, bool);

impl Unfinished {
    /// Notes `path`.
    pub fn new(path: &Path) -> Self {
        with(|all| Self::note(all, path, false))
    }

    /// Notes the folder `path`, which goes only if nothing is in it.
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

/// Removes them all, for a process that is about to end without unwinding. A file that is being written may need a second look. Whoever
/// is about to put its folder in place waits until that is done, and whoever is about to make one waits for ever.
pub fn remove_all() {
    let mut all = lock();
    if !is_placed() {
        for (path, if_empty) in all.drain(..) {
            let gone = || match if_empty {
                true => std::fs::remove_dir(&path).is_ok(),
                false => remove_folder(&path).or_else(|_| std::fs::remove_file(&path)).is_ok(),
            };
            let _ = (0..3).find(|_| gone());
        }
        std::mem::forget(all);
    }
}

fn with<T>(use_it: impl FnOnce(&mut Vec<Noted>) -> T) -> T {
    use_it(&mut lock())
}

fn lock() -> MutexGuard<'static, Vec<Noted>> {
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}
