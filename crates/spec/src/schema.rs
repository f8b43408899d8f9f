//! A spec whose sections and keys are known, what stands for keys that are left out, and what to say about unknown ones.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys;
use super::reader::{Document, Item, Result};
use super::sections::Section;
use super::solid;

/// TOML in `texts`, beside the defaults of `keys.toml`: values in force where the user says nothing. Later texts win.
pub(super) fn more<'m>(texts: &[&'m str], user: &DeTable<'_>) -> DeTable<'m> {
    let table = |text| DeTable::parse(text).expect("defaults are valid TOML").into_inner();
    let mut all = table(if solid::is_asked(user) { solid::ALL } else { "" });
    for (name, section) in texts.iter().copied().flat_map(table) {
        match (all.get_mut(&**name.get_ref()).map(Spanned::get_mut), section.get_ref()) {
            (Some(DeValue::Table(known)), DeValue::Table(added)) => known.extend(added.clone()),
            _ => drop(all.insert(name, section)),
        }
    }
    all
}

pub(super) const SAMPLER: &str = "sobol";
/// Default seed of a sampled axis.
pub(super) const SEED: u64 = 0;

/// A parsed spec whose sections and keys are all known.
pub(super) struct Sections<'a> {
    document: &'a Document<'a>,
    user: &'a DeTable<'a>,
    /// What else stands for keys that are left out.
    more: &'a DeTable<'a>,
}

impl<'a> Sections<'a> {
    /// Checks the names of all sections and keys.
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
            for (key, value) in table {
                if !keys.contains(&&**key.get_ref()) {
                    return Err(unknown(document, Some(name), key, value, &keys));
                }
            }
        }
        Ok(Self { document, user, more })
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

    /// What stands for tuples that are in memory.
    pub fn of_tuples(&self) -> Item<'a> {
        static NOTHING: DeValue<'static> = DeValue::Boolean(true);
        Item::nowhere(self.document, "tuples", &NOTHING)
    }

    pub fn format(&self) -> Option<Item<'a>> {
        let item = Item::written(self.document, "format".to_owned(), self.user.get("format")?);
        Some(item.of(keys::section("").key("format")))
    }

    /// Every value in force: dotted key, value as TOML, whether the user wrote it.
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
) -> crate::error::InputError {
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

/// "; did you mean …?" if one of `known` is close to `word`.
pub(super) fn hint(word: &str, known: &[&str]) -> String {
    crate::error::nearest(word, known).map_or_else(String::new, |name| format!("; did you mean {name}?"))
}

/// A value written as TOML on one line.
pub(super) fn toml_text(value: &DeValue<'_>) -> String {
    let join = |parts: Vec<String>| parts.join(", ");
    match value {
        DeValue::String(text) => toml::Value::String(text.clone().into_owned()).to_string(),
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
