//! Sweep over a tuple file: rows stay in file order, designs are the rows that share a whisker and a gauge.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::design::competing;
use super::grid::write_kept;
use super::select::{Best, Kept};
use super::{CHUNK, Run, key};
use crate::design::Design;
use crate::error::Error;
use crate::estimate::Estimated;
use crate::evaluate::{Outcome, Task};
use crate::scene::Tuple;
use crate::sink::{
    columns::{Block, Rows},
    run_json::Counts,
    table::{AtDistance, AtDrive, Table, TapRow, fields},
};
use crate::statistics::{Reduction, Told};

/// Designs whose own curves are solved together.
const TOGETHER: usize = 1 << 12;

/// Values in order of first appearance.
#[derive(Default)]
struct Seen {
    values: Vec<f64>,
    /// Row in which each value first stood.
    first: Vec<usize>,
}

/// Places of the values of every design; one map for all designs, most of which have few.
type Places = HashMap<(usize, u64), usize>;

impl Seen {
    fn place(&mut self, places: &mut Places, design: usize, x: f64, row: usize) -> usize {
        let next = self.values.len();
        let place = *places.entry((design, (x + 0.0).to_bits())).or_insert(next);
        if place == next {
            self.values.push(x);
            self.first.push(row);
        }
        place
    }
}

/// Rows of the file that share a design.
#[derive(Default)]
struct Group {
    rows: Vec<(usize, usize, usize)>,
    distances: Seen,
    drives: Seen,
}

/// Evaluates the listed tuples and writes their tables.
pub(super) fn run(run: &mut Run<'_>, tuples: &[Tuple]) -> Result<(), Error> {
    let study = run.study;
    let (designs, of_row, groups) = group(run, tuples);
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(tuples.len());
    for (from, chunk) in (0..).step_by(CHUNK as usize).zip(tuples.chunks(CHUNK as usize)) {
        let tasks: Vec<Task> = chunk
            .iter()
            .enumerate()
            .map(|(t, x)| Task { design: of_row[from + t], a: x.a, drive: x.drive })
            .collect();
        outcomes.extend(run.evaluate(&designs, &tasks)?);
        run.progress.at(outcomes.len() as u64, run.plan.taps);
    }

    let mut estimates = vec![None; tuples.len()];
    let mut all = Vec::with_capacity(groups.len());
    let mut best_rows = study.output.top.map(Best::new);
    let (mut profiles, mut first) = (Vec::new(), 0);
    for (place, (design, group)) in designs.iter().zip(&groups).enumerate() {
        if place % TOGETHER == 0 {
            let these = (place as u32..).zip(&groups[place..]).take(TOGETHER);
            let rows = these.flat_map(|(d, group)| {
                let reach = reach(&group.distances.values);
                group.drives.values.iter().map(move |drive| (d, *drive, reach))
            });
            (profiles, first) = (run.profiles(&designs, rows, None)?, 0);
        }
        let n = (group.distances.values.len(), group.drives.values.len());
        let mut reduced = Reduction::new(&study.setup, design, reach(&group.distances.values), n);
        for &(row, i, j) in &group.rows {
            reduced.count((i, j), &outcomes[row]);
        }
        reduced.calibrate();
        for &(row, i, j) in &group.rows {
            let t = &tuples[row];
            let told = Told::by(&profiles, first + j);
            estimates[row] = Some(reduced.estimate_by((i, j), (t.a, t.drive), &outcomes[row], told));
        }
        first += n.1;
        let unit = reduced.unit();
        let complete = reduced.drives.iter().enumerate().filter_map(|(j, row)| {
            let rank = row.rank(study.output.by, unit)?;
            let drive = group.drives.values[j];
            // Ties go to the row that stood first in the file.
            Some(Kept {
                rank,
                index: (group.drives.first[j] as u64, j as u32),
                design: design.tuple,
                drive,
                row: *row,
                unit,
            })
        });
        let complete: Vec<Kept> = complete.collect();
        match &mut best_rows {
            Some(best) => {
                competing(study.output.per, complete).into_iter().for_each(|row| best.offer(row));
            }
            None => complete.into_iter().for_each(|row| run.best.offer(row)),
        }
        all.push(reduced);
    }
    let estimates: Vec<Estimated> = estimates.into_iter().flatten().collect();
    let mut counts = Counts { taps: tuples.len() as u64, ..Counts::default() };
    for (tap, e) in outcomes.iter().zip(&estimates) {
        counts.note(tap.status | e.status, 1);
    }
    run.absorb(&counts);

    let kept = best_rows.map(|best| {
        run.counts.complete = Some(best.offered);
        best.into_rows()
    });
    let chosen = kept
        .as_ref()
        .map(|rows| rows.iter().map(|r| (key(&r.design), (r.drive + 0.0).to_bits())).collect::<HashSet<_>>());
    let wants_row =
        |t: &Tuple| chosen.as_ref().is_none_or(|c| c.contains(&(key(t), (t.drive + 0.0).to_bits())));
    let of_designs = kept.as_ref().map(|rows| rows.iter().map(|r| key(&r.design)).collect::<HashSet<_>>());
    let wants_design = |t: &Tuple| of_designs.as_ref().is_none_or(|c| c.contains(&key(t)));

    write_tuples(run, tuples, (&designs, &of_row, &all), &outcomes, &estimates, &wants_row)?;
    match &kept {
        Some(rows) => write_kept(run, rows)?,
        None => write_rows(run, Table::Designs, &designs, &groups, &all, &|_| true)?,
    }
    write_rows(run, Table::Distances, &designs, &groups, &all, &wants_design)
}

