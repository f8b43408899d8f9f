//! Parts on the disk, and checks that they belong to one sweep.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Listed, WORK, hash_file, is_sealed, listed, names_in, open_of_result, read_run};
use crate::sink::{Shard, TableFormat};

#[derive(Debug)]
pub(super) struct Part {
    pub folder: PathBuf,
    pub shard: Shard,
    pub run: Value,
    pub format: TableFormat,
    pub listed: Vec<Listed>,
}

impl Part {
    pub fn files(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let names = self.listed.iter().map(|file| file.name.as_str()).chain(["run.json"]);
        names.map(|name| self.folder.join(name))
    }

    pub fn lists(&self, name: &str) -> bool {
        self.listed.iter().any(|file| file.name == name)
    }

    pub fn file(&self, name: &str) -> Result<(PathBuf, File), Error> {
        if !self.lists(name) {
            return Err(refuse(&self.folder, format!("its run.json lists no {name}"), "a whole part"));
        }
        let path = self.folder.join(name);
        match open_of_result(&path)? {
            Some(file) => Ok((path, file)),
            None => Err(edited(&self.folder, name, "is missing")),
        }
    }
}

pub(super) fn refuse(folder: &Path, why: impl Into<String>, allowed: &str) -> Error {
    InputError::new(why).key("merge").value(folder.display()).allowed(allowed).into()
}

fn edited(folder: &Path, name: &str, why: &str) -> Error {
    let again = "the part as it was written; the command that made it makes it again with --force";
    refuse(folder, format!("{} {why}", folder.join(name).display()), again)
}

const FOLDERS: &str = "folders shard-i-of-n, or the folder that holds them";

fn absent(folder: &Path, e: std::io::Error) -> Error {
    match e.kind() {
        ErrorKind::NotFound => refuse(folder, "there is no such folder", FOLDERS),
        ErrorKind::NotADirectory => refuse(folder, "this is not a folder", FOLDERS),
        _ => Error::io(folder, e),
    }
}

/// The parts in `folders` or directly below them, by number, checked to be complete and of one sweep.
pub(super) fn all(folders: &[PathBuf]) -> Result<Vec<Part>, Error> {
    let found = found(folders)?;
    let parts = found.iter().map(|(shard, folder)| read(*shard, folder)).collect::<Result<Vec<_>, _>>()?;
    let (first, of) =
        (&parts[0], |part: &Part, place: &str| part.run.pointer(place).cloned().unwrap_or_default());
    for part in &parts[1..] {
        if let Some((place, what)) = SAME.iter().find(|(place, _)| of(first, place) != of(part, place)) {
            let (here, there) = (of(part, place), of(first, place));
            let other = first.folder.display();
            let why = format!("this part and {other} are of another {what}: {here} and {there}");
            let allowed = "parts of one spec, version, backend, precision and tolerance";
            return Err(refuse(&part.folder, why, allowed));
        }
    }
    Ok(parts)
}

fn found(folders: &[PathBuf]) -> Result<Vec<(Shard, PathBuf)>, Error> {
    let mut all: Vec<(Shard, PathBuf)> = Vec::new();
    for folder in folders {
        let named = |path: &Path| path.file_name().and_then(|n| n.to_str()).and_then(Shard::of_folder);
        // The real name, also of `.`.
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
            return Err(refuse(folder, "no part of a sweep is here", FOLDERS));
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
    let is_there = |i: &u32| all.binary_search_by_key(i, |(shard, _)| shard.index).is_ok();
    let missing: Vec<String> = (1..=first.of).filter(|i| !is_there(i)).map(|i| i.to_string()).collect();
    if !missing.is_empty() {
        let shown = missing[..missing.len().min(20)].join(", ");
        let why = format!("{} of {} parts are missing: {shown}", missing.len(), first.of);
        return Err(refuse(folder, why, &format!("all parts: sweep --shard i/{} makes part i", first.of)));
    }
    Ok(all)
}

const SAME: [(&str, &str); 8] = [
    ("/version", "version of the program"),
    ("/backend/name", "backend"),
    ("/backend/adapter", "adapter"),
    ("/backend/precision", "precision"),
    ("/backend/tolerance", "tolerance"),
    ("/shard/whole", "spec (values in force)"),
    ("/shard/candidates", "number of candidates"),
    // The tables contain it, so the whole can have only one.
    ("/spec/hash", "text of the spec, though its values are the same"),
];

fn read(shard: Shard, folder: &Path) -> Result<Part, Error> {
    let again = format!("the whole part: the same command with --shard {shard} makes it, or goes on with it");
    let text = read_run(folder)?.ok_or_else(|| {
        let why = match folder.join(WORK).is_dir() {
            true => "this part is unfinished",
            false => "this part has no run.json",
        };
        refuse(folder, format!("{why} ({shard})"), &again)
    })?;
    let run: Value = serde_json::from_str(&text).unwrap_or_default();
    let number = |key: &str| run["shard"][key].as_u64();
    let own = [Some(shard.index.into()), Some(shard.of.into())] == ["index", "of"].map(number);
    if !own || run["command"] != "sweep" || !run["name"].is_string() {
        return Err(refuse(folder, format!("its run.json is not that of part {shard} of a sweep"), &again));
    }
    // Its counts go into the whole, so it must be unedited.
    let Some(listed) = listed(&run).filter(|_| is_sealed(&text, &run)) else {
        return Err(edited(folder, "run.json", "is not what this version of the program wrote"));
    };
    let format = TableFormat::named(run["shard"]["format"].as_str().unwrap_or_default());
    Ok(Part { folder: folder.to_owned(), shard, run, format, listed })
}

pub(super) fn unedited(parts: &[Part]) -> Result<(), Error> {
    let each = |part: &Part| {
        part.listed.iter().try_for_each(|listed| {
            let (path, file) = part.file(&listed.name)?;
            match hash_file(file).map_err(|e| Error::io(path, e))? == listed.blake3 {
                true => Ok(()),
                false => Err(edited(&part.folder, &listed.name, "is not what was written")),
            }
        })
    };
    parts.par_iter().try_for_each(each)
}

/// Differences between parts of one sweep: the tables are then within the tolerance, but perhaps not byte-identical.
pub(super) fn differences(parts: &[Part]) -> Vec<String> {
    let of = |place: &str| {
        let mut values: BTreeMap<&str, u32> = BTreeMap::new();
        for part in parts {
            let value = part.run.pointer(place).and_then(Value::as_str).unwrap_or("none");
            *values.entry(value).or_default() += 1;
        }
        let each: Vec<String> = values.iter().map(|(value, n)| format!("{value} ({n} parts)")).collect();
        let (what, each) = (place.trim_start_matches("/backend/").trim_start_matches('/'), each.join(", "));
        let told = format!(
            "parts were made with several {what}s: {each}. Values keep the tolerance, but may differ in last digits from those of one machine"
        );
        (values.len() > 1).then_some(told)
    };
    ["/backend/driver", "/backend/instructions", "/commit"].into_iter().filter_map(of).collect()
}
