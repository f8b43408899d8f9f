//! One line of readings: which field is what.

use std::hash::{DefaultHasher, Hash, Hasher};

use super::Locator;
use crate::error::InputError;
use crate::fields::{self};
use crate::fields::{Decimals, fields, separator};
use crate::measure::Unit;
use crate::measure::header::Comments;
use crate::measure::lag::Memory;
use crate::measure::{
    columns::{Columns, may_drive},
    names::Names,
};
use crate::scene::{Drive, Signal};
use crate::sink::lab::{LabCell, LabRow};

/// The first line of a file, if it names columns.
struct Header {
    columns: Columns,
    names: Vec<String>,
    separator: char,
}

/// How lines are read.
pub struct Lines<'a> {
    locator: &'a Locator,
    header: Option<Header>,
    decimals: Decimals,
    /// What a sensor that lags remembers of the lines before.
    memory: Memory,
    /// Whether the last line had no time that follows those before.
    untimed: bool,
}

impl<'a> Lines<'a> {
    /// Lines for `locator`; without a header they hold the drive, which may be left out where it is known, and the signal in the
    /// unit of the calibration.
    pub fn new(locator: &'a Locator) -> Self {
        Self {
            locator,
            header: None,
            decimals: Decimals::default(),
            memory: Memory::default(),
            untimed: false,
        }
    }

    /// Looks at the first line; whether it is a header: it names a column that is known, or, in a `file`, anything that is no number. Where it is
    /// none, one of the `comments` before it may be.
    ///
    /// # Errors
    /// Columns that do not fit the calibration.
    pub fn first(
        &mut self,
        row: LabRow<'_>,
        comments: &Comments,
        said: &Names,
        file: bool,
    ) -> Result<bool, InputError> {
        let line = match row {
            LabRow::Line(line) => line,
            LabRow::Of(frame, _) => {
                let names: Vec<String> = frame.names.iter().map(|name| name.to_string()).collect();
                let columns = self.find(&names, said)?;
                self.header = Some(Header { columns, names, separator: ',' });
                return Ok(true);
            }
        };
        let mark = separator(line);
        let names: Vec<String> = fields(line, mark).iter().map(|f| f.to_string()).collect();
        if let Some((line, names)) = comments.before(line, &names, said)? {
            let columns = self.find(&names, said).map_err(|e| InputError { line: Some(line), ..e })?;
            self.header = Some(Header { columns, names, separator: mark });
            return Ok(false);
        }
        if !names.iter().any(|f| said.known(f) || (file && fields::number(f).is_none())) {
            return match said.is_empty() {
                true => Ok(false),
                false => {
                    let error =
                        InputError::new("the first line names no columns").key("--columns").value(line);
                    Err(error.allowed("a header with these columns; or no --columns"))
                }
            };
        }
        let columns = self.find(&names, said)?;
        self.header = Some(Header { columns, names, separator: mark });
        Ok(true)
    }

    /// Whether the columns were named, by a header or by a comment.
    pub fn is_headed(&self) -> bool {
        self.header.is_some()
    }

    fn find(&self, names: &[String], said: &Names) -> Result<Columns, InputError> {
        let (locator, kind) = (self.locator, self.locator.rig.setup.drive);
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
            None if locator.only_drive().is_none() && !locator.of_several => {
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
            let error =
                InputError::new(format!("column {wanted} is missing: the calibration is of two gauges"));
            let allowed =
                "both signals, of one kind; a calibration of one gauge (no second = true in [gauge])";
            return Err(error.key(wanted).value(names.join(",")).allowed(allowed));
        }
        Ok(columns)
    }

    /// Names of the columns.
    pub fn names(&self) -> Vec<String> {
        match &self.header {
            Some(header) => header.names.clone(),
            None => {
                let second = self.locator.is_twofold().then(|| self.unit().second().to_owned());
                let first = [self.locator.rig.setup.drive.column(), self.unit().column()];
                first.map(str::to_owned).into_iter().chain(second).collect()
            }
        }
    }

    /// What drives the whisker.
    pub fn drive(&self) -> Drive {
        let said = self.header.as_ref().and_then(|h| h.columns.drive);
        said.map_or(self.locator.rig.setup.drive, |(drive, _)| drive)
    }

    /// Unit of the signal.
    pub fn unit(&self) -> Unit {
        self.header.as_ref().map_or(self.locator.unit, |h| h.columns.signal.0)
    }

