//! Files of a result: being written, as listed in `run.json`, and on the disk; and hashes. Inputs have a SHA-256; outputs a BLAKE3, because SHA-256
//! without CPU instructions for it took half as long again as the sweep of `sweeps/million.toml`.

use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::error::{Error, InputError};
use crate::text_file::{Limit, TextFile};

pub(super) const PREFIX: &str = ".vibrissa-";
pub(super) const RUN: &str = "run.json";

/// Hex SHA-256 of a text or of bytes.
pub fn hash<T: AsRef<[u8]> + ?Sized>(bytes: &T) -> String {
    hex(Sha256::digest(bytes))
}

fn hex(digest: impl AsRef<[u8]>) -> String {
    digest.as_ref().iter().map(|b| format!("{b:02x}")).collect()
}

pub(super) fn hash_numbers(numbers: impl Iterator<Item = f64>) -> String {
    let mut digest = Sha256::new();
    numbers.for_each(|x| digest.update(x.to_le_bytes()));
    hex(digest.finalize())
}

/// Hex BLAKE3 of a result file.
pub fn hash_file(file: impl Read) -> io::Result<String> {
    let mut digest = blake3::Hasher::new();
    digest.update_reader(file)?;
    Ok(digest.finalize().to_hex().to_string())
}

/// A file of a run: finished, or as far as it is written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Listed {
    /// Name in the folder.
    pub name: String,
    /// Hex BLAKE3 of its bytes.
    pub blake3: String,
    /// Length in bytes.
    pub bytes: u64,
}

pub(super) type Closed = Arc<Mutex<Vec<Listed>>>;

/// A file of the result while it is written; hashed as it is written.
#[derive(Debug)]
pub struct Output {
    writer: BufWriter<File>,
    digest: blake3::Hasher,
    bytes: u64,
    path: PathBuf,
    closed: Closed,
}

impl Output {
    pub(super) fn new(file: File, path: PathBuf, closed: Closed) -> Self {
        let writer = BufWriter::with_capacity(1 << 20, file);
        Self { writer, digest: blake3::Hasher::new(), bytes: 0, path, closed }
    }

    /// Continues after the bytes of `mark` and cuts off the rest. `None` if the file does not begin with these bytes.
    pub(super) fn again(mut self, mark: &Listed) -> io::Result<Option<Self>> {
        let file = self.writer.get_mut();
        self.digest.update_reader(file.take(mark.bytes))?;
        if file.metadata()?.len() < mark.bytes || self.digest.finalize().to_hex().as_str() != mark.blake3 {
            return Ok(None);
        }
        file.set_len(mark.bytes)?;
        file.seek(SeekFrom::Start(mark.bytes))?;
        Ok(Some(Self { bytes: mark.bytes, ..self }))
    }

    pub(super) fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Bytes written until now.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Flushes, and returns the length and hash of the file up to here.
    pub fn mark(&mut self) -> Result<Listed, Error> {
        self.writer.flush().map_err(|e| Error::io(&self.path, e))?;
        let blake3 = self.digest.finalize().to_hex().to_string();
        Ok(Listed { name: self.name(), blake3, bytes: self.bytes })
    }

    /// Appends `bytes`.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.digest.update(bytes);
        self.bytes += bytes.len() as u64;
        self.writer.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Closes the file.
    pub fn close(mut self) -> Result<(), Error> {
        let whole = self.mark()?;
        self.closed.lock().unwrap_or_else(PoisonError::into_inner).push(whole);
        Ok(())
    }
}

pub(super) fn make_durable(path: &Path, bytes: u64) -> Result<(), Error> {
    let file = open_regular(path, OpenOptions::new().write(true)).ok();
    let Some(file) = file.filter(|file| file.metadata().is_ok_and(|m| m.len() == bytes)) else {
        let why = "this file was removed or changed while the run wrote it; there is no new result";
        return Err(Error::io(path, io::Error::other(why)));
    };
    file.sync_all().map_err(|e| Error::io(path, e))
}

pub(super) fn create(path: &Path) -> io::Result<File> {
    let _ = std::fs::remove_file(path);
    File::create_new(path)
}

