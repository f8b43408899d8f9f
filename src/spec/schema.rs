//! The defaults of a spec, and what to say about unknown sections and keys.

use std::sync::LazyLock;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::SECTIONS;
use super::reader::{Document, Item, Result};
use super::sections::Section;
use super::solid;
use crate::scene::{Amount, TERMS, Term};

/// Highest `format` that can be read.
pub(super) const FORMAT: u64 = 1;

/// Values in force where the user says nothing. A key that is absent here is required, or means "off".
const DEFAULTS: &str = r#"
format = 1
[whisker]
hub = 0.0
[gauge]
side = "contact"
noise_strain = 0.0
strain_limit = 0.05
factor = 2.21
second = false
[tap]
drive = "angle"
abscissa = false
tilt = 0.0
lean = 0.0
[model]
geometry = "exact"
solid = false
nu = 0.5
contact = "frictionless"
material = { hooke = 3.2 }
[sensor]
signal = "strain"
fixed = false
[estimate]
theory = "euler-bernoulli"
convention = "mean"
[optimise]
[output]
tuples = true
designs = true
distances = true
format = "csv"
by = "K_sd"
per = "row"
wrench = false
"#;

/// Effects of the rod are off.
static TERMS_OFF: LazyLock<String> = LazyLock::new(|| {
    let off = |term: &Term| match term.trial {
        Amount::Flag(_) => format!("{} = false\n", term.key),
        Amount::Number(_) => format!("{} = 0.0\n", term.key),
        Amount::Word(_) => format!("{} = {}\n", term.key, term.off()),
    };
    format!("[model]\n{}", TERMS.iter().map(off).collect::<String>())
});

/// The defaults of what the `user` wrote, and beside them the values of `more`, which is TOML like them.
pub(super) fn defaults<'m>(more: &[&'m str], user: &DeTable<'_>) -> DeTable<'m> {
    let table = |text| DeTable::parse(text).expect("defaults are valid TOML").into_inner();
    let mut all = table(DEFAULTS);
    let solid = if solid::is_asked(user) { solid::ALL } else { "" };
    for (name, section) in
        table(&TERMS_OFF).into_iter().chain(table(solid)).chain(more.iter().copied().flat_map(table))
    {
        match (all.get_mut(&**name.get_ref()).map(Spanned::get_mut), section.into_inner()) {
            (Some(DeValue::Table(known)), DeValue::Table(added)) => known.extend(added),
            (_, added) => panic!("no section of defaults takes {added:?}"),
        }
    }
    all
}

/// Defaults of a sampled axis.
pub(super) const SAMPLER: &str = "sobol";
/// Default seed of a sampled axis.
pub(super) const SEED: u64 = 0;

/// A value to show for a missing key.
pub(super) fn example(section: &str, key: &str) -> String {
    match SECTIONS.iter().find(|s| s.name == section).and_then(|s| s.key(key)) {
        Some(key) if key.unit.is_empty() => format!("{} ({})", key.example, key.what),
        Some(key) => format!("{} ({}, {})", key.example, key.what, key.unit),
        None => "\"…\"".to_owned(),
    }
}

/// A parsed spec whose sections and keys are all known.
pub(super) struct Sections<'a> {
    document: &'a Document<'a>,
    user: &'a DeTable<'a>,
    defaults: &'a DeTable<'a>,
}

impl<'a> Sections<'a> {
    /// Checks the names of all sections and keys.
    pub fn new(document: &'a Document<'a>, user: &'a DeTable<'a>, defaults: &'a DeTable<'a>) -> Result<Self> {
        let mut top: Vec<&str> = SECTIONS.iter().map(|s| s.name).collect();
        top.push("format");
        for (key, value) in user {
            let name: &str = key.get_ref();
            let item = Item::written(document, name.to_owned(), value);
            if !top.contains(&name) {
                return Err(unknown(document, None, key, value, &top));
            }
            let Some(table) = value.get_ref().as_table() else {
                if name == "format" {
                    continue;
                }
                let message =
                    format!("{name} is a section: write [{name}] on a line of its own, its keys below");
                return Err(item.error(message));
            };
            let Some(section) = SECTIONS.iter().find(|s| s.name == name) else { continue };
            let keys = section.names();
            for (key, value) in table {
                if !keys.contains(&&**key.get_ref()) {
                    return Err(unknown(document, Some(section.name), key, value, &keys));
                }
            }
        }
        Ok(Self { document, user, defaults })
    }

    /// One section.
    pub fn section(&self, name: &'static str) -> Section<'a> {
        let user = self.user.get_key_value(name);
        Section {
            document: self.document,
            name,
            span: user.map(|(key, _)| key.span()),
            user: user.and_then(|(_, value)| value.get_ref().as_table()),
            defaults: self.defaults.get(name).and_then(|value| value.get_ref().as_table()),
        }
    }

    /// `format`, if written.
    pub fn format(&self) -> Option<Item<'a>> {
        Some(Item::written(self.document, "format".to_owned(), self.user.get("format")?))
    }

    /// Every value in force: dotted key, value as TOML, whether the user wrote it.
    pub fn in_force(&self) -> Vec<(String, String, bool)> {
        let mut all = Vec::new();
        let mut note =
            |key: String, user: Option<&Spanned<DeValue<'_>>>, default: Option<&Spanned<DeValue<'_>>>| {
                if let Some(value) = user.or(default) {
                    all.push((key.clone(), toml_text(value.get_ref()), user.is_some()));
                }
                let sampled = user.and_then(|v| v.get_ref().as_table()).filter(|t| t.contains_key("samples"));
                if let Some(table) = sampled {
                    for (name, text) in [("sampler", format!("{SAMPLER:?}")), ("seed", SEED.to_string())] {
                        if !table.contains_key(name) {
                            all.push((format!("{key}.{name}"), text, false));
                        }
                    }
                }
            };
        note("format".to_owned(), self.user.get("format"), self.defaults.get("format"));
        for known in &SECTIONS {
            let (name, section) = (known.name, self.section(known.name));
            for key in known.names() {
                let (user, default) =
                    (section.user.and_then(|t| t.get(key)), section.defaults.and_then(|t| t.get(key)));
                note(format!("{name}.{key}"), user, default);
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
    let home = SECTIONS.iter().find(|s| s.key(name).is_some()).map(|s| s.name);
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
