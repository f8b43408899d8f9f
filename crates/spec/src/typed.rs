//! Structs of [`scene`](crate::scene) from sections and inline tables, by serde: a field is the key of its name, if that holds a flag, a number, a word, a
//! text or a range. An `Option` is `None` where the key has no value in force.

use serde::de::DeserializeOwned;
use toml::Value;

use super::keys::{self, Form};
use super::{Item, Result, Section};
use crate::error::InputError;

impl<'a> Section<'a> {
    /// The struct of this section's keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T> {
        read(self.known, |key| self.get(key).ok())
    }
}

impl<'a> Item<'a> {
    /// The struct of this inline table's keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T> {
        self.only_known()?;
        self.table()
            .map_or_else(|| self.wrong("no table is asked for"), |known| read(known, |key| self.child(key)))
    }

    /// The value by the form of its key; `None` for other forms.
    fn plain(&self) -> Result<Option<Value>> {
        let Some(known) = self.known else { return Ok(None) };
        Ok(Some(match known.form {
            Form::Flag => self.flag()?.into(),
            Form::Text => self.text()?.into(),
            Form::Whole(..) => self.whole()?.cast_signed().into(),
            Form::Number(_) => self.ranged()?.into(),
            Form::Words(_) => self.own_word()?.into(),
            Form::Ends(interval) => {
                let ends: [f64; 2] = self.numbers()?;
                if !ends.iter().all(|end| interval.holds(*end)) || ends[0] >= ends[1] {
                    return self.wrong("this is not a range");
                }
                ends.to_vec().into()
            }
            _ => return Ok(None),
        }))
    }
}

fn read<'a, T: DeserializeOwned>(known: &keys::Section, get: impl Fn(&str) -> Option<Item<'a>>) -> Result<T> {
    let mut table = toml::Table::new();
    for item in known.keys.iter().filter_map(|key| get(key.name)) {
        if let (Some(key), Some(value)) = (item.known, item.plain()?) {
            table.insert(key.name.to_owned(), value);
        }
    }
    table.try_into().map_err(|e| InputError::new(e.to_string()))
}
