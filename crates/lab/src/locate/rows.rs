//! Rows of readings: a drive and as many signals as the sensor has.

use rayon::prelude::*;

use super::reading::Lines;
use super::several::Several;
use super::{Located, Locator, PairOfReadings, Spatial};
use crate::error::{Error, InputError};
use crate::measure::Names;
use crate::measure::header::{Comments, same};
use crate::sink::lab::{LabCell, LabRow};
use crate::status::Status;

/// Taps from which on the work of answering them is shared by threads.
const MANY: usize = 512;

/// What answers readings.
#[derive(Clone, Copy)]
pub enum Answerer<'a> {
    /// A whisker with one signal, or with two gauges.
    One(&'a Locator),
    /// A sensor with several channels.
    Several(&'a Several),
}

impl<'a> From<&'a Locator> for Answerer<'a> {
    fn from(locator: &'a Locator) -> Self {
        Self::One(locator)
    }
}

impl<'a> From<&'a Several> for Answerer<'a> {
    fn from(several: &'a Several) -> Self {
        Self::Several(several)
    }
}

/// A reading of every signal.
pub struct Reading {
    /// Degrees or mm; NaN where it is not known.
    pub drive: f64,
    /// Above their zeros.
    pub signals: Vec<f64>,
    /// Of each zero the variance in units of that of one reading.
    pub shares: Vec<f64>,
}

impl Reading {
    /// Of two gauges.
    pub(super) fn pair(&self) -> PairOfReadings {
        let two = |all: &[f64]| [all[0], all[1]];
        PairOfReadings { drive: self.drive, signals: two(&self.signals), shares: two(&self.shares) }
    }
}

impl<'a> Answerer<'a> {
    /// The one whose rig and columns are those of all.
    pub fn first(self) -> &'a Locator {
        match self {
            Self::One(locator) => locator,
            Self::Several(several) => &several.locators[0],
        }
    }

    /// What knows the zero of signal `k`.
    pub fn locator(self, k: usize) -> &'a Locator {
        match self {
            Self::One(locator) => locator,
            Self::Several(several) => &several.locators[k],
        }
    }

    /// Signals of a reading.
    pub fn signals(self) -> usize {
        match self {
            Self::One(locator) => 1 + usize::from(locator.is_twofold()),
            Self::Several(several) => several.locators.len(),
        }
    }

    /// The column of signal `k` in the unit of the calibration.
    pub fn column(self, k: usize) -> &'a str {
        match self {
            Self::One(locator) if k == 0 => locator.unit.common(),
            Self::One(locator) => locator.unit.second_common(),
            Self::Several(several) => &several.names[k],
        }
    }

    /// Whether a tap of one signal is told at once, so that taps of one object can be taken together.
    pub fn is_alone(self) -> bool {
        self.signals() == 1
    }

    /// Whether it has two gauges: readings tell the tilt too.
    pub fn is_twofold(self) -> bool {
        matches!(self, Self::One(locator) if locator.is_twofold())
    }

    /// Whether the drive of a tap may be unknown.
    pub fn finds_drives(self) -> bool {
        matches!(self, Self::Several(_))
    }

    /// The answers to `taps`, of two gauges with the contact in space.
    pub(super) fn answer(self, taps: &[Reading]) -> Result<Vec<Spatial>, Error> {
        let plain = |located: Located| Spatial { located, ..Spatial::nothing(located.status) };
        match self {
            Self::One(locator) if locator.is_twofold() => {
                locator.locate_pairs(&taps.iter().map(Reading::pair).collect::<Vec<_>>())
            }
            Self::One(locator) => {
                let one = |t: &Reading| plain(locator.locate_above(t.drive, t.signals[0], 0.0, t.shares[0]));
                Ok(if taps.len() < MANY {
                    taps.iter().map(one).collect()
                } else {
                    taps.par_iter().map(one).collect()
                })
            }
            Self::Several(several) => {
                let one = |t: &Reading| plain(several.locate(t.drive, &t.signals, &t.shares));
                Ok(taps.par_iter().map(one).collect())
            }
        }
    }
}

/// How rows are read.
pub struct RowReader<'a> {
    pub(super) who: Answerer<'a>,
    /// What reads each channel; one for a whisker, with both its gauges.
    lines: Vec<Lines<'a>>,
    headed: bool,
}

impl<'a> RowReader<'a> {
    /// Rows for `who`; without a header they hold the drive, which may be left out where it is known, or found, and the signals in the
    /// units of the calibration.
    pub fn new(who: Answerer<'a>) -> Self {
        let lines = match who {
            Answerer::One(locator) => vec![Lines::new(locator)],
            Answerer::Several(several) => several.locators.iter().map(Lines::new).collect(),
        };
        Self { who, lines, headed: false }
    }

