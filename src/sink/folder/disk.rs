//! Files as they lie on the disk: opened without following links, made durable, known again.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};

/// Hex SHA-256 of a text.
pub fn hash(text: &str) -> String {
    hex(Sha256::digest(text.as_bytes()))
}

/// What is read, hashed on the way.
#[derive(Debug)]
pub struct Hashing<R> {
    reader: R,
    digest: Sha256,
}

impl<R: io::Read> Hashing<R> {
    /// Nothing of `reader` yet.
    pub fn new(reader: R) -> Self {
        Self { reader, digest: Sha256::new() }
    }

    /// Hex SHA-256 of all that was read, and of what is left, in constant memory.
    pub fn end(mut self) -> io::Result<String> {
        let mut buffer = vec![0; 1 << 16];
        while io::Read::read(&mut self, &mut buffer)? > 0 {}
        Ok(hex(self.digest.finalize()))
    }
}

impl<R: io::Read> io::Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.reader.read(buffer)?;
        self.digest.update(&buffer[..n]);
        Ok(n)
    }
}

/// Hex SHA-256 of everything that `reader` gives.
pub fn hash_all(reader: &mut impl io::Read) -> io::Result<String> {
    Hashing::new(reader).end()
}

/// Hex BLAKE3 of a result file: a table of gigabytes is hashed while it is written, and SHA-256 without the CPU's own instructions took
/// half as long again as the sweep of `sweeps/million.toml`.
pub fn hash_file(file: impl io::Read) -> io::Result<String> {
    let mut digest = blake3::Hasher::new();
    digest.update_reader(file)?;
    Ok(digest.finalize().to_hex().to_string())
}

/// A digest as it is written.
fn hex(digest: impl AsRef<[u8]>) -> String {
    digest.as_ref().iter().map(|b| format!("{b:02x}")).collect()
}

/// Opens a regular file; a link, a pipe or a folder under this name is an error, and nothing behind it is touched.
pub fn open_regular(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let odd = || io::Error::other("this is not a regular file; it is left as it is");
    match path.symlink_metadata() {
        Ok(there) if !there.is_file() => return Err(odd()),
        _ => {}
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // What appears under the name in the meantime is not followed and not waited for either.
        let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
        options.custom_flags(flags.bits().cast_signed());
    }
    let file = options.open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(odd()) }
}

/// Makes the names in a folder durable.
pub(super) fn sync(folder: &Path) -> io::Result<()> {
    if cfg!(unix) {
        match File::open(folder)?.sync_all() {
            // Some file systems have no such call for folders.
            Err(e) if e.kind() == io::ErrorKind::InvalidInput => {}
            other => other?,
        }
    }
    Ok(())
}

/// Changes whenever a file is written or replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
    place: Option<(u64, u64)>,
}

impl Stamp {
    pub fn of(m: &Metadata) -> Self {
        Self { length: m.len(), modified: m.modified().ok(), place: place(m) }
    }
}

/// Device and inode: the same for all names of a file.
pub(super) fn place(m: &Metadata) -> Option<(u64, u64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Some((m.dev(), m.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = m;
        None
    }
}

/// A file that is read, whatever names and links lead to it.
#[derive(Debug)]
pub(super) struct Identity {
    path: Option<PathBuf>,
    place: Option<(u64, u64)>,
}

impl Identity {
    pub fn of(path: &Path) -> Self {
        let place = fs::metadata(path).ok().as_ref().and_then(place);
        Self { path: path.canonicalize().ok(), place }
    }

    /// Whether both are the same file.
    pub fn is(&self, other: &Self) -> bool {
        let path = self.path.is_some() && self.path == other.path;
        path || (self.place.is_some() && self.place == other.place)
    }
}
