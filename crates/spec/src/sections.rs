//! Sections of a spec, with the values in force for keys that are left out.
//!
//! Structs of [`scene`](crate::scene) are read from sections and inline tables by serde: a field is the key of its name, if that holds a flag, a number,
//! a word, a text or a range. An `Option` is `None` where the key has no value in force.

use std::cell::RefCell;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Value};

use super::keys::Form;
use super::{Document, InputError, Item, Result, keys, model};
use crate::scene::{Estimate, Output, RankBy, Theory};

pub(super) fn rankable(sections: &Sections<'_>, estimate: &Estimate, output: &Output) -> Result<()> {
    let robust = sections.section("optimise").written("robust");
    let calibrated = robust.and_then(|robust| robust.child("calibrated"));
    let nominal = calibrated.is_some_and(|c| c.text().is_ok_and(|word| word == "nominal"));
    let error = matches!(output.by, RankBy::ErrorRms | RankBy::ErrorMax);
    if estimate.theory != Theory::Exact || !error || nominal {
        return Ok(());
    }
    let others = RankBy::WORDS.iter().map(|(name, _)| *name).filter(|name| !name.starts_with("error_"));
    let message = "with theory = \"exact\" the model inverts its own strains: beyond the peak there is no error to rank by";
    let allowed = others.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    sections.section("output").get("by")?.refuse(message, allowed)
}

#[derive(Debug, Clone)]
pub(super) struct Section<'a> {
    pub document: &'a Document<'a>,
    pub known: &'static keys::Section,
    pub span: super::reader::Span,
    pub user: Option<&'a DeTable<'a>>,
    pub more: Option<&'a DeTable<'a>>,
}

impl<'a> Section<'a> {
    pub fn dotted(&self, key: &str) -> String {
        format!("{}.{key}", self.known.name)
    }

    pub fn written(&self, key: &str) -> Option<Item<'a>> {
        let item = Item::written(self.document, self.dotted(key), self.user?.get(key)?);
        Some(item.of(self.known.key(key)))
    }

    /// The default of `key`; those of `[optimise]` hold for a command that searches.
    pub fn default(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        let usual = self.known.key(key).filter(|_| self.known.name != "optimise" || self.more.is_some());
        self.more.and_then(|more| more.get(key)).or_else(|| usual?.default)
    }

    pub fn get(&self, key: &str) -> Result<Item<'a>> {
        let usual = || {
            let item = Item::new(self.document, self.dotted(key), None, self.default(key)?.get_ref());
            Some(item.of(self.known.key(key)))
        };
        self.written(key).or_else(usual).ok_or_else(|| self.missing(key))
    }

    pub fn optional<T>(&self, key: &str, read: impl FnOnce(&Item<'a>) -> Result<T>) -> Result<Option<T>> {
        self.written(key).as_ref().map(read).transpose()
    }

    /// The struct of this section's keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T> {
        read(self.known, |key| self.get(key).ok())
    }

    fn missing(&self, key: &str) -> InputError {
        let (name, known) = (self.known.name, self.known.key(key).cloned().unwrap_or_default());
        let unit = if known.unit.is_empty() { "" } else { ", " };
        let line = format!("{key} = {} ({}{unit}{})", known.example, known.what, known.unit);
        let message = match self.user {
            Some(_) => format!("{key} is missing from [{name}]; add a line such as {line}"),
            None => format!("[{name}] with {key} is missing; add [{name}] and a line such as {line}"),
        };
        self.document.error(self.span.clone(), message).key(self.dotted(key))
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
                let outside = ends.iter().any(|end| !interval.holds(*end));
                self.wrong_if(outside || ends[0] >= ends[1], "this is not a range")?;
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

/// Values in force for keys that are left out, before the defaults of `keys.toml`: TOML of `texts`, of which later ones win.
pub(super) fn more<'m>(texts: &[&'m str], user: &DeTable<'_>) -> DeTable<'m> {
    let table = |text| DeTable::parse(text).expect("defaults are valid TOML").into_inner();
    let mut all = table(if model::is_asked(user) { model::ALL } else { "" });
    for (name, section) in texts.iter().copied().flat_map(table) {
        match (all.get_mut(&**name.get_ref()).map(Spanned::get_mut), section.get_ref()) {
            (Some(DeValue::Table(known)), DeValue::Table(added)) => known.extend(added.clone()),
            _ => drop(all.insert(name, section)),
        }
    }
    all
}

pub(super) const SAMPLER: &str = "sobol";
pub(super) const SEED: u64 = 0;

pub(super) struct Sections<'a> {
    document: &'a Document<'a>,
    user: &'a DeTable<'a>,
    more: &'a DeTable<'a>,
    pub warnings: RefCell<Vec<String>>,
}

