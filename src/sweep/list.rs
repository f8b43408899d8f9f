//! Sweep over a tuple file: rows stay in file order, designs are the rows that share a whisker and a gauge.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::design::competing;
use super::grid::write_kept;
use super::parted::Place;
use super::select::{Best, Kept};
use super::{CHUNK, Run, key};
use crate::design::Design;
use crate::error::Error;
use crate::estimate::Estimated;
use crate::evaluate::{Outcome, Task};
use crate::scene::{Direction, Tuple};
use crate::sink::{
    pack::Packed,
    rows::Rows,
    run_json::Counts,
    table::{AtDistance, AtDrive, Table, TapRow, fields},
};
use crate::statistics::{Reduction, Told};

/// Designs whose own curves are solved together.
const TOGETHER: usize = 1 << 12;

/// A distance, or a drive, and the direction of the pole.
type Value = (f64, Direction);

/// Values in order of first appearance.
#[derive(Default)]
struct Seen {
    values: Vec<Value>,
    /// Row in which each value first stood.
    first: Vec<usize>,
}

/// Places of the values of every design; one map for all designs, most of which have few.
type Places = HashMap<(usize, [u64; 3]), usize>;

impl Seen {
    fn place(&mut self, places: &mut Places, design: usize, value: Value, row: usize) -> usize {
        let next = self.values.len();
        let place = *places.entry((design, bits(value))).or_insert(next);
        if place == next {
            self.values.push(value);
            self.first.push(row);
        }
        place
    }
}

/// What makes two values the same.
fn bits((x, Direction { tilt, lean }): Value) -> [u64; 3] {
    [x, tilt, lean].map(|x| (x + 0.0).to_bits())
}

/// Rows of the file that share a design.
#[derive(Default)]
struct Group {
    rows: Vec<(usize, usize, usize)>,
    distances: Seen,
    drives: Seen,
}

impl Group {
    /// Its rows in the order in which they are reduced: that of their values, so that sums do not depend on the order of the file.
    fn sorted(&self) -> Vec<(usize, usize, usize)> {
        let mut rows = self.rows.clone();
        rows.sort_by_cached_key(|&(row, i, j)| {
            (bits(self.drives.values[j]), bits(self.distances.values[i]), row)
        });
        rows
    }
}

/// Evaluates the listed tuples of the run's own designs and writes their tables.
pub(super) fn run(run: &mut Run<'_>, tuples: &[Tuple]) -> Result<(), Error> {
    let (own, rows) = own(run, tuples);
    let (study, tuples) = (run.study, own.as_slice());
    let (designs, of_row, groups) = group(run, tuples);
    let mut outcomes: Vec<Outcome> = run.resumed()?.unwrap_or_default();
    run.progress.begin(outcomes.len() as u64);
    while outcomes.len() < tuples.len() {
        let from = outcomes.len();
        let to = tuples.len().min(from + run.pace.size as usize);
        let task = |(t, x): (usize, &Tuple)| Task::of(of_row[t], x);
        let tasks: Vec<Task> = (from..).zip(&tuples[from..to]).map(task).collect();
        outcomes.extend(run.evaluate(&designs, &tasks)?);
        run.progress.at(outcomes.len() as u64, tuples.len() as u64);
        run.complete((to as u64, tuples.len() as u64, "rows"), |to| outcomes.pack(to))?;
    }

    let (mut both, together) = (Vec::new(), run.pace.size as usize);
    for (from, taps) in (0..).step_by(together).zip(outcomes.chunks(together)) {
        let row = |i: usize| of_row[from + i];
        let tasks: Vec<Task> = (0..taps.len()).map(|i| Task::of(row(i), &tuples[from + i])).collect();
        let reach = |i: usize| reach(&groups[row(i) as usize].distances.values);
        both.extend(run.both(&designs, (&tasks, taps), reach)?);
    }
    let mut estimates = vec![None; tuples.len()];
    let mut all = Vec::with_capacity(groups.len());
    let mut best_rows = study.output.top.map(Best::new);
    let (mut curves, mut first) = (Vec::new(), 0);
    for (place, (design, group)) in designs.iter().zip(&groups).enumerate() {
        if place % TOGETHER == 0 {
            let these = (place as u32..).zip(&groups[place..]).take(TOGETHER);
            let rows = these.flat_map(|(d, group)| {
                let reach = reach(&group.distances.values);
                group.drives.values.iter().map(move |(drive, direction)| (d, *direction, *drive, reach))
            });
            (curves, first) = (run.curves(&designs, rows, None)?, 0);
        }
        let n = (group.distances.values.len(), group.drives.values.len());
        let mut reduced = Reduction::new(&study.setup, design, reach(&group.distances.values), n);
        let sorted = group.sorted();
        for &(row, i, j) in &sorted {
            reduced.count((i, j), (tuples[row].a, tuples[row].drive), &outcomes[row]);
        }
        reduced.calibrate();
        for (row, i, j) in sorted {
            let t = &tuples[row];
            let told = Told::by(&curves, first + j).towards(t.direction()).or_both(both.get(row));
            estimates[row] = Some(reduced.estimate_by((i, j), (t.a, t.drive), &outcomes[row], told));
        }
        first += n.1;
        let unit = reduced.unit();
        let complete = reduced.drives.iter().enumerate().filter_map(|(j, row)| {
            let rank = row.rank(study.listed_by(), unit)?;
            let (drive, direction) = group.drives.values[j];
            let row = AtDrive { design: &design.tuple, direction, drive, row: row.figures(), unit };
            // Ties go to the row that stood first in the file.
            Some(Kept::of(&row, rank, (rows[group.drives.first[j]], j as u32)))
        });
        let complete: Vec<Kept> = complete.collect();
        match &mut best_rows {
            Some(best) => {
                competing(study.output.per, complete).into_iter().for_each(|row| best.offer(row));
            }
            None => complete.iter().for_each(|row| run.best.offer(row)),
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
    let chosen = kept.as_ref().map(|rows| {
        rows.iter().map(|r| (key(&r.design), bits((r.drive, r.direction)))).collect::<HashSet<_>>()
    });
    let wants_row =
        |t: &Tuple| chosen.as_ref().is_none_or(|c| c.contains(&(key(t), bits((t.drive, t.direction())))));
    let of_designs = kept.as_ref().map(|rows| rows.iter().map(|r| key(&r.design)).collect::<HashSet<_>>());
    let wants_design = |t: &Tuple| of_designs.as_ref().is_none_or(|c| c.contains(&key(t)));

    let first = |d: usize| rows[groups[d].rows[0].0];
    let owner = |&(_, _, j): &(usize, usize, usize), group: &Group| rows[group.drives.first[j]];
    let mut owners = vec![0; tuples.len()];
    groups.iter().for_each(|g| g.rows.iter().for_each(|row| owners[row.0] = owner(row, g)));
    let listed = (tuples, rows.as_slice(), owners.as_slice());
    write_tuples(run, listed, (&designs, &of_row, &all), (&outcomes, &estimates), &wants_row)?;
    match &kept {
        Some(kept) => {
            let of_key: HashMap<_, u64> =
                designs.iter().enumerate().map(|(d, design)| (key(&design.tuple), first(d))).collect();
            write_kept(run, kept, &|row| of_key.get(&key(&row.design)).copied().unwrap_or_default())?;
        }
        None => write_rows(run, Table::Designs, (&designs, &rows), &groups, &all, &|_| true)?,
    }
    write_rows(run, Table::Distances, (&designs, &rows), &groups, &all, &wants_design)
}

/// The tuples of the run's own designs, and their rows in the file.
fn own(run: &Run<'_>, tuples: &[Tuple]) -> (Vec<Tuple>, Vec<u64>) {
    let mut at = HashMap::new();
    let own = |(row, t): (u64, &Tuple)| {
        let next = at.len() as u64;
        run.designs.contains(at.entry(key(t)).or_insert(next)).then_some((*t, row))
    };
    (0..).zip(tuples).filter_map(own).unzip()
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
        let i = group.distances.place(&mut distances, place, (t.a, t.direction()), row);
        let j = group.drives.place(&mut drives, place, (t.drive, t.direction()), row);
        group.rows.push((row, i, j));
    }
    (firsts.par_iter().map(|t| Design::new(&run.study.setup, *t)).collect(), of_row, groups)
}

fn reach(distances: &[Value]) -> [f64; 2] {
    distances.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], &(a, _)| [lo.min(a), hi.max(a)])
}

