//! The rows that a sweep keeps with `top`, and those that it shows; in bounded memory.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::key;
use crate::recommend::{self, Standing};
use crate::sink::table::AtDrive;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    pub rank: f64,
    /// Number of the design, then of the stroke.
    pub index: (u64, u32),
    pub at: AtDrive,
    /// Rank value from a chart, which selects candidates; NaN for a row solved tap by tap.
    pub(super) charted: f32,
}

impl Kept {
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.rank.total_cmp(&other.rank).then(self.index.cmp(&other.index))
    }
}

#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Best {
    n: usize,
    /// The best rows, and newer ones not compared yet.
    rows: Vec<Kept>,
    pub offered: u64,
}

const WAITING: usize = 64;

impl Best {
    pub fn new(n: usize) -> Self {
        Self { n, ..Self::default() }
    }

    pub fn offer(&mut self, row: Kept) {
        self.offered += 1;
        self.rows.push(row);
        if self.rows.len() >= 2 * self.n + WAITING {
            self.rows.select_nth_unstable_by(self.n, Kept::order);
            self.rows.truncate(self.n);
        }
    }

    pub fn into_rows(mut self) -> Vec<Kept> {
        self.rows.sort_unstable_by(Kept::order);
        self.rows.truncate(self.n);
        self.rows
    }
}

const SHOWN: usize = 8;

/// The best of all offered rows, and the best row of each of the best designs.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Highlights {
    pub offered: u64,
    least: Option<f64>,
    rows: Vec<Kept>,
    designs: Vec<Kept>,
}

fn order(a: &Kept, b: &Kept) -> Ordering {
    let of = |row: &Kept| (row.at.row.status, row.rank);
    recommend::order(of(a), of(b)).then(a.index.cmp(&b.index))
}

fn put(best: &mut Vec<Kept>, row: &Kept, of_each_design: bool) {
    if best.len() == SHOWN && order(row, &best[SHOWN - 1]).is_ge() {
        return;
    }
    let same = |old: &Kept| of_each_design && key(&old.at.design) == key(&row.at.design);
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
    pub fn offer(&mut self, row: &Kept) {
        self.offered += 1;
        self.least = Some(self.least.map_or(row.rank, |least| least.min(row.rank)));
        put(&mut self.rows, row, false);
        put(&mut self.designs, row, true);
    }

    /// Position of the recommended row relative to the strain limit; `None` without a complete row.
    pub fn standing(&self) -> Option<Standing> {
        let best = self.rows.first()?;
        Some(Standing::of((best.at.row.status, best.rank), self.least?))
    }

    /// The rows shown, the recommended one first: all if they are few or were `asked` for, else one per design if there are several.
    pub fn into_rows(self, asked: bool) -> (Vec<Kept>, bool) {
        let by_design = !asked && self.offered > SHOWN as u64 && self.designs.len() > 1;
        (if by_design { self.designs } else { self.rows }, by_design)
    }
}
