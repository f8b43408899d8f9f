//! The reference: every key of a spec, every column of every table, every status word, every exit code. [`page`] is the page of the site.
//! A list of named things is printed as a table in Markdown, or as indented lines on a terminal.

pub mod schema;

use toml::{Table, Value};

use crate::scene::Property;
use crate::sink::heading::{Fact, HEADINGS, Heading, units};
use crate::spec::keys::{Form, Key, Section, inline, section, sections};
use crate::status::Status;

vibrissa_core::choices! {
    Topic {
        Spec = "spec", "Every section and key of a spec: unit, default, allowed values, example";
        Columns = "columns", "Every column of every table: unit, meaning";
        Statuses = "statuses", "Status words, reasons and exit codes";
    }
}

impl Topic {
    pub fn parts(self) -> Vec<Part> {
        match self {
            Self::Spec => keys(),
            Self::Columns => columns(),
            Self::Statuses => words(),
        }
    }

    pub fn titles(self) -> Vec<String> {
        let mut titles: Vec<String> = self.parts().iter().map(|p| short(&p.title).to_owned()).collect();
        titles.dedup();
        titles
    }

    fn heading(self) -> [&'static str; 2] {
        match self {
            Self::Spec => ["The spec", KEYS],
            Self::Columns => ["The tables", COLUMNS],
            Self::Statuses => ["Words and exit codes", WORDS],
        }
    }

