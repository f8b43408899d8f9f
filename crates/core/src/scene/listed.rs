//! Listed tuples, as columns, and their groups. Rows with the same D, d, L_a, x_ss, l and rig are one design; designs.csv has a row per design and
//! stroke (direction of the pole and drive), distances.csv per design, distance and direction. Numbers follow first appearance.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::space::{COLUMNS, Column, Tuple};

type Entry = (u64, u32, u32);

/// Most rows of a list.
pub const MOST_ROWS: u64 = u32::MAX as u64;

/// Listed tuples, in their order: 56 bytes a row, 16 more if poles tilt or lean, 4 more if rigs differ.
#[derive(Debug, Clone, Default)]
pub struct Listed {
    /// In [`Column`] order; a column that is 0 in every row is empty.
    columns: Box<[Vec<f64>; COLUMNS]>,
    /// Rig of each row; empty if all have the first.
    rigs: Vec<u32>,
    rows: usize,
    groups: OnceLock<Box<Groups>>,
}

/// Groups of the rows of a list.
#[derive(Debug, Clone, PartialEq)]
pub struct Groups {
    /// Design of each row.
    pub designs: Vec<u32>,
    /// Design at one stroke of each row.
    pub strokes: Vec<u32>,
    /// Design at one distance and direction of each row.
    pub distances: Vec<u32>,
    /// Number of groups of each kind.
    pub counts: [u64; 3],
    /// Smallest and largest distance of each design, mm.
    pub reach: Vec<[f64; 2]>,
}

impl Listed {
    /// Takes the next tuple.
    pub fn push(&mut self, t: &Tuple) {
        for (column, value) in self.columns.iter_mut().zip(t.to_array()) {
            if !column.is_empty() || value.to_bits() != 0 {
                column.resize(self.rows, 0.0);
                column.push(value);
            }
        }
        if !self.rigs.is_empty() || t.rig != 0 {
            self.rigs.resize(self.rows, 0);
            self.rigs.push(t.rig as u32);
        }
        self.rows += 1;
        self.groups = OnceLock::new();
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// True if `column` is not 0 in some row.
    pub fn has(&self, column: Column) -> bool {
        self.columns[column as usize].iter().any(|value| *value != 0.0)
    }

    /// The tuple of a row.
    pub fn tuple(&self, row: usize) -> Tuple {
        let rig = self.rigs.get(row).copied().unwrap_or(0);
        Tuple::from_array(std::array::from_fn(|k| self.value(k, row))).of_rig(rig.into())
    }

    /// All tuples.
    pub fn iter(&self) -> impl Iterator<Item = Tuple> {
        (0..self.rows).map(|row| self.tuple(row))
    }

    fn value(&self, column: usize, row: usize) -> f64 {
        self.columns[column].get(row).copied().unwrap_or(0.0)
    }

    /// The groups of its rows, found on first use.
    pub fn groups(&self) -> &Groups {
        self.groups.get_or_init(|| Box::new(Groups::of(self)))
    }
}

impl PartialEq for Listed {
    fn eq(&self, other: &Self) -> bool {
        (self.rows, &self.columns, &self.rigs) == (other.rows, &other.columns, &other.rigs)
    }
}

impl FromIterator<Tuple> for Listed {
    fn from_iter<I: IntoIterator<Item = Tuple>>(tuples: I) -> Self {
        let mut listed = Self::default();
        tuples.into_iter().for_each(|t| listed.push(&t));
        listed
    }
}

impl Groups {
    fn of(listed: &Listed) -> Self {
        let numbered = |key: &(dyn Fn(usize) -> [u64; 6] + Sync)| {
            let entry = |row: usize| {
                let (high, low) = digest(key(row));
                (high, low, row as u32)
            };
            numbers((0..listed.rows).into_par_iter().map(entry).collect())
        };
        let bits = |column: Column, row: usize| (listed.value(column as usize, row) + 0.0).to_bits();
        let (designs, n_designs) = numbered(&|row| {
            let whisker: [u64; 5] = std::array::from_fn(|k| bits(Column::ALL[k], row));
            let [base, tip, length, place, grid] = whisker;
            [base, tip, length, place, grid, listed.rigs.get(row).copied().unwrap_or(0).into()]
        });
        let at = |column: Column| {
            let [tilt, lean] = [Column::Tilt, Column::Lean].map(|c| move |row| bits(c, row));
            numbered(&|row| [designs[row].into(), tilt(row), lean(row), bits(column, row), 0, 0])
        };
        let ((strokes, n_strokes), (distances, n_distances)) = (at(Column::Drive), at(Column::Distance));
        let mut reach = vec![[f64::INFINITY, f64::NEG_INFINITY]; n_designs as usize];
        for (row, &design) in designs.iter().enumerate() {
            let (a, [lo, hi]) = (listed.value(Column::Distance as usize, row), &mut reach[design as usize]);
            (*lo, *hi) = (lo.min(a), hi.max(a));
        }
        Self { designs, strokes, distances, counts: [n_designs, n_strokes, n_distances], reach }
    }
}

/// 96 well-mixed bits (splitmix64): two of 10⁷ designs get the same once in 10¹⁵ files.
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

fn numbers(mut entries: Vec<Entry>) -> (Vec<u32>, u64) {
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
