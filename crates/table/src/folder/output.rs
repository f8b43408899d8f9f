//! A file of the result while it is written, hashed on the way.

use std::fs;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::disk::{hash_file, open_regular, place};
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

    /// Makes them durable, all at once: a disk is waited for about as long as for one.
    pub fn sync(&self) -> io::Result<()> {
        self.each(|_, file| file.sync_all())
    }

    /// Fails unless each file is what lies under its name in `folder`, and holds what was written; `Some(true)` compares every byte, else the
    /// length. `None`: the result is in its final place.
    pub fn check(&self, folder: &Path, before: Option<bool>) -> Result<(), Error> {
        let so = match before {
            Some(_) => "there is no new result",
            None => {
                "the new result has taken the place of the old one, and is not whole: run the command again with --force"
            }
        };
        self.each(|listed, file| {
            let path = folder.join(&listed.name);
            let why = touched(&path, listed, file, before == Some(true)).map_err(|e| Error::io(&path, e))?;
            let failed = |why| Error::io(&path, io::Error::other(format!("{why}; {so}")));
            why.map_or(Ok(()), |why| Err(failed(why)))
        })
    }

    /// Does `f` for all of them at once.
    fn each<E: Send>(&self, f: impl Fn(&Listed, &fs::File) -> Result<(), E> + Sync) -> Result<(), E> {
        let (files, f) = (self.lock(), &f);
        std::thread::scope(|scope| {
            let each: Vec<_> =
                files.iter().map(|(listed, file)| scope.spawn(move || f(listed, file))).collect();
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

/// What somebody else has done to the file at `path`, which was written through `file`; nothing as a rule.
fn touched(path: &Path, listed: &Listed, file: &fs::File, hashed: bool) -> io::Result<Option<&'static str>> {
    let there = match open_regular(path, fs::OpenOptions::new().read(true)) {
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            let why = "this file is gone: it was removed, or its folder was moved, while the run wrote it";
            return Ok(Some(why));
        }
        Err(_) if path.symlink_metadata().is_ok_and(|m| !m.is_file()) => {
            return Ok(Some("this was replaced while the run wrote it, by what is no regular file"));
        }
        other => other?,
    };
    let found = there.metadata()?;
    if place(&found) != place(&file.metadata()?) {
        return Ok(Some("this file was replaced by another one while the run wrote it"));
    }
    let same = found.len() == listed.bytes && (!hashed || hash_file(there)? == listed.blake3);
    Ok((!same).then_some("this file was changed by something else while the run wrote it"))
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
