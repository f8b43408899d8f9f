//! Tables as a lab writes them: the header, maybe in a comment (`# reading,theta_deg`, as numpy's savetxt writes it), the rows, and numbers with a mark that
//! may separate thousands or decimals: `1,367` next to `412` may be 1367.

use super::columns::drive_like;
use super::names::{Names, Role};
use crate::error::{Checked, InputError};
use crate::fields::{fields, lines, number, separator};
use crate::sink::{LabCell, LabRow, LabTable};

/// Words in column names other than drives.
const WORDS: &str = "reading signal strain microstrain ustrain voltage volt volts mv adc count counts raw value force moment channel ch gauge sensor \
                     distance dist position pos time run spannung dehnung kraft abstand";

/// Comments of a file before its rows, with their lines.
pub type Comments = Vec<(usize, String)>;
/// Column names, with their line.
type Header = (usize, Vec<String>);

/// The column names in the last of the `comments` before the `first` line, which has the fields `names`, and its line; `None` if that line is the header.
/// Errors: a comment that names columns, in another number than there are fields.
pub fn before(comments: &Comments, first: &str, names: &[String], said: &Names) -> Checked<Option<Header>> {
    if names.iter().any(|name| said.known(name)) {
        return Ok(None);
    }
    let found = comments.iter().rev().find_map(|(line, text)| Some((*line, named(text, first, said)?)));
    // A line of headers has the names of a drive and of a signal.
    let names_columns = |text: &str| {
        let known = Names::default();
        let words = || text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        let is_signal = |word: &str| matches!(known.role(word), Some(Role::Signal(_)));
        words().any(|word| known.is_drive(word)) && words().any(is_signal)
    };
    let other = comments.iter().find(|(_, text)| found.is_none() && names_columns(text));
    let Some((line, text)) = other else { return Ok(found) };
    let count = names.len();
    let message = format!("this comment names columns, but the rows have {count} fields");
    let error = InputError::new(message).value(text);
    let allowed = "one name for each field, with what separates the fields; or a header that is no comment";
    Err(InputError { line: Some(*line), ..error.allowed(allowed) })
}

/// A row with its line and its fields.
type Read<'a> = (usize, LabRow<'a>, Vec<LabCell<'a>>);

/// A table of a lab: column names, and rows one by one.
pub struct Sheet<'a> {
    /// Column names.
    pub names: Vec<String>,
    /// Line of the names.
    pub line: usize,
    /// Separator of fields.
    mark: char,
    /// The first line, which decides how comments are read, and the whole text.
    first: &'a str,
    text: &'a str,
    thousands: Thousands,
    rows: Box<dyn Iterator<Item = (usize, LabRow<'a>)> + 'a>,
}

impl<'a> Sheet<'a> {
    /// Finds the column names, with the user's names in `said`; `allowed` lists columns for messages.
    /// Errors: Text without a line; a comment with column names of another number than the columns.
    pub fn new(table: LabTable<'a, &'a str>, said: &Names, allowed: &str) -> Result<Self, InputError> {
        let text = match table {
            LabTable::Text(text) => text.trim_start_matches('\u{feff}'),
            LabTable::Frame(frame) => {
                let names = frame.names.iter().map(|name| name.to_string()).collect();
                let rows = Box::new((0..frame.len()).map(|row| (row + 2, LabRow::Of(frame, row))));
                let thousands = Thousands::default();
                return Ok(Self { names, line: 1, mark: ',', first: "", text: "", thousands, rows });
            }
        };
        let mut lines = (1..).zip(lines(text)).filter(|(_, line)| !line.trim().is_empty()).peekable();
        let mut comments = Comments::default();
        while let Some((line, text)) = lines.next_if(|(_, line)| line.starts_with('#')) {
            comments.push((line, text.to_owned()));
        }
        let Some((line, first)) = lines.peek().copied() else {
            let message = "this file is empty; its first line must name the columns";
            return Err(InputError::new(message).allowed(allowed));
        };
        let mark = separator(first);
        let names = words(first, mark);
        let commented = before(&comments, first, &names, said)?;
        if commented.is_none() {
            lines.next();
        }
        let (line, names) = commented.unwrap_or((line, names));
        let rows = Box::new(lines.map(|(line, text)| (line, LabRow::Line(text))));
        Ok(Self { names, line, mark, first, text, thousands: Thousands::default(), rows })
    }

