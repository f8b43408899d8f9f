//! What a key may hold: the form of its value, as `keys.toml` says it.

use super::keys::{Section, section};
use crate::scene::Interval;

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
    /// As many numbers.
    Numbers(usize),
    /// One of these words.
    Words(Vec<&'static str>),
    /// Two or more different ones of these words.
    Several(Vec<&'static str>),
    /// From … to so many rows of numbers.
    Matrix(usize, usize),
    /// [[s, diameter], …].
    Pairs,
    /// An inline table of this name, with at least and at most as many keys.
    Table(&'static str, usize, usize),
    /// A list of tables of this name.
    Tables(&'static str),
    /// Any of these.
    Any(Vec<Form>),
}

impl Form {
    /// Of words such as `axis (0, ∞) | pairs`; `own` is the interval of a kind without one.
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

    /// Numbers that it takes, if it does.
    pub fn interval(&self) -> Option<Interval> {
        match self {
            Self::Number(interval) | Self::Axis(interval) | Self::Ends(interval) => Some(*interval),
            Self::Any(forms) => forms.iter().find_map(Self::interval),
            _ => None,
        }
    }

    /// Words that it takes; none where it takes none.
    pub fn known_words(&self) -> &[&'static str] {
        match self {
            Self::Words(words) => words,
            Self::Any(forms) => forms.first().map_or(&[], Self::known_words),
            _ => &[],
        }
    }

    /// Keys of the table that it takes, if it does.
    pub fn table(&self) -> Option<&'static Section> {
        match self {
            Self::Table(name, ..) | Self::Tables(name) => Some(section(name)),
            Self::Axis(_) => Some(section("axis")),
            Self::Any(forms) => forms.iter().find_map(Self::table),
            _ => None,
        }
    }

    /// What may stand there, in words, of a key of this `name` and `unit`.
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
            Self::Any(forms) => {
                forms.iter().map(|form| form.words(name, unit)).collect::<Vec<_>>().join(", or ")
            }
        }
    }
}

/// `(0, 1]`: what lies between two numbers, of which a round bracket excludes its own.
fn interval(text: &str) -> Option<Interval> {
    let open = [text.starts_with('('), text.ends_with(')')];
    let (low, high) = text.get(1..text.len() - 1)?.split_once(", ")?;
    let end = |text: &str| text.replace('∞', "inf").parse().ok();
    Some(Interval::new([end(low)?, end(high)?], open))
}
