//! Numbers with a mark that may separate thousands or decimals: `1,367` next to `412` may be 1367.

use super::names::{Names, Role};
use crate::error::InputError;
use crate::fields::number;
use crate::sink::lab::LabCell;

/// Marks of decimals or thousands.
const MARKS: [char; 2] = ['.', ','];

/// Evidence in the numbers of a file about its marks.
#[derive(Debug, Clone, Default)]
pub struct Thousands {
    /// For each mark: true if some number can only have decimals behind it.
    decimal: [bool; 2],
    columns: Vec<Column>,
}

#[derive(Debug, Clone, Default)]
struct Column {
    /// True if some number has no mark.
    plain: bool,
    /// For each mark, line and text of the first number with three digits behind it.
    marked: [Option<(usize, String)>; 2],
}

impl Thousands {
    /// Reads the fields of a line, separated by `separator`; true if one may be a number above a thousand.
    pub fn see(&mut self, line: usize, fields: &[LabCell<'_>], separator: char) -> bool {
        let mut grouped = false;
        if self.columns.len() < fields.len() {
            self.columns.resize(fields.len(), Column::default());
        }
        for (field, column) in fields.iter().zip(&mut self.columns) {
            let LabCell::Text(field) = field else { continue };
            let Some(k) = MARKS.iter().position(|mark| field.contains(*mark)) else {
                let digits = field.trim_start_matches(['+', '-']);
                column.plain |=
                    digits.bytes().all(|c| c.is_ascii_digit()) && digits.bytes().any(|c| c != b'0');
                continue;
            };
            let three = is_grouped(field, MARKS[k]);
            let new = three || !self.decimal[k] || MARKS[k] == separator;
            if !new || !number(field).is_some_and(f64::is_finite) {
                continue;
            }
            grouped |= three;
            match three {
                true if column.marked[k].is_none() => column.marked[k] = Some((line, field.to_string())),
                true => {}
                false => self.decimal[k] = true,
            }
            // With commas as separators, a comma within quotes is hardly a decimal mark.
            column.plain |= MARKS[k] == separator;
        }
        grouped
    }

    /// Refuses numbers of which nothing says whether they are above a thousand. Unused columns are not checked, nor times: three digits are
    /// milliseconds, and misread times do not rise, which is refused elsewhere.
    pub fn check(&self, names: &[String], said: &Names) -> Result<(), InputError> {
        let is_read = |place: usize| {
            names.get(place).is_none_or(|name| said.means(name) && said.role(name) != Some(Role::Time))
        };
        let doubt = |(place, column): (usize, &Column)| {
            let of = |k: &usize| column.plain && !self.decimal[*k] && column.marked[*k].is_some();
            (0..MARKS.len()).find(of).filter(|_| is_read(place)).map(|k| (place, k))
        };
        let Some((place, k)) = self.columns.iter().enumerate().find_map(doubt) else { return Ok(()) };
        let (line, text) = self.columns[place].marked[k].clone().unwrap_or_default();
        let whole = text.replace(MARKS[k], "");
        let message = format!(
            "is this {whole}, or {}? Nothing in this file says whether `{}` stands between thousands or before decimals",
            text.replace(MARKS[k], "."),
            MARKS[k]
        );
        let error = InputError::new(message).key(names.get(place).map_or("", String::as_str)).value(&text);
        let error = error.allowed(format!(
            "{whole} without a mark; or decimals written so that they cannot be thousands: {text}0"
        ));
        Err(InputError { line: Some(line), ..error })
    }
}

/// True if three digits follow the mark and one to three precede it.
fn is_grouped(field: &str, mark: char) -> bool {
    let digits = |part: &str| part.bytes().all(|c| c.is_ascii_digit());
    field.trim_start_matches(['+', '-']).split_once(mark).is_some_and(|(before, after)| {
        (1..=3).contains(&before.len())
            && !before.starts_with('0')
            && after.len() == 3
            && digits(before)
            && digits(after)
    })
}
