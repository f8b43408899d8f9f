//! The reference: every key of a spec, every column of every table, every status word, every exit code. [`page`] is the page of the site.

pub mod columns;
pub mod keys;
mod layout;
pub mod schema;
pub mod words;

pub use layout::{Entry, Part};

use crate::scene::Property;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    Spec,
    Columns,
    Statuses,
}

impl Topic {
    pub const WORDS: [(&'static str, Self, &'static str); 3] = [
        ("spec", Self::Spec, "Every section and key of a spec: unit, default, allowed values, example"),
        ("columns", Self::Columns, "Every column of every table: unit, meaning"),
        ("statuses", Self::Statuses, "Status words, reasons and exit codes"),
    ];

    pub fn parts(self) -> Vec<Part> {
        match self {
            Self::Spec => keys::parts(),
            Self::Columns => columns::parts(),
            Self::Statuses => words::parts(),
        }
    }

    pub fn titles(self) -> Vec<String> {
        let mut titles: Vec<String> = self.parts().iter().map(|p| short(&p.title).to_owned()).collect();
        titles.dedup();
        titles
    }

    fn heading(self) -> [&'static str; 2] {
        match self {
            Self::Spec => ["The spec", keys::ABOUT],
            Self::Columns => ["The tables", columns::ABOUT],
            Self::Statuses => ["Words and exit codes", words::ABOUT],
        }
    }

    /// For a terminal: the whole topic, or its parts with `title`; empty if the title is unknown.
    pub fn plain(self, title: Option<&str>) -> String {
        let parts = self.parts();
        let wanted = |p: &&Part| title.is_none_or(|t| short(&p.title) == short(t));
        let text: Vec<String> = parts.iter().filter(wanted).map(Part::plain).collect();
        match title {
            Some(_) => text.join("\n"),
            None => [vec![layout::plainly("", 0, self.heading()[1])], text].concat().join("\n"),
        }
    }
}

/// `gauge` of `[gauge]`, `rows.csv` of `rows.csv (calibrate)`.
fn short(title: &str) -> &str {
    let name = title.split_once(" (").map_or(title, |(name, _)| name);
    name.trim_matches(['[', ']'])
}

/// The variables of `[optimise]` without properties of the rig, which other sections explain; its introduction names them.
fn without_properties(mut part: Part) -> Part {
    if !["optimise.variables", "optimise.robust"].contains(&part.title.as_str()) {
        return part;
    }
    let known = |name: &str| {
        let of = |p: &Property| p.name().trim_start_matches("root.") == name;
        Property::ALL.iter().any(of)
    };
    let (properties, rest): (Vec<_>, Vec<_>) = part.entries.into_iter().partition(|e| known(&e.name));
    let names: Vec<String> = properties.iter().map(|e| format!("`{}`", e.name)).collect();
    part.about += &format!(" Also, with unit and meaning of their own keys: {}.", names.join(", "));
    part.entries = rest;
    part
}

/// A part without the columns that earlier tables explain; its introduction names them.
fn told_once(mut part: Part, topic: Topic, known: &mut Vec<(Entry, String)>) -> Part {
    if topic != Topic::Columns {
        return without_properties(part);
    }
    let (old, new): (Vec<_>, Vec<_>) =
        part.entries.into_iter().partition(|e| known.iter().any(|(k, _)| k == e));
    let mut titles: Vec<&String> =
        known.iter().filter(|(k, _)| old.contains(k)).map(|(_, title)| title).collect();
    titles.dedup();
    for title in titles {
        let theirs = known.iter().filter(|(k, t)| t == title && old.contains(k));
        let names: Vec<String> =
            theirs.map(|(k, _)| format!("`{}`", k.name.replace(" or ", "` or `"))).collect();
        part.about += &format!(" As in {title}: {}.", names.join(", "));
    }
    known.extend(new.iter().map(|e| (e.clone(), part.title.clone())));
    part.entries = new;
    part
}

pub fn page() -> String {
    let about = "Made of the definitions in the code by `vibrissa help reference`. \
        `vibrissa help spec`, `help columns` and `help statuses` print it on the terminal, `vibrissa help spec gauge` one section of it.";
    let mut text = format!("# Reference\n\n{}", layout::paragraph(about));
    for (_, topic, _) in Topic::WORDS {
        let [title, about] = topic.heading();
        text += &format!("\n## {title}\n\n{}", layout::paragraph(about));
        let mut known: Vec<(Entry, String)> = Vec::new();
        for part in topic.parts() {
            text += &format!("\n{}", told_once(part, topic, &mut known).markdown());
        }
    }
    text
}
