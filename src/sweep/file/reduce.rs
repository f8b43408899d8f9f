//! Designs rows of a tuple file, from whole runs of solved taps.

use rayon::prelude::*;

use super::super::Run;
use super::super::grid::write_kept;
use super::super::parted::Place;
use super::super::select::{Best, Kept};
use super::read::SolvedRow;
use super::{curves, reduction};
use crate::design::Design;
use crate::error::Error;
use crate::scene::listed::Groups;
use crate::scene::{Per, Study};
use crate::sink::run_json::Counts;
use crate::sink::{
    pack::{Packed, Packer, Unpacker},
    rows::{Form, Rows},
    table::{AtDrive, Table, TapRow, fields},
};
use crate::statistics::Told;
use crate::status::Status;

/// Designs rows of one work item.
pub(super) const GRAIN: usize = 256;

/// What is kept of every row until the distances are reduced: K − 1 and the words.
#[derive(Debug)]
pub(super) struct Left {
    deviation: Vec<f64>,
    status: Vec<Status>,
}

impl Left {
    pub(super) fn of(rows: usize) -> Self {
        Self { deviation: vec![f64::NAN; rows], status: vec![Status::OK; rows] }
    }

    /// Notes a row; nothing where nothing is kept.
    pub(super) fn put(&mut self, row: u32, deviation: f64, status: Status) {
        if let Some(place) = self.deviation.get_mut(row as usize) {
            (*place, self.status[row as usize]) = (deviation, status);
        }
    }

    pub(super) fn at(&self, row: u32) -> (f64, Status) {
        (self.deviation[row as usize], self.status[row as usize])
    }
}

/// What the rows come to.
pub(super) struct Reduced {
    pub left: Left,
    /// K̄ of each designs row, where the taps are solved again; NaN where there is none.
    pub k: Vec<f64>,
    best: Option<Best>,
    /// Best row so far of the design at hand, where designs compete.
    champion: Option<(u32, Kept)>,
    /// First row of each designs row, of a part.
    firsts: Vec<u32>,
}

impl Packed for Reduced {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.left.deviation.len() as u64).pack(to);
        self.left.deviation.iter().for_each(|x| x.pack(to));
        self.left.status.iter().for_each(|x| x.pack(to));
        self.k.pack(to);
        self.best.pack(to);
        self.champion.pack(to);
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let n: u64 = from.take()?;
        let deviation = (0..n).map(|_| from.take()).collect::<Option<_>>()?;
        let status = (0..n).map(|_| from.take()).collect::<Option<_>>()?;
        let (k, best, champion) = from.take()?;
        Some(Self { left: Left { deviation, status }, k, best, champion, firsts: Vec::new() })
    }
}

/// What some designs rows come to.
pub(super) struct Part {
    tuples: Rows,
    designs: Rows,
    /// First row of each designs row that is written.
    firsts: Vec<u32>,
    counts: Counts,
    left: Vec<(u32, f64, Status)>,
    k: Vec<(u32, f64)>,
    complete: Vec<(u32, Kept)>,
}

impl Reduced {
    /// Nothing yet; what is left is kept of `rows` rows, K̄ of `numbers` designs rows, and the best `top` are ranked.
    pub(super) fn new(rows: usize, numbers: usize, top: Option<usize>) -> Self {
        Self {
            left: Left::of(rows),
            k: vec![f64::NAN; numbers],
            best: top.map(Best::new),
            champion: None,
            firsts: Vec::new(),
        }
    }

    /// Notes the first row of each designs row.
    pub(super) fn with_firsts(mut self, groups: &Groups) -> Self {
        for (row, number) in (0..).zip(&groups.drives) {
            // Numbers are those of first appearance.
            if *number as usize == self.firsts.len() {
                self.firsts.push(row);
            }
        }
        self
    }

    /// Reduces whole designs rows, and writes them unless they are ranked; `tuples`: their taps too.
    pub(super) fn reduce(
        &mut self,
        run: &mut Run<'_>,
        groups: &Groups,
        designs: &[Design],
        batch: &[SolvedRow],
        tuples: bool,
    ) -> Result<(), Error> {
        let study = run.study;
        let runs: Vec<&[SolvedRow]> =
            batch.chunk_by(|p, q| groups.drives[p.row as usize] == groups.drives[q.row as usize]).collect();
        let tuples = tuples && run.writers.wants(Table::Tuples);
        let ranked = self.best.is_some();
        let curves = curves(run, groups, designs, runs.iter().map(|taps| &taps[0]))?;
        let form = run.writers.form;
        let part = |(at, runs): (usize, &[&[SolvedRow]])| -> Result<Part, Error> {
            let mut part = Part::new(form);
            for (k, taps) in (at * GRAIN..).zip(runs) {
                let told = Told::by(&curves, k).towards(taps[0].direction);
                part.take(study, groups, designs, (taps, told), (tuples, !ranked))?;
            }
            Ok(part)
        };
        let parts = runs.par_chunks(GRAIN).enumerate().map(part);
        let parts: Vec<Part> = parts.collect::<Result<_, _>>()?;
        for part in parts {
            if tuples {
                run.place(part.left.iter().map(|(row, ..)| self.place(groups, Table::Tuples, *row)))?;
            }
            if run.writers.wants(Table::Designs) {
                run.place(part.firsts.iter().map(|row| self.place(groups, Table::Designs, *row)))?;
            }
            run.write(Table::Tuples, part.tuples, if tuples { part.counts.taps } else { 0 })?;
            run.write(Table::Designs, part.designs, part.firsts.len() as u64)?;
            run.absorb(&part.counts);
            // What nobody waits for has no place.
            part.left.into_iter().for_each(|(row, deviation, status)| self.left.put(row, deviation, status));
            for (number, k) in part.k {
                self.k.get_mut(number as usize).into_iter().for_each(|place| *place = k);
            }
            match &mut self.best {
                None => part.complete.iter().for_each(|(_, row)| run.best.offer(row)),
                Some(best) => part.complete.into_iter().for_each(|(design, row)| {
                    offer(best, &mut self.champion, study.output.per, design, row);
                }),
            }
        }
        Ok(())
    }

