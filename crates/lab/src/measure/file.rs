//! Data files of a rig: a_mm, theta_deg or delta_mm, and one signal.

use std::path::Path;

use super::columns::{Columns, Others, all_names, followed, missing};
use super::missing::{self, Missing};
pub use super::names::{DISTANCE, Names};
use super::time::{Runs, forward, seconds};
use super::{Unit, group::rounded, header::Sheet};
use crate::text_file::{Limit, TextFile};
use crate::{error::InputError, fields::Decimals, scene::Drive, sink::LabTable};

/// One line of a data file; NaN for a missing value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Line number, from 1.
    pub line: usize,
    /// Contact distance as labelled, mm.
    pub a: f64,
    /// θ in degrees or δ in mm as labelled; 0 is a zero reading.
    pub drive: f64,
    /// The signal as recorded.
    pub value: f64,
    /// Correction for the sensor's lag, subtracted from `value`.
    pub late: f64,
    /// Number of its run, from 0 in file order; 0 without a column for runs.
    pub run: usize,
    /// Time in s; without a column for times, the row's index.
    pub t: f64,
    /// Hash of the whole line.
    pub text: u64,
}

/// Columns that only a whisker with a second gauge uses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Beside {
    /// Unit of the second signal, and the name of its column.
    pub second: Option<(Unit, String)>,
    /// Name of the column of the pole's tilt.
    pub tilt: Option<String>,
    /// For each row the second signal as recorded and the tilt in degrees; NaN where missing.
    pub values: Vec<[f64; 2]>,
    /// The first field of these columns that is not a number: line, column, text.
    pub fault: Option<(usize, String, String)>,
}

impl Beside {
    /// Names of these columns.
    pub fn names(&self) -> Vec<String> {
        self.second.iter().map(|s| s.1.clone()).chain(self.tilt.clone()).collect()
    }
}

/// A data file.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// File name as the user gave it.
    pub file: String,
    /// Kind of drive; `None` without a column for it.
    pub drive: Option<Drive>,
    /// Unit of the signal.
    pub unit: Unit,
    /// True if a column gives times.
    pub timed: bool,
    /// All rows, without comments and blank lines.
    pub rows: Vec<Row>,
    /// Second gauge and tilt of the pole.
    pub beside: Beside,
    /// Unused columns.
    pub ignored: Vec<String>,
    /// Placeholders of missing values, which are NaN in the rows.
    pub missing: Vec<Missing>,
}

impl Data {
    /// A copy with distances, drives and tilts freed of rounding, so that they can be compared; `as_they_are` excludes distances or drives.
    pub fn rounded(&self, as_they_are: [bool; 2]) -> Self {
        let mut data = self.clone();
        let tilts = rounded(&self.beside.values.iter().map(|v| v[1]).collect::<Vec<_>>());
        data.beside.values.iter_mut().zip(tilts).for_each(|(v, tilt)| v[1] = tilt);
        let labels: [fn(&mut Row) -> &mut f64; 2] = [|r| &mut r.a, |r| &mut r.drive];
        for (label, _) in labels.into_iter().zip(as_they_are).filter(|(_, as_it_is)| !as_it_is) {
            let values = rounded(&data.rows.iter_mut().map(|r| *label(r)).collect::<Vec<_>>());
            data.rows.iter_mut().zip(values).for_each(|(r, x)| *label(r) = x);
        }
        data
    }

    /// The largest distance, mm.
    /// Errors: No distance > 0.
    pub fn furthest(&self) -> Result<f64, InputError> {
        let furthest = self.rows.iter().map(|r| r.a).filter(|a| a.is_finite()).fold(0.0, f64::max);
        let error = || InputError::new("no row has a distance > 0").at(&self.file, None).key("a_mm");
        (furthest > 0.0).then_some(furthest).ok_or_else(|| error().allowed("contact distances in mm"))
    }

