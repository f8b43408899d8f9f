//! Rows of taps whose numbers were probably meant in another unit: those of a tuple file, or given one by one.

use super::{Beside, Doubt, angle, length, shown};
use crate::design::MOST;
use crate::error::InputError;
use crate::scene::{Column, Drive, Tuple};

/// Least and largest value of each column, numbers alone.
pub type Ends = [[f64; 2]; 9];

/// Those of no row.
pub const NO_ENDS: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// `ends` with `v` among what lies between them.
#[inline(always)]
pub fn widened([least, most]: [f64; 2], v: f64) -> [f64; 2] {
    [if v < least { v } else { least }, if v > most { v } else { most }]
}

/// The warnings about `n` taps that are given one by one, `tap(i)` being tap i, all of them within `ends` where these are known; `key` names a column.
pub fn of_taps(
    drive: Drive,
    n: usize,
    ends: Option<Ends>,
    tap: impl Fn(usize) -> Tuple,
    key: impl Fn(Column) -> String,
) -> Vec<String> {
    let mut rows = DoubtfulRows::new(drive);
    if !ends.is_some_and(|ends| rows.are_sure(n, &ends)) {
        (0..n).for_each(|i| rows.take(&tap(i), i));
    }
    rows.said(|column, value, words, _| InputError::new(words).key(key(column)).value(shown(value)))
}

/// What is doubtful in rows of taps: the first of it is told, and how many rows are like it.
#[derive(Debug)]
pub(crate) struct DoubtfulRows {
    drive: Drive,
    rows: u64,
    doubted: u64,
    /// Column, value, doubt and place of the first.
    first: Option<(Column, f64, Doubt, usize)>,
    largest: f64,
}

impl DoubtfulRows {
    pub fn new(drive: Drive) -> Self {
        Self { drive, rows: 0, doubted: 0, first: None, largest: f64::NEG_INFINITY }
    }

    /// Whether nothing is doubtful in the next `count` rows, whose columns lie between `ends`: then they are counted.
    fn are_sure(&mut self, count: usize, ends: &Ends) -> bool {
        // The longest stands where the shortest is asked for.
        let beside = Beside::new(|column| [1, 0].map(|k| ends[column as usize][k]));
        let sure = |column: &Column| {
            let ends = ends[*column as usize];
            matches!(column, Column::Tilt | Column::Lean)
                || ends[0] > 0.0 && ends.iter().all(|v| length(*column, *v, &beside).is_none())
        };
        let drives = ends[Column::Drive as usize];
        let all = self.lengths().iter().all(sure) && drives.iter().all(|drive| admissible(*drive));
        if all {
            self.rows += count as u64;
            self.largest = self.largest.max(drives[1]);
        }
        all
    }

    fn lengths(&self) -> &'static [Column] {
        match self.drive {
            Drive::Angle => &Column::ALL[..6],
            Drive::Displacement => &Column::ALL,
        }
    }

    /// The next row, which starts at `place`.
    pub fn take(&mut self, tuple: &Tuple, place: usize) {
        self.rows += 1;
        if admissible(tuple.drive) {
            self.largest = self.largest.max(tuple.drive);
        }
        let values = tuple.to_array();
        let beside = Beside::new(|column| [values[column as usize]; 2]);
        let slip = |column: &Column| {
            let v = values[*column as usize];
            Some((*column, v, length(*column, v, &beside).filter(|_| admissible(v))?, place))
        };
        if let Some(first) = self.lengths().iter().find_map(slip) {
            self.doubted += 1;
            self.first.get_or_insert(first);
        }
    }

    /// The warnings, one for lengths and one for angles; `line` finds the line of a place in `file`.
    pub fn doubts(self, file: &str, line: impl Fn(usize) -> Option<usize>) -> Vec<String> {
        let drive = self.drive;
        self.said(|column, value, words, place| {
            InputError::new(words).at(file, place.and_then(&line)).key(column.name(drive)).value(shown(value))
        })
    }

    /// The warnings as `say` makes them of column, value, words and, where there is one, the place.
    fn said(self, say: impl Fn(Column, f64, String, Option<usize>) -> InputError) -> Vec<String> {
        let Self { drive, rows, doubted, first, largest } = self;
        let among = |words: String, what: String| if rows > 1 { words + &what } else { words };
        let lengths = first.map(|(column, v, doubt, place)| {
            let words = among(doubt.say(v, " mm"), format!(" ({doubted} of {rows} rows)"));
            say(column, v, words, Some(place))
        });
        let angles = angle(largest).filter(|_| drive == Drive::Angle && largest > 0.0);
        let angles = angles.map(|doubt| {
            say(Column::Drive, largest, among(doubt.say(largest, "°"), " (the largest)".into()), None)
        });
        lengths.into_iter().chain(angles).map(|error| error.to_string()).collect()
    }
}

/// Whether a value may be right: what is outside every domain has a status, and no unit that would mend it.
fn admissible(v: f64) -> bool {
    v > 0.0 && v <= MOST
}
