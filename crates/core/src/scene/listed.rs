//! Tuples that stay in their file, because they are too many to hold: what is known of every row, and how to read rows again.
//!
//! A design is what rows with the same D, d, L_a, x_ss, l and rig share; a row of designs.csv is a design at one stroke (direction of the pole
//! and drive), of distances.csv a design at one distance and direction. All are numbered in order of first appearance.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::rigs::Rigs;
use super::space::{COLUMNS, Tuple};
use crate::error::Error;

/// Number of a design, of a design's drive or distance.
type Number = u32;

/// Where each column stands in a row; what has none is 0 in every row.
pub type Places = [Option<usize>; COLUMNS];

/// A key of 96 bits and the row that has it.
type Entry = (u64, u32, u32);

/// Most rows of a tuple file.
pub const MOST_ROWS: u64 = u32::MAX as u64;

/// A checked tuple file.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    path: PathBuf,
    /// Place of each column.
    places: Places,
    rigs: Option<Varied>,
    groups: Arc<Groups>,
}

/// Places of the properties that vary, and the rigs that rows have.
type Varied = (Vec<usize>, Arc<Rigs>);

/// What belongs together in a tuple file.
#[derive(Debug, Clone, PartialEq)]
pub struct Groups {
    /// Design of each row.
    pub designs: Vec<Number>,
    /// Design at one stroke of each row.
    pub drives: Vec<Number>,
    /// Design at one distance and direction of each row.
    pub distances: Vec<Number>,
    /// How many of each there are.
    pub counts: [u64; 3],
    /// Smallest and largest distance of each design, mm.
    pub reach: Vec<[f64; 2]>,
}

impl Listed {
    /// The file at `path`, whose columns stand at `places`, those of properties at the places of `rigs`.
    pub fn new(path: &Path, places: Places, rigs: Option<Varied>, groups: Groups) -> Self {
        Self { path: path.to_owned(), places, rigs, groups: Arc::new(groups) }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What belongs together.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.groups.designs.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Rows from the first on.
    pub fn rows(&self) -> csv::Result<Rows> {
        let (reader, rigs) = (reader(File::open(&self.path)?), self.rigs.clone());
        let mut rows = Rows { reader, places: self.places, rigs, record: Default::default() };
        rows.reader.read_record(&mut rows.record)?;
        Ok(rows)
    }

    /// All tuples, in memory.
    ///
    /// # Errors
    /// Where the file is not what it was when it was checked.
    pub fn tuples(&self) -> Result<Vec<Tuple>, Error> {
        let all = || {
            let mut rows = self.rows()?;
            (0..self.len()).map(|_| rows.next()).collect::<csv::Result<Vec<Tuple>>>()
        };
        all().map_err(|e| Error::Run(format!("{}: {e}", self.path.display())))
    }

    /// Byte at which each row starts.
    pub fn offsets(&self) -> csv::Result<Vec<u64>> {
        let mut rows = self.rows()?;
        let start = |_| {
            rows.next()?;
            Ok(rows.record.position().map_or(0, csv::Position::byte))
        };
        (0..self.len()).map(start).collect()
    }
}

/// A reader of tables as users write them: `#` lines are skipped, blanks around values too.
pub fn reader<R: Read>(from: R) -> csv::Reader<R> {
    let mut builder = csv::ReaderBuilder::new();
    builder.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All).from_reader(from)
}

/// Rows of a tuple file, one after the other.
#[derive(Debug)]
pub struct Rows {
    reader: csv::Reader<File>,
    places: Places,
    rigs: Option<Varied>,
    record: csv::StringRecord,
}

impl Rows {
    /// The next row. An error where the file is not what it was when it was checked.
    #[allow(clippy::should_implement_trait, reason = "it is known how many there are")]
    pub fn next(&mut self) -> csv::Result<Tuple> {
        let changed = || csv::Error::from(std::io::Error::other("this file was changed while it was read"));
        if !self.reader.read_record(&mut self.record)? {
            return Err(changed());
        }
        let number =
            |place: usize| self.record.get(place).and_then(|x| x.parse::<f64>().ok()).ok_or_else(changed);
        let mut values = [0.0; COLUMNS];
        for (value, place) in values.iter_mut().zip(self.places) {
            let Some(place) = place else { continue };
            *value = number(place)?;
        }
        let mut rig = 0;
        if let Some((places, rigs)) = &self.rigs {
            let values = places.iter().map(|place| number(*place)).collect::<csv::Result<Vec<f64>>>()?;
            rig = rigs.number(&values);
        }
        Ok(Tuple::from_array(values).of_rig(rig))
    }

    /// Goes to the row that starts at `byte`.
    pub fn seek(&mut self, byte: u64) -> csv::Result<()> {
        let mut position = csv::Position::new();
        position.set_byte(byte);
        self.reader.seek(position)
    }
}

/// Takes the rows of a file in turn.
#[derive(Debug, Default)]
pub struct Grouping {
    designs: Vec<Entry>,
    /// Directions, where one is not upright; until then nothing is kept of them.
    directions: Vec<[f64; 2]>,
    a: Vec<f64>,
    drive: Vec<f64>,
}

