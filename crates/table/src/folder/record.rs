//! The `run.json` of an older result: whose it is, and which files it wrote.

use std::path::{Component, Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::disk::open_of_result;
use crate::error::Error;
use crate::run_json::FORMAT;
use crate::text_file::{Limit, TextFile};

/// Name of the record.
pub(super) const RUN: &str = "run.json";

/// The text of the `run.json` in `folder`; `None` where there is none.
///
/// # Errors
/// What is no regular file, no text, or too long for a `run.json`; what the system says.
pub fn read_run(folder: &Path) -> Result<Option<String>, Error> {
    let path = folder.join(RUN);
    let Some(file) = open_of_result(&path)? else { return Ok(None) };
    let text = TextFile::new(file, &path.display().to_string(), RUN, Limit::Whole).text()?;
    Ok(Some(text))
}

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
        match read_run(folder) {
            Ok(None) => Ok(Self::Nothing),
            Ok(Some(text)) => {
                let run: Value = serde_json::from_str(&text).unwrap_or_default();
                Ok(Self::of(run).unwrap_or(Self::Unlisted))
            }
            Err(Error::Input(_)) => Ok(Self::Unlisted),
            Err(e) => Err(e),
        }
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
