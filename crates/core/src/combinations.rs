//! Counts of taps per combination of status words.

use std::collections::BTreeMap;

use crate::status::Status;

/// Taps per combination of status words: each tap counts once.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Combinations(BTreeMap<Status, u64>);

impl Combinations {
    /// Adds `taps` taps with these words.
    pub fn note(&mut self, status: Status, taps: u64) {
        if taps > 0 {
            *self.0.entry(status).or_default() += taps;
        }
    }

    /// Adds those of `other`.
    pub fn add(&mut self, other: &Self) {
        other.0.iter().for_each(|(status, taps)| self.note(*status, *taps));
    }

    /// Counts by the words of tables, joined by `+`, in alphabetical order.
    pub fn named(&self) -> BTreeMap<String, u64> {
        self.0.iter().map(|(status, taps)| (status.to_string(), *taps)).collect()
    }

    /// Taps per word, and `ok`: a tap with two words counts twice.
    pub fn words(&self) -> BTreeMap<&'static str, u64> {
        let mut words = BTreeMap::new();
        for (status, taps) in &self.0 {
            let ok = (*status == Status::OK).then_some("ok");
            status.words().chain(ok).for_each(|word| *words.entry(word).or_default() += taps);
        }
        words
    }

    /// Text, as `952 ok, 48 strain_limit+ambiguous`, or `none` without taps; `number` writes the counts.
    pub fn told(&self, number: impl Fn(u64) -> String) -> String {
        told(self.named().iter().map(|(words, taps)| (words.as_str(), *taps)), number)
    }
}

/// Counts of words, as [`Combinations::told`].
pub fn told<'w>(counts: impl Iterator<Item = (&'w str, u64)>, number: impl Fn(u64) -> String) -> String {
    let all: Vec<String> = counts.map(|(words, taps)| format!("{} {words}", number(taps))).collect();
    if all.is_empty() { "none".to_owned() } else { all.join(", ") }
}
