//! Parts as they lie on the disk, and whether they are those of one sweep.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::Value;

use super::checked::Checked;
use super::stated::Stated;
use crate::error::{Error, InputError};
use crate::sink::folder::{Listed, WORK, names_in, read_run};
use crate::sink::format::TableFormat;
use crate::sink::shard::Shard;
use crate::sink::table::Table;

/// Counts that every part states.
const COUNTS: [&str; 7] = [
    "counts.taps",
    "counts.solved",
    "counts.interpolated",
    "counts.referred",
    "counts.tuples",
    "counts.designs",
    "counts.distances",
];
/// Counts that only some sweeps have.
const SPARE: [&str; 6] = [
    "counts.complete_rows",
    "shard.top",
    "shard.candidates",
    "shard.distances_each",
    "shard.directions_each",
    "model_error.taps_by_full_model",
];
/// Numbers that every part states.
const NUMBERS: [&str; 5] =
    ["counts.sweeps_mean", "counts.sweeps_max", "seconds.total", "seconds.open", "seconds.solve"];

/// A whole part.
#[derive(Debug)]
pub(super) struct Part {
    pub folder: PathBuf,
    pub shard: Shard,
    /// Name of its spec.
    pub name: String,
    pub run: Value,
    pub format: TableFormat,
    pub tables: Vec<Table>,
    listed: Vec<Listed>,
}

impl Part {
    /// The files of the part.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let names = self.listed.iter().map(|file| file.name.as_str()).chain(["run.json"]);
        names.map(|name| self.folder.join(name))
    }

    /// The file `name`, to be read.
    pub fn file(&self, name: &str) -> Result<Checked, Error> {
        let missing = || refuse(&self.folder, format!("its run.json lists no {name}"), "a whole part");
        Checked::open(&self.folder, self.listed.iter().find(|f| f.name == name).ok_or_else(missing)?)
    }

    /// A number of its description.
    pub fn number(&self, key: &str) -> Option<u64> {
        self.run["shard"][key].as_u64()
    }
}

pub(super) fn refuse(folder: &Path, why: impl Into<String>, allowed: &str) -> Error {
    InputError::new(why).key("merge").value(folder.display()).allowed(allowed).into()
}

/// Why what was named cannot be read: a mistake of whoever named it, or the machine's.
fn absent(folder: &Path, e: std::io::Error) -> Error {
    let allowed = "folders shard-i-of-n, or the folder that holds them";
    match e.kind() {
        ErrorKind::NotFound => refuse(folder, "there is no such folder", allowed),
        ErrorKind::NotADirectory => refuse(folder, "this is not a folder", allowed),
        _ => Error::io(folder, e),
    }
}

/// The folders of parts in `folders` or right below them, by number.
pub(super) fn found(folders: &[PathBuf]) -> Result<Vec<(Shard, PathBuf)>, Error> {
    let mut all: Vec<(Shard, PathBuf)> = Vec::new();
    for folder in folders {
        let named = |path: &Path| path.file_name().and_then(|n| n.to_str()).and_then(Shard::of_folder);
        // As it is called, also where it was named `.`.
        let real = folder.canonicalize().map_err(|e| absent(folder, e))?;
        if let Some(shard) = named(&real) {
            all.push((shard, folder.clone()));
            continue;
        }
        let before = all.len();
        for name in names_in(folder).map_err(|e| absent(folder, e))? {
            let path = folder.join(name);
            all.extend(named(&path).filter(|_| path.is_dir()).map(|shard| (shard, path)));
        }
        if all.len() == before {
            let allowed = "folders shard-i-of-n, or the folder that holds them";
            return Err(refuse(folder, "no part of a sweep is here", allowed));
        }
    }
    all.sort_by_key(|(shard, _)| (shard.of, shard.index));
    let ((first, folder), (last, other)) = (&all[0], &all[all.len() - 1]);
    if first.of != last.of {
        let why = format!("these are parts of {} and of {} ({})", first.of, last.of, other.display());
        return Err(refuse(folder, why, "the folders of the parts that belong together"));
    }
    if let Some(pair) = all.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let why = format!("part {} is there twice, also in {}", pair[0].0, pair[1].1.display());
        return Err(refuse(&pair[0].1, why, "each part once"));
    }
    let missing: Vec<String> = (1..=first.of)
        .filter(|i| all.binary_search_by_key(i, |(shard, _)| shard.index).is_err())
        .map(|i| i.to_string())
        .collect();
    if !missing.is_empty() {
        let shown = missing.iter().take(20).cloned().collect::<Vec<_>>().join(", ");
        let why = format!("{} of {} parts are missing: {shown}", missing.len(), first.of);
        return Err(refuse(folder, why, &format!("all parts: sweep --shard i/{} makes part i", first.of)));
    }
    Ok(all)
}

