//! All readings of a file with their answers, for contours, arrays and the next tap.

use super::Locator;
use super::pair::Spatial;
use super::rows::{Answerer, Reading};
use super::stream::{Ask, Kept};
use super::tared::TaredRows;
use crate::error::{Error, InputError};
use crate::sink::frame::Frame;
use crate::sink::heading::Heading;
use crate::sink::lab::{LabCell, LabTable};
use crate::sink::values::Field;
use crate::status::Status;

#[derive(Debug, Clone)]
pub struct AnsweredRow {
    pub line: usize,
    /// Its fields, those of [`Readings::names`]; empty where the line has another shape.
    pub fields: Vec<LabCell<'static>>,
    /// The row as it is kept: number of the line, the user's own columns, drive, signal and zero.
    pub kept: Vec<Field>,
    /// Degrees or mm, as recorded; NaN where the line says nothing.
    pub drive: f64,
    /// The first signal above its zero: strain, or the unit of the reading.
    pub signal: f64,
    /// Variance of the zero in units of that of one reading.
    pub share: f64,
    pub rests: bool,
    pub tap: Option<Reading>,
    /// Its distance, of two gauges with the contact.
    pub answer: Spatial,
}

#[derive(Debug, Clone)]
pub struct Readings {
    pub file: String,
    pub names: Vec<String>,
    /// The table of the answers without rows: what is kept of each reading, and the columns that are added.
    pub empty: Frame,
    pub rows: Vec<AnsweredRow>,
}

impl Readings {
    /// Reads and answers `input` for the table `of` this heading, whose columns from the zero on follow what is kept of each row.
    pub fn of(locator: &Locator, input: LabTable<'_>, ask: &Ask<'_>, of: &Heading) -> Result<Self, Error> {
        let who = Answerer::from(locator);
        let (label, read) = (ask.label(), ask.zeros(who, input.into())?);
        let of_frame = if let LabTable::Frame(frame) = input { Some(frame) } else { None };
        let mut tared = TaredRows::new(who, input.into(), ask, Some(read))?;
        let kept = Kept::new(&tared.rows, of_frame, of, &of.names_from("zero"));
        let names = tared.rows.header.names.clone();
        let (mut rows, mut taps) = (Vec::new(), Vec::new());
        while let Some(row) = tared.next()? {
            let fields: Vec<_> = row.cells.into_iter().map(LabCell::into_owned).collect();
            let why = row.tap.as_ref().err();
            taps.extend(row.tap.as_ref().ok().cloned());
            rows.push(AnsweredRow {
                line: row.line.number,
                kept: kept.fields(row.line.number, &fields, [row.drive, row.recorded[0], row.zero]),
                fields: if fields.len() == names.len() { fields } else { Vec::new() },
                drive: row.drive,
                signal: row.tap.as_ref().map_or(row.recorded[0], |tap| tap.signals[0]),
                share: row.tap.as_ref().map_or(0.0, |tap| tap.shares[0]),
                rests: row.rests,
                answer: Spatial::nothing(*why.unwrap_or(&Status::OK)),
                tap: row.tap.ok(),
            });
        }
        let of_taps = rows.iter_mut().filter(|row| row.tap.is_some());
        of_taps.zip(who.answer(&taps)?).for_each(|(row, answer)| row.answer = answer);
        Ok(Self { file: label.to_owned(), names, empty: kept.empty, rows })
    }

    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Values of the column `name`, NaN where a row says nothing; `None` where there is no such column.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, InputError> {
        let Some(place) = self.column(name) else { return Ok(None) };
        if self.names.iter().filter(|n| *n == name).count() > 1 {
            let error = InputError::new("this column appears twice").at(self.file.clone(), Some(1));
            return Err(error.key(name).allowed("each column once"));
        }
        let value = |row: &AnsweredRow| match row.fields.get(place) {
            None => Ok(f64::NAN),
            Some(field) => field.number().ok_or_else(|| {
                let error = InputError::new("this is not a number").at(self.file.clone(), Some(row.line));
                let error = error.key(name).value(field);
                error.allowed("a number without unit; empty or NaN where it is missing")
            }),
        };
        self.rows.iter().map(value).collect::<Result<_, _>>().map(Some)
    }
}
