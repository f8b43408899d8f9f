//! Status words and other words of tables, and exit codes, from `words.toml`.

use toml::{Table, Value};

use super::layout::{Entry, Part};
use crate::status::Status;

pub const ABOUT: &str = "Every row that was asked for comes back; one without values says why. `status` is `ok`, or words of the first list joined \
    by `+` in its order; of a row over many taps it is the union of their words. A tap that counts enters K̄, SD, errors and maxima of its row. \
    Summaries count each combination of words once, and add up to the number of taps, as `counts.combinations` of run.json does; `counts.status` there \
    counts each word.";

pub fn parts() -> Vec<Part> {
    let all: Table = include_str!("words.toml").parse().expect("words.toml is TOML");
    all.iter().map(|(title, words)| part(title, words)).collect()
}

fn part(title: &str, words: &Value) -> Part {
    let about = words.get("about").and_then(Value::as_str).unwrap_or_default();
    let heads = match title {
        "status" => &["word", "counts", "values of the tap", "in locate", "meaning"][..],
        _ => &["word", "meaning"],
    };
    let told =
        words.as_table().into_iter().flatten().filter_map(|(word, told)| Some((word, told.as_array()?)));
    let entries = told.map(|(word, told)| {
        let [meaning, values, locate] =
            [0, 1, 2].map(|k| told.get(k).and_then(Value::as_str).unwrap_or_default().to_owned());
        let status = Status::ALL.iter().find(|(_, name)| name == word).filter(|_| title == "status");
        // Words that sweeps never give have no entry for counting.
        let counts = status.map(|(status, _)| match (values.as_str(), status.counts()) {
            ("", _) => "",
            (_, true) => "yes",
            (_, false) => "no",
        });
        let facts = counts.map_or_else(Vec::new, |counts| vec![counts.to_owned(), values, locate]);
        Entry { name: word.clone(), facts, meaning }
    });
    Part::new(title, about, heads, entries)
}