type Reduced<'a> = [Reduction<'a>];

fn write_tuples(
    run: &mut Run<'_>,
    (tuples, places, owners): (&[Tuple], &[u64], &[u64]),
    (designs, of_row, reduced): (&[Design], &[u32], &Reduced<'_>),
    (outcomes, estimates): (&[Outcome], &[Estimated]),
    wanted: &(dyn Fn(&Tuple) -> bool + Sync),
) -> Result<(), Error> {
    if !run.writers.wants(Table::Tuples) {
        return Ok(());
    }
    let rows: Vec<usize> = (0..tuples.len()).filter(|&r| wanted(&tuples[r])).collect();
    let form = run.writers.form;
    run.place(rows.iter().map(|&r| Place::row(Table::Tuples, places[r], owners[r])))?;
    for part in rows.chunks(CHUNK as usize) {
        let made = |rows: &[usize]| {
            let (mut text, mut values) = (Rows::new(form), Vec::new());
            for &r in rows {
                let (t, d) = (&tuples[r], of_row[r] as usize);
                let at = (t.a, t.direction(), t.drive);
                let row = TapRow::of(&reduced[d], &designs[d], at, (&outcomes[r], &estimates[r]));
                fields(&TapRow::COLUMNS, &run.study.setup, &row, &mut values);
                text.row(&mut values)?;
            }
            Ok(text)
        };
        let texts: Vec<Rows> = part.par_chunks(1 << 13).map(made).collect::<Result<_, Error>>()?;
        for text in texts {
            run.write(Table::Tuples, text, 0)?;
        }
        run.count(Table::Tuples, part.len() as u64);
    }
    Ok(())
}

/// Rows of designs.csv or distances.csv in order of first appearance in the file.
fn write_rows(
    run: &mut Run<'_>,
    which: Table,
    (designs, rows): (&[Design], &[u64]),
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
    let (mut text, mut values) = (run.rows(), Vec::new());
    for &(_, d, place) in &order {
        let reduced = &reduced[d];
        let unit = reduced.unit();
        match which {
            Table::Designs => {
                let (drive, direction) = groups[d].drives.values[place];
                let row = reduced.drives[place].figures();
                let row = AtDrive { design: &designs[d].tuple, direction, drive, row, unit };
                fields(&AtDrive::COLUMNS, &run.study.setup, &row, &mut values);
            }
            _ => {
                let (a, direction) = groups[d].distances.values[place];
                let row = &reduced.distances[place];
                let row = AtDistance { design: &designs[d].tuple, a, direction, row, unit };
                fields(&AtDistance::COLUMNS, &run.study.setup, &row, &mut values);
            }
        }
        text.row(&mut values)?;
    }
    if run.writers.wants(which) {
        let first = |d: usize| rows[groups[d].rows[0].0];
        run.place(order.iter().map(|(row, d, _)| Place::row(which, rows[*row], first(*d))))?;
    }
    run.write(which, text, order.len() as u64)
}
