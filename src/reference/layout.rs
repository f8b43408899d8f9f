//! How a list of named things is laid out: as a table in Markdown, as indented lines on a terminal.

/// Width of a page on a terminal.
const WIDTH: usize = 100;
/// Column at which the words behind a name begin.
const INDENT: usize = 18;
/// Cells up to this width are padded, so that the source of a table can be read too.
const PADDED: usize = 30;

/// A titled list of things of which the same facts are told.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name of a section, a file or a list.
    pub title: String,
    /// What it is.
    pub about: String,
    /// Heads of name, facts and meaning.
    pub heads: Vec<&'static str>,
    /// The things.
    pub entries: Vec<Entry>,
}

/// One thing.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its name; `this or that` where it is called one or the other.
    pub name: String,
    /// As many facts as there are heads between the first and the last; an empty one is not told.
    pub facts: Vec<String>,
    /// What it means.
    pub meaning: String,
}

impl Part {
    /// A heading, a paragraph and a table.
    pub fn markdown(&self) -> String {
        let cells = |e: &Entry| -> Vec<String> {
            let name = format!("`{}`", e.name.replace(" or ", "` or `"));
            let facts = e.facts.iter().map(|f| f.replace('|', "\\|"));
            std::iter::once(name).chain(facts).chain([e.meaning.replace('|', "\\|")]).collect()
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
        let about = if self.about.is_empty() { String::new() } else { format!("{}\n\n", self.about) };
        let rows: String = rows.iter().map(line).collect();
        format!("### {}\n\n{about}{}|{}|\n{rows}", self.title, line(&heads), rule.join("|"))
    }

    /// The same for a terminal.
    pub fn plain(&self) -> String {
        let mut text = format!("{}\n", self.title);
        if !self.about.is_empty() {
            text += &indented("  ", 2, &self.about);
        }
        for e in &self.entries {
            let facts: Vec<String> = self.heads[1..]
                .iter()
                .zip(&e.facts)
                .filter(|(_, fact)| !fact.is_empty())
                .map(|(head, fact)| match fact.starts_with("required") {
                    true => fact.clone(),
                    false => format!("{head} {fact}"),
                })
                .collect();
            text.push('\n');
            text += &indented(&format!("  {}", e.name), INDENT, &e.meaning);
            if !facts.is_empty() {
                text += &indented("", INDENT, &facts.join("; "));
            }
        }
        text
    }
}

/// `text` without marks of code, wrapped.
pub fn paragraph(text: &str) -> String {
    indented("", 0, text)
}

/// `name`, and from column `indent` on the words of `text`, wrapped; a long name has a line of its own.
fn indented(name: &str, indent: usize, text: &str) -> String {
    let blank = " ".repeat(indent);
    let (mut out, mut line) = (String::new(), format!("{name:indent$}"));
    if name.chars().count() > indent {
        out = format!("{name}\n");
        line = blank.clone();
    }
    let mut first = true;
    for word in text.replace('`', "").split_whitespace() {
        if !first && line.chars().count() + 1 + word.chars().count() > WIDTH {
            out += &format!("{line}\n");
            (line, first) = (blank.clone(), true);
        }
        if !first {
            line.push(' ');
        }
        line += word;
        first = false;
    }
    out + line.trim_end() + "\n"
}