/// The parts in these folders, all whole, unedited and of one sweep.
pub(super) fn checked(found: &[(Shard, PathBuf)]) -> Result<Vec<Part>, Error> {
    let parts: Vec<Part> =
        found.iter().map(|(shard, folder)| read(*shard, folder)).collect::<Result<_, _>>()?;
    let first = &parts[0];
    for part in &parts[1..] {
        for (key, what) in [
            (&["version"][..], "version of the program"),
            (&["backend", "name"], "backend"),
            (&["backend", "adapter"], "adapter"),
            (&["backend", "precision"], "precision"),
            (&["backend", "tolerance"], "tolerance"),
            (&["shard", "format"], "format of its tables"),
            (&["shard", "whole"], "spec (values in force)"),
            (&["shard", "tables"], "list of tables"),
            (&["shard", "top"], "number of rows that are kept"),
            (&["shard", "candidates"], "number of candidates"),
            (&["shard", "distances_each"], "number of distances"),
            (&["shard", "directions_each"], "number of directions"),
            // The tables name it, and those of the whole can name but one.
            (&["spec", "hash"], "text of the spec, though its values are the same"),
        ] {
            let of = |run: &Value| key.iter().fold(run.clone(), |value, key| value[*key].clone());
            let (one, other) = (of(&first.run), of(&part.run));
            if one != other {
                let beside = first.folder.display();
                let why = format!("this part and {beside} are of another {what}: {other} and {one}");
                let allowed = "parts of one spec, version, backend, precision and tolerance";
                return Err(refuse(&part.folder, why, allowed));
            }
        }
    }
    let names = |part: &Part| part.listed.iter().map(|file| file.name.clone()).collect::<Vec<_>>();
    if let Some(part) = parts.iter().find(|part| names(part) != names(first)) {
        let why = format!("this part lists other files than {}", first.folder.display());
        return Err(refuse(&part.folder, why, &names(first).join(", ")));
    }
    unedited(&parts)?;
    Ok(parts)
}

fn read(shard: Shard, folder: &Path) -> Result<Part, Error> {
    let again = format!("the whole part: sweep --shard {shard} makes it, or goes on with it");
    let path = folder.join("run.json");
    let text = match read_run(folder) {
        Ok(Some(text)) => text,
        other => {
            let why = match path.symlink_metadata() {
                Ok(m) if !m.is_file() => "the run.json of this part is a link, a folder or a pipe",
                _ if folder.join(WORK).is_dir() => "this part is unfinished",
                _ => "this part has no run.json",
            };
            return Err(match other {
                Err(Error::Input(e)) if path.is_file() => e.into(),
                _ => refuse(folder, format!("{why} ({shard})"), &again),
            });
        }
    };
    let run: Value = serde_json::from_str(&text).unwrap_or_default();
    let part = || {
        let of = |key: &str| run["shard"][key].as_u64();
        let same = (of("index")?, of("of")?) == (shard.index.into(), shard.of.into());
        let word = run["shard"]["format"].as_str()?;
        let format = TableFormat::WORDS.iter().find(|(name, _)| *name == word)?.1;
        let tables = run["shard"]["tables"].as_array()?.iter();
        let named = |name: &Value| Table::ALL.into_iter().find(|t| name == t.name());
        let tables = tables.map(named).collect::<Option<_>>()?;
        let name = run["name"].as_str().filter(|_| same && run["command"] == "sweep")?.to_owned();
        let listed = Vec::new();
        Some(Part { folder: folder.to_owned(), shard, name, run: run.clone(), format, tables, listed })
    };
    let part = part().ok_or_else(|| {
        refuse(folder, format!("its run.json is not that of part {shard} of a sweep"), &again)
    })?;
    let stated = Stated::of(folder, &run);
    stated.objects(&["material_fit", "model_error"])?;
    stated.counts(&COUNTS, false)?;
    stated.counts(&SPARE, true)?;
    stated.counts_in("counts.status")?;
    if !run["counts"]["combinations"].is_null() {
        stated.counts_in("counts.combinations")?;
    }
    stated.numbers(&NUMBERS)?;
    let wanted: Vec<String> = part.tables.iter().map(|table| table.file(part.format)).collect();
    Ok(Part { listed: stated.files(&wanted)?, ..part })
}

/// Fails unless each file of `parts` is what was written.
pub(super) fn unedited(parts: &[Part]) -> Result<(), Error> {
    let edited =
        |part: &Part| part.listed.iter().try_for_each(|file| Checked::open(&part.folder, file)?.end());
    parts.par_iter().try_for_each(edited)
}

/// In what the parts differ though they are of one sweep: their tables are within the tolerance then, but perhaps not the very bytes.
pub(super) fn differences(parts: &[Part]) -> Vec<String> {
    let keys = [
        ("driver", &["backend", "driver"][..]),
        ("instructions", &["backend", "instructions"]),
        ("commit", &["commit"]),
    ];
    let mut all = Vec::new();
    for (what, key) in keys {
        let mut values: BTreeMap<String, u32> = BTreeMap::new();
        for part in parts {
            let value = key.iter().fold(&part.run, |value, key| &value[*key]);
            *values.entry(value.as_str().unwrap_or("none").to_owned()).or_default() += 1;
        }
        if values.len() > 1 {
            let each: Vec<String> = values.iter().map(|(value, n)| format!("{value} ({n} parts)")).collect();
            all.push(format!(
                "parts were made with several {what}s: {}. Values keep the tolerance, but may differ in last digits from those of one machine",
                each.join(", ")
            ));
        }
    }
    all
}