    /// The fields of a line.
    pub fn cells<'b>(&self, line: LabRow<'b>) -> Vec<LabCell<'b>> {
        line.cells(self.header.as_ref().map_or_else(|| line.separator(), |h| h.separator))
    }

    /// The fields `cells` of a line by the names of the columns; where the drive may be left out, and is, an empty one stands for it.
    pub fn named<'b>(&self, mut cells: Vec<LabCell<'b>>) -> Vec<LabCell<'b>> {
        if self.header.is_none() && cells.len() == self.signals() {
            cells.insert(0, LabCell::EMPTY);
        }
        cells
    }

    /// How many signals a reading has.
    fn signals(&self) -> usize {
        1 + usize::from(self.locator.is_twofold())
    }

    /// The second signal of a line that [`Self::parse`] reads; NaN where it is missing or no number.
    pub fn second(&mut self, cells: &[LabCell<'_>]) -> f64 {
        let place = match &self.header {
            Some(header) => header.columns.second.map(|s| s.1),
            // After the drive, if it is there, and the first signal.
            None => cells.len().checked_sub(1).filter(|_| self.locator.is_twofold()),
        };
        let field = place.and_then(|place| cells.get(place));
        field.and_then(|f| self.decimals.number(f)).map_or(f64::NAN, |value| self.signal(value))
    }

    /// The number of a field that holds one; NaN of any other.
    pub fn number(&mut self, field: &LabCell<'_>) -> f64 {
        self.decimals.number(field).unwrap_or(f64::NAN)
    }

    /// The number of a field that may be left out: NaN of an empty one and of `nan`, infinite of what is no number.
    pub fn optional_number(&mut self, field: &LabCell<'_>) -> f64 {
        if field.is_empty() || field.text().eq_ignore_ascii_case("nan") {
            return f64::NAN;
        }
        self.decimals.number(field).filter(|x| x.is_finite()).unwrap_or(f64::INFINITY)
    }

    /// The signal of a field that may be left out, as [`Self::told`].
    pub fn signal_if_told(&mut self, field: &LabCell<'_>) -> f64 {
        let value = self.optional_number(field);
        if value.is_infinite() { value } else { self.signal(value) }
    }

    /// Strain, or the reading, of a recorded value.
    pub fn signal(&self, value: f64) -> f64 {
        self.unit().strain(value, self.locator.rig.setup.gauge.factor)
    }

    /// A signal above its zero, both as [`Self::signal`] gives them.
    pub fn above(&self, signal: f64, zero: f64) -> f64 {
        self.unit().above(signal, zero, self.locator.rig.setup.gauge.factor)
    }

    /// Drive and signal of a `line` with the fields `all`, NaN where one is missing or no number; `None` for a line of another shape.
    pub fn parse(&mut self, line: LabRow<'_>, all: &[LabCell<'_>]) -> Option<(f64, f64)> {
        let only = self.locator.only_drive();
        let places = self.header.as_ref().map(|h| &h.columns);
        let places = places.map(|c| (c.fields, c.drive.map(|d| d.1), c.signal.1));
        let when = self.when(all);
        let (count, field, none) = (all.len(), |place: usize| all.get(place), &LabCell::EMPTY);
        let (drive, signal) = match places {
            None => match (count + 1 - self.signals(), only) {
                (2, _) => (field(0), field(1)?),
                (1, Some(_)) if !line.is_blank() => (Some(none), field(0)?),
                _ => return None,
            },
            Some((fields, drive, signal)) if fields == count => {
                (drive.map_or(Some(none), field), field(signal)?)
            }
            Some(_) => return None,
        };
        let drive = match (drive?, only) {
            (drive, Some(only)) if drive.is_empty() => only,
            (drive, _) if self.locator.of_several => self.optional_number(drive),
            (drive, _) => self.number(drive),
        };
        let signal = if self.locator.of_several {
            self.signal_if_told(signal)
        } else {
            let mut value = self.number(signal);
            if let (Some(lag), Some((t, run))) = (self.locator.lag, when) {
                // A word is no time; what it settles to is not known.
                if t.is_infinite() {
                    return None;
                }
                self.untimed = !self.memory.follows(t, run);
                value = self.memory.settled(&lag, t, run, value).0;
            }
            self.signal(value)
        };
        Some((drive, signal))
    }

    /// Whether the last line is taken as settled because its time is missing, or before that of a line above.
    pub fn is_untimed(&self) -> bool {
        self.untimed
    }

    /// Whether lines have a time.
    pub fn is_timed(&self) -> bool {
        self.header.as_ref().is_some_and(|h| h.columns.time.is_some())
    }

    /// Time and run of a line of these fields; `None` where no column says the time.
    fn when(&mut self, fields: &[LabCell<'_>]) -> Option<(f64, u64)> {
        let Columns { time, run: named, .. } = self.header.as_ref()?.columns;
        let t = self.optional_number(fields.get(time?)?);
        let mut run = DefaultHasher::new();
        named.and_then(|place| fields.get(place)).map(LabCell::text).hash(&mut run);
        Some((t, run.finish()))
    }
}
