//! A folder in memory, where the system has one, that is used over and over.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use tempfile::TempDir;

static DESK: LazyLock<TempDir> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.expect("a folder")
});

/// The path of `name` in it.
pub fn path(name: &str) -> PathBuf {
    DESK.path().join(name)
}

/// The folder.
pub fn folder() -> &'static Path {
    DESK.path()
}

/// Writes a file, and the folders that it needs.
pub fn write(name: &str, bytes: &[u8]) {
    let path = path(name);
    std::fs::create_dir_all(path.parent().expect("it is in a folder")).expect("a folder");
    std::fs::write(path, bytes).expect("a file");
}

/// Removes a folder with all that is in it.
pub fn clear(name: &str) {
    let _ = std::fs::remove_dir_all(path(name));
}
