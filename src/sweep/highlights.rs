//! What a sweep shows of its complete rows: the one that it recommends first, in bounded memory.

use std::cmp::Ordering;

use super::key;
use super::select::Kept;
use crate::recommend::{self, Standing};
use crate::sink::pack::{Packed, Packer, Unpacker};

/// Rows that are shown at most.
const SHOWN: usize = 8;

/// The best rows of all that were offered, and the best row of each of the best designs.
#[derive(Debug)]
pub(super) struct Highlights {
    /// Complete rows offered.
    pub offered: u64,
    /// Smallest value of a row.
    least: f64,
    rows: Vec<Kept>,
    designs: Vec<Kept>,
}

impl Default for Highlights {
    fn default() -> Self {
        Self { offered: 0, least: f64::INFINITY, rows: Vec::new(), designs: Vec::new() }
    }
}

impl Packed for Highlights {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.offered, self.least).pack(to);
        self.rows.pack(to);
        self.designs.pack(to);
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let ((offered, least), rows, designs) = (from.take()?, from.take()?, from.take()?);
        Some(Self { offered, least, rows, designs })
    }
}

/// What decides between two complete rows.
fn order(a: &Kept, b: &Kept) -> Ordering {
    let of = |row: &Kept| (row.row.status, row.rank);
    recommend::order(of(a), of(b)).then(a.index.cmp(&b.index))
}

/// Puts `row` into the `best` rows, if it is one of them: one of each design, where that is asked.
fn put(best: &mut Vec<Kept>, row: &Kept, of_each_design: bool) {
    if best.len() == SHOWN && order(row, &best[SHOWN - 1]).is_ge() {
        return;
    }
    let same = |old: &Kept| of_each_design && key(&old.design) == key(&row.design);
    if let Some(place) = best.iter().position(same) {
        if order(row, &best[place]).is_ge() {
            return;
        }
        best.remove(place);
    }
    best.insert(best.partition_point(|old| order(old, row).is_lt()), row.clone());
    best.truncate(SHOWN);
}

impl Highlights {
    /// Takes a complete row.
    pub fn offer(&mut self, row: &Kept) {
        self.offered += 1;
        self.least = self.least.min(row.rank);
        put(&mut self.rows, row, false);
        put(&mut self.designs, row, true);
    }

    /// Takes over what `other` was offered.
    pub fn merge(&mut self, other: &Self) {
        self.offered += other.offered;
        self.least = self.least.min(other.least);
        other.rows.iter().for_each(|row| put(&mut self.rows, row, false));
        other.designs.iter().for_each(|row| put(&mut self.designs, row, true));
    }

    /// How the recommended row stands to the strain limit; without a complete row there is none.
    pub fn standing(&self) -> Option<Standing> {
        let best = self.rows.first()?;
        Some(Standing::of((best.row.status, best.rank), self.least))
    }

    /// The rows shown, the recommended one first: all, where they are few or were `asked` for, else one of each design, if there are several.
    pub fn into_rows(self, asked: bool) -> (Vec<Kept>, bool) {
        let by_design = !asked && self.offered > SHOWN as u64 && self.designs.len() > 1;
        (if by_design { self.designs } else { self.rows }, by_design)
    }
}
