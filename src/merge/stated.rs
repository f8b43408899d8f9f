//! What the run.json of a part states, checked before anything is made of it.

use std::path::Path;

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Listed, is_result_name};

/// What a value must be: of a part of a sweep a count or a number must be there, the others may be missing, and of a search all.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Must {
    Count,
    Number,
    Spare,
    SpareNumber,
    Object,
    /// An object of counts.
    Counts,
}

/// What the whole has in its place.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Whole {
    Sum,
    Largest,
    /// What a part has, or something else.
    Own,
}

use Must::{Count, Counts, Number, Object, Spare, SpareNumber};
use Whole::{Largest, Own, Sum};

/// Values that a merge uses, in the order in which they are checked.
pub(super) const VALUES: [(&str, Must, Whole); 28] = [
    ("material_fit", Object, Own),
    ("model_error", Object, Own),
    ("counts.taps", Count, Sum),
    ("counts.solved", Count, Sum),
    ("counts.interpolated", Count, Sum),
    ("counts.referred", Count, Sum),
    ("counts", Object, Own),
    ("counts.complete_rows", Spare, Sum),
    ("counts.evaluations", Spare, Sum),
    ("counts.evaluations_sensitivity", Spare, Sum),
    ("counts.starts", Spare, Sum),
    ("counts.status", Counts, Sum),
    ("counts.combinations", Counts, Sum),
    ("counts.sweeps_mean", Number, Own),
    ("counts.sweeps_max", Number, Largest),
    ("shard.top", Spare, Own),
    ("shard.candidates", Spare, Own),
    ("shard.distances_each", Spare, Own),
    ("shard.directions_each", Spare, Own),
    ("model_error.taps_by_full_model", Spare, Sum),
    ("material_fit.largest_gauge_strain", SpareNumber, Largest),
    ("seconds.total", Number, Sum),
    ("seconds.open", Number, Sum),
    ("seconds.solve", Number, Sum),
    ("seconds.chart", SpareNumber, Sum),
    ("seconds", Object, Own),
    ("backend", Object, Own),
    ("result", Object, Own),
];

/// The value at a dotted key; null where there is none.
pub(super) fn at<'a>(run: &'a Value, key: &str) -> &'a Value {
    key.split('.').fold(run, |value, key| &value[key])
}

fn wrong(folder: &Path, (key, value): (&str, &Value), why: &str, allowed: &str) -> Error {
    let error = InputError::new(format!("the run.json of this part {why}"));
    let at = folder.join("run.json").display().to_string();
    error.at(at, None).key(key).value(value).allowed(allowed).into()
}

/// Fails unless the values of `run`, that of a part of a sweep or of a search, are what they must be.
pub(super) fn check(folder: &Path, run: &Value, searched: bool) -> Result<(), Error> {
    VALUES.iter().try_for_each(|(key, must, _)| one(folder, (key, at(run, key)), *must, searched))
}

fn one(folder: &Path, (key, value): (&str, &Value), must: Must, searched: bool) -> Result<(), Error> {
    /// Largest count: up to it, every whole number is one of f64, as JSON has them.
    const MOST: u64 = 1 << 53;
    let whole = format!("a whole number, 0 … {MOST}");
    let (fits, why, allowed) = match must {
        Count | Spare => (value.as_u64().is_some_and(|n| n <= MOST), "states no such count", &*whole),
        Number | SpareNumber => {
            (value.as_f64().is_some_and(|x| x >= 0.0), "states no such number", "a number ≥ 0")
        }
        Object => (value.is_object(), "states no values", "an object of keys and values"),
        Counts => (value.is_object(), "states no counts of its words", "an object of whole numbers"),
    };
    let spare = value.is_null() && (searched || !matches!(must, Count | Number));
    if !(fits || spare) {
        return Err(wrong(folder, (key, value), why, allowed));
    }
    let mut words = value.as_object().filter(|_| must == Counts).into_iter().flatten();
    words.try_for_each(|(word, n)| one(folder, (&format!("{key}.{word}"), n), Count, false))
}

/// The files that `run` lists: each by its name in the folder, once, and all that are `wanted`.
pub(super) fn files(folder: &Path, run: &Value, wanted: &[String]) -> Result<Vec<Listed>, Error> {
    let value = &run["files"];
    let shape = "a list of { name, blake3, bytes }";
    let all: Vec<Listed> = serde_json::from_value(value.clone())
        .map_err(|_| wrong(folder, ("files", value), "lists no files", shape))?;
    for (i, Listed { name, blake3, .. }) in all.iter().enumerate() {
        let is_hash = blake3.len() == 64 && blake3.bytes().all(|b| b.is_ascii_hexdigit());
        let (key, value, why, allowed) = if !is_result_name(name) {
            ("name", name, "names no file of a result", "the name of a file in its folder")
        } else if all[..i].iter().any(|other| other.name == *name) {
            ("name", name, "lists a file twice", "each file once")
        } else if !is_hash {
            ("blake3", blake3, "states no hash", "64 hexadecimal digits")
        } else {
            continue;
        };
        let place = (&*format!("files[{i}].{key}"), &value.as_str().into());
        return Err(wrong(folder, place, why, allowed));
    }
    if wanted.iter().all(|name| all.iter().any(|file| file.name == *name)) {
        return Ok(all);
    }
    let names: Value = all.iter().map(|file| file.name.as_str()).collect();
    let allowed = format!("the files of this part: {}", wanted.join(", "));
    Err(wrong(folder, ("files", &names), "does not list all files of the part", &allowed))
}
