//! Parts of a sweep that several machines made, joined to the tables of the whole, byte for byte.
//!
//! Each part holds whole designs in the order of the whole, so most tables are the parts one behind the other. Rows of a tuple file
//! interleave, and rows that were ranked compete: their parts say where each row stands ([`Place`](crate::sweep::Place)), and the rows
//! are taken in that order. A chart ranks candidates before they are solved; how many of them the whole would have solved is decided here,
//! over all parts. No tap is solved, so any machine can do it; memory is that of the places, not of the rows. Searches with seeds of their own
//! are joined to their best design and one front.

mod checked;
mod order;
mod part;
mod record;
mod search;
mod source;
mod stated;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Folder, Question, Written};
use crate::sink::shard::Shard;
use crate::sink::sheet::{About, Sheet};
use crate::sink::table::Table;
use part::Part;
use source::Source;

/// What a merge tells.
#[derive(Debug)]
pub struct Report {
    /// Where the whole is.
    pub out: PathBuf,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<PathBuf>,
    /// The run.json of the whole.
    pub run: Value,
    /// What the parts differ in without being of another sweep.
    pub warnings: Vec<String>,
    /// Seconds of the merge.
    pub seconds: f64,
}

/// Joins the parts of a sweep, or the searches, in `folders`, or in folders of `folders`, into `out` (where they all lie, by default).
///
/// # Errors
/// Parts that are missing, unfinished, edited, there twice, of another sweep or of another version; a folder that holds something else.
pub fn run(folders: &[PathBuf], out: Option<&Path>, force: bool) -> Result<Report, Error> {
    let start = Instant::now();
    let found = part::found(folders)?;
    let out = match out {
        Some(out) => out.to_owned(),
        None => beside(&found)?,
    };
    if search::is_search(&found[0].1) {
        return search::run(&found, out, force);
    }
    let parts = part::checked(&found)?;
    let warnings = part::differences(&parts);
    let first = &parts[0];
    let tables: Vec<Table> = Table::ALL.into_iter().filter(|t| first.tables.contains(t)).collect();
    let names: Vec<String> = tables.iter().map(|t| t.file(first.format)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let inputs = parts.iter().flat_map(Part::files).collect();
    let question = Question { inputs, in_force: record::in_force(first, &out), ..question(first) };
    let mut folder = Folder::open(&out, question, &names, force)?;
    // What changed since it was checked may fail in any way; then that is the reason.
    let (rows, kept) =
        joined(&parts, &tables, &mut folder).or_else(|e| part::unedited(&parts).and(Err(e)))?;
    let run = record::whole(&parts, (rows, kept), start.elapsed().as_secs_f64(), &out);
    folder.run_json(&run)?;
    let Written { files, removed, .. } = folder.finish()?;
    Ok(Report { out, files, removed, run, warnings, seconds: start.elapsed().as_secs_f64() })
}

/// Writes the tables of the whole; rows of each, and how many `top` keeps.
fn joined(parts: &[Part], tables: &[Table], folder: &mut Folder) -> Result<([u64; 3], Option<u64>), Error> {
    let orders = order::Orders::new(parts)?;
    let mut rows = [0; 3];
    for &table in tables {
        let mut sources =
            parts.iter().map(|part| Source::open(part, table)).collect::<Result<Vec<_>, _>>()?;
        let (empty, provenance) = (sources[0].empty.clone(), sources[0].provenance.clone());
        if let Some(at) = sources.iter().position(|source| source.empty.names != empty.names) {
            let why = format!("its {} has other columns than that of the first part", table.name());
            return Err(part::refuse(&parts[at].folder, why, "the part as it was written"));
        }
        let format = parts[0].format;
        let about = About { table, empty: &empty, format, provenance: &provenance };
        let mut sheet = Sheet::new(folder, &about)?;
        rows[table as usize] = orders.write(table, &mut sources, &mut sheet)?;
        sheet.close()?;
        sources.into_iter().try_for_each(Source::end)?;
    }
    Ok((rows, orders.kept()))
}

/// What an unsharded run would answer.
fn question(first: &Part) -> Question {
    let mut asked = first.run["asked"].clone();
    if let Some(asked) = asked.as_object_mut() {
        asked.shift_remove("shard");
    }
    Question::new("sweep", first.name.clone(), asked)
}

/// The folder in which all parts lie.
fn beside(found: &[(Shard, PathBuf)]) -> Result<PathBuf, Error> {
    let parent = |path: &PathBuf| match path.parent() {
        Some(p) if p.as_os_str().is_empty() => PathBuf::from("."),
        Some(p) => p.to_owned(),
        None => path.clone(),
    };
    let mut all: Vec<PathBuf> = found.iter().map(|(_, path)| parent(path)).collect();
    all.dedup();
    match all.as_slice() {
        [one] => Ok(one.clone()),
        _ => {
            let error = InputError::new("these parts lie in several folders");
            Err(error.key("--out").allowed("the folder for the whole").into())
        }
    }
}
