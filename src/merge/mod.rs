//! Joins the parts of a sweep to the tables of the whole, byte for byte. Each part holds whole designs in the order of the whole, so most tables are
//! the parts in sequence. Rows of a tuple file interleave, and ranked rows compete: their parts store the position of each row
//! ([`Place`](crate::sweep::Place)), and the number of a chart's candidates to solve is decided here. No tap is solved; memory holds positions, not
//! rows.

mod part;
mod record;
mod rows;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Folder, Question, Written};
use crate::sink::table::Table;
use crate::sweep::PLACES;
use part::Part;
use rows::{Order, Source};

#[derive(Debug)]
pub struct Report {
    pub out: PathBuf,
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<PathBuf>,
    pub run: Value,
    /// Harmless differences between the parts.
    pub warnings: Vec<String>,
    pub seconds: f64,
}

/// Joins the parts in `folders` or their subfolders into `out` (by default their common parent).
/// Errors: missing, unfinished, edited or repeated parts; parts of another sweep or version; a folder that holds something else.
pub fn run(folders: &[PathBuf], out: Option<&Path>, force: bool) -> Result<Report, Error> {
    let start = Instant::now();
    let (parts, out) = found(folders, out)?;
    let mut run = record::whole(&parts, &out);
    let names: Vec<&str> =
        parts[0].listed.iter().map(|file| file.name.as_str()).filter(|name| *name != PLACES).collect();
    // Same question as a run without shards.
    let mut asked = parts[0].run["asked"].clone();
    asked.as_object_mut().map(|asked| asked.shift_remove("shard"));
    let inputs = parts.iter().flat_map(Part::files).collect();
    let question = Question::new("sweep", parts[0].run["name"].as_str().unwrap_or_default(), asked);
    let question = Question { inputs, in_force: run["in_force"].clone(), ..question };
    let mut folder = Folder::open(&out, question, &names, force)?;
    let joined = joined(&parts, &mut folder, &mut run);
    // If joining failed, an edited part is the better reason.
    part::unedited(&parts)?;
    joined?;
    record::timed(&mut run, start.elapsed().as_secs_f64());
    folder.run_json(&run)?;
    let warnings = part::differences(&parts);
    let Written { files, removed } = folder.finish()?;
    Ok(Report { out, files, removed, run, warnings, seconds: start.elapsed().as_secs_f64() })
}

pub fn plan(folders: &[PathBuf], out: Option<&Path>) -> Result<(usize, PathBuf), Error> {
    found(folders, out).map(|(parts, out)| (parts.len(), out))
}

fn found(folders: &[PathBuf], out: Option<&Path>) -> Result<(Vec<Part>, PathBuf), Error> {
    let parts = part::all(folders)?;
    let out = out.map_or_else(|| beside(&parts), |out| Ok(out.to_owned()))?;
    Ok((parts, out))
}

fn tables(part: &Part) -> impl Iterator<Item = Table> {
    Table::ALL.into_iter().filter(|table| part.lists(&table.file(part.format)))
}

fn joined(parts: &[Part], folder: &mut Folder, run: &mut Value) -> Result<(), Error> {
    let order = Order::new(parts)?;
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
