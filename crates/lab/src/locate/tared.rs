//! Rows of readings above their zeros: one by one, or all of a file with their answers for contours, arrays and the next tap.

use std::cell::OnceCell;

use super::lines::{Line, Source};
use super::stream::{Kept, UNRECORDED};
use super::tare::{Tare, doubt};
use super::{Answerer, Ask, By, Locator, Reading, Spatial, rows::RowReader};
use crate::error::{Checked, InputError, Result};
use crate::measure::{Zero, header::Thousands, missing::is_usual};
use crate::sink::{Field, Frame, Heading, LabCell, LabStream, LabTable};
use crate::{fields::plain, reduce::median, status::Status};

/// A placeholder such as -1 is no zero reading if it differs from the others by this share of a usual tap.
const NO_ZERO: f64 = 0.1;

/// Zero readings of a whole file, those of each signal, and the lines of those that are none by their size. Empty where the file has none.
pub fn zeros(who: Answerer<'_>, input: LabStream<'_>, ask: &Ask<'_>) -> Result<(Vec<Zero>, Vec<usize>)> {
    let (mut source, mut rows) = (Source::new(input, ask), RowReader::new(who));
    let (mut readings, mut numbers, mut sizes) = (vec![Vec::new(); who.signals()], Vec::new(), Vec::new());
    let mut thousands = Thousands::default();
    while let Some(row) = recorded(&mut source, &mut rows, (Some(&mut thousands), None))? {
        if !row.rests {
            sizes.extend(Some(row.recorded[0]).filter(|x| x.is_finite()));
            continue;
        }
        numbers.push((row.line.place, row.line.number));
        for (k, signal) in row.recorded.into_iter().enumerate().filter(|(_, x)| x.is_finite()) {
            let last = readings[k].last().map_or(signal, |(_, zero)| *zero);
            readings[k].push((row.line.place, who.locator(k).beside(last, signal)));
        }
    }
    let here = |e: InputError| InputError { file: Some(ask.label().to_owned()), ..e };
    thousands.check(&rows.header.names, ask.columns).map_err(here)?;
    let mut all: Vec<f64> = readings[0].iter().map(|r| r.1).collect();
    if all.is_empty() {
        return Ok((vec![Zero::default(); who.signals()], Vec::new()));
    }
    // Placeholders and exact zeros are left out where other readings exist.
    let is_none = |x: f64| x == 0.0 || is_usual(x);
    let mut judged: Vec<f64> = all.iter().copied().filter(|x| !is_none(*x)).collect();
    let middle = median(if judged.is_empty() { &mut all } else { &mut judged });
    let locator = who.first();
    let mut sizes: Vec<f64> = sizes.iter().map(|s| (locator.beside(middle, *s) - middle).abs()).collect();
    let scale = if sizes.is_empty() { f64::INFINITY } else { median(&mut sizes) };
    let mut off = Zero::outliers(&readings[0], scale);
    let missing =
        |r: &&(usize, f64)| !judged.is_empty() && is_none(r.1) && (r.1 - middle).abs() > NO_ZERO * scale;
    off.extend(readings[0].iter().filter(missing).map(|r| r.0));
    let wrong = numbers.iter().filter(|(place, _)| off.contains(place)).map(|(_, n)| *n).collect();
    readings.iter_mut().for_each(|all| all.retain(|r| !off.contains(&r.0)));
    Ok((readings.iter().map(|all| Zero::new(all)).collect(), wrong))
}

pub(super) struct TaredRow<'b> {
    pub line: Line<'b>,
    /// Its fields by the names of the columns.
    pub cells: Vec<LabCell<'b>>,
    /// The recorded number; NaN if the line has none.
    pub drive: f64,
    pub recorded: Vec<f64>,
    pub rests: bool,
    /// True if it is taken as settled for want of a time.
    pub untimed: bool,
    /// What was subtracted from the first signal; NaN where nothing is known.
    pub zero: f64,
    /// The tap; else why it has no distance.
    pub tap: Result<Reading, Status>,
}

/// The next row as recorded. With `unclear`, a line with a number that may be more than a thousand is no reading.
fn recorded<'s>(
    source: &'s mut Source<'_>,
    rows: &mut RowReader<'_>,
    (thousands, unclear): (Option<&mut Thousands>, Option<&OnceCell<()>>),
) -> Result<Option<TaredRow<'s>>> {
    let (who, ask) = (rows.who, source.ask);
    let Some(line) = source.next(rows)? else { return Ok(None) };
    // Without a row there are no fields.
    let cells = line.row.map_or_else(Vec::new, |row| rows.cells(row));
    let mut read = line.row.and_then(|row| rows.parse(row, &cells));
    let cells = rows.named(cells);
    if let Some((seen, row)) = thousands.zip(line.row) {
        let grouped = seen.see(line.number, &cells, row.separator());
        if let Some(once) = unclear.filter(|_| grouped)
            && let Err(why) = seen.check(&rows.header.names, ask.columns)
        {
            read = None;
            once.get_or_init(|| {
                (ask.warn)(&format!("line {}: {why}: such lines are bad_input", line.number))
            });
        }
    }
    let (drive, recorded) = read.unwrap_or_else(|| (f64::NAN, vec![f64::NAN; who.signals()]));
    let rests = drive.is_finite() && recorded[0].is_finite() && who.first().rests(drive);
    let untimed = rows.untimed;
    let (zero, tap) = (f64::NAN, Err(Status::NO_STRAIN));
    Ok(Some(TaredRow { line, cells, drive, recorded, rests, untimed, zero, tap }))
}

pub(super) struct TaredRows<'a> {
    source: Source<'a>,
    pub rows: RowReader<'a>,
    tares: Vec<Tare>,
    zeros: u64,
    follows: bool,
    asked: bool,
    /// Of input that was not looked through before.
    thousands: Option<Thousands>,
    unclear: OnceCell<()>,
}