    /// The next row with its line and its fields.
    /// Errors: a comment that names other columns.
    pub fn next(&mut self, said: &Names) -> Result<Option<Read<'a>>, InputError> {
        for (line, row) in &mut self.rows {
            match row {
                LabRow::Line(text) if text.starts_with('#') => {
                    same(line, text, self.first, &self.names, said)?;
                }
                row => {
                    let cells = row.cells(self.mark);
                    self.thousands.see(line, &cells, self.mark);
                    return Ok(Some((line, row, cells)));
                }
            }
        }
        Ok(None)
    }

    /// Refuses numbers above a thousand, or not, in the rows so far; see [`Thousands::check`].
    pub fn check(&self, said: &Names) -> Result<(), InputError> {
        self.thousands.check(&self.names, said)
    }

    /// `error` about the names in `label`; adds the likely line of the header if that is another one.
    pub fn elsewhere(&self, error: InputError, label: &str) -> InputError {
        let error = error.at(label, Some(self.line));
        let Some(begin) = begins(self.text).filter(|begin| *begin != self.line) else { return error };
        let allowed = error.allowed.clone().unwrap_or_default();
        error.allowed(format!("{allowed}; the table seems to begin in line {begin}: leave out what is above"))
    }
}

/// Refuses a `comment` that names other columns than `names`.
pub fn same(line: usize, comment: &str, row: &str, names: &[String], said: &Names) -> Result<(), InputError> {
    if named(comment, row, said).is_none_or(|other| other == names) {
        return Ok(());
    }
    let message = "this comment names other columns than the rows before it have";
    let error = InputError::new(message).value(comment).allowed(names.join(","));
    Err(InputError { line: Some(line), ..error })
}

/// Line of the names before the first three rows of numbers.
fn begins(text: &str) -> Option<usize> {
    let numbers = |line: &str, mark: char| {
        let all = fields(line, mark);
        let n = all.iter().filter(|f| number(f).is_some_and(f64::is_finite)).count();
        [all.len(), n]
    };
    let all: Vec<&str> = lines(text).collect();
    let is_header = |w: &&[&str]| {
        let mark = separator(w[1]);
        let [[names, none], first, second, third] = [0, 1, 2, 3].map(|k| numbers(w[k], mark));
        none == 0 && names >= first[0] && first[1] >= 2 && first == second && second == third
    };
    all.windows(4).position(|w| is_header(&w)).map(|place| place + 1)
}

/// The fields of a line.
pub fn words(line: &str, mark: char) -> Vec<String> {
    fields(line, mark).iter().map(|f| f.to_string()).collect()
}

/// The column names in a `comment`, if there is one for each field of `row`.
fn named(comment: &str, row: &str, said: &Names) -> Option<Vec<String>> {
    let text = comment.trim_start_matches(['#', ' ']);
    let mark = separator(row);
    let count = fields(row, mark).len();
    let after = text.split_once(':').map_or("", |(_, after)| after);
    let ways = [text, after].into_iter().flat_map(|text| [words(text, mark), words(text, separator(text))]);
    // Words separated by blanks are a remark, unless each is a column name.
    let apart = text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let only_names =
        apart.iter().all(|word| said.means(word)) && apart.iter().any(|word| said.is_drive(word));
    let fit = ways.filter(|names| are_names(names, said)).chain(only_names.then_some(apart));
    let fit: Vec<_> = fit.filter(|names| names.len() == count).collect();
    // Prefer the split with the most known names; `max_by_key` returns the last of equals, hence `rev`.
    fit.into_iter().rev().max_by_key(|names| names.iter().filter(|name| said.means(name)).count())
}

/// True if one of these is a known column name, or all look like names.
fn are_names(names: &[String], said: &Names) -> bool {
    let letter = |name: &str| matches!(name, "a" | "s" | "t" | "u" | "v" | "x");
    let like = |name: &String| {
        let name = name.to_lowercase();
        let known = |word: &str| WORDS.split(' ').any(|known| known == word);
        drive_like(&name).is_some() || letter(&name) || name.split(|c: char| !c.is_alphabetic()).any(known)
    };
    let is_drive = |name: &String| drive_like(&name.to_lowercase()).is_some();
    names.iter().any(|name| said.means(name)) || names.iter().all(like) && names.iter().any(is_drive)
}

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
            // Three digits follow the mark, and one to three precede it.
            let parts = field.trim_start_matches(['+', '-']).split_once(MARKS[k]);
            let three = parts.is_some_and(|(before, after)| {
                let digits = [before, after].iter().all(|part| part.bytes().all(|c| c.is_ascii_digit()));
                let sized = (1..=3).contains(&before.len()) && after.len() == 3;
                digits && sized && !before.starts_with('0')
            });
            let new = three || !self.decimal[k] || MARKS[k] == separator;
            if !new || !number(field).is_some_and(f64::is_finite) {
                continue;
            }
            grouped |= three;
            self.decimal[k] |= !three;
            if three {
                column.marked[k].get_or_insert_with(|| (line, field.to_string()));
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
