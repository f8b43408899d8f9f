//! Folders in which results are being written, and their locks, so that a process that ends in the middle can take them away.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::folder::remove_folder;

static PATHS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
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

impl Unfinished {
    /// Notes `path`.
    pub fn new(path: &Path) -> Self {
        with(|all| Self::note(all, path))
    }

    /// Makes something and notes it, so that no end of the process comes between.
    ///
    /// # Errors
    /// What `make` says.
    pub fn make<T: AsRef<Path>, E>(make: impl FnOnce() -> Result<T, E>) -> Result<(T, Self), E> {
        with(|all| {
            let made = make()?;
            let noted = Self::note(all, made.as_ref());
            Ok((made, noted))
        })
    }

    fn note(all: &mut Vec<PathBuf>, path: &Path) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        all.push(path.clone());
        Self(path)
    }

    /// It is no longer unfinished.
    pub fn settle(&self) {
        with(|all| all.retain(|path| *path != self.0));
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        self.settle();
    }
}

/// Removes them all, for a process that is about to end without unwinding. A file that is being written may need a second look. Whoever
/// is about to put its folder in place waits until that is done, and whoever is about to make one waits for ever.
pub fn remove_all() {
    let mut all = lock();
    if !is_placed() {
        for path in all.drain(..) {
            let gone = || remove_folder(&path).or_else(|_| std::fs::remove_file(&path)).is_ok();
            let _ = (0..3).find(|_| gone());
        }
        std::mem::forget(all);
    }
}

fn with<T>(use_it: impl FnOnce(&mut Vec<PathBuf>) -> T) -> T {
    use_it(&mut lock())
}

fn lock() -> MutexGuard<'static, Vec<PathBuf>> {
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}