    /// Looks at the first line, after these `comments`; whether it is a header: it names a column that is known, or, in a `file`, anything that is
    /// no number.
    ///
    /// # Errors
    /// Columns that do not fit the calibration.
    pub fn first(
        &mut self,
        line: LabRow<'_>,
        comments: &Comments,
        said: &Names,
        file: bool,
    ) -> Result<bool, InputError> {
        let mut is_header = false;
        match self.who {
            Answerer::One(_) => is_header = self.lines[0].first(line, comments, said, file)?,
            Answerer::Several(several) => {
                for (lines, column) in self.lines.iter_mut().zip(&several.columns) {
                    is_header = lines.first(line, comments, &said.of_channel(column.clone()), file)?;
                }
            }
        }
        self.headed = self.lines[0].is_headed();
        Ok(is_header)
    }

    /// Refuses a `comment` that names other columns than those of the lines before it.
    pub fn same(&self, line: usize, comment: &str, said: &Names) -> Result<(), InputError> {
        let names = self.names();
        same(line, comment, &names.join("\t"), &names, said)
    }

    /// What reads the first signal, and the user's own columns.
    pub fn lines(&self) -> &Lines<'a> {
        &self.lines[0]
    }

    /// Names of the columns.
    pub fn names(&self) -> Vec<String> {
        match self.who {
            Answerer::Several(several) if !self.headed => {
                let drive = several.locators[0].rig.setup.drive.column();
                std::iter::once(drive.to_owned()).chain(several.names.iter().cloned()).collect()
            }
            _ => self.lines[0].names(),
        }
    }

    /// The fields of a line.
    pub fn cells<'b>(&self, line: LabRow<'b>) -> Vec<LabCell<'b>> {
        self.lines[0].cells(line)
    }

    /// The fields `cells` of a line by the names of the columns; where the drive may be left out, and is, an empty one stands for it.
    pub fn named<'b>(&self, mut cells: Vec<LabCell<'b>>) -> Vec<LabCell<'b>> {
        match self.who {
            Answerer::Several(several) if !self.headed => {
                if cells.len() == several.names.len() {
                    cells.insert(0, LabCell::EMPTY);
                }
                cells
            }
            _ => self.lines[0].named(cells),
        }
    }

    /// Drive and signals of a `line` with the fields `cells`, NaN where one is missing or no number, of several channels infinite where it is no number;
    /// `None` for a line of another shape.
    pub fn parse(&mut self, line: LabRow<'_>, cells: &[LabCell<'_>]) -> Option<(f64, Vec<f64>)> {
        let several = match self.who {
            Answerer::One(locator) => {
                let (drive, signal) = self.lines[0].parse(line, cells)?;
                let second = locator.is_twofold().then(|| self.lines[0].second(cells));
                return Some((drive, std::iter::once(signal).chain(second).collect()));
            }
            Answerer::Several(several) => several,
        };
        if self.headed {
            let mut all = self.lines.iter_mut().map(|lines| lines.parse(line, cells));
            let (drive, first) = all.next()??;
            return all.try_fold((drive, vec![first]), |(drive, mut signals), read| {
                signals.push(read?.1);
                Some((drive, signals))
            });
        }
        let all = self.named(cells.to_vec());
        if all.len() != 1 + several.names.len() {
            return None;
        }
        let only = several.locators[0].only_drive().filter(|_| all[0].is_empty());
        let drive = only.unwrap_or_else(|| self.lines[0].optional_number(&all[0]));
        let signals = (0..several.names.len()).map(|k| self.lines[k].signal_if_told(&all[k + 1]));
        Some((drive, signals.collect()))
    }

    /// Signal `k` above its zero.
    pub fn above(&self, k: usize, signal: f64, zero: f64) -> f64 {
        self.lines[k.min(self.lines.len() - 1)].above(signal, zero)
    }

    /// Why a row cannot be answered by what it holds: nothing where it can.
    pub(super) fn lacks(&self, drive: f64, signals: &[f64]) -> Option<Status> {
        let missing = match self.who {
            Answerer::One(_) => !drive.is_finite() || !signals[0].is_finite(),
            Answerer::Several(_) => !signals.iter().any(|x| x.is_finite()),
        };
        missing.then_some(Status::BAD_INPUT)
    }

    /// Whether a row is one of the zero, but for rounding.
    pub(super) fn rests(&self, drive: f64, signals: &[f64]) -> bool {
        drive.is_finite() && signals[0].is_finite() && self.who.first().rests(drive)
    }
}
