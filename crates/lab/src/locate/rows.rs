//! Rows of readings: a drive and as many signals as the sensor has.

use std::hash::{DefaultHasher, Hash, Hasher};

use rayon::prelude::*;

use super::{Locator, Spatial, several::Several};
use crate::error::{Checked, Error, InputError};
use crate::fields::{Decimals, number};
use crate::measure::columns::{Columns, may_drive};
use crate::measure::header::{Comments, before, words};
use crate::measure::{Names, Unit, time::Memory};
use crate::scene::{Drive, Signal};
use crate::sink::{LabCell, LabRow};

/// What answers readings: one whisker with one gauge or two, or a sensor with several channels.
#[derive(Clone, Copy)]
pub struct Answerer<'a> {
    /// What knows each signal; one of two gauges.
    pub locators: &'a [Locator],
    pub(super) several: Option<&'a Several>,
}

impl<'a> From<&'a Locator> for Answerer<'a> {
    fn from(locator: &'a Locator) -> Self {
        Self { locators: std::slice::from_ref(locator), several: None }
    }
}

/// A reading of every signal, above their zeros.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    pub line: usize,
    /// Degrees or mm, as recorded; NaN where it is not known.
    pub drive: f64,
    /// Strain, or the unit of the reading.
    pub signals: Vec<f64>,
    /// Variance of each zero in units of that of one reading.
    pub shares: Vec<f64>,
    /// Zero readings before it: taps with the same number are above the same zero.
    pub zeros: u64,
    /// Shift of the base towards the object from where distances are counted, mm; NaN if the row has none.
    pub shift: f64,
}

impl<'a> Answerer<'a> {
    /// The one whose rig and columns are those of all.
    pub fn first(self) -> &'a Locator {
        &self.locators[0]
    }

    /// What knows the zero of signal `k`.
    pub fn locator(self, k: usize) -> &'a Locator {
        &self.locators[k.min(self.locators.len() - 1)]
    }

    pub fn signals(self) -> usize {
        self.locators.len() + usize::from(self.is_twofold())
    }

    /// The column of signal `k` in the unit of the calibration.
    pub fn column(self, k: usize) -> &'a str {
        match self.several {
            Some(several) => &several.names[k],
            None if k == 0 => self.first().unit.common(),
            None if self.first().unit.is_absolute() => Unit::Strain.second(),
            None => Unit::Reading.second(),
        }
    }

    /// True of one signal, whose taps are answered at once.
    pub fn is_alone(self) -> bool {
        self.signals() == 1
    }

    /// True of two gauges, which tell the tilt too.
    pub fn is_twofold(self) -> bool {
        self.several.is_none() && self.first().is_twofold()
    }

    /// True of several channels, which may find the drive of a tap.
    pub fn finds_drives(self) -> bool {
        self.several.is_some()
    }

    /// The answers to `taps`, of two gauges with the contact in space.
    pub(super) fn answer(self, taps: &[Reading]) -> Result<Vec<Spatial>, Error> {
        let locator = self.first();
        let alone = |t: &Reading| Spatial::of(locator.locate_above(t.drive, t.signals[0], 0.0, t.shares[0]));
        match self.several {
            Some(several) => {
                let one = |t: &Reading| several.locate(t.drive, &t.signals, &t.shares);
                Ok(taps.par_iter().map(|t| one(t).map_or_else(Spatial::nothing, Spatial::of)).collect())
            }
            None if locator.is_twofold() => locator.locate_pairs(taps),
            None => Ok(taps.iter().map(alone).collect()),
        }
    }

    /// What the user said of columns, as signal `k` reads it.
    fn said(self, said: &Names, k: usize) -> Names {
        self.several.map_or_else(|| said.clone(), |several| said.of_channel(several.columns[k].clone()))
    }
}

pub(super) struct Header {
    pub names: Vec<String>,
    /// None where no header says it.
    separator: Option<char>,
    drive: Option<(Drive, usize)>,
    pub time: Option<usize>,
    run: Option<usize>,
    /// Unit and place of each signal.
    signals: Vec<(Unit, usize)>,
}

pub struct RowReader<'a> {
    pub(super) who: Answerer<'a>,
    pub(super) header: Header,
    decimals: Decimals,
    /// Memory of a sensor that lags, from the rows before.
    memory: Memory,
    /// True if the last row is taken as settled because its time is missing, or before that of a row above.
    pub untimed: bool,
}

