//! Sweep over a tuple file too large to hold: its rows are read again where they are needed.
//!
//! Rows go through in the order of the designs rows they belong to, so that each is reduced and written as soon as it is complete.
//! Where that is also the order of the file, the taps are written on the way; else they are solved a second time, in file order.

use rayon::prelude::*;

use super::grid::write_kept;
use super::select::{Best, Kept};
use super::{CHUNK, HIGHLIGHTS, KEEP, Run};
use crate::design::Design;
use crate::error::Error;
use crate::estimate::Estimator;
use crate::evaluate::{Outcome, Task};
use crate::scene::listed::{Groups, Listed, Rows};
use crate::scene::{Per, Scene, Tuple};
use crate::sink::run_json::Counts;
use crate::sink::{
    csv::Text,
    table::{self, Table},
};
use crate::statistics::{DistanceRow, Tally};
use crate::status::Status;

/// Designs rows of one work item.
const GRAIN: usize = 256;

/// A solved row of the file.
#[derive(Debug, Clone)]
struct Tap {
    row: u32,
    a: f64,
    drive: f64,
    /// Place of its design in the batch.
    design: u32,
    outcome: Outcome,
}

/// What is kept of every row until the distances are reduced.
type Left = (f64, Status);

/// Evaluates the rows of `file` and writes their tables.
pub(super) fn run(run: &mut Run<'_>, file: &Listed) -> Result<(), Error> {
    let (scene, groups) = (run.scene, file.groups());
    let distances = run.writers.wants(Table::Distances);
    let order = order(groups, scene.output.top.is_some());
    let once = order.is_none() && scene.output.top.is_none() && longest(&groups.drives) <= KEEP;
    let mut all = Reduced {
        left: if distances { vec![(f64::NAN, Status::OK); file.len()] } else { Vec::new() },
        k: if once { Vec::new() } else { vec![f64::NAN; groups.counts[1] as usize] },
        highlights: vec![None; HIGHLIGHTS],
        best: scene.output.top.map(Best::new),
        champion: None,
    };
    let (mut batch, mut designs) = (Vec::new(), Vec::new());
    let mut reader = Reader::new(file, order.as_deref())?;
    loop {
        let more = solve(run, groups, &mut reader, &mut designs, &mut batch)?;
        let open = if more { last_run(groups, &batch) } else { batch.len() };
        all.reduce(run, groups, &designs, &batch[..open], once)?;
        batch.drain(..open);
        if !more {
            break;
        }
        // The design of what is left comes first in the next batch.
        if let Some(tap) = batch.first() {
            designs.swap(0, tap.design as usize);
            designs.truncate(1);
            batch.iter_mut().for_each(|tap| tap.design = 0);
        } else {
            designs.clear();
        }
    }
    drop(reader);
    drop((batch, designs, order));
    let kept = all.finish(run)?;
    if !once && run.writers.wants(Table::Tuples) {
        write_tuples(run, file, &all.k, kept.as_deref())?;
    }
    if distances {
        write_distances(run, file, &all.left, kept.as_deref())?;
    }
    Ok(())
}

/// Rows in the order of their designs rows (of their designs first where these compete); `None` where that is the file's.
fn order(groups: &Groups, by_design: bool) -> Option<Vec<u32>> {
    let key = |row: u32| {
        let row = row as usize;
        (if by_design { groups.designs[row] } else { 0 }, groups.drives[row])
    };
    let n = groups.drives.len() as u32;
    if (1..n).all(|row| key(row - 1) <= key(row)) {
        return None;
    }
    let mut order: Vec<u32> = (0..n).collect();
    order.par_sort_unstable_by_key(|&row| (key(row), row));
    Some(order)
}

/// Most rows with the same number, where these are together.
fn longest(numbers: &[u32]) -> u64 {
    numbers.chunk_by(|p, q| p == q).map(|run| run.len() as u64).max().unwrap_or(0)
}

/// Where the designs row begins that may go on in the next batch.
fn last_run(groups: &Groups, batch: &[Tap]) -> usize {
    let number = |tap: &Tap| groups.drives[tap.row as usize];
    let Some(last) = batch.last().map(number) else { return 0 };
    batch.iter().rposition(|tap| number(tap) != last).map_or(0, |at| at + 1)
}

