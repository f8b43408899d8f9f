//! Formats lists of named things: as a table in Markdown, or as indented lines on a terminal.

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

impl Part {
    pub fn new(
        title: impl Into<String>,
        about: &str,
        heads: &[&'static str],
        entries: impl Iterator<Item = Entry>,
    ) -> Self {
        let (title, about) = (title.into(), about.to_owned());
        Self { title, about, examples: Vec::new(), heads: heads.to_vec(), entries: entries.collect() }
    }

    pub fn markdown(&self) -> String {
        let cells = |e: &Entry| -> Vec<String> {
            let name = format!("`{}`", e.name.replace(" or ", "` or `"));
            let cells = std::iter::once(name).chain(e.facts.clone()).chain([e.meaning.clone()]);
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
        // Entries with few facts are printed without blank lines between them.
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
            let (examples, facts): (Vec<_>, Vec<_>) =
                told.into_iter().partition(|(head, _)| **head == EXAMPLE);
            let fact = |(head, fact): (&&str, &String)| match fact.starts_with("required") {
                true => fact.clone(),
                false => format!("{head}: {fact}"),
            };
            text += &plainly("", INDENT, &facts.into_iter().map(fact).collect::<Vec<_>>().join("; "));
            text.extend(examples.iter().map(|(_, e)| plainly("", INDENT, e)));
        }
        text
    }
}

pub fn paragraph(text: &str) -> String {
    fill("", 0, text, PAGE)
}

/// Like [`fill`], for a terminal, without the marks of code.
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
