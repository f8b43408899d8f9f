//! The result folder: nothing half-written under a final name, and only the same spec replaces an older result.

use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::unfinished::Unfinished;
use crate::error::{Error, InputError};

/// Every file that this program writes into a result folder; a new result removes the older ones.
const OURS: [&str; 30] = [
    "verify.csv",
    "tuples.csv",
    "designs.csv",
    "distances.csv",
    "work_precision.csv",
    "scaling.csv",
    "threads.csv",
    "peaks.csv",
    "roofline.csv",
    "work_precision.svg",
    "work_precision.png",
    "configurations.svg",
    "configurations.png",
    "scaling.svg",
    "scaling.png",
    "threads.svg",
    "threads.png",
    "roofline.svg",
    "roofline.png",
    "calibration.toml",
    "K_table.csv",
    "rows.csv",
    "located.csv",
    "measurements.csv",
    "best.toml",
    "history.csv",
    "sensitivity.csv",
    "pareto.csv",
    "tap.csv",
    "run.json",
];

/// Start of the name of a folder in which a result is being written, or was when the machine went down.
const PARTIAL: &str = ".vibrissa-";

/// Hex SHA-256 of a spec text: the identity of a result.
pub fn hash(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// Hex SHA-256 of everything that `reader` gives, in constant memory.
pub fn hash_all(reader: &mut impl std::io::Read) -> std::io::Result<String> {
    let mut digest = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match reader.read(&mut buffer)? {
            0 => return Ok(digest.finalize().iter().map(|b| format!("{b:02x}")).collect()),
            n => digest.update(&buffer[..n]),
        }
    }
}

/// A result folder that is being written in or beside its final place.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    partial: tempfile::TempDir,
    names: Vec<String>,
    _unfinished: Unfinished,
}

impl Folder {
    /// Refuses a non-empty `target` that is not the result of the spec with this `hash`, unless `force`.
    pub fn new(target: &Path, hash: &str, force: bool) -> Result<Self, Error> {
        let refuse = |why: &str| {
            InputError::new(format!("{why}; it is kept"))
                .key("--out")
                .value(target.display())
                .allowed("an empty or new folder, the result of the same spec, or --force")
        };
        let there = target.is_dir();
        if !there && target.symlink_metadata().is_ok() {
            return Err(refuse("this is a file, not a folder").into());
        }
        let foreign = |entry: std::io::Result<fs::DirEntry>| {
            entry.is_ok_and(|e| !e.file_name().to_string_lossy().starts_with(PARTIAL))
        };
        let occupied = fs::read_dir(target).is_ok_and(|mut entries| entries.any(foreign));
        if occupied && !force {
            let run = fs::read_to_string(target.join("run.json")).ok();
            let older = run.and_then(|t| serde_json::from_str::<serde_json::Value>(&t).ok());
            match older.as_ref().and_then(|j| j["spec"]["hash"].as_str()) {
                Some(h) if h == hash => {}
                Some(_) => return Err(refuse("this folder holds the result of another spec").into()),
                None => {
                    return Err(refuse("this folder is not empty and holds no result of this program").into());
                }
            }
        }
        // Files are moved within one file system only: a folder that is there may be on another than its parent.
        let place = match target.parent() {
            _ if there => target.to_owned(),
            Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
            _ => PathBuf::from("."),
        };
        fs::create_dir_all(&place).map_err(|e| Error::io(&place, e))?;
        let partial =
            tempfile::Builder::new().prefix(PARTIAL).tempdir_in(&place).map_err(|e| Error::io(&place, e))?;
        let _unfinished = Unfinished::new(partial.path());
        Ok(Self { target: target.to_owned(), partial, names: Vec::new(), _unfinished })
    }

    /// Writes run.json, from which a result is known again.
    pub fn run_json(&mut self, document: &serde_json::Value) -> Result<(), Error> {
        let mut file = self.file("run.json")?;
        file.write(format!("{document:#}\n").as_bytes())?;
        file.close()
    }

    /// A new file of the result.
    pub fn file(&mut self, name: &str) -> Result<Output, Error> {
        let path = self.partial.path().join(name);
        let file = fs::File::create(&path).map_err(|e| Error::io(&path, e))?;
        self.names.push(name.to_owned());
        Ok(Output { writer: BufWriter::with_capacity(1 << 20, file), path: self.target.join(name) })
    }

    /// Moves all files to their final place: older files of ours go first, `run.json` comes last.
    pub fn finish(self) -> Result<Vec<PathBuf>, Error> {
        fs::create_dir_all(&self.target).map_err(|e| Error::io(&self.target, e))?;
        for name in OURS.iter().rev() {
            let old = self.target.join(name);
            if old.exists() {
                fs::remove_file(&old).map_err(|e| Error::io(&old, e))?;
            }
        }
        let mut files = Vec::new();
        for name in &self.names {
            let (from, to) = (self.partial.path().join(name), self.target.join(name));
            fs::rename(&from, &to).map_err(|e| Error::io(&to, e))?;
            files.push(to);
        }
        Ok(files)
    }
}

/// A file of the result while it is written.
#[derive(Debug)]
pub struct Output {
    writer: BufWriter<fs::File>,
    path: PathBuf,
}

impl Output {
    /// Appends `bytes`.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.writer.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Flushes to the disk.
    pub fn close(mut self) -> Result<(), Error> {
        self.writer.flush().map_err(|e| Error::io(&self.path, e))
    }
}
