//! Parts of a sweep that several machines made, joined to the tables of the whole, byte for byte.
//!
//! Each part holds whole designs in the order of the whole, so most tables are the parts one behind the other. Rows of a tuple file
//! interleave, and rows that were ranked compete: their parts say where each row stands ([`Place`](crate::sweep::Place)), and the rows
//! are taken in that order. A chart ranks candidates before they are solved; how many of them the whole would have solved is decided here,
//! over all parts. No tap is solved, so any machine can do it; memory is that of the places, not of the rows. Searches with seeds of their own
//! are joined to their best design and one front.

mod order;
mod part;
mod record;
mod search;
mod source;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Folder, Question, Written};
use crate::sink::table::Table;
use crate::sweep::PLACES;
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
    let (parts, out) = found(folders, out)?;
    // The part that says what the whole says.
    let lead = if parts[0].is_search() { search::best(&parts) } else { &parts[0] };
    let mut run = record::whole(&parts, lead, &out);
    let names: Vec<&str> =
        lead.listed.iter().map(|file| file.name.as_str()).filter(|name| *name != PLACES).collect();
    // What an unsharded run would answer.
    let mut asked = lead.run["asked"].clone();
    asked.as_object_mut().map(|asked| asked.shift_remove("shard"));
    let inputs = parts.iter().flat_map(Part::files).collect();
    let command = if lead.is_search() { "optimise" } else { "sweep" };
    let question = Question::new(command, lead.run["name"].as_str().unwrap_or_default(), asked);
    let question = Question { inputs, in_force: run["in_force"].clone(), ..question };
    let mut folder = Folder::open(&out, question, &names, force)?;
    let joined = match lead.is_search() {
        true => search::joined(&parts, lead, &mut folder, &mut run),
        false => joined(&parts, &mut folder, &mut run),
    };
    // What is not as it was written may fail in any way; then that is the reason.
    part::unedited(&parts)?;
    joined?;
    record::timed(&mut run, start.elapsed().as_secs_f64());
    folder.run_json(&run)?;
    let warnings = if lead.is_search() { Vec::new() } else { part::differences(&parts) };
    let Written { files, removed } = folder.finish()?;
    Ok(Report { out, files, removed, run, warnings, seconds: start.elapsed().as_secs_f64() })
}

/// How many parts, or searches, [`run`] would join, and where.
///
/// # Errors
/// Parts that are missing, unfinished, there twice, of another sweep or of another version.
pub fn plan(folders: &[PathBuf], out: Option<&Path>) -> Result<(usize, PathBuf), Error> {
    found(folders, out).map(|(parts, out)| (parts.len(), out))
}

fn found(folders: &[PathBuf], out: Option<&Path>) -> Result<(Vec<Part>, PathBuf), Error> {
    let parts = part::all(folders)?;
    let out = out.map_or_else(|| beside(&parts), |out| Ok(out.to_owned()))?;
    Ok((parts, out))
}

/// The tables of a part, in their order.
fn tables(part: &Part) -> impl Iterator<Item = Table> {
    Table::ALL.into_iter().filter(|table| part.lists(&table.file(part.format)))
}

/// Writes the tables of the whole, and says in `run` how many rows each has, and how many `top` keeps.
fn joined(parts: &[Part], folder: &mut Folder, run: &mut Value) -> Result<(), Error> {
    let order = order::Order::new(parts)?;
    let mut rows = [0u64; 3];
    for table in tables(&parts[0]) {
        let open = |part| Source::open(part, table);
        let mut sources = parts.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        if let Some(at) = sources.iter().position(|source| source.empty.names != sources[0].empty.names) {
            let why = format!("its {} has other columns than that of the first part", table.name());
            return Err(part::refuse(&parts[at].folder, why, "the part as it was written"));
        }
        let mut sheet = sources[0].sheet(folder, &table.file(parts[0].format))?;
        rows[table as usize] = order.write(table, &mut sources, &mut sheet)?;
        sheet.close()?;
    }
    for (key, rows) in ["tuples", "designs", "distances"].into_iter().zip(rows) {
        run["counts"][key] = rows.into();
    }
    if !run["counts"]["complete_rows"].is_null() {
        run["counts"]["kept_rows"] = order.kept().into();
    }
    Ok(())
}

/// The folder in which all parts lie.
fn beside(parts: &[Part]) -> Result<PathBuf, Error> {
    let parent = |part: &Part| match part.folder.parent() {
        Some(parent) if parent.as_os_str().is_empty() => PathBuf::from("."),
        parent => parent.unwrap_or(&part.folder).to_owned(),
    };
    let first = parent(&parts[0]);
    if parts.iter().all(|part| parent(part) == first) {
        return Ok(first);
    }
    let error = InputError::new("these parts lie in several folders");
    Err(error.key("--out").allowed("the folder for the whole").into())
}
