//! What the run.json of a part states, checked before anything is made of it.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, InputError};
use crate::sink::folder::{Listed, is_result_name};

/// Largest count: up to it, every whole number is one of f64, as JSON has them.
const MOST: u64 = 1 << 53;

/// The run.json of a part.
pub(super) struct Stated<'a> {
    path: PathBuf,
    run: &'a Value,
}

impl<'a> Stated<'a> {
    pub fn of(folder: &Path, run: &'a Value) -> Self {
        Self { path: folder.join("run.json"), run }
    }

    fn wrong(&self, key: &str, value: &Value, why: &str, allowed: impl Into<String>) -> Error {
        let error = InputError::new(format!("the run.json of this part {why}"));
        error.at(self.path.display().to_string(), None).key(key).value(value).allowed(allowed).into()
    }

    /// The value at the dotted `key`; null where there is none.
    fn at(&self, key: &str) -> &'a Value {
        key.split('.').fold(self.run, |value, key| &value[key])
    }

    /// Fails unless each of `keys` is a count; one that is `spare` may be missing.
    pub fn counts(&self, keys: &[&str], spare: bool) -> Result<(), Error> {
        let is_count = |value: &Value| value.as_u64().is_some_and(|n| n <= MOST);
        keys.iter().try_for_each(|key| match self.at(key) {
            Value::Null if spare => Ok(()),
            value if is_count(value) => Ok(()),
            value => {
                Err(self.wrong(key, value, "states no such count", format!("a whole number, 0 … {MOST}")))
            }
        })
    }

    /// As [`Self::counts`], of each entry of the object at `key`.
    pub fn counts_in(&self, key: &str) -> Result<(), Error> {
        let all = self.at(key).as_object().ok_or_else(|| {
            self.wrong(key, self.at(key), "states no counts of its words", "an object of whole numbers")
        })?;
        all.keys().try_for_each(|word| self.counts(&[&format!("{key}.{word}")], false))
    }

    /// Fails unless each of `keys` that is there is an object.
    pub fn objects(&self, keys: &[&str]) -> Result<(), Error> {
        match keys.iter().find(|key| !(self.at(key).is_object() || self.at(key).is_null())) {
            None => Ok(()),
            Some(key) => {
                Err(self.wrong(key, self.at(key), "states no values", "an object of keys and values"))
            }
        }
    }

    /// Fails unless each of `keys` is a number that is not negative.
    pub fn numbers(&self, keys: &[&str]) -> Result<(), Error> {
        let bad = |key: &&&str| !self.at(key).as_f64().is_some_and(|x| x >= 0.0);
        match keys.iter().find(bad) {
            None => Ok(()),
            Some(key) => Err(self.wrong(key, self.at(key), "states no such number", "a number ≥ 0")),
        }
    }

    /// The files it lists: each by its name in the folder, once, and all that are `wanted`.
    pub fn files(&self, wanted: &[String]) -> Result<Vec<Listed>, Error> {
        let value = self.at("files");
        let shape = "a list of { name, blake3, bytes }";
        let all: Vec<Listed> = serde_json::from_value(value.clone())
            .map_err(|_| self.wrong("files", value, "lists no files", shape))?;
        for (i, file) in all.iter().enumerate() {
            let wrong = |key: &str, value: &str, why, allowed| {
                Err(self.wrong(&format!("files[{i}].{key}"), &value.into(), why, allowed))
            };
            let (name, hash) = (file.name.as_str(), file.blake3.as_str());
            if !is_result_name(name) {
                return wrong("name", name, "names no file of a result", "the name of a file in its folder");
            }
            if all[..i].iter().any(|other| other.name == name) {
                return wrong("name", name, "lists a file twice", "each file once");
            }
            if hash.len() != 64 || !hash.bytes().all(|b| b.is_ascii_hexdigit()) {
                return wrong("blake3", hash, "states no hash", "64 hexadecimal digits");
            }
        }
        let listed = |name: &String| all.iter().any(|file| file.name == *name);
        if wanted.iter().all(listed) {
            return Ok(all);
        }
        let names: Value = all.iter().map(|file| file.name.as_str()).collect();
        let allowed = format!("the files of this part: {}", wanted.join(", "));
        Err(self.wrong("files", &names, "does not list all files of the part", allowed))
    }
}
