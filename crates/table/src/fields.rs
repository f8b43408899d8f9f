//! Fields of a line as a rig writes it: separator and decimal mark (point or comma).

use std::borrow::Cow;

use super::lab::LabCell;

/// The lines of a file, without their ends: LF, CR LF, or CR alone.
pub fn lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let end = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let (line, after) = rest.split_at(end);
        rest = after.strip_prefix("\r\n").or_else(|| after.get(1..)).unwrap_or_default();
        Some(line)
    })
}

/// The separator of `line`: `;` or a tab outside quotes, else a comma.
pub fn separator(line: &str) -> char {
    let is_there = |mark: &char| line.split('"').step_by(2).any(|unquoted| unquoted.contains(*mark));
    [';', '\t'].into_iter().find(is_there).unwrap_or(',')
}

/// Trimmed fields of a line. A quoted field may contain the separator.
pub fn fields(line: &str, separator: char) -> Vec<Cow<'_, str>> {
    if !line.contains('"') {
        return line.split(separator).map(|f| f.trim().into()).collect();
    }
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.has_headers(false).delimiter(separator as u8).from_reader(line.as_bytes());
    let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
    record.iter().map(|f| f.trim().to_owned().into()).collect()
}

/// A number; NaN if empty or not finite; `None` for words. A comma is a decimal comma.
pub fn number(field: &str) -> Option<f64> {
    if field.is_empty() {
        return Some(f64::NAN);
    }
    let parsed = if mark(field) == Some(',') { field.replacen(',', ".", 1).parse() } else { field.parse() };
    parsed.ok().map(|x: f64| if x.is_finite() { x } else { f64::NAN })
}

/// A number as text, with an exponent below 1e-4 and from 1e9 on.
pub fn plain(x: f64) -> String {
    if x == 0.0 || !x.is_finite() || (1e-4..1e9).contains(&x.abs()) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

fn mark(field: &str) -> Option<char> {
    let mut marks = field.chars().filter(|c| matches!(c, '.' | ','));
    // Two marks separate thousands; such a field is refused.
    marks.next().filter(|_| marks.next().is_none())
}

/// The decimal mark of a file, taken from the first number with one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Decimals(Option<char>);

impl Decimals {
    /// Number of a field, as [`LabCell::number`]; `None` if its decimal mark differs from the file's: 1,234 in a file with points may mean 1234.
    pub fn number(&mut self, field: &LabCell<'_>) -> Option<f64> {
        let x = field.number()?;
        let LabCell::Text(text) = field else { return Some(x) };
        let here = mark(text);
        self.0 = self.0.or(here.filter(|_| x.is_finite()));
        (!self.differs(here)).then_some(x)
    }

    fn differs(self, here: Option<char>) -> bool {
        here.zip(self.0).is_some_and(|(here, before)| here != before)
    }

    /// True if `field` is a number with the other decimal mark.
    pub fn refuses(self, field: &LabCell<'_>) -> bool {
        let LabCell::Text(text) = field else { return false };
        self.differs(mark(text)) && number(text).is_some()
    }

    /// The reason why `field` is refused, for an error.
    pub fn wrong(self, field: &LabCell<'_>) -> &'static str {
        match self.refuses(field) {
            true => "numbers before this one have another decimal mark: is this more than a thousand?",
            false if is_date(&field.text()) => "this is a date, not a number",
            false => "this is not a number",
        }
    }
}

const MONTHS: [&str; 16] = [
    "jan", "feb", "mar", "mär", "apr", "may", "mai", "jun", "jul", "aug", "sep", "oct", "okt", "nov", "dec",
    "dez",
];

/// True for a date as spreadsheets show it: `04. Feb`, `4-Feb`, `2026-02-04 10:00`, `4/2/2026`, `04.02.2026`.
fn is_date(field: &str) -> bool {
    let is_month = |word: &str| MONTHS.contains(&&*word.chars().take(3).collect::<String>().to_lowercase());
    let mut words = field.split(|c: char| !c.is_alphanumeric());
    if words.clone().any(is_month) && words.any(|word| word.parse::<u16>().is_ok()) {
        return true;
    }
    let date = field.split([' ', 'T']).next().unwrap_or_default();
    let parts: Vec<Option<u16>> = date.split(['-', '/', '.']).map(|part| part.parse().ok()).collect();
    let least = if date.contains(['-', '/']) { 2 } else { 3 };
    let fits = |part: &Option<u16>| part.is_some_and(|n| matches!(n, 1..=31 | 1900..=2100));
    (least..=3).contains(&parts.len()) && parts.iter().all(fits)
}
