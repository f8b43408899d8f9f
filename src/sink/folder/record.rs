//! The `run.json` of an older result: whose it is, and which files it wrote.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Read};
use std::path::{Component, Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::disk::open_regular;
use crate::error::Error;
use crate::sink::run_json::FORMAT;

/// Name of the record.
pub(super) const RUN: &str = "run.json";

/// A file that a run wrote.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Listed {
    /// Its name in the folder.
    pub name: String,
    /// Hex BLAKE3 of what was written.
    pub blake3: String,
    /// Its length.
    pub bytes: u64,
}

/// What stands in a folder's `run.json`.
#[derive(Debug)]
pub(super) enum Record {
    /// There is none.
    Nothing,
    /// Of an older version of this program, or of another program.
    Unlisted,
    /// A result of this program.
    Result { command: String, name: String, files: Vec<Listed>, seconds: f64, run: Value },
}

impl Record {
    /// Reads it.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(RUN);
        let mut text = String::new();
        let read =
            open_regular(&path, OpenOptions::new().read(true)).and_then(|mut f| f.read_to_string(&mut text));
        match read {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::Nothing),
            Err(e) if e.kind() == ErrorKind::InvalidData => return Ok(Self::Unlisted),
            other => other.map_err(|e| Error::io(&path, e))?,
        };
        let run: Value = serde_json::from_str(&text).unwrap_or_default();
        Ok(Self::of(run).unwrap_or(Self::Unlisted))
    }

    fn of(run: Value) -> Option<Self> {
        let text = |key: &str| run[key].as_str().map(str::to_owned);
        if run["format"].as_u64() != Some(FORMAT.into()) {
            return None;
        }
        let files: Vec<Listed> = serde_json::from_value(run["files"].clone()).ok()?;
        if !files.iter().all(|f| is_result_name(&f.name)) {
            return None;
        }
        Some(Self::Result {
            command: text("command")?,
            name: text("name")?,
            files,
            seconds: run["seconds"]["total"].as_f64()?,
            run,
        })
    }

    /// The files that it lists.
    pub fn files(&self) -> &[Listed] {
        match self {
            Self::Result { files, .. } => files,
            _ => &[],
        }
    }
}

/// Whether `name` may be that of a file that a `run.json` lists.
pub fn is_result_name(name: &str) -> bool {
    is_plain(name) && name != RUN
}

/// Whether `name` is that of a file in the folder itself, and none of the program's own hidden ones.
pub(super) fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let one = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    one && !name.starts_with(super::PREFIX)
}
