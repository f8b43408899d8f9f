//! A whole file of readings, answered at once: for those who make more of a reading than its distance.

use super::kept::Kept;
use super::lines::Source;
use super::pair::{Readings as PairOfReadings, Spatial};
use super::pairs::Parts;
use super::rows::{Answerer, RowReader};
use super::stream::{Ask, tares, zeros};
use super::tare::doubt;
use super::{Located, Locator};
use crate::error::{Error, InputError};
use crate::sink::frame::Frame;
use crate::sink::heading::Heading;
use crate::sink::lab::{LabCell, LabTable};
use crate::sink::values::Field;
use crate::status::Status;

/// A reading and its answer.
#[derive(Debug, Clone)]
pub struct Reading {
    /// Line of the file, from 1.
    pub line: usize,
    /// Its fields, those of [`Readings::names`]; empty where the line has another shape.
    pub fields: Vec<LabCell<'static>>,
    /// The row as it is kept: number of the line, the user's own columns, drive, signal and zero.
    pub kept: Vec<Field>,
    /// Degrees or mm; NaN where the line says nothing.
    pub drive: f64,
    /// Strain, or the unit of the reading, above its zero.
    pub signal: f64,
    /// Variance of the zero in units of that of one reading.
    pub share: f64,
    /// Whether it is one of the zero.
    pub rests: bool,
    /// Its distance.
    pub located: Located,
    /// Of two gauges the contact, and what it is made of.
    pub(super) pair: Option<(Spatial, Option<Parts>)>,
}

/// Readings of a file.
#[derive(Debug, Clone)]
pub struct Readings {
    /// The file as the user named it.
    pub file: String,
    /// Names of its columns.
    pub names: Vec<String>,
    /// The table of the answers without rows: what is kept of each reading, and the columns that are added.
    pub empty: Frame,
    /// In the order of the file.
    pub rows: Vec<Reading>,
}

impl Readings {
    /// Reads and answers `input` for the table of `heading`, whose columns from the zero on follow what is kept of each row.
    ///
    /// # Errors
    /// A header that does not fit the calibration; a zero that contradicts the file's own.
    pub fn of(
        locator: &Locator,
        input: LabTable<'_>,
        ask: &Ask<'_>,
        heading: &Heading,
    ) -> Result<Self, Error> {
        let (read, wrong) = zeros(Answerer::One(locator), input.into(), ask)?;
        let label = ask.label.unwrap_or("stdin");
        ask.contradicted(&read).map_err(|error| error.at(label, None))?;
        if !wrong.is_empty() {
            let lines: Vec<String> = wrong.iter().take(8).map(usize::to_string).collect();
            (ask.warn)(&format!(
                "{label}: {} zero readings are taps by their size and not used (lines {})",
                wrong.len(),
                lines.join(", ")
            ));
        }
        let of_frame = if let LabTable::Frame(frame) = input { Some(frame) } else { None };
        let mut source = Source::new(input.into(), ask);
        let mut lines = RowReader::new(Answerer::One(locator));
        source.first(&mut lines)?;
        let tares = tares(Answerer::One(locator), lines.lines(), ask, read)?;
        let kept = Kept::new(&lines, of_frame, &heading.names_from("zero"));
        let names = lines.names();
        let (mut rows, mut asked): (Vec<Reading>, bool) = Default::default();
        let (mut pairs, mut places): (Vec<PairOfReadings>, Vec<usize>) = Default::default();
        while let Some(line) = source.next(&mut lines)? {
            let cells = line.row.map_or_else(Vec::new, |row| lines.cells(row));
            let (drive, recorded) = line
                .row
                .and_then(|row| lines.parse(row, &cells))
                .unwrap_or_else(|| (f64::NAN, vec![f64::NAN; tares.len()]));
            let finite = drive.is_finite() && recorded[0].is_finite();
            let rests = finite && locator.rests(drive);
            let zero = if finite && !rests { tares[0].at(line.place) } else { None };
            if finite && !rests && !std::mem::replace(&mut asked, true) {
                doubt(locator, zero.map(|z| z.0)).iter().for_each(|text| (ask.warn)(text));
            }
            let (value, share) = zero.unwrap_or((0.0, 0.0));
            let signal = lines.above(0, recorded[0], value);
            let located = match (rests, finite) {
                (true, _) => Located::nothing(Status::NO_STRAIN),
                (_, false) => Located::nothing(Status::BAD_INPUT),
                _ => {
                    // A drive that was not recorded when the whisker was calibrated counts as 1 here too.
                    let drive = if locator.drive_recorded { drive } else { 1.0 };
                    if locator.is_twofold() {
                        let (value, share_2) = tares[1].at(line.place).unwrap_or((0.0, 0.0));
                        let signals = [signal, lines.above(1, recorded[1], value)];
                        pairs.push(PairOfReadings { drive, signals, shares: [share, share_2] });
                        places.push(rows.len());
                        Located::nothing(Status::OK)
                    } else {
                        locator.locate_above(drive, signal, 0.0, share)
                    }
                }
            };
            let fields: Vec<_> = lines.named(cells).into_iter().map(LabCell::into_owned).collect();
            let told = [drive, recorded[0], zero.map_or(f64::NAN, |z| z.0)];
            rows.push(Reading {
                line: line.number,
                kept: kept.fields(line.number, &fields, told),
                fields: if fields.len() == names.len() { fields } else { Vec::new() },
                drive,
                signal,
                share,
                rests,
                located,
                pair: None,
            });
        }
        for (place, found) in places.into_iter().zip(locator.pairs(&pairs)?) {
            rows[place].located = found.0.located;
            rows[place].pair = Some(found);
        }
        Ok(Self { file: label.to_owned(), names, empty: kept.frame(heading), rows })
    }

    /// Place of the column `name`.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Values of the column `name`, NaN where a row says nothing; `None` where there is no such column.
    ///
    /// # Errors
    /// A column that appears twice; a word where a number must stand.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, InputError> {
        let Some(place) = self.column(name) else { return Ok(None) };
        if self.names.iter().filter(|n| *n == name).count() > 1 {
            let error = InputError::new("this column appears twice").at(self.file.clone(), Some(1));
            return Err(error.key(name).allowed("each column once"));
        }
        let value = |row: &Reading| match row.fields.get(place) {
            None => Ok(f64::NAN),
            Some(field) => field.number().ok_or_else(|| {
                let error = InputError::new("this is not a number").at(self.file.clone(), Some(row.line));
                error
                    .key(name)
                    .value(field)
                    .allowed("a number without unit; empty or NaN where it is missing")
            }),
        };
        self.rows.iter().map(value).collect::<Result<_, _>>().map(Some)
    }
}
