//! Sections and keys of specs, and of other TOML files that users write, as `keys.toml` has them, for reader, schema and reference.

use std::sync::LazyLock;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::properties::{unsure, varied};
use crate::scene::{Interval, Property};

/// Unit and range of the ends of an axis: those of its key.
pub const THAT_OF_THE_KEY: &str = "that of the key";

/// A key of a section.
#[derive(Debug, Clone, Default)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// Form of its value.
    pub form: Form,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// Its meaning, in a few words.
    pub what: &'static str,
    /// Allowed values in words, if the form is not enough.
    pub allowed: String,
    /// The usual range; a largest number outside of it is warned about.
    pub usual: Option<[f64; 2]>,
    /// The value in force if it is left out.
    pub default: Option<&'static Spanned<DeValue<'static>>>,
    /// The behaviour if it is left out; empty if it has a default or is required.
    pub absent: &'static str,
    /// A value, as TOML; empty in an inline table, whose examples are whole.
    pub example: &'static str,
    /// Further remarks; may be empty.
    pub note: &'static str,
}

/// A section, an inline table of a key, or another file.
#[derive(Debug)]
pub struct Section {
    /// `gauge`, or `optimise.limits` for the inline table `limits` of `[optimise]`.
    pub name: &'static str,
    /// Its description.
    pub about: &'static str,
    /// Its keys, in the order in which values in force are listed.
    pub keys: Vec<Key>,
    /// Whole inline tables; empty for a section.
    pub examples: Vec<&'static str>,
}

impl Key {
    /// Allowed values, in words.
    pub fn allowed(&self) -> String {
        match &*self.allowed {
            "" if self.unit == THAT_OF_THE_KEY => THAT_OF_THE_KEY.to_owned(),
            "" => self.form.words(self.name, self.unit),
            words => words.to_owned(),
        }
    }

    /// The default, or the behaviour if it is left out.
    pub fn if_absent(&self) -> String {
        match self.default {
            Some(value) => format!("`{}`", super::sections::toml_text(value.get_ref())),
            None if self.absent.is_empty() => "required".to_owned(),
            None => self.absent.to_owned(),
        }
    }
}

impl Section {
    /// Names of its keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|k| k.name).collect()
    }

    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|k| k.name == name)
    }
}

static TOML: LazyLock<DeTable<'static>> =
    LazyLock::new(|| DeTable::parse(include_str!("keys.toml")).expect("keys.toml is TOML").into_inner());

static ALL: LazyLock<Vec<Section>> =
    LazyLock::new(|| TOML.iter().map(|(k, v)| described(k.get_ref(), v)).collect());

/// The sections of a spec.
pub fn sections() -> impl Iterator<Item = &'static Section> {
    let others = ["", "axis", "files", "array", "strokes"];
    ALL.iter().filter(move |s| !s.name.contains('.') && !others.contains(&s.name))
}

/// Inline tables of a spec, by the key that takes them; `axis` belongs to D, d, L_a, x_ss, l, a, theta and delta.
pub fn inline() -> impl Iterator<Item = &'static Section> {
    let of_spec = |s: &&Section| sections().any(|of| s.name.split_once('.').is_some_and(|n| n.0 == of.name));
    ALL.iter().filter(move |s| s.name == "axis" || of_spec(s))
}

/// The section of this name, which must exist; the empty name has the keys above all sections.
pub fn section(name: &str) -> &'static Section {
    ALL.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("keys.toml has no section {name}"))
}

/// Unit of every key by its dotted name, `axis.from` for that of an axis; empty without unit.
pub fn units() -> impl Iterator<Item = (String, &'static str)> {
    let of = |section: &'static Section| {
        let name = if section.name == "array.whisker" { "array" } else { section.name };
        section.keys.iter().map(move |k| (format!("{name}.{}", k.name), k.unit))
    };
    ALL.iter().filter(|s| !s.name.is_empty()).flat_map(of)
}