    /// Where a row of the file stands in the whole.
    pub(super) fn place(&self, groups: &Groups, table: Table, row: u32) -> Place {
        let at = row as usize;
        let owner = match table {
            Table::Tuples => self.firsts.get(groups.drives[at] as usize).map_or(0, |first| u64::from(*first)),
            _ => u64::from(groups.designs[at]),
        };
        Place::row(table, u64::from(row), owner)
    }

    /// Writes the best rows, where rows are ranked.
    pub(super) fn finish(&mut self, run: &mut Run<'_>, groups: &Groups) -> Result<Option<Vec<Kept>>, Error> {
        let Some(mut best) = self.best.take() else { return Ok(None) };
        self.champion.take().into_iter().for_each(|(_, row)| best.offer(row));
        run.counts.complete = Some(best.offered);
        let kept = best.into_rows();
        write_kept(run, &kept, &|row| u64::from(groups.designs[row.index.0 as usize]))?;
        Ok(Some(kept))
    }
}

/// Offers a complete row of `design` to `best`; where designs compete, first to the best row so far of the design at hand.
fn offer(best: &mut Best, champion: &mut Option<(u32, Kept)>, per: Per, design: u32, row: Kept) {
    match champion {
        _ if per == Per::Row => best.offer(row),
        Some((number, old)) if *number == design => {
            if row.order(old).is_lt() {
                *old = row;
            }
        }
        champion => champion.replace((design, row)).into_iter().for_each(|(_, row)| best.offer(row)),
    }
}

impl Part {
    fn new(form: Form) -> Self {
        let (left, k, complete, firsts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (tuples, designs, counts) = (Rows::new(form), Rows::new(form), Counts::default());
        Self { tuples, designs, firsts, counts, left, k, complete }
    }

    /// The designs row of `taps`, all of its taps, and what tells their distances; whether to write the taps, and the row.
    pub(super) fn take(
        &mut self,
        study: &Study,
        groups: &Groups,
        designs: &[Design],
        (taps, told): (&[SolvedRow], Told<'_>),
        (tuples, row_too): (bool, bool),
    ) -> Result<(), Error> {
        let (first, design) = (&taps[0], &designs[taps[0].design as usize]);
        let number = groups.designs[first.row as usize];
        let mut reduced = reduction(&study.setup, groups, design, number);
        taps.iter().for_each(|tap| reduced.count((0, 0), (tap.a, tap.drive), &tap.outcome));
        reduced.calibrate();
        let mut values = Vec::new();
        for SolvedRow { row, a, direction, drive, outcome, both, .. } in taps {
            let told = told.or_both(both.as_ref());
            let estimated = reduced.estimate_by((0, 0), (*a, *drive), outcome, told);
            self.counts.taps += 1;
            self.counts.note(outcome.status | estimated.status, 1);
            self.left.push((*row, outcome.deviation, outcome.status | estimated.status));
            if tuples {
                let row = TapRow::of(&reduced, design, (*a, *direction, *drive), (outcome, &estimated));
                fields(&TapRow::COLUMNS, &study.setup, &row, &mut values);
                self.tuples.row(&mut values)?;
            }
        }
        let (row, unit) = (reduced.drives[0], reduced.unit());
        let (direction, drive) = (first.direction, first.drive);
        let at = AtDrive { design: &design.tuple, direction, drive, row: row.figures(), unit };
        if row_too {
            fields(&AtDrive::COLUMNS, &study.setup, &at, &mut values);
            self.designs.row(&mut values)?;
            self.firsts.push(first.row);
        }
        self.k.push((groups.drives[first.row as usize], row.k.unwrap_or(f64::NAN)));
        let rank = reduced.rank(0, study.listed_by());
        self.complete.extend(rank.map(|rank| (number, Kept::of(&at, rank, (u64::from(first.row), 0)))));
        Ok(())
    }
}