/// Reads the rows of a file in some order.
struct Reader<'a> {
    rows: Rows,
    order: Option<(&'a [u32], Vec<u64>)>,
    /// The row that comes next without seeking, and the place of the row that is wanted next.
    at: (usize, usize),
    len: usize,
}

impl<'a> Reader<'a> {
    fn new(file: &Listed, order: Option<&'a [u32]>) -> Result<Self, Error> {
        let offsets = order.map(|_| file.offsets()).transpose().map_err(failed)?;
        let order = order.zip(offsets);
        Ok(Self { rows: file.rows().map_err(failed)?, order, at: (0, 0), len: file.len() })
    }

    /// The next row and its number; `None` after the last.
    fn next(&mut self) -> Result<Option<(u32, Tuple)>, Error> {
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

fn failed(e: csv::Error) -> Error {
    Error::Run(format!("the tuple file: {e}"))
}

/// Solves the next rows into `batch`; false where they were the last.
fn solve(
    run: &mut Run<'_>,
    groups: &Groups,
    reader: &mut Reader<'_>,
    designs: &mut Vec<Design>,
    batch: &mut Vec<Tap>,
) -> Result<bool, Error> {
    let (scene, known) = (run.scene, designs.len());
    let mut last = batch.last().map(|tap| groups.designs[tap.row as usize]);
    let mut tuples: Vec<Tuple> = Vec::new();
    let mut rows = Vec::with_capacity(CHUNK as usize);
    while rows.len() < CHUNK as usize
        && let Some((row, tuple)) = reader.next()?
    {
        if last.replace(groups.designs[row as usize]) != Some(groups.designs[row as usize]) {
            tuples.push(tuple);
        }
        rows.push((row, Task { design: (known + tuples.len() - 1) as u32, a: tuple.a, drive: tuple.drive }));
    }
    designs.par_extend(tuples.into_par_iter().map(|t| Design::new(scene, t)));
    let tasks: Vec<Task> = rows.iter().map(|(_, task)| *task).collect();
    let outcomes = run.evaluate(designs, &tasks)?;
    let tap = |((row, t), outcome): ((u32, Task), Outcome)| Tap {
        row,
        a: t.a,
        drive: t.drive,
        design: t.design,
        outcome,
    };
    batch.extend(rows.into_iter().zip(outcomes).map(tap));
    Ok(reader.at.1 < reader.len)
}

/// What the rows come to.
struct Reduced {
    left: Vec<Left>,
    /// K̄ of each designs row, where the taps are solved again; NaN where there is none.
    k: Vec<f64>,
    /// Best row of the first designs.
    highlights: Vec<Option<Kept>>,
    best: Option<Best>,
    /// Best row so far of the design at hand, where designs compete.
    champion: Option<(u32, Kept)>,
}

/// What some designs rows come to.
#[derive(Default)]
struct Part {
    tuples: Text,
    designs: Text,
    counts: Counts,
    left: Vec<(u32, Left)>,
    k: Vec<(u32, f64)>,
    complete: Vec<(u32, Kept)>,
    rows: u64,
}

impl Reduced {
    /// Reduces whole designs rows, and writes them unless they are ranked; `tuples`: their taps too.
    fn reduce(
        &mut self,
        run: &mut Run<'_>,
        groups: &Groups,
        designs: &[Design],
        batch: &[Tap],
        tuples: bool,
    ) -> Result<(), Error> {
        let scene = run.scene;
        let runs: Vec<&[Tap]> =
            batch.chunk_by(|p, q| groups.drives[p.row as usize] == groups.drives[q.row as usize]).collect();
        let tuples = tuples && run.writers.wants(Table::Tuples);
        let ranked = self.best.is_some();
        let part = |runs: &[&[Tap]]| -> csv::Result<Part> {
            let mut part = Part::default();
            runs.iter().try_for_each(|taps| part.take(scene, groups, designs, taps, (tuples, !ranked)))?;
            Ok(part)
        };
        let parts: Vec<Part> = runs.par_chunks(GRAIN).map(part).collect::<Result<_, _>>().map_err(failed)?;
        for part in parts {
            run.write(Table::Tuples, &part.tuples.into_bytes(), if tuples { part.counts.taps } else { 0 })?;
            run.write(Table::Designs, &part.designs.into_bytes(), part.rows)?;
            run.absorb(&part.counts);
            // What nobody waits for has no place.
            for (row, left) in part.left {
                self.left.get_mut(row as usize).into_iter().for_each(|place| *place = left);
            }
            for (number, k) in part.k {
                self.k.get_mut(number as usize).into_iter().for_each(|place| *place = k);
            }
            part.complete.into_iter().for_each(|(design, row)| self.offer(scene.output.per, design, row));
        }
        Ok(())
    }

    /// A complete row of `design`.
    fn offer(&mut self, per: Per, design: u32, row: Kept) {
        let better = |old: &Kept| row.rank.total_cmp(&old.rank).then(row.index.cmp(&old.index)).is_lt();
        match (&mut self.best, per) {
            (None, _) => {
                if let Some(place) = self.highlights.get_mut(design as usize)
                    && place.as_ref().is_none_or(better)
                {
                    *place = Some(row);
                }
            }
            (Some(best), Per::Row) => best.offer(row),
            (Some(best), Per::Design) => match &mut self.champion {
                Some((number, old)) if *number == design => {
                    if better(old) {
                        *old = row;
                    }
                }
                champion => {
                    champion.replace((design, row)).into_iter().for_each(|(_, row)| best.offer(row));
                }
            },
        }
    }

    /// Tells the best rows and, where they are ranked, writes them.
    fn finish(&mut self, run: &mut Run<'_>) -> Result<Option<Vec<Kept>>, Error> {
        let Some(mut best) = self.best.take() else {
            self.highlights.drain(..).for_each(|row| run.highlight(row));
            return Ok(None);
        };
        self.champion.take().into_iter().for_each(|(_, row)| best.offer(row));
        run.counts.complete = Some(best.offered);
        let kept = best.into_rows();
        write_kept(run, &kept)?;
        Ok(Some(kept))
    }
}

impl Part {
    /// The designs row of `taps`, all of its taps; whether to write the taps, and the row.
    fn take(
        &mut self,
        scene: &Scene,
        groups: &Groups,
        designs: &[Design],
        taps: &[Tap],
        (tuples, row_too): (bool, bool),
    ) -> csv::Result<()> {
        let (first, design) = (&taps[0], &designs[taps[0].design as usize]);
        let number = groups.designs[first.row as usize];
        let estimator = estimator(scene, groups, design, number);
        let elongation = table::elongation(scene, estimator.as_ref());
        let mut tally = Tally::new(1, 1);
        taps.iter().for_each(|tap| tally.count(0, 0, &tap.outcome));
        tally.calibrate(estimator.as_ref());
        let mut fields = Vec::new();
        for Tap { row, a, drive, outcome, .. } in taps {
            let estimated = tally.estimate((0, 0), (*a, scene.drive, *drive), outcome, estimator.as_ref());
            self.counts.taps += 1;
            self.counts.note(outcome.status | estimated.status, 1);
            self.left.push((*row, (outcome.deviation, outcome.status | estimated.status)));
            if tuples {
                table::tuple_row(design, (*a, *drive), outcome, &estimated, elongation, &mut fields);
                self.tuples.row(&mut fields)?;
            }
        }
        let (row, unit) = (tally.drives[0], elongation.unwrap_or(1.0));
        if row_too {
            table::drive_row(&design.tuple, first.drive, &row, unit, &mut fields);
            self.designs.row(&mut fields)?;
            self.rows += 1;
        }
        self.k.push((groups.drives[first.row as usize], row.k.unwrap_or(f64::NAN)));
        let rank = table::rank(&row, scene.output.by, unit).filter(|_| row.deviation.n == row.asked);
        self.complete.extend(rank.map(|rank| {
            let (index, design, drive) = ((u64::from(first.row), 0), design.tuple, first.drive);
            (number, Kept { rank, index, design, drive, row, unit })
        }));
        Ok(())
    }
}

fn estimator<'a>(scene: &Scene, groups: &Groups, design: &'a Design, number: u32) -> Option<Estimator<'a>> {
    design.shared.as_ref().map(|s| Estimator::new(scene, s, groups.reach[number as usize]))
}

