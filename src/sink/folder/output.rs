//! A file of the result while it is written, hashed on the way.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::record::Listed;
use crate::error::Error;

/// The files that are written, each once it is closed.
#[derive(Debug, Clone, Default)]
pub(super) struct Closed(Arc<Mutex<Vec<(Listed, fs::File)>>>);

impl Closed {
    fn lock(&self) -> MutexGuard<'_, Vec<(Listed, fs::File)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes them durable, all at once: a disk is waited for about as long as for one.
    pub fn sync(&self) -> io::Result<()> {
        let files = self.lock();
        std::thread::scope(|scope| {
            let each: Vec<_> = files.iter().map(|(_, file)| scope.spawn(|| file.sync_all())).collect();
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

impl Output {
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