    /// For a terminal: the whole topic, or its parts with `title`; empty if the title is unknown.
    pub fn plain(self, title: Option<&str>) -> String {
        let parts = self.parts();
        let wanted = |p: &&Part| title.is_none_or(|t| short(&p.title) == short(t));
        let text: Vec<String> = parts.iter().filter(wanted).map(Part::plain).collect();
        let about = title.is_none().then(|| plainly("", 0, self.heading()[1]));
        about.into_iter().chain(text).collect::<Vec<_>>().join("\n")
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
    let known = |e: &Entry| Property::ALL.iter().any(|p| p.name().trim_start_matches("root.") == e.name);
    let (properties, rest): (Vec<_>, Vec<_>) = part.entries.into_iter().partition(known);
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
    let is_known = |e: &Entry| known.iter().any(|(k, _)| k == e);
    let (old, new): (Vec<_>, Vec<_>) = part.entries.into_iter().partition(is_known);
    let again: Vec<_> = known.iter().filter(|(k, _)| old.contains(k)).collect();
    for theirs in again.chunk_by(|a, b| a.1 == b.1) {
        let names: Vec<String> = theirs.iter().map(|(k, _)| k.marked()).collect();
        part.about += &format!(" As in {}: {}.", theirs[0].1, names.join(", "));
    }
    known.extend(new.iter().map(|e| (e.clone(), part.title.clone())));
    part.entries = new;
    part
}

pub fn page() -> String {
    let about = "Made of the definitions in the code by `vibrissa help reference`. \
        `vibrissa help spec`, `help columns` and `help statuses` print it on the terminal, `vibrissa help spec gauge` one section of it.";
    let mut text = format!("# Reference\n\n{}", paragraph(about));
    for (_, topic, _) in Topic::WORDS {
        let [title, about] = topic.heading();
        text += &format!("\n## {title}\n\n{}", paragraph(about));
        let mut known: Vec<(Entry, String)> = Vec::new();
        for part in topic.parts() {
            text += &format!("\n{}", told_once(part, topic, &mut known).markdown());
        }
    }
    text
}

const COLUMNS: &str = "CSV in UTF-8 with one header and no comment lines; numbers in the shortest form that reads back the same. A value \
    that does not exist is empty, never 0. Read columns by name: new ones may be added before `status`. *if varied*: the column is there if the spec has an axis of it, or the tuple file has the column. `delta_mm` stands in place of `theta_deg` \
    with `drive = \"displacement\"`, K has the unit mm with `convention = \"elongation\"`. Sections (§) and equations are those of \
    docs/model.md.";

fn columns() -> Vec<Part> {
    let entry = |fact: &&Fact| {
        let meaning = match fact.only.when() {
            "" => fact.meaning.clone(),
            when => format!("{} ({when})", fact.meaning),
        };
        Entry { facts: vec![units(&fact.name)], meaning, name: fact.name.replace('|', " or ") }
    };
    let part = |table: &Heading| {
        let title = format!("{} ({})", table.file, table.command);
        Part::new(&title, &table.row, &["column", "unit", "meaning"], table.columns.iter().map(entry))
    };
    HEADINGS.iter().map(part).collect()
}

const KEYS: &str = "A spec is TOML: lengths in mm, angles in degrees, moduli in MPa, forces in N; strain has no unit. Unknown keys are \
    errors, paths are relative to the spec. A key without default is required, or off. *axis*: the key takes a value, a list or an axis. \
    `--plan` prints every value in force.";

fn keys() -> Vec<Part> {
    let heads = ["key", "unit", "default", "allowed", EXAMPLE, "meaning"];
    let entries = |s: &'static Section| s.keys.iter().map(|k| entry(s, k));
    let part = |title: &str, s: &'static Section| Part::new(title, s.about, &heads, entries(s));
    let top = part("Above all sections", section(""));
    let inline = inline().map(|s| Part {
        examples: s.examples.clone(),
        ..Part::new(s.name, s.about, &["key", "unit", "default", "allowed", "meaning"], entries(s))
    });
    let sections = sections().map(|s| part(&format!("[{}]", s.name), s));
    std::iter::once(top).chain(sections).chain(inline).collect()
}

fn entry(section: &Section, key: &Key) -> Entry {
    let note = if key.note.is_empty() { String::new() } else { format!(". {}", key.note) };
    let axis = match &key.form {
        _ if section.name.contains('.') => "",
        Form::Axis(_) => "; axis",
        Form::Any(forms) if forms.iter().any(|form| matches!(form, Form::Axis(_))) => {
            "; a number may be an axis"
        }
        _ => "",
    };
    let mut facts = vec![key.unit.to_owned(), key.if_absent(), key.allowed() + axis];
    if !key.example.is_empty() {
        facts.push(format!("`{} = {}`", key.name, key.example));
    }
    Entry { name: key.name.to_owned(), facts, meaning: format!("{}{note}", key.what) }
}

const WORDS: &str = "Every row that was asked for comes back; one without values says why. `status` is `ok`, or words of the first list joined \
    by `+` in its order; of a row over many taps it is the union of their words. A tap that counts enters K̄, SD, errors and maxima of its row. \
    Summaries count each combination of words once, and add up to the number of taps, as `counts.combinations` of run.json does; `counts.status` there \
    counts each word.";

fn words() -> Vec<Part> {
    let all: Table = include_str!("words.toml").parse().expect("words.toml is TOML");
    all.iter().map(|(title, words)| list(title, words)).collect()
}

fn list(title: &str, words: &Value) -> Part {
    let about = words.get("about").and_then(Value::as_str).unwrap_or_default();
    let heads = match title {
        "status" => &["word", "counts", "values of the tap", "in locate", "meaning"][..],
        _ => &["word", "meaning"],
    };
    let entries = words.as_table().into_iter().flatten().filter_map(|(word, told)| {
        let told = told.as_array()?;
        let [meaning, values, locate] =
            [0, 1, 2].map(|k| told.get(k).and_then(Value::as_str).unwrap_or_default().to_owned());
        let status = Status::ALL.iter().find(|(_, name)| name == word).filter(|_| title == "status");
        // Words that sweeps never give have no entry for counting.
        let facts = status.map_or_else(Vec::new, |(status, _)| {
            let counts = if status.counts() { "yes" } else { "no" };
            vec![if values.is_empty() { "" } else { counts }.to_owned(), values, locate]
        });
        Some(Entry { name: word.clone(), facts, meaning })
    });
    Part::new(title, about, heads, entries)
}

const WIDTH: usize = 100;
const PAGE: usize = 140;
/// Column where the text after a name begins.
const INDENT: usize = 18;
/// Cells up to this width are padded, to keep the source of a table readable.
const PADDED: usize = 30;
pub const EXAMPLE: &str = "example";

/// A titled list of entries with the same heads.
#[derive(Debug, Clone)]
pub struct Part {
    pub title: String,
    pub about: String,
    pub examples: Vec<&'static str>,
    pub heads: Vec<&'static str>,
    pub entries: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name, or `this or that` for two names.
    pub name: String,
    /// One per head between the first and the last; empty facts are not printed.
    pub facts: Vec<String>,
    pub meaning: String,
}

impl Entry {
    /// Its name as code in Markdown.
    fn marked(&self) -> String {
        format!("`{}`", self.name.replace(" or ", "` or `"))
    }
}

impl Part {
    pub fn new(
        title: &str,
        about: &str,
        heads: &[&'static str],
        entries: impl Iterator<Item = Entry>,
    ) -> Self {
        let (title, about) = (title.to_owned(), about.to_owned());
        Self { title, about, examples: Vec::new(), heads: heads.to_vec(), entries: entries.collect() }
    }

    pub fn markdown(&self) -> String {
        let cells = |e: &Entry| -> Vec<String> {
            let cells = std::iter::once(e.marked()).chain(e.facts.clone()).chain([e.meaning.clone()]);
            cells.map(|cell| cell.replace('|', "\\|")).collect()
        };
        let rows: Vec<Vec<String>> = self.entries.iter().map(cells).collect();
        let heads: Vec<String> = self.heads.iter().map(|h| (*h).to_owned()).collect();
        let last = heads.len() - 1;
        let width = |c: usize| {
            let widths = rows.iter().chain([&heads]).map(|row| row[c].chars().count());
            if c == last { 0 } else { widths.filter(|w| *w <= PADDED).max().unwrap_or(0) }
        };
        let widths: Vec<usize> = (0..=last).map(width).collect();
        let line = |row: &Vec<String>| {
            let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, w)| format!("{cell:w$}")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule: Vec<String> = widths.iter().map(|w| "-".repeat((w + 2).max(3))).collect();
        let examples: String = self.examples.iter().map(|e| format!("    {e}\n")).collect();
        let examples = if examples.is_empty() { examples } else { format!("\n{examples}") };
        let about = fill("", 0, &self.about, PAGE);
        let rows: String = rows.iter().map(line).collect();
        format!("### {}\n\n{about}{examples}\n{}|{}|\n{rows}", self.title, line(&heads), rule.join("|"))
    }

    pub fn plain(&self) -> String {
        let mut text = format!("{}\n{}", self.title, plainly("", 2, &self.about));
        text.extend(self.examples.iter().map(|e| format!("      {e}\n")));
        let close = self.heads.len() <= 3;
        text += if close { "\n" } else { "" };
        for e in &self.entries {
            let name = format!("  {}", e.name);
            let told: Vec<_> = self.heads[1..].iter().zip(&e.facts).filter(|(_, f)| !f.is_empty()).collect();
            if close {
                let unit = told.first().map_or(String::new(), |(_, fact)| format!(" [{fact}]"));
                text += &plainly(&name, INDENT, &format!("{}{unit}", e.meaning));
                continue;
            }
            text += &format!("\n{}", plainly(&name, INDENT, &e.meaning));
            let (examples, facts): (Vec<_>, Vec<_>) = told.into_iter().partition(|(h, _)| **h == EXAMPLE);
            let required = |fact: &str| fact.starts_with("required");
            let fact = |(h, f): (&&str, &String)| if required(f) { f.clone() } else { format!("{h}: {f}") };
            text += &plainly("", INDENT, &facts.into_iter().map(fact).collect::<Vec<_>>().join("; "));
            text.extend(examples.iter().map(|(_, e)| plainly("", INDENT, e)));
        }
        text
    }
}

pub fn paragraph(text: &str) -> String {
    fill("", 0, text, PAGE)
}

/// Like `fill`, for a terminal, without the marks of code.
pub fn plainly(name: &str, indent: usize, text: &str) -> String {
    fill(name, indent, &text.replace('`', ""), WIDTH)
}

/// `name`, then the words of `text` from column `indent` in lines up to `width`; a long name has a separate line.
fn fill(name: &str, indent: usize, text: &str, width: usize) -> String {
    let blank = " ".repeat(indent);
    let (mut out, mut line) = (String::new(), format!("{name:indent$}"));
    if !name.is_empty() && name.chars().count() >= indent {
        let own = format!("{name}\n");
        out = if own.chars().count() > width { fill("", 2, name.trim(), width) } else { own };
        line = blank.clone();
    }
    let mut first = true;
    for word in text.split_whitespace() {
        if !first && line.chars().count() + 1 + word.chars().count() > width {
            out += &format!("{line}\n");
            (line, first) = (blank.clone(), true);
        }
        line += if first { "" } else { " " };
        line += word;
        first = false;
    }
    if first { out } else { out + &line + "\n" }
}
