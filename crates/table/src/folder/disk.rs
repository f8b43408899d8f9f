//! Files as they lie on the disk: opened without following links, made durable, known again.

#[cfg(unix)]
use std::ffi::OsStr;
use std::ffi::OsString;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::error::{Error, InputError};

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

/// Hex SHA-256 of the bytes of `numbers`.
pub fn hash_numbers(numbers: impl Iterator<Item = f64>) -> String {
    let mut digest = Sha256::new();
    numbers.for_each(|x| digest.update(x.to_le_bytes()));
    hex(digest.finalize())
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

/// Opens a file of a result to read it; `None` where there is none. A link, a pipe, a device or a folder under its name is refused.
///
/// # Errors
/// That, and what the system says.
pub fn open_of_result(path: &Path) -> Result<Option<File>, Error> {
    match open_regular(path, OpenOptions::new().read(true)) {
        Ok(file) => Ok(Some(file)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(_) if path.symlink_metadata().is_ok_and(|m| !m.is_file()) => {
            let error = InputError::new("this is a link, a pipe, a device or a folder, no file of a result");
            Err(error.at(path.display().to_string(), None).allowed("the file as it was written").into())
        }
        Err(e) => Err(Error::io(path, e)),
    }
}

/// Names of everything in a folder, but `.` and `..`. The standard library's way panics where the system fails to close a folder.
#[cfg(unix)]
pub fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::OpenOptionsExt;
    let flags = rustix::fs::OFlags::DIRECTORY.bits().cast_signed();
    let opened = OpenOptions::new().read(true).custom_flags(flags).open(folder)?;
    let mut names = Vec::new();
    for entry in rustix::fs::Dir::new(opened)? {
        let entry = entry?;
        let name = entry.file_name().to_bytes();
        names.extend((!matches!(name, b"." | b"..")).then(|| OsStr::from_bytes(name).to_owned()));
    }
    Ok(names)
}

/// Names of everything in a folder.
#[cfg(not(unix))]
pub fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect()
}

/// Removes a folder and all that is in it; of a link the link.
pub fn remove_folder(folder: &Path) -> io::Result<()> {
    for name in names_in(folder)? {
        let path = folder.join(name);
        match path.symlink_metadata()?.is_dir() {
            true => remove_folder(&path)?,
            false => fs::remove_file(&path)?,
        }
    }
    fs::remove_dir(folder)
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
pub struct Identity {
    path: Option<PathBuf>,
    place: Option<(u64, u64)>,
}

impl Identity {
    /// Of the file at `path`.
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