impl<'a> RowReader<'a> {
    /// Rows for `who`. Without a header: the drive, unless it is known or found, then the signals in the units of the calibration.
    pub fn new(who: Answerer<'a>) -> Self {
        let (kind, unit) = (who.first().rig.setup.drive, who.first().unit);
        let signal = |k: usize| match who.several {
            Some(several) => several.names[k].clone(),
            None => [unit.column(), unit.second()][k].to_owned(),
        };
        let names = [kind.column().to_owned()].into_iter().chain((0..who.signals()).map(signal)).collect();
        let signals = (0..who.signals()).map(|k| (who.locator(k).unit, k + 1)).collect();
        let header =
            Header { names, separator: None, drive: Some((kind, 0)), time: None, run: None, signals };
        let (decimals, memory) = Default::default();
        Self { who, header, decimals, memory, untimed: false }
    }

    /// Reads the first row. True if it is a header: it names a known column or, in a `file`, anything that is no number.
    pub fn first(&mut self, row: LabRow<'_>, comments: &Comments, said: &Names, file: bool) -> Checked<bool> {
        let separator = row.separator();
        let mut names = match row {
            LabRow::Line(line) => words(line, separator),
            LabRow::Of(frame, _) => frame.names.iter().map(|name| name.to_string()).collect(),
        };
        let mut comment = None;
        if let LabRow::Line(line) = row {
            let own = self.who.said(said, 0);
            if let Some((at, others)) = before(comments, line, &names, &own)? {
                (comment, names) = (Some(at), others);
            } else if !names.iter().any(|f| own.known(f) || (file && number(f).is_none())) {
                if said.is_empty() {
                    return Ok(false);
                }
                let error = InputError::new("the first line names no columns").key("--columns").value(line);
                return Err(error.allowed("a header with these columns; or no --columns"));
            }
        }
        let found = |k: usize| columns(self.who, k, &names, &self.who.said(said, k));
        let all = (0..self.who.locators.len()).map(found).collect::<Result<Vec<_>, _>>();
        let all = all.map_err(|e| InputError { line: comment.or(e.line), ..e })?;
        let second = all[0].second.filter(|_| self.who.is_twofold());
        let signals = all.iter().map(|columns| columns.signal).chain(second).collect();
        let Columns { drive, time, run, .. } = all[0];
        self.header = Header { names, separator: Some(separator), drive, time, run, signals };
        Ok(comment.is_none())
    }

    pub fn drive(&self) -> Drive {
        self.header.drive.map_or(self.who.first().rig.setup.drive, |(drive, _)| drive)
    }

    /// Strain, or the reading, of a recorded value of signal `k`.
    pub fn signal(&self, k: usize, value: f64) -> f64 {
        self.header.signals[k].0.strain(value, self.who.locator(k).rig.setup.gauge.factor)
    }

    /// Signal `k` above its zero, both as [`Self::signal`] gives them.
    pub fn above(&self, k: usize, signal: f64, zero: f64) -> f64 {
        self.header.signals[k].0.above(signal, zero, self.who.locator(k).rig.setup.gauge.factor)
    }

