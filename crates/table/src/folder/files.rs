//! Files of a result: while they are written, as `run.json` lists them, and as they lie on the disk.

use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::hash::{hash_bytes, hash_file};
use crate::error::{Error, InputError};
use crate::text_file::{Limit, TextFile};

/// Start of the names that this program uses for itself in result folders.
pub(super) const PREFIX: &str = ".vibrissa-";
/// Name of the record of a result.
pub(super) const RUN: &str = "run.json";

/// A file that a run wrote, whole or so far.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Listed {
    /// Its name in the folder.
    pub name: String,
    /// Hex BLAKE3 of what was written.
    pub blake3: String,
    /// Its length.
    pub bytes: u64,
}

/// Files that are written, each once it is closed.
pub(super) type Closed = Arc<Mutex<Vec<Listed>>>;

/// A file of the result while it is written, hashed on the way.
#[derive(Debug)]
pub struct Output {
    writer: BufWriter<File>,
    digest: blake3::Hasher,
    bytes: u64,
    /// Where it will be found.
    path: PathBuf,
    closed: Closed,
}

impl Output {
    /// `path` is where the file will be found.
    pub(super) fn new(file: File, path: PathBuf, closed: Closed) -> Self {
        let writer = BufWriter::with_capacity(1 << 20, file);
        Self { writer, digest: blake3::Hasher::new(), bytes: 0, path, closed }
    }

    /// Continues behind the bytes that `mark` knows; what follows them is cut off. `None` where they are not those.
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

    /// Bytes so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The file so far, with everything handed to the system.
    pub fn mark(&mut self) -> Result<Listed, Error> {
        self.writer.flush().map_err(|e| Error::io(&self.path, e))?;
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Listed { name, blake3: self.digest.finalize().to_hex().to_string(), bytes: self.bytes })
    }

    /// Appends `bytes`.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.digest.update(bytes);
        self.bytes += bytes.len() as u64;
        self.writer.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Ends the file.
    pub fn close(mut self) -> Result<(), Error> {
        let whole = self.mark()?;
        self.closed.lock().unwrap_or_else(PoisonError::into_inner).push(whole);
        Ok(())
    }
}

/// Makes a file durable that was written with so many `bytes`.
pub(super) fn make_durable(path: &Path, bytes: u64) -> Result<(), Error> {
    let file = open_regular(path, OpenOptions::new().write(true)).ok();
    let Some(file) = file.filter(|file| file.metadata().is_ok_and(|m| m.len() == bytes)) else {
        let why = "this file was removed or changed while the run wrote it; there is no new result";
        return Err(Error::io(path, io::Error::other(why)));
    };
    file.sync_all().map_err(|e| Error::io(path, e))
}

/// A new file; what is left under its name goes.
pub(super) fn create(path: &Path) -> io::Result<File> {
    let _ = std::fs::remove_file(path);
    File::create_new(path)
}

/// Puts a file of these `bytes` into the hidden folder `work` in one step: after a crash it is there whole, or as it was.
pub(super) fn commit(work: &Path, name: &str, bytes: &[u8]) -> io::Result<()> {
    let next = work.join(format!("{name}-next"));
    let mut file = create(&next)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(next, work.join(name))?;
    sync(work)
}

/// Makes the names in a folder durable.
pub(super) fn sync(folder: &Path) -> io::Result<()> {
    match cfg!(unix).then(|| File::open(folder)?.sync_all()) {
        // Some file systems have no such call for folders.
        Some(Err(e)) if e.kind() != io::ErrorKind::InvalidInput => Err(e),
        _ => Ok(()),
    }
}

/// Opens a regular file; a link, a pipe or a folder under this name is an error, and nothing behind it is touched.
pub(super) fn open_regular(path: &Path, options: &OpenOptions) -> io::Result<File> {
    match path.symlink_metadata()?.is_file() {
        true => options.open(path),
        false => Err(io::Error::other("this is not a regular file; it is left as it is")),
    }
}

/// Opens a file of a result to read it; `None` where there is none. A link, a pipe, a device or a folder under its name is refused.
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

/// A file as it is now; `None` where there is none.
pub fn look(folder: &Path, name: &str) -> Result<Option<Listed>, Error> {
    let path = folder.join(name);
    let Some(file) = open_of_result(&path)? else { return Ok(None) };
    let listed = || Ok((file.metadata()?.len(), hash_file(&file)?));
    let (bytes, blake3) = listed().map_err(|e| Error::io(&path, e))?;
    Ok(Some(Listed { name: name.to_owned(), blake3, bytes }))
}

/// The text of the `run.json` in `folder`; `None` where there is none.
pub fn read_run(folder: &Path) -> Result<Option<String>, Error> {
    let path = folder.join(RUN);
    let Some(file) = open_of_result(&path)? else { return Ok(None) };
    Ok(Some(TextFile::new(file, &path.display().to_string(), RUN, Limit::Whole).text()?))
}

/// Key of the hash of a `run.json` in it: of its text with [`BLANK`] in place of the hash.
const SEAL: &str = "blake3";
const BLANK: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// The text of a `run.json`, with the hash by which [`is_sealed`] knows it.
pub fn sealed(mut document: Value) -> String {
    document[SEAL] = BLANK.into();
    let text = format!("{document:#}\n");
    resealed(&text, BLANK, &hash_bytes(text.as_bytes()))
}

/// True if `text`, which says `run`, is that of a `run.json` as it was written.
pub fn is_sealed(text: &str, run: &Value) -> bool {
    run[SEAL].as_str().is_some_and(|seal| hash_bytes(resealed(text, seal, BLANK).as_bytes()) == seal)
}

/// `text` with one hash in place of another, which stands last.
fn resealed(text: &str, from: &str, to: &str) -> String {
    text.rsplit_once(from).map_or_else(String::new, |(before, after)| [before, to, after].concat())
}

/// Whether `name` may be that of a file that a `run.json` lists.
pub fn is_result_name(name: &str) -> bool {
    is_plain(name) && name != RUN
}

/// Whether `name` is that of a file in the folder itself, and none of the program's own hidden ones.
pub(super) fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let one = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    one && !name.starts_with(PREFIX)
}

/// Names of everything in a folder.
pub fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    std::fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect()
}