    /// Reads the file at `path`.
    /// Errors: a missing file, no CSV; missing, doubled or contradicting columns; a field that is not a number. Empty, `NaN` and `inf` are missing values.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &Self::load(path)?)
    }

    /// Bytes of the file at `path`, read once, since it may be a pipe.
    pub fn load(path: &Path) -> Result<Vec<u8>, InputError> {
        if path.is_dir() {
            let error = InputError::new("this is a folder; a data file is needed");
            return Err(error.at(path.display().to_string(), None));
        }
        TextFile::open(path, "data", Limit::AnyLines)?.bytes()
    }

    /// Reads `bytes`; `label` is their name in messages. Errors as in [`Self::read`].
    pub fn parse(label: &str, bytes: &[u8]) -> Result<Self, InputError> {
        Self::parse_named(label, LabTable::Text(bytes), &Names::default())
    }

    /// [`Self::parse`] for a file or a table in memory; `said` are the user's column names.
    pub fn parse_named(label: &str, table: LabTable<'_>, said: &Names) -> Result<Self, InputError> {
        let here = |e: InputError| InputError { file: Some(label.to_owned()), ..e };
        let table = match table {
            LabTable::Text(bytes) => LabTable::Text(std::str::from_utf8(bytes).map_err(|e| {
                let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
                let error = InputError::new("this data file is not UTF-8 text; save it as UTF-8 CSV");
                error.at(label, Some(line))
            })?),
            LabTable::Frame(frame) => LabTable::Frame(frame),
        };
        let mut sheet = Sheet::new(table, said, &all_names()).map_err(here)?;
        let names = sheet.names.clone();
        let columns = Columns::find(&names, said, None).map_err(|e| sheet.elsewhere(e, label))?;
        let distance = columns.a.ok_or_else(|| sheet.elsewhere(missing(DISTANCE, &names), label))?;

        let mut beside = Beside {
            second: columns.second.map(|(unit, place)| (unit, names[place].clone())),
            tilt: columns.tilt.map(|place| names[place].clone()),
            ..Beside::default()
        };
        let mut others = Others::new(&columns, &names);
        let mut rows: Vec<Row> = Vec::new();
        let mut runs = Runs::default();
        let mut decimals = Decimals::default();
        while let Some((line, row, record)) = sheet.next(said).map_err(here)? {
            if record.len() != names.len() {
                let message =
                    format!("this line has {} fields, but the header has {}", record.len(), names.len());
                let allowed = "one field for each column; decimal commas need ; or tabs between fields";
                return Err(InputError::new(message).value(row).allowed(allowed).at(label, Some(line)));
            }
            let mut number = |place: usize| {
                decimals.number(&record[place]).ok_or_else(|| {
                    let allowed = if decimals.refuses(&record[place]) {
                        "one decimal mark in the whole file, point or comma; nothing between thousands"
                    } else {
                        "a number without unit; empty or NaN where it is missing"
                    };
                    let error = InputError::new(decimals.wrong(&record[place])).key(&names[place]);
                    error.value(record[place].text()).allowed(allowed).at(label, Some(line))
                })
            };
            others.push(&record);
            rows.push(Row {
                run: columns.run.map_or(0, |at| runs.number(&record[at].text(), line)),
                t: columns.time.map_or(Ok(f64::NAN), &mut number)?,
                line,
                a: number(distance)?,
                drive: columns.drive.map_or(Ok(f64::NAN), |(_, place)| number(place))?,
                value: number(columns.signal.1)?,
                late: 0.0,
                text: row.fingerprint(),
            });
            let places = [columns.second.map(|s| s.1), columns.tilt];
            beside.values.push(places.map(|place| {
                let Some(place) = place else { return f64::NAN };
                decimals.number(&record[place]).unwrap_or_else(|| {
                    let fault = || (line, names[place].clone(), record[place].text().into_owned());
                    beside.fault.get_or_insert_with(fault);
                    f64::NAN
                })
            }));
        }
        if rows.is_empty() {
            return Err(InputError::new("this file has a header but no rows").at(label, None));
        }
        sheet.check(said).map_err(here)?;
        if let Some(at) = columns.run {
            runs.check(rows.len())
                .map_err(|e| InputError { line: e.line, ..e.key(&names[at]).at(label, None) })?;
        }
        let timed = columns.time.filter(|_| rows.iter().any(|r| r.t.is_finite()));
        if let Some(at) = timed {
            let wrong = |line: usize, e: InputError| e.key(&names[at]).at(label, Some(line));
            rows.iter().try_for_each(|row| seconds(row.t).map_err(|e| wrong(row.line, e)))?;
            forward(&rows).map_err(|(line, e)| wrong(line, e))?;
        } else {
            rows.iter_mut().enumerate().for_each(|(place, row)| row.t = place as f64);
        }
        if let Some(name) = others.drive(&rows) {
            return Err(sheet.elsewhere(followed(name), label));
        }
        let named = [columns.a, columns.drive.map(|d| d.1), Some(columns.signal.1)]
            .map(|place| place.map_or("", |place| names[place].as_str()));
        let missing = missing::take(&mut rows, named);
        let Columns { drive, signal: (unit, _), ignored, .. } = columns;
        let (file, drive, timed) = (label.to_owned(), drive.map(|d| d.0), timed.is_some());
        Ok(Self { missing, file, drive, unit, timed, rows, beside, ignored })
    }
}