fn described(name: &'static str, value: &'static Spanned<DeValue<'static>>) -> Section {
    let table = value.get_ref().as_table().expect("sections are tables");
    let examples = table.get("examples").and_then(|all| all.get_ref().as_array()).into_iter().flatten();
    let about = table.get("about").and_then(|about| about.get_ref().as_str());
    let keys = table.iter().filter_map(|(key, facts)| Some((key.get_ref(), facts.get_ref().as_table()?)));
    let mut keys: Vec<Key> = keys.map(|(key, facts)| key_of(name, key, facts)).collect();
    match name {
        "optimise.variables" => keys.extend(varied().map(|property| {
            let allowed = format!("[min, max] with min < max, {}", property.about().allowed);
            of_property(property, Form::Ends(property.about().range), "fixed", allowed)
        })),
        "optimise.robust" => keys.extend(unsure().map(|property| {
            let form = Form::Number(Interval::new([0.0, f64::INFINITY], [false; 2]));
            of_property(property, form, "0", "a standard deviation ≥ 0, in the key's unit".to_owned())
        })),
        _ => {}
    }
    let examples = examples.filter_map(|one| one.get_ref().as_str()).collect();
    Section { name, about: about.unwrap_or_default(), keys, examples }
}

fn key_of(section: &str, name: &'static str, facts: &'static DeTable<'static>) -> Key {
    let text = |fact: &str| facts.get(fact).and_then(|v| v.get_ref().as_str()).unwrap_or_default();
    let full = format!("{section}.{name}");
    let about = Property::ALL.into_iter().map(Property::about).find(|about| {
        let own = format!("{}.{}", about.section, about.key);
        full.strip_prefix(&own).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    });
    let bare = text("form").split(" | ").any(|kind| kind == "axis");
    let own = about.filter(|_| bare).map_or("", |about| about.allowed);
    Key {
        name,
        form: Form::parse(text("form"), about.map(|about| about.range)),
        unit: text("unit"),
        what: text("what"),
        allowed: if text("allowed").is_empty() { own } else { text("allowed") }.to_owned(),
        usual: interval(text("usual")).map(|range| range.ends),
        default: facts.get("default"),
        absent: text("absent"),
        example: text("example"),
        note: text("note"),
    }
}

fn of_property(property: Property, form: Form, absent: &'static str, allowed: String) -> Key {
    let about = property.about();
    let name = property.name().trim_start_matches("root.");
    Key { name, form, unit: about.unit, what: about.what, absent, allowed, ..Key::default() }
}

/// Largest whole number.
pub const LARGEST: u64 = i64::MAX as u64;