    pub fn cells<'b>(&self, line: LabRow<'b>) -> Vec<LabCell<'b>> {
        line.cells(self.header.separator.unwrap_or_else(|| line.separator()))
    }

    /// The fields `cells` of a line by the names of the columns; where the drive may be left out, and is, an empty one stands for it.
    pub fn named<'b>(&self, mut cells: Vec<LabCell<'b>>) -> Vec<LabCell<'b>> {
        if self.header.separator.is_none() && cells.len() == self.who.signals() {
            cells.insert(0, LabCell::EMPTY);
        }
        cells
    }

    /// Drive and signals of a `line`; NaN where one is missing, infinite where one of several channels is no number; `None` of another shape.
    pub fn parse(&mut self, line: LabRow<'_>, cells: &[LabCell<'_>]) -> Option<(f64, Vec<f64>)> {
        let (only, several) = (self.who.first().only_drive(), self.who.finds_drives());
        let left_out = self.header.separator.is_none() && cells.len() == self.who.signals();
        let cells = self.named(cells.to_vec());
        let none = left_out && !several && (only.is_none() || line.is_blank());
        if none || cells.len() != self.header.names.len() {
            return None;
        }
        let Header { time, run, .. } = self.header;
        // Time and run of the row; nothing where no column says the time.
        let when = time.and_then(|place| cells.get(place)).map(|cell| self.optional_number(cell));
        let when = when.map(|t| {
            let mut hasher = DefaultHasher::new();
            run.and_then(|place| cells.get(place)).map(LabCell::text).hash(&mut hasher);
            (t, hasher.finish())
        });
        let drive = self.header.drive.map_or(&LabCell::EMPTY, |(_, place)| &cells[place]);
        let drive = match only.filter(|_| drive.is_empty()) {
            Some(only) => only,
            None => self.number(drive),
        };
        let mut signals = Vec::with_capacity(self.header.signals.len());
        for k in 0..self.header.signals.len() {
            let mut value = self.number(&cells[self.header.signals[k].1]);
            if let (0, Some(lag), Some((t, run)), false) = (k, self.who.first().lag, when, several) {
                // Without a time the settled value is unknown.
                if t.is_infinite() {
                    return None;
                }
                self.untimed = !self.memory.follows(t, run);
                value = self.memory.settled(&lag, t, run, value).0;
            }
            signals.push(if value.is_infinite() { value } else { self.signal(k, value) });
        }
        Some((drive, signals))
    }

    /// The number of a field: NaN where it holds none. Of several channels a field may be left out, and what is no number is infinite.
    fn number(&mut self, field: &LabCell<'_>) -> f64 {
        match self.who.finds_drives() {
            true => self.optional_number(field),
            false => self.decimals.number(field).unwrap_or(f64::NAN),
        }
    }

    /// The number of a field that may be left out: NaN of an empty one and of `nan`, infinite of what is no number.
    fn optional_number(&mut self, field: &LabCell<'_>) -> f64 {
        if field.is_empty() || field.text().eq_ignore_ascii_case("nan") {
            return f64::NAN;
        }
        self.decimals.number(field).filter(|x| x.is_finite()).unwrap_or(f64::INFINITY)
    }
}

/// The columns of `names`, as `said`, that hold readings of signal `k`.
fn columns(who: Answerer<'_>, k: usize, names: &[String], said: &Names) -> Result<Columns, InputError> {
    let locator = who.locator(k);
    let kind = locator.rig.setup.drive;
    let allowed = match locator.unit.signal() {
        Some(Signal::Strain) => {
            "exactly one of strain, microstrain, bridge_mV_per_V; or --columns strain=NAME"
        }
        Some(Signal::Moment) => "moment_Nmm; or --columns moment=NAME",
        Some(Signal::Force) => "force_N; or --columns force=NAME",
        None => "reading, in the unit of the calibration; or --columns reading=NAME",
    };
    let columns = Columns::find(names, said, Some(kind)).map_err(|e| match e.key.as_deref() {
        Some("strain") if e.message.starts_with("column") => InputError {
            message: e.message.replace("column strain", &format!("column {}", locator.unit.common())),
            ..e.key(locator.unit.common()).allowed(allowed)
        },
        _ => e,
    })?;
    match columns.drive {
        Some((drive, place)) if drive != kind && locator.drive_recorded => {
            let error = InputError::new("these readings are driven another way than the calibration");
            return Err(error.key(&names[place]).allowed(kind.column()));
        }
        None if locator.only_drive().is_none() && !who.finds_drives() => {
            let error = InputError::new(format!("column {} is missing", kind.column()));
            let role = if kind == Drive::Angle { "theta" } else { "delta" };
            let likely = names.iter().find(|n| may_drive(n)).map_or("NAME", |n| n.as_str());
            let allowed = format!("a column with the drive of each tap; or --columns {role}={likely}");
            return Err(error.key(kind.column()).value(names.join(",")).allowed(allowed));
        }
        _ => {}
    }
    if columns.signal.0.signal() != locator.unit.signal() {
        let error = InputError::new("the calibration was made with another kind of signal");
        return Err(error.key(&names[columns.signal.1]).allowed(allowed));
    }
    if locator.is_twofold() && columns.second.is_none_or(|s| s.0 != columns.signal.0) {
        let wanted = columns.signal.0.second();
        let error = InputError::new(format!("column {wanted} is missing: the calibration is of two gauges"));
        let allowed = "both signals, of one kind; a calibration of one gauge (no second = true in [gauge])";
        return Err(error.key(wanted).value(names.join(",")).allowed(allowed));
    }
    Ok(columns)
}