/// Designs in order of first appearance, the design of every row, and the rows of every design.
fn group(run: &Run<'_>, tuples: &[Tuple]) -> (Vec<Design>, Vec<u32>, Vec<Group>) {
    let (mut at, mut distances, mut drives) = (HashMap::new(), Places::new(), Places::new());
    let (mut firsts, mut of_row, mut groups) = (Vec::new(), Vec::new(), Vec::<Group>::new());
    for (row, t) in tuples.iter().enumerate() {
        let place = *at.entry(key(t)).or_insert_with(|| {
            firsts.push(*t);
            groups.push(Group::default());
            firsts.len() - 1
        });
        of_row.push(place as u32);
        let group = &mut groups[place];
        let i = group.distances.place(&mut distances, place, t.a, row);
        let j = group.drives.place(&mut drives, place, t.drive, row);
        group.rows.push((row, i, j));
    }
    (firsts.par_iter().map(|t| Design::new(&run.study.setup, *t)).collect(), of_row, groups)
}

fn reach(distances: &[f64]) -> [f64; 2] {
    distances.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], &a| [lo.min(a), hi.max(a)])
}

type Reduced<'a> = [Reduction<'a>];

fn write_tuples(
    run: &mut Run<'_>,
    tuples: &[Tuple],
    (designs, of_row, reduced): (&[Design], &[u32], &Reduced<'_>),
    outcomes: &[Outcome],
    estimates: &[Estimated],
    wanted: &(dyn Fn(&Tuple) -> bool + Sync),
) -> Result<(), Error> {
    if !run.writers.wants(Table::Tuples) {
        return Ok(());
    }
    let rows: Vec<usize> = (0..tuples.len()).filter(|&r| wanted(&tuples[r])).collect();
    let form = run.writers.form;
    for part in rows.chunks(CHUNK as usize) {
        let format = |rows: &[usize]| {
            let (mut written, mut values) = (Rows::new(form), Vec::new());
            for &r in rows {
                let (t, d) = (&tuples[r], of_row[r] as usize);
                let row = TapRow {
                    design: &designs[d].tuple,
                    a: t.a,
                    drive: t.drive,
                    tap: &outcomes[r],
                    estimated: &estimates[r],
                    elongation: reduced[d].elongation,
                };
                fields(&TapRow::COLUMNS, &row, &mut values);
                written.row(&mut values)?;
            }
            Ok(written.into_block())
        };
        let blocks: Vec<Block> = part.par_chunks(1 << 13).map(format).collect::<Result<_, Error>>()?;
        for block in blocks {
            run.write(Table::Tuples, block, 0)?;
        }
        run.count(Table::Tuples, part.len() as u64);
    }
    Ok(())
}

/// Rows of designs.csv or distances.csv in order of first appearance in the file.
fn write_rows(
    run: &mut Run<'_>,
    which: Table,
    designs: &[Design],
    groups: &[Group],
    reduced: &Reduced<'_>,
    wanted: &dyn Fn(&Tuple) -> bool,
) -> Result<(), Error> {
    let mut order: Vec<(usize, usize, usize)> = Vec::new();
    for (d, group) in groups.iter().enumerate().filter(|(d, _)| wanted(&designs[*d].tuple)) {
        let seen = if which == Table::Designs { &group.drives } else { &group.distances };
        order.extend(seen.first.iter().enumerate().map(|(place, &row)| (row, d, place)));
    }
    order.sort_unstable();
    let (mut rows, mut values) = (Rows::new(run.writers.form), Vec::new());
    for &(_, d, place) in &order {
        let reduced = &reduced[d];
        let unit = reduced.unit();
        match which {
            Table::Designs => {
                let drive = groups[d].drives.values[place];
                let row = AtDrive { design: &designs[d].tuple, drive, row: &reduced.drives[place], unit };
                fields(&AtDrive::COLUMNS, &row, &mut values);
            }
            _ => {
                let a = groups[d].distances.values[place];
                let row = AtDistance { design: &designs[d].tuple, a, row: &reduced.distances[place], unit };
                fields(&AtDistance::COLUMNS, &row, &mut values);
            }
        }
        rows.row(&mut values)?;
    }
    run.write(which, rows.into_block(), order.len() as u64)
}