impl<'a> TaredRows<'a> {
    /// Reads the columns of `input`. Without the `zero` of each signal, zero readings among the rows serve those after them.
    pub fn new(
        who: Answerer<'a>,
        input: LabStream<'a>,
        ask: &'a Ask<'a>,
        zero: Option<Vec<Zero>>,
    ) -> Result<Self> {
        let (mut source, mut rows) = (Source::new(input, ask), RowReader::new(who));
        source.first(&mut rows)?;
        let thousands = zero.is_none().then(Thousands::default);
        let tares = tares(who, &rows, ask, zero.unwrap_or_default())?;
        let (zeros, unclear) = (0, OnceCell::new());
        Ok(Self { source, rows, tares, zeros, follows: false, asked: false, thousands, unclear })
    }

    pub fn next(&mut self) -> Result<Option<TaredRow<'_>>> {
        let Self { source, rows, .. } = self;
        let (who, ask) = (rows.who, source.ask);
        // The search for zeros, if there was one, has judged these numbers.
        let seen = self.thousands.as_mut();
        let unclear = Some(&self.unclear).filter(|_| seen.is_some());
        let Some(mut row) = recorded(source, rows, (seen, unclear))? else { return Ok(None) };
        let follows = std::mem::replace(&mut self.follows, row.rests);
        let line = row.line.number;
        if row.rests {
            self.zeros += 1;
            if let Some(zero) = ask.zero[0].filter(|_| self.zeros == 1) {
                let zero = plain(zero);
                (ask.warn)(&format!("the zero readings from line {line} on take the place of --zero {zero}"));
            }
            for (k, signal) in row.recorded.iter().enumerate().filter(|(_, x)| x.is_finite()) {
                let aside = self.tares[k].see(who.locator(k), *signal, follows);
                if let Some(zero) = aside.filter(|_| k == 0 || who.finds_drives()) {
                    (ask.warn)(&format!(
                        "line {line}: a zero reading of {signal:.4e} is far off the others ({zero:.4e}); it is not used unless the next one is like it"
                    ));
                }
            }
            return Ok(Some(row));
        }
        let known = match who.finds_drives() {
            true => row.recorded.iter().any(|x| x.is_finite()),
            false => row.drive.is_finite() && row.recorded[0].is_finite(),
        };
        if !known {
            row.tap = Err(Status::BAD_INPUT);
            return Ok(Some(row));
        }
        let zeros: Vec<Option<(f64, f64)>> = self.tares.iter().map(|tare| tare.at(row.line.place)).collect();
        let free = matches!(ask.by, By::Strokes(free) if free.zero);
        if !std::mem::replace(&mut self.asked, true) && !free {
            let known = if who.is_twofold() { 1 } else { zeros.len() };
            for text in (0..known).filter_map(|k| doubt(who.locator(k), zeros[k].map(|z| z.0))) {
                (ask.warn)(&if who.finds_drives() { text.replace(", or --zero", "") } else { text });
            }
        }
        row.zero = zeros[0].map_or(f64::NAN, |z| z.0);
        let known = zeros.iter().map(|zero| zero.unwrap_or((0.0, 0.0)));
        let (values, shares): (Vec<f64>, Vec<f64>) = known.unzip();
        row.tap = Ok(Reading {
            line,
            drive: if who.first().drive_recorded { row.drive } else { UNRECORDED },
            signals: (0..values.len()).map(|k| rows.above(k, row.recorded[k], values[k])).collect(),
            shares,
            zeros: self.zeros,
            shift: 0.0,
        });
        Ok(Some(row))
    }
}

/// The zero of each signal: that of the file, if it has any, else what the user said or the calibration fitted.
fn tares(who: Answerer<'_>, rows: &RowReader<'_>, ask: &Ask<'_>, zeros: Vec<Zero>) -> Checked<Vec<Tare>> {
    let said = ask.zero.map(|zero| zero.map(|z| rows.signal(0, z)));
    if let Some(k) = (0..2).find(|&k| said[k].is_some_and(|z| !z.is_finite())) {
        let error = InputError::new("this is no zero of such a signal").key("--zero");
        let error = error.value(plain(ask.zero[k].unwrap_or(f64::NAN)));
        return Err(error.allowed("a number in the unit of the signal"));
    }
    let mut zeros = zeros.into_iter();
    let tare = |k: usize| match zeros.next().filter(|zero| zero.count > 0) {
        Some(zero) => Tare::File(zero),
        None if k > 0 && who.is_twofold() => Tare::said(said[k]),
        None => Tare::new(who.locator(k), said[k.min(1)].filter(|_| !who.finds_drives())),
    };
    Ok((0..who.signals()).map(tare).collect())
}

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
    pub fn of(locator: &Locator, input: LabTable<'_>, ask: &Ask<'_>, of: &Heading) -> Result<Self> {
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
    pub fn numbers(&self, name: &str) -> Checked<Option<Vec<f64>>> {
        let Some(place) = self.column(name) else { return Ok(None) };
        if self.names.iter().filter(|n| *n == name).count() > 1 {
            let error = InputError::new("this column appears twice").at(self.file.clone(), Some(1));
            return Err(error.key(name).allowed("each column once"));
        }
        let value = |row: &AnsweredRow| match row.fields.get(place) {
            None => Ok(f64::NAN),
            Some(field) => field.number().ok_or_else(|| {
                let error = InputError::new("this is not a number").at(self.file.clone(), Some(row.line));
                let error = error.key(name).value(field.text());
                error.allowed("a number without unit; empty or NaN where it is missing")
            }),
        };
        self.rows.iter().map(value).collect::<Result<_, _>>().map(Some)
    }
}