/// Solves the rows again in file order and writes them; only those of the `kept` designs rows, if some were.
fn write_tuples(run: &mut Run<'_>, file: &Listed, k: &[f64], kept: Option<&[Kept]>) -> Result<(), Error> {
    let (scene, groups) = (run.scene, file.groups());
    let chosen = kept.map(|rows| marked(rows, &groups.drives, groups.counts[1]));
    let wanted = |row: usize| chosen.as_ref().is_none_or(|c| c[groups.drives[row] as usize]);
    let order: Option<Vec<u32>> =
        chosen.is_some().then(|| (0..file.len()).filter(|row| wanted(*row)).map(|row| row as u32).collect());
    let mut reader = Reader::new(file, order.as_deref())?;
    reader.len = order.as_ref().map_or(file.len(), Vec::len);
    let mut more = reader.len > 0;
    while more {
        let (mut designs, mut batch) = (Vec::new(), Vec::new());
        more = solve(run, groups, &mut reader, &mut designs, &mut batch)?;
        let text = |taps: &[Tap]| -> csv::Result<Vec<u8>> {
            let (mut text, mut fields) = (Text::default(), Vec::new());
            for tap in taps {
                let (row, design) = (tap.row as usize, &designs[tap.design as usize]);
                let estimator = estimator(scene, groups, design, groups.designs[row]);
                let mut tally = Tally::new(1, 1);
                tally.drives[0].k = Some(k[groups.drives[row] as usize]).filter(|k| !k.is_nan());
                let place = (tap.a, scene.drive, tap.drive);
                let estimated = tally.estimate((0, 0), place, &tap.outcome, estimator.as_ref());
                let elongation = table::elongation(scene, estimator.as_ref());
                let place = (tap.a, tap.drive);
                table::tuple_row(design, place, &tap.outcome, &estimated, elongation, &mut fields);
                text.row(&mut fields)?;
            }
            Ok(text.into_bytes())
        };
        let texts: Vec<_> = batch.par_chunks(1 << 13).map(text).collect::<Result<_, _>>().map_err(failed)?;
        texts.iter().try_for_each(|text| run.write(Table::Tuples, text, 0))?;
        run.write(Table::Tuples, &[], batch.len() as u64)?;
    }
    Ok(())
}

