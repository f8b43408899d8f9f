//! Folders in which results are being written, so that a process that ends in the middle can take them away.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A folder that goes if the process ends before this does.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Notes `folder`.
    pub fn new(folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        with(|all| all.push(folder.clone()));
        Self(folder)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        with(|all| all.retain(|f| *f != self.0));
    }
}

/// Removes them all, for a process that is about to end without unwinding. A file that is being written may need a second look.
pub fn remove_all() {
    let folders = with(|all| all.clone());
    for folder in folders {
        let _ = (0..3).find(|_| std::fs::remove_dir_all(&folder).is_ok());
    }
}

fn with<T>(use_it: impl FnOnce(&mut Vec<PathBuf>) -> T) -> T {
    use_it(&mut FOLDERS.lock().unwrap_or_else(PoisonError::into_inner))
}
