//! A folder for all inputs, in memory where the system has one.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use tempfile::TempDir;

static DESK: LazyLock<TempDir> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.expect("a folder")
});

pub fn path(name: &str) -> PathBuf {
    DESK.path().join(name)
}

pub fn folder() -> &'static Path {
    DESK.path()
}

pub fn write(name: &str, bytes: &[u8]) {
    let path = path(name);
    std::fs::create_dir_all(path.parent().expect("it is in a folder")).expect("a folder");
    std::fs::write(path, bytes).expect("a file");
}

pub fn clear(name: &str) {
    let _ = std::fs::remove_dir_all(path(name));
}
