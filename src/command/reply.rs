//! The reply of a command, and tables for people.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{Content, Destination};
use crate::backend::Backend;
use crate::census::needed::Needed;
use crate::digits::short_to;
use crate::error::{Error, InputError};
use crate::report::answer_of;
use crate::scene::Spec;
use crate::sink::{Field, Frame, Written, heading, run_json};

#[derive(Default)]
pub struct Reply {
    /// The result in a sentence or two, at the start of the text; may be empty.
    pub answer: String,
    pub text: String,
    pub out: Option<PathBuf>,
    pub files: Vec<PathBuf>,
    pub removed: Vec<PathBuf>,
    /// Results in memory instead of a folder, by name.
    pub kept: Vec<(String, Content)>,
    pub document: Value,
    pub counts: Value,
    /// Measured, or expected for a plan.
    pub seconds: Value,
    pub backend: Value,
    pub result: Value,
    pub quiet: bool,
    /// A failure in spite of a result. Exit code 1.
    pub broken: Option<String>,
    /// A refused additional request. Exit code 2.
    pub refused: Option<InputError>,
}

impl Reply {
    pub fn planned(out: PathBuf, what: impl FnOnce(std::path::Display<'_>) -> String) -> Self {
        let text = what(out.display()) + "; nothing was run\n";
        Self { text, out: Some(out), ..Self::default() }
    }

    pub fn of_spec(self, spec: &Spec, needed: Option<&Needed>) -> Self {
        let left = needed.map_or_else(String::new, Needed::sentence);
        let text = format!("{}{left}values in force:\n{}", self.text, in_force(spec));
        let left = needed.map(Needed::summary);
        Self { text, result: json!({ "in_force": run_json::in_force(spec), "model_error": left }), ..self }
    }

    /// Adds the answer from the report of the result in its folder.
    pub fn answered(self) -> Self {
        match &self.out {
            Some(out) => Self { answer: answer_of(out), ..self },
            None => self,
        }
    }

    /// [`Self::answered`], unless its tables have more `rows` than are worth reading again for a sentence.
    pub fn answered_of(self, rows: u64) -> Self {
        if rows <= 100_000 { self.answered() } else { self }
    }

    /// Completes the result at `destination` with its run.json: spec or data `of`, `body`, and the counts and seconds of this reply.
    pub fn filed(mut self, destination: Destination<'_>, of: Value, mut body: Value) -> Result<Self, Error> {
        let context = destination.context;
        if self.seconds.is_null() {
            self.seconds = context.seconds();
        }
        if !self.counts.is_null() {
            body["counts"] = self.counts.clone();
        }
        body["seconds"] = self.seconds.clone();
        let document = run_json::document(destination.command, of, body);
        let Some(mut folder) = destination.folder else {
            return Ok(Self { kept: destination.kept, document, ..self });
        };
        folder.run_json(&document)?;
        let written = folder.finish()?;
        Ok(self.with_files(destination.out, written, (context.elapsed(), context.is_quiet())))
    }

    /// Like [`Self::filed`], for a `spec`, with its values in force, and its warnings unless `body` has others.
    pub fn filed_of(self, spec: &Spec, destination: Destination<'_>, body: Value) -> Result<Self, Error> {
        let mut whole = json!({ "in_force": run_json::in_force(spec), "warnings": spec.warnings });
        body.as_object().into_iter().flatten().for_each(|(key, value)| whole[key] = value.clone());
        self.filed(destination, run_json::spec(spec), whole)
    }

    pub fn with_files(self, out: PathBuf, written: Written, (seconds, quiet): (f64, bool)) -> Self {
        let Written { files, removed } = written;
        let text = self.text + &format!("wrote {} in {seconds:.2} s\n", listed(&files));
        let mut reply = Self { text, out: Some(out), files, quiet, ..self };
        if !removed.is_empty() {
            reply.result["removed"] = removed.iter().map(|p| p.display().to_string()).collect();
            reply.removed = removed;
        }
        reply
    }
}

pub fn listed(files: &[PathBuf]) -> String {
    files.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

pub fn in_force(spec: &Spec) -> String {
    let line = |(key, value, written): &(String, String, bool)| {
        format!("  {key} = {value}{}\n", if *written { "" } else { "    (default)" })
    };
    spec.in_force.iter().map(line).collect()
}

pub fn with_model_error(mut result: Value, model_error: Option<&(Value, String)>) -> Value {
    if let Some((told, _)) = model_error {
        result["model_error"] = told.clone();
    }
    result
}

pub fn where_and_why(b: &Backend) -> String {
    let place = match &b.adapter {
        Some(name) => format!("gpu {name}"),
        None => format!("{} with {} threads", b.name, b.threads),
    };
    let tolerance = b.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
    format!("{place} ({}; {}{tolerance})", b.reason, b.precision)
}

/// A count in groups of three digits: 10 000.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let first = digits.len() % 3;
    let groups: Vec<&str> = std::iter::once(&digits[..first])
        .chain((first..digits.len()).step_by(3).map(|i| &digits[i..i + 3]))
        .filter(|group| !group.is_empty())
        .collect();
    groups.join(" ")
}

/// A rate or a number of bytes to two digits: 870 000, 4.3e9.
pub fn rough(x: f64) -> String {
    let two: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    match two {
        _ if two >= 1e9 => format!("{two:.1e}"),
        _ if two >= 10.0 => grouped(two as u64),
        _ => two.to_string(),
    }
}

/// The table `name` of these `rows`; of columns with two names those that are `said`, else the first.
pub fn framed<R: IntoIterator<Item = Field>>(
    name: &str,
    said: &[&str],
    rows: impl IntoIterator<Item = R>,
) -> Result<Frame, Error> {
    let mut frame = heading(name).frame(said);
    rows.into_iter().try_for_each(|row| frame.row(row))?;
    Ok(frame)
}

/// The rows of `frame` as JSON, each value by the name of its column.
pub fn objects(frame: &Frame) -> Vec<Value> {
    let names = || frame.names.iter().map(|name| name.to_string()).enumerate();
    let whole = |x: f64| x.fract() == 0.0 && x.abs() < 9e15;
    let value = |column, row| match frame.json(column, row) {
        Value::Number(x) => x.as_f64().filter(|x| whole(*x)).map_or(x.into(), |x| (x as i64).into()),
        Value::String(word) if word.is_empty() => Value::Null,
        other => other,
    };
    let object = |row| names().map(|(column, name)| (name, value(column, row))).collect();
    (0..frame.len()).map(object).collect()
}

/// A field for people: words, and numbers to three digits.
pub fn cell(frame: &Frame, name: &str, row: usize) -> String {
    match frame.number(name, row) {
        x if x.is_nan() => frame.word(name, row),
        x => short_to(x, 3),
    }
}

/// Some rows of `frame` for people, and of its `columns`, separated by commas.
pub fn shown(frame: &Frame, rows: &[usize], columns: &str) -> String {
    let cells = |row: &usize| columns.split(',').map(|name| cell(frame, name, *row)).collect();
    aligned(columns, rows.iter().map(cells))
        + &format!("`vibrissa help columns {}` explains the columns.\n", frame.file)
}

/// `rows` under the names of their columns, which commas separate: columns of numbers to the right, others to the left.
pub fn aligned(names: &str, rows: impl Iterator<Item = Vec<String>>) -> String {
    let names: Vec<String> = names.split(',').map(str::to_owned).collect();
    let columns = names.len();
    let rows: Vec<Vec<String>> = std::iter::once(names).chain(rows).collect();
    let column = |c: usize| rows.iter().filter_map(move |row| row.get(c));
    let width = |c: usize| column(c).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let number = |cell: &String| {
        cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || "+-−–".contains(c))
    };
    let shape: Vec<(usize, bool)> = (0..columns).map(|c| (width(c), column(c).skip(1).all(number))).collect();
    let line = |row: &Vec<String>| {
        let cell = |(cell, (width, number)): (&String, &(usize, bool))| match number {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        };
        row.iter().zip(&shape).map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}
