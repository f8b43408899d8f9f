//! What can stand in a spec: every section, its keys, their units and meanings. The reader knows the names from here, and
//! The site's reference is made of them.

pub mod form;
mod inline;
mod sections;

use super::{optimise, schema};
use form::Form;
pub use inline::{AXIS, BUDGET, CONTACT, CORE, FOIL, LIMITS, MATERIAL, ROBUST, ROOT, VARIABLES, WEIGHTS};
pub use sections::{ESTIMATE, GAUGE, MODEL, OPTIMISE, OUTPUT, RUN, SENSOR, TAP, TUPLES, WHISKER};

/// Unit, and range, of the ends of an axis.
pub const THAT_OF_THE_KEY: &str = "that of the key";

/// A key.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// What holds where it is left out, unless it has a default value or is required.
    pub absent: &'static str,
    /// A value, as TOML; empty in an inline table, which has examples of its own.
    pub example: &'static str,
    /// What more there is to say; may be empty.
    pub note: &'static str,
    /// What it may hold.
    pub form: Form,
}

/// A section, or an inline table of a key.
#[derive(Debug)]
pub struct Section {
    /// `gauge`, or `optimise.limits` for the inline table that stands under `limits` in `[optimise]`.
    pub name: &'static str,
    /// What it says.
    pub about: &'static str,
    /// Its keys, in the order in which values in force are listed.
    pub keys: &'static [Key],
    /// Whole inline tables; none of a section.
    pub examples: &'static [&'static str],
}

const fn key(name: &'static str, unit: &'static str, what: &'static str, example: &'static str) -> Key {
    Key { name, unit, what, absent: "", example, note: "", form: Form::Text }
}

impl Key {
    const fn absent(self, absent: &'static str) -> Self {
        Self { absent, ..self }
    }

    const fn holds(self, form: Form) -> Self {
        Self { form, ..self }
    }

    const fn note(self, note: &'static str) -> Self {
        Self { note, ..self }
    }
}

const fn section(name: &'static str, about: &'static str, keys: &'static [Key]) -> Section {
    Section { name, about, keys, examples: &[] }
}

const fn inline(
    name: &'static str,
    about: &'static str,
    examples: &'static [&'static str],
    keys: &'static [Key],
) -> Section {
    Section { name, about, keys, examples }
}

impl Section {
    /// Names of its keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|k| k.name).collect()
    }

    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|k| k.name == name)
    }
}

/// The key above all sections.
pub const FORMAT: Key = key("format", "", "format of the spec", "1")
    .holds(Form::Whole(1, schema::FORMAT))
    .note("A higher one than the program knows is refused");

/// All sections.
pub const SECTIONS: [Section; 10] =
    [WHISKER, GAUGE, SENSOR, TAP, TUPLES, MODEL, ESTIMATE, OPTIMISE, OUTPUT, RUN];

/// Inline tables, by the key that takes them. `axis` is taken by D, d, L_a, x_ss, l, a, theta and delta.
pub const INLINE: [Section; 11] =
    [AXIS, ROOT, CORE, CONTACT, MATERIAL, FOIL, WEIGHTS, BUDGET, VARIABLES, LIMITS, ROBUST];

/// Unit of every key under its dotted name, `axis.from` for that of an axis; empty where it has none.
pub fn units() -> impl Iterator<Item = (String, &'static str)> {
    let of = |section: &'static Section| {
        section.keys.iter().map(|k| (format!("{}.{}", section.name, k.name), k.unit))
    };
    // Where a drive may be varied, it is that of the spec.
    let delta =
        TAP.key("delta").map(|k| [&VARIABLES, &ROBUST].map(|s| (format!("{}.delta", s.name), k.unit)));
    SECTIONS.iter().chain(&INLINE).flat_map(of).chain(delta.into_iter().flatten())
}

/// What stands for `key` of `section` where the user says nothing, as TOML.
pub fn default(section: &str, key: &str) -> Option<String> {
    let all = schema::defaults(&[optimise::DEFAULTS], &toml::de::DeTable::new());
    let table = if section.is_empty() { &all } else { all.get(section)?.get_ref().as_table()? };
    Some(schema::toml_text(table.get(key)?.get_ref()))
}