/// Writes a file into the hidden folder `work` atomically: after a crash it is either new and whole, or the old one.
pub(super) fn commit(work: &Path, name: &str, bytes: &[u8]) -> io::Result<()> {
    let next = work.join(format!("{name}-next"));
    let mut file = create(&next)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(next, work.join(name))?;
    sync(work)
}

pub(super) fn sync(folder: &Path) -> io::Result<()> {
    match cfg!(unix).then(|| File::open(folder)?.sync_all()) {
        // Some file systems do not support this call on folders.
        Some(Err(e)) if e.kind() != io::ErrorKind::InvalidInput => Err(e),
        _ => Ok(()),
    }
}

/// Opens a regular file; a link, pipe or folder of this name is an error and is not followed.
pub(super) fn open_regular(path: &Path, options: &OpenOptions) -> io::Result<File> {
    match path.symlink_metadata()?.is_file() {
        true => options.open(path),
        false => Err(io::Error::other("this is not a regular file; it is left as it is")),
    }
}

/// Opens a file of a result for reading; `None` if it does not exist. A link, pipe, device or folder is refused.
pub fn open_of_result(path: &Path) -> Result<Option<File>, Error> {
    match open_regular(path, OpenOptions::new().read(true)) {
        Ok(file) => Ok(Some(file)),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(_) if path.symlink_metadata().is_ok_and(|m| !m.is_file()) => {
            let error = InputError::new("this is a link, a pipe, a device or a folder, no file of a result");
            Err(error.at(path.display().to_string(), None).allowed("the file as it was written").into())
        }
        Err(e) => Err(Error::io(path, e)),
    }
}

/// Length and hash of a file as it is now; `None` if it does not exist.
pub fn look(folder: &Path, name: &str) -> Result<Option<Listed>, Error> {
    let path = folder.join(name);
    let Some(file) = open_of_result(&path)? else { return Ok(None) };
    let listed = || Ok((file.metadata()?.len(), hash_file(&file)?));
    let (bytes, blake3) = listed().map_err(|e| Error::io(&path, e))?;
    Ok(Some(Listed { name: name.to_owned(), blake3, bytes }))
}

/// The text of the `run.json` in `folder`; `None` if the file does not exist.
pub fn read_run(folder: &Path) -> Result<Option<String>, Error> {
    let path = folder.join(RUN);
    let Some(file) = open_of_result(&path)? else { return Ok(None) };
    Ok(Some(TextFile::new(file, &path.display().to_string(), RUN, Limit::Whole).text()?))
}

/// Key in `run.json` of the hash of its text, computed with [`BLANK`] in place of the hash.
const SEAL: &str = "blake3";
const BLANK: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// The text of a `run.json` with its own hash, which [`is_sealed`] checks.
pub fn sealed(mut document: Value) -> String {
    document[SEAL] = BLANK.into();
    let text = format!("{document:#}\n");
    resealed(&text, BLANK, &blake3::hash(text.as_bytes()).to_hex())
}

/// True if `text`, parsed as `run`, is a `run.json` that was not edited.
pub fn is_sealed(text: &str, run: &Value) -> bool {
    let hash = |seal: &str| blake3::hash(resealed(text, seal, BLANK).as_bytes()).to_hex();
    run[SEAL].as_str().is_some_and(|seal| *hash(seal) == *seal)
}

fn resealed(text: &str, from: &str, to: &str) -> String {
    text.rsplit_once(from).map_or_else(String::new, |(before, after)| [before, to, after].concat())
}

/// The files that the `run.json` in `run` lists; `None` if it is not that of a result.
pub fn listed(run: &Value) -> Option<Vec<Listed>> {
    let files: Vec<Listed> = serde_json::from_value(run["files"].clone()).ok()?;
    files.iter().all(|file| is_result_name(&file.name)).then_some(files)
}

/// True if `name` may be listed in a `run.json`.
pub fn is_result_name(name: &str) -> bool {
    is_plain(name) && name != RUN
}

pub(super) fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let one = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    one && !name.starts_with(PREFIX)
}

/// Names of all entries of a folder.
pub fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    std::fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect()
}
