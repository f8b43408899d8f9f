//! Joins the parts of a sweep to the tables of the whole, byte for byte. Each part holds whole designs in the order of the whole, so most tables are
//! the parts in sequence. Rows of a tuple file interleave, and ranked rows compete: their parts store the position of each row
//! ([`Place`](crate::sweep::Place)), and the number of a chart's candidates to solve is decided here. No tap is solved; memory holds positions, not
//! rows. The run.json of the whole has the shared entries, sums, and the list of parts.

mod part;
mod rows;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use crate::error::{Error, InputError};
use crate::sink::{Folder, Question, Table, Written};
use crate::sweep::PLACES;
use part::Part;
use rows::{Order, Source};

#[derive(Debug)]
pub struct Report {
    pub out: PathBuf,
    pub written: Written,
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
    let mut run = whole(&parts, &out);
    let names: Vec<&str> =
        parts[0].listed.iter().map(|file| file.name.as_str()).filter(|name| *name != PLACES).collect();
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
    let merged = start.elapsed().as_secs_f64();
    let total = run["seconds"]["total"].as_f64().unwrap_or(0.0) + merged;
    (run["seconds"]["total"], run["seconds"]["merge"]) = (total.into(), merged.into());
    if let Some(taps) = run["counts"]["taps"].as_f64().filter(|_| !run["taps_per_second"].is_null()) {
        run["taps_per_second"] = (taps / total.max(1e-9)).into();
    }
    folder.run_json(&run)?;
    let warnings = part::differences(&parts);
    let written = folder.finish()?;
    Ok(Report { out, written, run, warnings, seconds: start.elapsed().as_secs_f64() })
}

pub fn plan(folders: &[PathBuf], out: Option<&Path>) -> Result<(usize, PathBuf), Error> {
    found(folders, out).map(|(parts, out)| (parts.len(), out))
}

fn found(folders: &[PathBuf], out: Option<&Path>) -> Result<(Vec<Part>, PathBuf), Error> {
    let parts = part::all(folders)?;
    let out = out.map_or_else(|| beside(&parts), |out| Ok(out.to_owned()))?;
    Ok((parts, out))
}

fn joined(parts: &[Part], folder: &mut Folder, run: &mut Value) -> Result<(), Error> {
    let (order, first) = (Order::new(parts)?, &parts[0]);
    let mut rows = [0u64; 3];
    for table in Table::ALL.into_iter().filter(|table| first.lists(&table.file(first.format))) {
        let open = |part| Source::open(part, table);
        let mut sources = parts.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        if let Some(at) = sources.iter().position(|source| source.empty.names != sources[0].empty.names) {
            let why = format!("its {} has other columns than that of the first part", table.word());
            return Err(part::refuse(&parts[at].folder, why, "the part as it was written"));
        }
        let mut sheet = sources[0].sheet(folder, &table.file(first.format))?;
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

/// Places in run.json of numbers that are summed over the parts.
const SUMS: [(&str, &[&str]); 3] = [
    ("counts", &["taps", "solved", "interpolated", "referred", "complete_rows", "status", "combinations"]),
    ("model_error", &["taps_by_full_model"]),
    ("seconds", &["total", "open", "solve", "chart"]),
];

/// The run.json of the whole, with shared entries from the first part; row counts and the time of the merge are added later.
fn whole(parts: &[Part], out: &Path) -> Value {
    let mut run = parts[0].run.clone();
    let mut join = |(group, keys): (&str, &[&str]), both: fn(&Value, &Value) -> Value| {
        for key in keys {
            let values = parts.iter().map(|part| &part.run[group][key]).filter(|x| !x.is_null()).cloned();
            if let Some(all) = values.reduce(|a, b| both(&a, &b)) {
                run[group][key] = all;
            }
        }
    };
    SUMS.into_iter().for_each(|place| join(place, sum));
    for place in [("counts", "sweeps_max"), ("material_fit", "largest_gauge_strain")] {
        join((place.0, &[place.1]), |a, b| if a.as_f64() < b.as_f64() { b } else { a }.clone());
    }
    let of = |part: &Part, key: &str| part.run["counts"][key].as_f64().unwrap_or(0.0);
    let solved: f64 = parts.iter().map(|part| of(part, "solved")).sum();
    let spent: f64 = parts.iter().map(|part| of(part, "solved") * of(part, "sweeps_mean")).sum();
    run["counts"]["sweeps_mean"] = (if solved > 0.0 { spent / solved } else { 0.0 }).into();
    if !run["material_fit"].is_null() {
        let within = |part: &Part| part.run["material_fit"]["within_data_range"] != false;
        run["material_fit"]["within_data_range"] = parts.iter().all(within).into();
    }
    for entry in run["in_force"].as_array_mut().into_iter().flatten().filter(|e| e["key"] == "run.out") {
        entry["value"] = format!("{:?}", out.display().to_string()).into();
    }
    let mut warnings: Vec<&Value> = Vec::new();
    for text in parts.iter().flat_map(|part| part.run["warnings"].as_array().into_iter().flatten()) {
        if !warnings.contains(&text) {
            warnings.push(text);
        }
    }
    run["warnings"] = json!(warnings);
    for key in ["shard", "resumed", "files", "asked", "name", "handed_over"] {
        run.as_object_mut().map(|run| run.shift_remove(key));
    }
    // Entries of one device stay with its part.
    run["backend"].as_object_mut().map(|backend| backend.shift_remove("device"));
    let described = |part: &Part| {
        let (run, folder, shard) = (&part.run, part.folder.display().to_string(), part.shard.to_string());
        json!({
            "folder": folder, "part": shard, "designs": run["shard"]["designs"], "backend": run["backend"],
            "taps": run["counts"]["taps"], "handed_over": run["handed_over"], "seconds": run["seconds"]["total"], "files": run["files"],
        })
    };
    run["parts"] = parts.iter().map(described).collect();
    run
}

fn sum(a: &Value, b: &Value) -> Value {
    if let (Some(a), Some(b)) = (a.as_object(), b.as_object()) {
        let mut all = a.clone();
        for (word, n) in b {
            let n = all.get(word).map_or_else(|| n.clone(), |before| sum(before, n));
            all.insert(word.clone(), n);
        }
        all.sort_keys();
        return all.into();
    }
    match (a.as_u64().zip(b.as_u64()), a.as_f64().zip(b.as_f64())) {
        (Some((a, b)), _) => (a + b).into(),
        (_, Some((a, b))) => (a + b).into(),
        _ => Value::Null,
    }
}