impl<'a> Sections<'a> {
    pub fn new(document: &'a Document<'a>, user: &'a DeTable<'a>, more: &'a DeTable<'a>) -> Result<Self> {
        let top: Vec<&str> = keys::sections().map(|s| s.name).chain(["format"]).collect();
        for (key, value) in user {
            let name: &str = key.get_ref();
            let item = Item::written(document, name.to_owned(), value);
            if !top.contains(&name) {
                return Err(unknown(document, None, key, value, &top));
            }
            if name == "format" {
                continue;
            }
            let Some(table) = value.get_ref().as_table() else {
                let message =
                    format!("{name} is a section: write [{name}] on a line of its own, its keys below");
                return Err(item.error(message));
            };
            let keys = keys::section(name).names();
            if let Some((key, value)) = table.iter().find(|(key, _)| !keys.contains(&&**key.get_ref())) {
                return Err(unknown(document, Some(name), key, value, &keys));
            }
        }
        Ok(Self { document, user, more, warnings: RefCell::default() })
    }

    pub fn warn(&self, words: impl IntoIterator<Item = String>) {
        self.warnings.borrow_mut().extend(words);
    }

    pub fn section(&self, name: &'static str) -> Section<'a> {
        let user = self.user.get_key_value(name);
        Section {
            document: self.document,
            known: keys::section(name),
            span: user.map(|(key, _)| key.span()),
            user: user.and_then(|(_, value)| value.get_ref().as_table()),
            more: self.more.get(name).and_then(|value| value.get_ref().as_table()),
        }
    }

    /// Stand-in for tuples in memory.
    pub fn of_tuples(&self) -> Item<'a> {
        static NOTHING: DeValue<'static> = DeValue::Boolean(true);
        Item::new(self.document, "tuples".to_owned(), None, &NOTHING)
    }

    pub fn format(&self) -> Option<Item<'a>> {
        let item = Item::written(self.document, "format".to_owned(), self.user.get("format")?);
        Some(item.of(keys::section("").key("format")))
    }

    /// Every value in force: dotted key, value as TOML, true if the user wrote it.
    pub fn in_force(&self) -> Vec<(String, String, bool)> {
        let mut all = Vec::new();
        let mut note = |key: String, user: Option<&DeValue<'_>>, default: Option<&DeValue<'_>>| {
            let Some(value) = user.or(default) else { return };
            all.push((key.clone(), toml_text(value), user.is_some()));
            let sampled = user.and_then(DeValue::as_table).filter(|t| t.contains_key("samples"));
            for (name, text) in [("sampler", format!("{SAMPLER:?}")), ("seed", SEED.to_string())] {
                if sampled.is_some_and(|table| !table.contains_key(name)) {
                    all.push((format!("{key}.{name}"), text, false));
                }
            }
        };
        let format = self.user.get("format").map(Spanned::get_ref);
        note("format".to_owned(), format, keys::section("").keys[0].default.map(Spanned::get_ref));
        for known in keys::sections() {
            let section = self.section(known.name);
            for key in &known.keys {
                let user = section.user.and_then(|t| t.get(key.name)).map(Spanned::get_ref);
                note(section.dotted(key.name), user, section.default(key.name).map(Spanned::get_ref));
            }
        }
        all
    }
}

fn unknown<'a>(
    document: &'a Document<'a>,
    section: Option<&str>,
    key: &Spanned<std::borrow::Cow<'a, str>>,
    value: &Spanned<DeValue<'a>>,
    known: &[&str],
) -> InputError {
    let name: &str = key.get_ref();
    let home = keys::sections().find(|s| s.key(name).is_some()).map(|s| s.name);
    let hint = match home {
        Some(home) => format!("; it belongs under [{home}]"),
        None => hint(name, known),
    };
    let (dotted, place) = match section {
        Some(section) => (format!("{section}.{name}"), format!(" in [{section}]")),
        None => (name.to_owned(), String::new()),
    };
    let what = if value.get_ref().is_table() && section.is_none() { "section" } else { "key" };
    let error = document.error(Some(key.span()), format!("unknown {what}{place}{hint}")).key(dotted);
    let error = if what == "key" { error.value(document.excerpt(value.span())) } else { error };
    error.allowed(known.join(", "))
}

pub(super) fn hint(word: &str, known: &[&str]) -> String {
    crate::error::nearest(word, known).map_or_else(String::new, |name| format!("; did you mean {name}?"))
}

pub(super) fn toml_text(value: &DeValue<'_>) -> String {
    let join = |parts: Vec<String>| parts.join(", ");
    match value {
        DeValue::String(text) => Value::String(text.clone().into_owned()).to_string(),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(date) => date.to_string(),
        DeValue::Array(list) => format!("[{}]", join(list.iter().map(|v| toml_text(v.get_ref())).collect())),
        DeValue::Table(table) => {
            let entry = |(key, value): (&Spanned<std::borrow::Cow<'_, str>>, &Spanned<DeValue<'_>>)| {
                format!("{} = {}", key.get_ref(), toml_text(value.get_ref()))
            };
            format!("{{ {} }}", join(table.iter().map(entry).collect()))
        }
    }
}
