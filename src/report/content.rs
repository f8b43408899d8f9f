//! Figures and tables of a report, for every command; and its page, one self-contained file with style, data as JSON, and scripts that draw them.

use std::borrow::Cow;

use serde_json::{Value, json};

use super::{Source, quantity};
use crate::combinations::told;
use crate::error::Error;
use crate::figure::{self, Figure, LOOK, Mark, Marker, Path};
use crate::sink::Frame;

/// Most rows of a table in the page.
pub const SHOWN: usize = 1500;

/// Points of `rows` along `path`, with half bar lengths `error` and a `note` by row. Linked with the page's rows if it has all of them.
pub fn points_of(
    table: &Frame,
    (path, marker): (Path, Marker),
    rows: &[usize],
    error: &[f64],
    note: impl Fn(usize) -> String,
) -> Mark {
    Mark::Points {
        path,
        marker,
        error: rows.iter().filter_map(|r| error.get(*r).copied()).collect(),
        rows: if table.len() <= SHOWN { rows.to_vec() } else { Vec::new() },
        notes: rows.iter().map(|r| note(*r)).collect(),
    }
}

#[derive(Debug, Default)]
pub struct Content {
    pub answer: String,
    /// In page order.
    pub figures: Vec<Figure>,
    /// Tables of the page as JSON: file, number of rows, choice of the rows shown, whether they are linked with parallel coordinates and the front,
    /// columns, values, row indices in the file.
    pub tables: Vec<Value>,
    /// Names and values listed for the result.
    pub facts: Vec<(String, String)>,
    /// Notes: omissions and cautions.
    pub notes: Vec<String>,
}

impl Content {
    /// Adds the figure, if there is one that is not empty.
    pub fn figure(&mut self, figure: impl Into<Option<Figure>>) {
        self.figures.extend(figure.into().filter(|figure| !figure.is_empty()));
    }

    /// Adds `rows` of `table`; `how` describes the choice.
    pub fn table(&mut self, table: &Frame, rows: Vec<usize>, how: &str, linked: bool) {
        let file = table.file.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        let (some, all) = (rows.len(), table.len());
        if some < all {
            self.notes.push(format!("{file}: {some} of {all} rows are in this page, {how}"));
        }
        let column = |c: &Cow<'static, str>| {
            let axis = quantity::axis(c);
            json!({ "name": c, "label": axis.label, "unit": axis.unit })
        };
        let columns: Vec<Value> = table.names.iter().map(column).collect();
        let values: Vec<Value> =
            rows.iter().map(|r| (0..table.columns.len()).map(|c| table.json(c, *r)).collect()).collect();
        self.tables.push(json!({
            "file": file, "of": all, "how": how, "linked": linked, "columns": columns, "rows": values, "at": rows,
        }));
    }

    /// Adds the first rows of `table`.
    pub fn first(&mut self, table: &Frame, linked: bool) {
        self.table(table, (0..table.len().min(SHOWN)).collect(), "the first", linked);
    }

    /// Adds the first rows of those tables of these names that exist.
    pub fn first_rows(&mut self, source: &Source, names: &[&str]) -> Result<(), Error> {
        for name in names {
            if let Some(table) = source.maybe(name)? {
                self.first(&table, false);
            }
        }
        Ok(())
    }

    /// Adds a fact unless it is null.
    pub fn fact(&mut self, name: &str, value: &Value) {
        let text = match value {
            Value::Null => return,
            Value::String(text) => text.clone(),
            Value::Number(n) => n.as_f64().map_or(n.to_string(), crate::digits::short),
            other => other.to_string(),
        };
        self.facts.push((name.to_owned(), text));
    }
}

/// Scripts in the order in which they depend on each other: `pages/report/*.ts`, built.
const SCRIPTS: [&str; 9] = [
    include_str!("../../pages/report/data.js"),
    include_str!("../../pages/report/scale.js"),
    include_str!("../../pages/report/bar.js"),
    include_str!("../../pages/report/panel.js"),
    include_str!("../../pages/report/marks.js"),
    include_str!("../../pages/report/notes.js"),
    include_str!("../../pages/report/parallel.js"),
    include_str!("../../pages/report/table.js"),
    include_str!("../../pages/report/main.js"),
];

/// The page of `content`, as HTML.
pub fn page(source: &Source, content: &Content, notes: &[&String]) -> String {
    let data = json!({
        "colours": LOOK.colours,
        "map": LOOK.map,
        "markers": LOOK.markers,
        "no_value": figure::NO_VALUE,
        "answer": content.answer,
        "made": made(source),
        "facts": content.facts,
        "notes": notes,
        "figures": content.figures,
        "tables": content.tables,
        "spec": source.run["spec"]["text"],
    });
    html(&format!("{} of {}", source.command, source.name), &data)
}

/// Origin of the result, as names and values.
fn made(source: &Source) -> Vec<[String; 2]> {
    let run = &source.run;
    let text = |v: &Value| v.as_str().map(str::to_owned);
    let backend = |b: &Value| {
        let named = |a: String| format!("{} {a}", b["name"].as_str().unwrap_or_default());
        let place = text(&b["adapter"]).map(named).or_else(|| text(&b["name"]));
        let tolerance = b["tolerance"].as_f64().map_or(String::new(), |t| format!(", tolerance {t:e}"));
        place.map(|p| format!("{p}, {}{tolerance}", b["precision"].as_str().unwrap_or_default()))
    };
    let places = match &run["backends"] {
        Value::Array(all) => all.iter().filter_map(backend).collect::<Vec<_>>().join("; "),
        _ => backend(&run["backend"]).unwrap_or_default(),
    };
    let version = run["version"].as_str().unwrap_or("?");
    let commit = text(&run["commit"]).map(|commit| format!(" ({})", &commit[..commit.len().min(12)]));
    let version = format!("{version}{}", commit.unwrap_or_default());
    let counts = run["counts"].as_object().map_or(String::new(), |c| {
        let plain = |(k, v): (&String, &Value)| v.as_u64().map(|n| format!("{n} {}", k.replace('_', " ")));
        c.iter().filter_map(plain).collect::<Vec<_>>().join(", ")
    });
    // Older versions counted each word instead of combinations.
    let counted = ["combinations", "status"].iter().find_map(|key| run["counts"][*key].as_object());
    let status = counted.filter(|c| !c.is_empty()).map_or(String::new(), |c| {
        told(c.iter().map(|(words, n)| (words.as_str(), n.as_u64().unwrap_or(0))), |n| n.to_string())
    });
    let seconds = run["seconds"]["total"].as_f64().map_or(String::new(), |s| format!("{s:.2} s"));
    let rows = [
        ("command", format!("vibrissa {} {}", source.command, source.name)),
        ("version", version),
        ("computed on", places),
        ("took", seconds),
        ("counts", counts),
        ("taps by status", status),
        ("BLAKE3 of run.json", source.hash.clone()),
    ];
    rows.into_iter().filter(|(_, v)| !v.is_empty()).map(|(k, v)| [k.to_owned(), v]).collect()
}

/// A file whose content policy forbids all requests, so that opening a mailed page is not reported to anyone.
fn html(title: &str, data: &Value) -> String {
    // Inside a script element only `</` and `<!--` have a meaning.
    let data = data.to_string().replace('<', "\\u003c");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n(() => {{\n{}\n}})();\n</script>\n</body>\n</html>\n",
        include_str!("../../pages/report/report.css"),
        SCRIPTS.join("\n")
    )
}
