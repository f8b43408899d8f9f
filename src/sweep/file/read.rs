//! Rows of a tuple file in some order, solved a batch at a time.

use std::ops::Range;

use rayon::prelude::*;

use super::super::Run;
use crate::curve::both::Both;
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Outcome, Task};
use crate::scene::listed::{Groups, Listed, Rows};
use crate::scene::{Direction, Tuple};

/// A solved row of the file.
#[derive(Debug, Clone)]
pub(super) struct SolvedRow {
    pub row: u32,
    pub a: f64,
    pub direction: Direction,
    pub drive: f64,
    /// Place of its design in the batch.
    pub design: u32,
    pub outcome: Outcome,
    /// What the model takes its two strains for, where distances are told so.
    pub both: Option<Option<Both>>,
}

/// Rows of the designs `own` in the order of their designs rows (of their designs first where these compete); `None` where that is the
/// whole file in its order.
pub(super) fn order(groups: &Groups, by_design: bool, own: &Range<u64>) -> Option<Vec<u32>> {
    let key = |row: u32| {
        let row = row as usize;
        (if by_design { groups.designs[row] } else { 0 }, groups.drives[row])
    };
    let n = groups.drives.len() as u32;
    let all = own.start == 0 && own.end == groups.counts[0];
    if all && (1..n).all(|row| key(row - 1) <= key(row)) {
        return None;
    }
    let mut order: Vec<u32> = (0..n).filter(|&row| is_own(groups, own, row)).collect();
    order.par_sort_unstable_by_key(|&row| (key(row), row));
    Some(order)
}

/// Whether a row is of one of the designs `own`.
pub(super) fn is_own(groups: &Groups, own: &Range<u64>, row: u32) -> bool {
    own.contains(&u64::from(groups.designs[row as usize]))
}

/// Most rows with the same number, where these are together.
pub(super) fn longest(numbers: &[u32]) -> u64 {
    numbers.chunk_by(|p, q| p == q).map(|run| run.len() as u64).max().unwrap_or(0)
}

/// Where the designs row begins that may go on in the next batch.
pub(super) fn last_run(groups: &Groups, batch: &[SolvedRow]) -> usize {
    let number = |tap: &SolvedRow| groups.drives[tap.row as usize];
    let Some(last) = batch.last().map(number) else { return 0 };
    batch.iter().rposition(|tap| number(tap) != last).map_or(0, |at| at + 1)
}

/// Reads the rows of a file in some order.
pub(super) struct Reader<'a> {
    rows: Rows,
    order: Option<(&'a [u32], Vec<u64>)>,
    /// The row that comes next without seeking, and the place of the row that is wanted next.
    pub at: (usize, usize),
    pub len: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &Listed, order: Option<&'a [u32]>) -> Result<Self, Error> {
        let offsets = order.map(|_| file.offsets()).transpose().map_err(failed)?;
        let (order, len) = (order.zip(offsets), order.map_or(file.len(), <[u32]>::len));
        Ok(Self { rows: file.rows().map_err(failed)?, order, at: (0, 0), len })
    }

    /// Passes over the next `n` rows.
    pub(super) fn skip(&mut self, n: usize) -> Result<(), Error> {
        if self.order.is_some() {
            self.at.1 = self.len.min(self.at.1 + n);
            return Ok(());
        }
        (0..n).try_for_each(|_| self.next().map(drop))
    }

    /// The next row and its number; `None` after the last.
    pub(super) fn next(&mut self) -> Result<Option<(u32, Tuple)>, Error> {
        let (next, place) = self.at;
        if place == self.len {
            return Ok(None);
        }
        let row = match &self.order {
            None => place,
            Some((order, offsets)) => {
                let row = order[place] as usize;
                if row != next {
                    self.rows.seek(offsets[row]).map_err(failed)?;
                }
                row
            }
        };
        self.at = (row + 1, place + 1);
        Ok(Some((row as u32, self.rows.next().map_err(failed)?)))
    }
}

pub(super) fn failed(e: csv::Error) -> Error {
    Error::Run(format!("the tuple file: {e}"))
}

/// Solves the next rows into `batch`; false where they were the last.
pub(super) fn solve(
    run: &mut Run<'_>,
    groups: &Groups,
    reader: &mut Reader<'_>,
    designs: &mut Vec<Design>,
    batch: &mut Vec<SolvedRow>,
) -> Result<bool, Error> {
    let (study, known) = (run.study, designs.len());
    let mut last = batch.last().map(|tap| groups.designs[tap.row as usize]);
    let mut tuples: Vec<Tuple> = Vec::new();
    let mut rows = Vec::new();
    let together = run.pace.size as usize;
    while rows.len() < together
        && let Some((row, tuple)) = reader.next()?
    {
        if last.replace(groups.designs[row as usize]) != Some(groups.designs[row as usize]) {
            tuples.push(tuple);
        }
        rows.push((row, Task::of((known + tuples.len() - 1) as u32, &tuple)));
    }
    designs.par_extend(tuples.into_par_iter().map(|t| Design::new(&study.setup, t)));
    let tasks: Vec<Task> = rows.iter().map(|(_, task)| *task).collect();
    let outcomes = run.evaluate(designs, &tasks)?;
    let reach = |i: usize| groups.reach[groups.designs[rows[i].0 as usize] as usize];
    let both = run.both(designs, (&tasks, &outcomes), reach)?;
    let tap = |(i, (&(row, t), &outcome)): (usize, (&(u32, Task), &Outcome))| SolvedRow {
        row,
        a: t.a,
        direction: t.direction,
        drive: t.drive,
        design: t.design,
        outcome,
        both: both.get(i).copied(),
    };
    batch.extend(rows.iter().zip(&outcomes).enumerate().map(tap));
    Ok(reader.at.1 < reader.len)
}