/// Form of a value.
#[derive(Debug, Clone, Default)]
pub enum Form {
    /// true or false.
    Flag,
    /// A text that is not empty.
    #[default]
    Text,
    /// A whole number from … to.
    Whole(u64, u64),
    /// A number.
    Number(Interval),
    /// A number, or many of them: a list, a range or samples.
    Axis(Interval),
    /// [smallest, largest].
    Ends(Interval),
    /// This many numbers.
    Numbers(usize),
    /// One of these words.
    Words(Vec<&'static str>),
    /// Two or more different ones of these words.
    Several(Vec<&'static str>),
    /// Rows of numbers, from … to this many.
    Matrix(usize, usize),
    /// [[s, diameter], …].
    Pairs,
    /// An inline table of this name, with at least and at most this many keys.
    Table(&'static str, usize, usize),
    /// A list of tables of this name.
    Tables(&'static str),
    /// Any of these.
    Any(Vec<Form>),
}

impl Form {
    pub(super) fn parse(words: &'static str, own: Option<Interval>) -> Self {
        let mut kinds: Vec<Self> = words.split(" | ").map(|kind| Self::one(kind, own)).collect();
        if kinds.len() == 1 { kinds.remove(0) } else { Self::Any(kinds) }
    }

    fn one(words: &'static str, own: Option<Interval>) -> Self {
        let (kind, rest) = words.split_once(' ').unwrap_or((words, ""));
        let wrong = "a form such as `axis (0, ∞)` in keys.toml";
        let parts = || rest.split(' ');
        let size = |k: usize| parts().nth(k).and_then(|n| n.parse().ok()).expect(wrong);
        let interval = || if rest.is_empty() { own } else { interval(rest) }.expect(wrong);
        match kind {
            "flag" => Self::Flag,
            "text" => Self::Text,
            "pairs" => Self::Pairs,
            "whole" => {
                let [low, high] = interval().ends.map(|end| end as u64);
                Self::Whole(low, if rest.contains('∞') { LARGEST } else { high })
            }
            "number" => Self::Number(interval()),
            "axis" => Self::Axis(interval()),
            "ends" => Self::Ends(interval()),
            "numbers" => Self::Numbers(size(0)),
            "words" => Self::Words(parts().collect()),
            "several" => Self::Several(parts().collect()),
            "matrix" => Self::Matrix(size(0), size(1)),
            "table" => Self::Table(parts().next().unwrap_or_default(), size(1), size(2)),
            "tables" => Self::Tables(rest),
            _ => panic!("{kind} is no {wrong}"),
        }
    }

    /// Interval of its numbers, if it takes numbers.
    pub fn interval(&self) -> Option<Interval> {
        match self {
            Self::Number(interval) | Self::Axis(interval) | Self::Ends(interval) => Some(*interval),
            Self::Any(forms) => forms.iter().find_map(Self::interval),
            _ => None,
        }
    }

    /// Words that it takes; may be empty.
    pub fn known_words(&self) -> &[&'static str] {
        match self {
            Self::Words(words) => words,
            Self::Any(forms) => forms.first().map_or(&[], Self::known_words),
            _ => &[],
        }
    }

    /// Keys of the table that it takes, if it takes one.
    pub fn table(&self) -> Option<&'static Section> {
        match self {
            Self::Table(name, ..) | Self::Tables(name) => Some(section(name)),
            Self::Axis(_) => Some(section("axis")),
            Self::Any(forms) => forms.iter().find_map(Self::table),
            _ => None,
        }
    }

    /// Allowed values in words, for a key of this `name` and `unit`.
    pub fn words(&self, name: &str, unit: &str) -> String {
        let quoted = |words: &[&str]| words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ");
        match self {
            Self::Flag => "true or false".to_owned(),
            Self::Text => "\"…\"".to_owned(),
            Self::Whole(low, LARGEST) => format!("a whole number ≥ {low}"),
            Self::Whole(low, high) => format!("a whole number, {low} … {high}"),
            Self::Number(interval) | Self::Axis(interval) => interval.words(name, unit),
            Self::Ends(interval) => format!("[min, max] with min < max, {}", interval.words(name, unit)),
            Self::Numbers(n) => format!("{n} numbers"),
            Self::Words(words) => quoted(words),
            Self::Several(words) => format!("a list of two or more different ones of {}", quoted(words)),
            Self::Matrix(least, most) => format!("{least} to {most} rows of numbers"),
            Self::Pairs => "[[s, diameter], …] with s rising".to_owned(),
            Self::Table(name, ..) | Self::Tables(name) => {
                let (names, keys) = (section(name).names().join(", "), &section(name).keys);
                let bounds = keys.iter().all(|key| matches!(key.form, Self::Ends(_)));
                if bounds { format!("some of {names}, each [min, max]") } else { names }
            }
            Self::Any(all) => all.iter().map(|form| form.words(name, unit)).collect::<Vec<_>>().join(", or "),
        }
    }
}

/// Parses `(0, 1]`; a round bracket excludes its end.
fn interval(text: &str) -> Option<Interval> {
    let open = [text.starts_with('('), text.ends_with(')')];
    let (low, high) = text.get(1..text.len().checked_sub(1)?)?.split_once(", ")?;
    let end = |text: &str| text.replace('∞', "inf").parse().ok();
    Some(Interval::new([end(low)?, end(high)?], open))
}
