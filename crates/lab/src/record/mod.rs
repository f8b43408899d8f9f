//! Taps out of a raw signal: rest, onset, plateau or peak.
//!
//! The level without contact is followed through the record ([`mod@rest`]); what stands out of it is contact ([`mod@find`]); a contact holds one reading, or
//! one for each drive at which it stands still.

pub mod contact;
pub mod find;
pub mod rest;

pub use find::{Kind, Reading, Take, find};

use crate::locate::object::NAME as OBJECT;
use crate::measure::names::{DISTANCE, Names, TILT};
use crate::measure::{Unit, columns::Columns, header::Sheet, time::seconds};
use crate::{error::InputError, fields::Decimals, scene::Drive, sink::lab::LabTable};

const LEAST: usize = 20;

#[derive(Debug, Clone)]
pub struct Record {
    pub file: String,
    /// Seconds, rising.
    pub time: Vec<f64>,
    pub signal: Vec<f64>,
    pub unit: Unit,
    /// Degrees or mm, as recorded.
    pub drive: Option<(Drive, Vec<f64>)>,
    /// Names and fields of distance, tilt and run, where there are such columns.
    pub labels: Vec<(String, Vec<String>)>,
    pub ignored: Vec<String>,
    /// Lines without a signal, which are left out.
    pub empty: usize,
}

impl Record {
    /// From a file or a table in memory: a header, then a sample in each row.
    pub fn parse(file: &str, table: LabTable<'_>, said: &Names) -> Result<Self, InputError> {
        let text = if let LabTable::Text(bytes) = table { String::from_utf8_lossy(bytes) } else { "".into() };
        let table = if let LabTable::Frame(f) = table { LabTable::Frame(f) } else { LabTable::Text(&*text) };
        let here = |e: InputError| InputError { file: Some(file.to_owned()), ..e };
        let mut sheet = Sheet::new(table, said, "t_s and the signal of each sample").map_err(here)?;
        let (names, first) = (sheet.names.clone(), sheet.line);
        let at = |error: InputError, line: usize| error.at(file, Some(line));
        let columns = Columns::find(&names, said, None).map_err(|e| sheet.elsewhere(e, file))?;
        let Some(time) = columns.time else {
            let error = InputError::new("column t_s is missing: a raw record has the time of each sample");
            let error = error.key("t_s").value(names.join(","));
            return Err(at(error.allowed("t_s, in seconds; or --columns t=NAME"), first));
        };
        let object = names.iter().position(|name| name == OBJECT);
        // Named as in data files.
        let labels = [(columns.a, DISTANCE), (columns.tilt, TILT), (columns.run, "run"), (object, OBJECT)];
        let there = |(place, name): (Option<usize>, &str)| Some((place?, (name.to_owned(), Vec::new())));
        let (labelled, labels): (Vec<usize>, _) = labels.into_iter().filter_map(there).unzip();
        let ignored = columns.ignored.iter().filter(|name| *name != OBJECT).cloned().collect();
        let drive = columns.drive.map(|(kind, _)| (kind, Vec::new()));
        let (label, of_time, signal, unit) = (file.to_owned(), Vec::new(), Vec::new(), columns.signal.0);
        let mut record = Self { file: label, time: of_time, signal, unit, drive, labels, ignored, empty: 0 };
        let mut decimals = Decimals::default();
        while let Some((line, _, all)) = sheet.next(said).map_err(here)? {
            if all.len() != names.len() {
                let error = InputError::new("this line has another number of fields than the header");
                return Err(at(error.value(all.len()).allowed(names.len().to_string()), line));
            }
            if matches!(&*all[columns.signal.1].text(), "" | "NaN" | "nan") {
                record.empty += 1;
                continue;
            }
            let mut number = |place: usize| match decimals.number(&all[place]) {
                Some(x) if x.is_finite() => Ok(x),
                _ => {
                    let allowed = "a number; samples that are missing are left out";
                    let error = InputError::new(decimals.wrong(&all[place])).key(&names[place]);
                    Err(at(error.value(all[place].text()).allowed(allowed), line))
                }
            };
            let t = number(time)?;
            seconds(t).map_err(|e| at(e.key(&names[time]).allowed("seconds"), line))?;
            if record.time.last().is_some_and(|before| *before >= t) {
                let error = InputError::new("this time is not after the one before").key(&names[time]);
                return Err(at(error.value(t).allowed("seconds that rise from sample to sample"), line));
            }
            record.time.push(t);
            record.signal.push(number(columns.signal.1)?);
            if let (Some((_, drives)), Some((_, place))) = (&mut record.drive, columns.drive) {
                drives.push(number(place)?);
            }
            for ((_, values), place) in record.labels.iter_mut().zip(&labelled) {
                values.push(all[*place].text().into_owned());
            }
        }
        sheet.check(said).map_err(here)?;
        if record.time.len() < LEAST {
            let error = InputError::new("this record is too short").at(file, None).key("samples");
            return Err(error.value(record.time.len()).allowed(format!("{LEAST} samples or more")));
        }
        Ok(record)
    }

    /// The one label of the samples `from … to` in each column; empty where they differ.
    pub fn labels(&self, from: usize, to: usize) -> Vec<&str> {
        let of = |values: &Vec<String>| values[from..=to].iter().all(|v| *v == values[from]).then_some(from);
        self.labels.iter().map(|(_, values)| of(values).map_or("", |k| values[k].as_str())).collect()
    }
}
