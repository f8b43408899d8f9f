//! A file of the result while it is written, hashed on the way.

use std::fs;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::record::Listed;
use crate::error::Error;
use crate::pack::packed;

/// The files that are written, each once it is closed.
#[derive(Debug, Clone, Default)]
pub(super) struct Closed(Arc<Mutex<Vec<(Listed, fs::File)>>>);

impl Closed {
    fn lock(&self) -> MutexGuard<'_, Vec<(Listed, fs::File)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes them durable, all at once (a disk is waited for about as long as for one), and closes them. Each must be in `folder`, as long as it
    /// was written.
    ///
    /// # Errors
    /// A file that somebody has removed, cut or replaced; a disk that fails.
    pub fn end(&self, folder: &Path) -> Result<(), Error> {
        let files = std::mem::take(&mut *self.lock());
        let end = |(listed, file): &(Listed, fs::File)| {
            let path = folder.join(&listed.name);
            file.sync_all().map_err(|e| Error::io(&path, e))?;
            match path.symlink_metadata() {
                Ok(m) if m.is_file() && m.len() == listed.bytes => Ok(()),
                _ => {
                    let why =
                        "this file was removed or changed while the run wrote it; there is no new result";
                    Err(Error::io(&path, io::Error::other(why)))
                }
            }
        };
        std::thread::scope(|scope| {
            let each: Vec<_> = files.iter().map(|file| scope.spawn(move || end(file))).collect();
            each.into_iter().try_for_each(|done| done.join().expect("a call to the system does not panic"))
        })
    }

    /// All of them, by name.
    pub fn sorted(&self) -> Vec<Listed> {
        let mut files: Vec<Listed> = self.lock().iter().map(|(listed, _)| listed.clone()).collect();
        files.sort_by(|a, b| a.name.cmp(&b.name));
        files
    }
}

/// A file of the result while it is written.
#[derive(Debug)]
pub struct Output {
    writer: BufWriter<fs::File>,
    digest: blake3::Hasher,
    bytes: u64,
    name: String,
    path: PathBuf,
    closed: Closed,
}

/// How far a file was written: its length, and the check of its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// Bytes.
    pub bytes: u64,
    /// Their hex BLAKE3.
    pub blake3: String,
}

packed!(Mark { bytes, blake3 });

impl Output {
    /// Goes on with `file` behind the bytes that `mark` knows; what follows them is cut off. `None` where they are not those.
    pub(super) fn again(
        mut file: fs::File,
        name: &str,
        path: PathBuf,
        closed: Closed,
        mark: &Mark,
    ) -> io::Result<Option<Self>> {
        if file.metadata()?.len() < mark.bytes {
            return Ok(None);
        }
        let mut digest = blake3::Hasher::new();
        digest.update_reader((&mut file).take(mark.bytes))?;
        if digest.finalize().to_hex().as_str() != mark.blake3 {
            return Ok(None);
        }
        file.set_len(mark.bytes)?;
        file.seek(SeekFrom::Start(mark.bytes))?;
        let again = Self::new(file, name, path, closed);
        Ok(Some(Self { digest, bytes: mark.bytes, ..again }))
    }

    /// Bytes so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// How far it is, with everything handed to the system.
    pub fn mark(&mut self) -> Result<Mark, Error> {
        self.writer.flush().map_err(|e| Error::io(&self.path, e))?;
        Ok(Mark { bytes: self.bytes, blake3: self.digest.finalize().to_hex().to_string() })
    }

    /// The file itself, to make it durable.
    pub fn handle(&self) -> Result<fs::File, Error> {
        self.writer.get_ref().try_clone().map_err(|e| Error::io(&self.path, e))
    }

    /// `path` is where the file will be found.
    pub(super) fn new(file: fs::File, name: &str, path: PathBuf, closed: Closed) -> Self {
        let writer = BufWriter::with_capacity(1 << 20, file);
        Self { writer, digest: blake3::Hasher::new(), bytes: 0, name: name.to_owned(), path, closed }
    }

    /// Appends `bytes`.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.digest.update(bytes);
        self.bytes += bytes.len() as u64;
        self.writer.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Ends the file.
    pub fn close(self) -> Result<(), Error> {
        let file = self.writer.into_inner().map_err(|e| Error::io(&self.path, e.into_error()))?;
        let blake3 = self.digest.finalize().to_hex().to_string();
        self.closed.lock().push((Listed { name: self.name, blake3, bytes: self.bytes }, file));
        Ok(())
    }
}