impl Grouping {
    /// Takes the next row.
    pub fn push(&mut self, t: &Tuple) {
        let (high, low) = digest([bits(t.D), bits(t.d), bits(t.L_a), bits(t.x_ss), bits(t.l), t.rig]);
        self.designs.push((high, low, self.a.len() as u32));
        if !self.directions.is_empty() || !t.direction().is_upright() {
            self.directions.resize(self.a.len(), [0.0; 2]);
            self.directions.push([t.tilt, t.lean]);
        }
        self.a.push(t.a);
        self.drive.push(t.drive);
    }

    /// Rows so far.
    pub fn len(&self) -> u64 {
        self.a.len() as u64
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.a.is_empty()
    }

    /// What belongs together.
    pub fn finish(self) -> Groups {
        let Self { designs, directions, a, drive } = self;
        let (designs, n) = numbered(designs);
        // Design and direction of each row: the design alone where all poles are upright.
        let towards = if directions.is_empty() {
            None
        } else {
            let entry = |(row, (&design, d)): (usize, (&Number, &[f64; 2]))| {
                let (high, low) = digest([u64::from(design), bits(d[0]), bits(d[1]), 0, 0, 0]);
                (high, low, row as u32)
            };
            Some(numbered(designs.iter().zip(&directions).enumerate().map(entry).collect()).0)
        };
        drop(directions);
        let of = |column: &[f64]| {
            let entry = |(row, (&at, &x)): (usize, (&Number, &f64))| (bits(x), at, row as u32);
            let at = towards.as_ref().unwrap_or(&designs);
            numbered(at.iter().zip(column).enumerate().map(entry).collect())
        };
        let ((drives, n_drives), (distances, n_distances)) = (of(&drive), of(&a));
        drop(drive);
        let mut reach = vec![[f64::INFINITY, f64::NEG_INFINITY]; n as usize];
        for (&design, &a) in designs.iter().zip(&a) {
            let [lo, hi] = &mut reach[design as usize];
            (*lo, *hi) = (lo.min(a), hi.max(a));
        }
        Groups { designs, drives, distances, counts: [n, n_drives, n_distances], reach }
    }
}

/// Bits that are the same for equal numbers.
fn bits(x: f64) -> u64 {
    (x + 0.0).to_bits()
}

/// 96 well-mixed bits (splitmix64): of 10⁷ designs two are taken for one once in 10¹⁵ files.
fn digest(words: [u64; 6]) -> (u64, u32) {
    let mix = |seed: u64| {
        words.iter().fold(seed, |h, w| {
            let mut z = (h ^ w).wrapping_add(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        })
    };
    (mix(0x243f_6a88_85a3_08d3), mix(0x1319_8a2e_0370_7344) as u32)
}

/// Numbers of the keys of all rows, in order of first appearance, and how many there are.
fn numbered(mut entries: Vec<Entry>) -> (Vec<Number>, u64) {
    entries.par_sort_unstable();
    let mut numbers = vec![0; entries.len()];
    for same in entries.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
        same.iter().for_each(|e| numbers[e.2 as usize] = same[0].2);
    }
    drop(entries);
    let mut next = 0;
    for row in 0..numbers.len() {
        let first = numbers[row] as usize;
        if first == row {
            numbers[row] = next;
            next += 1;
        } else {
            numbers[row] = numbers[first];
        }
    }
    (numbers, u64::from(next))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_numbered_in_order_of_first_appearance() {
        let row = |d: f64, a: f64, drive: f64| Tuple {
            D: 10.0,
            d,
            L_a: 50.0,
            x_ss: 0.0,
            l: 2.0,
            a,
            drive,
            ..Tuple::default()
        };
        let mut grouping = Grouping::default();
        let rows = [row(7.0, 20.0, 1.0), row(4.0, 20.0, 1.0), row(7.0, 30.0, 1.0), row(7.0, 20.0, 2.0)];
        rows.iter().for_each(|t| grouping.push(t));
        grouping.push(&Tuple { x_ss: -0.0, ..rows[1] });
        let groups = grouping.finish();
        assert_eq!(groups.designs, [0, 1, 0, 0, 1]);
        assert_eq!(groups.drives, [0, 1, 0, 2, 1]);
        assert_eq!(groups.distances, [0, 1, 2, 0, 1]);
        assert_eq!((groups.counts, groups.reach), ([2, 3, 3], vec![[20.0, 30.0], [20.0, 20.0]]));
    }

    #[test]
    fn a_direction_belongs_to_strokes_and_distances_not_to_designs() {
        let row =
            |tilt: f64, a: f64, drive: f64| Tuple { D: 10.0, d: 4.0, a, tilt, drive, ..Tuple::default() };
        let mut grouping = Grouping::default();
        for t in [row(0.0, 20.0, 1.0), row(-0.0, 30.0, 1.0), row(5.0, 20.0, 1.0), row(5.0, 20.0, 2.0)] {
            grouping.push(&t);
        }
        let groups = grouping.finish();
        assert_eq!((groups.designs, groups.drives), (vec![0; 4], vec![0, 0, 1, 2]));
        assert_eq!((groups.distances, groups.counts), (vec![0, 1, 2, 2], [1, 3, 3]));
    }
}