/// Which of `n` numbers the rows that were kept have.
fn marked(kept: &[Kept], numbers: &[u32], n: u64) -> Vec<bool> {
    let mut marked = vec![false; n as usize];
    kept.iter().for_each(|row| marked[numbers[row.index.0 as usize] as usize] = true);
    marked
}

/// Reduces what is `left` of the rows by distance and writes that, of the `kept` designs only if some were.
fn write_distances(
    run: &mut Run<'_>,
    file: &Listed,
    left: &[Left],
    kept: Option<&[Kept]>,
) -> Result<(), Error> {
    let (scene, groups) = (run.scene, file.groups());
    let chosen = kept.map(|rows| marked(rows, &groups.designs, groups.counts[0]));
    let numbers = &groups.distances;
    let mut order: Vec<u32> = (0..numbers.len() as u32).collect();
    order.par_sort_unstable_by_key(|&row| (numbers[row as usize], row));
    let mut runs = order.chunk_by(|p, q| numbers[*p as usize] == numbers[*q as usize]).peekable();
    let (mut reader, mut text, mut rows, mut fields) =
        (Reader::new(file, None)?, Text::default(), 0, Vec::new());
    while let Some((row, tuple)) = reader.next()? {
        // Rows are met in the order in which distances first appear.
        let Some(same) = runs.next_if(|same| same[0] == row) else { continue };
        if chosen.as_ref().is_some_and(|c| !c[groups.designs[row as usize] as usize]) {
            continue;
        }
        let mut reduced = DistanceRow::default();
        for &(deviation, status) in same.iter().map(|&row| &left[row as usize]) {
            reduced.status |= status;
            if status.counts() {
                reduced.deviation.push(deviation);
            }
        }
        // Only a K with a unit needs the curves of the whisker.
        let mut design = Design { tuple, shared: None };
        let mut unit = None;
        if table::elongation(scene, None).is_some() {
            design = Design::new(scene, tuple);
            let estimator = estimator(scene, groups, &design, groups.designs[row as usize]);
            unit = table::elongation(scene, estimator.as_ref());
        }
        table::distance_row(&design, tuple.a, &reduced, unit.unwrap_or(1.0), &mut fields);
        text.row(&mut fields).map_err(failed)?;
        rows += 1;
        if text.len() > 1 << 20 {
            run.write(Table::Distances, &std::mem::take(&mut text).into_bytes(), 0)?;
        }
    }
    run.write(Table::Distances, &text.into_bytes(), rows)
}
