//! Tables for people.

use serde_json::Value;

use crate::digits::short_to;
use crate::error::Error;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::values::Field;

/// The table `name` of these `rows`.
pub fn framed(name: &str, rows: impl Iterator<Item = Vec<Field>>) -> Result<Frame, Error> {
    let mut frame = heading(name).frame(&[]);
    { rows }.try_for_each(|row| frame.row(row))?;
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
    let names = || columns.split(',');
    let mut all: Vec<Vec<String>> = vec![names().map(str::to_owned).collect()];
    all.extend(rows.iter().map(|row| names().map(|name| cell(frame, name, *row)).collect()));
    aligned(&all) + &format!("`vibrissa help columns {}` explains the columns.\n", frame.file)
}

/// `rows` under each other, the first with their names: columns of numbers to the right, others to the left.
pub fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
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
