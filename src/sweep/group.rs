//! Solves, reduces and writes a group of designs together.

use std::borrow::Cow;
use std::iter::Peekable;
use std::ops::Range;

use rayon::prelude::*;

use super::taps::Places;
use super::{CHUNK, Kept, Place, Run, Taps};
use crate::curve::both::{self, Both};
use crate::curve::{self, Ask, Curve, Reach};
use crate::design::Design;
use crate::error::Error;
use crate::estimate::Estimated;
use crate::evaluate::{Outcome, Referral, Task};
use crate::plan::Way;
use crate::scene::{RankBy, Tuple};
use crate::sink::{AtDistance, AtDrive, Frame, Table, TapRow, run_json::Counts, table::Chosen};
use crate::statistics::{Reduction, Told};

const TOGETHER: usize = 1 << 12;

const PIECE: usize = 1 << 10;

/// Number of the design and place of the stroke in it, in order.
pub(super) type Strokes<'s> = &'s [(u64, u32)];

pub(super) struct Group {
    pub numbers: Vec<u64>,
    designs: Vec<Design>,
    /// First tap of each design, and the end of the last.
    starts: Vec<usize>,
    outcomes: Vec<Outcome>,
}

impl Group {
    /// The next chunk of `designs`, with solved taps; `None` after the last. `all`: one chunk, because the rows of designs alternate.
    pub fn next(
        run: &mut Run<'_>,
        taps: &Taps<'_>,
        (designs, all): (&mut Peekable<impl Iterator<Item = u64>>, bool),
    ) -> Result<Option<Self>, Error> {
        let chunk = run.plan.chunk;
        let (mut numbers, mut starts, mut total) = (Vec::new(), vec![0], 0);
        while let Some(k) = designs.next_if(|k| all || total == 0 || total + taps.block(*k) <= chunk) {
            total += taps.block(k);
            numbers.push(k);
            starts.push(total as usize);
        }
        if numbers.is_empty() {
            return Ok(None);
        }
        let setup = &run.study.setup;
        let designs: Vec<Design> = numbers.par_iter().map(|&k| Design::new(setup, taps.design(k))).collect();
        let total = total as usize;
        let mut group = Self { numbers, designs, starts, outcomes: Vec::with_capacity(total) };
        let step = if run.plan.solved == Way::Reference { chunk } else { CHUNK } as usize;
        for from in (0..total).step_by(step) {
            let to = total.min(from + step);
            group.outcomes.extend(run.evaluate(&group.designs, &group.tasks(taps, from..to))?);
            if to < total {
                run.show(to as u64);
            }
        }
        Ok(Some(group))
    }

    fn tasks(&self, taps: &Taps<'_>, range: Range<usize>) -> Vec<Task> {
        let task = |s: usize| {
            let d = self.starts.partition_point(|start| *start <= s) - 1;
            let design = (self.numbers[d], &self.designs[d].tuple);
            Task::of(d as u32, &taps.tap(design, (s - self.starts[d]) as u64))
        };
        range.into_par_iter().map(task).collect()
    }

    /// Reduces the designs and writes `tables`, taps only of the `kept` strokes if given. Returns the complete rows of each design.
    pub fn finish(
        &self,
        run: &mut Run<'_>,
        taps: &Taps<'_>,
        (tables, kept): (&[Table], Option<Strokes<'_>>),
    ) -> Result<Vec<Vec<Kept>>, Error> {
        let mut all = Vec::with_capacity(self.designs.len());
        for from in (0..self.designs.len()).step_by(TOGETHER) {
            all.extend(self.reduce(run, taps, from..self.designs.len().min(from + TOGETHER))?);
        }
        let by = run.study.listed_by();
        for one in &all {
            run.reached.counts.taps += one.counts.taps;
            run.reached.counts.combinations.add(&one.counts.combinations);
            run.show(0);
        }
        for &table in tables {
            write(run, taps, (table, kept), &all)?;
        }
        Ok(all.iter().map(|one| one.complete(taps, by)).collect())
    }

    fn reduce<'g>(
        &'g self,
        run: &mut Run<'_>,
        taps: &'g Taps<'_>,
        range: Range<usize>,
    ) -> Result<Vec<Reduced<'g>>, Error> {
        let setup = &run.study.setup;
        let begin = |d: usize| {
            let (number, design) = (self.numbers[d], &self.designs[d]);
            let (places, outcomes) =
                (taps.places(number), &self.outcomes[self.starts[d]..self.starts[d + 1]]);
            let tap = |t: &u32| taps.tap((number, &design.tuple), u64::from(*t));
            let distances: Vec<Tuple> = places.distances.iter().map(tap).collect();
            let strokes: Vec<Tuple> = places.strokes.iter().map(tap).collect();
            let reduction =
                Reduction::new(setup, design, taps.reach(number), (distances.len(), strokes.len()));
            let (estimates, counts) = (vec![Estimated::NOTHING; outcomes.len()], Counts::default());
            Reduced { number, design, places, distances, strokes, outcomes, reduction, estimates, counts }
        };
        let mut all: Vec<Reduced<'_>> = range.clone().into_par_iter().map(begin).collect();
        let asks = range.clone().zip(&all).flat_map(|(d, one)| {
            let (design, ends) = (d as u32, taps.reach(one.number));
            let reach = move |stroke: &Tuple| Reach::of(stroke.direction(), ends);
            one.strokes.iter().map(move |stroke| Ask { design, drive: stroke.drive, reach: reach(stroke) })
        });
        let asks: Vec<Ask> = asks.collect();
        let every = Referral::ALL;
        let curves = run.more(|setup, one| curve::solve(setup, (one, every), &self.designs, &asks))?;
        let (first, end, mut both) = (self.starts[range.start], self.starts[range.end], Vec::new());
        let told = first..if both::asked(setup) { end } else { first };
        for from in told.step_by(CHUNK as usize) {
            let taken = from..end.min(from + CHUNK as usize);
            let ask = |(task, tap): (Task, &Outcome)| {
                both::Ask::own(setup, task, tap, taps.reach(self.numbers[task.design as usize]))
            };
            let asks: Vec<both::Ask> =
                self.tasks(taps, taken.clone()).into_iter().zip(&self.outcomes[taken]).map(ask).collect();
            both.extend(run.more(|setup, one| both::both(setup, (one, every), &self.designs, &asks))?);
        }
        let mut of_curves = 0;
        let place = |(d, one): (usize, &Reduced<'_>)| {
            let from = of_curves;
            of_curves += one.strokes.len();
            (from..of_curves, self.starts[d] - first..self.starts[d + 1] - first)
        };
        let places: Vec<_> = range.zip(&all).map(place).collect();
        all.par_iter_mut().zip(places).for_each(|(one, (strokes, rows))| {
            one.reduce(taps, curves.get(strokes).unwrap_or_default(), both.get(rows).unwrap_or_default());
        });
        Ok(all)
    }
}

struct Reduced<'g> {
    number: u64,
    design: &'g Design,
    places: Cow<'g, Places>,
    distances: Vec<Tuple>,
    strokes: Vec<Tuple>,
    outcomes: &'g [Outcome],
    reduction: Reduction<'g>,
    estimates: Vec<Estimated>,
    counts: Counts,
}

impl Reduced<'_> {
    fn at(&self, t: usize) -> ((usize, usize), Tuple) {
        let (i, j) = self.places.of[t];
        let (i, j) = (i as usize, j as usize);
        ((i, j), Tuple { a: self.distances[i].a, ..self.strokes[j] })
    }

    fn reduce(&mut self, taps: &Taps<'_>, curves: &[Option<Curve>], both: &[Option<Both>]) {
        let order = taps.order(&self.places, &self.strokes, &self.distances);
        let order = (0..self.outcomes.len()).map(|s| order.get(s).map_or(s, |t| *t as usize));
        for t in order.clone() {
            let (place, at) = self.at(t);
            self.reduction.count(place, (at.a, at.drive), &self.outcomes[t]);
        }
        self.reduction.calibrate();
        for t in order {
            let ((place, at), tap) = (self.at(t), &self.outcomes[t]);
            let told = Told::by(curves, place.1).towards(at.direction()).or_both(both.get(t));
            self.estimates[t] = self.reduction.estimate(place, (at.a, at.drive), tap, told);
            self.counts.taps += 1;
            self.counts.combinations.note(tap.status | self.estimates[t].status, 1);
        }
    }

    fn stroke(&self, j: usize) -> AtDrive {
        let row = self.reduction.drives[j].figures();
        AtDrive { design: self.strokes[j], row, unit: self.reduction.unit() }
    }

    fn complete(&self, taps: &Taps<'_>, by: RankBy) -> Vec<Kept> {
        let row = |j: usize| {
            // In a list, ties go to the earlier row.
            let first = taps.row(self.number, self.places.strokes[j]).unwrap_or(self.number);
            let rank = self.reduction.drives[j].rank(by, self.reduction.unit())?;
            Some(Kept { rank, index: (first, j as u32), at: self.stroke(j), charted: f32::NAN })
        };
        (0..self.strokes.len()).filter_map(row).collect()
    }

    fn tap(&self, n: usize) -> TapRow<'_> {
        TapRow::of(&self.reduction, self.design, self.at(n).1, (&self.outcomes[n], &self.estimates[n]))
    }

    fn distance(&self, n: usize) -> AtDistance<'_> {
        let (design, unit) = (self.distances[n], self.reduction.unit());
        AtDistance { design, row: &self.reduction.distances[n], unit }
    }

    /// The tap and the stroke of row `n` of a table, or its first ones.
    fn place(&self, table: Table, n: u32) -> (u32, u32) {
        match table {
            Table::Tuples => (n, self.places.of[n as usize].1),
            Table::Designs => (self.places.strokes[n as usize], n),
            Table::Distances => (self.places.distances[n as usize], 0),
        }
    }
}

/// The `rows` of a table in pieces, made in parallel.
fn pieces<R>(
    empty: &Frame,
    columns: &Chosen<'_, R>,
    rows: &[(u32, u32)],
    row: impl Fn(usize, usize) -> R + Sync,
) -> Result<Vec<Frame>, Error> {
    let piece = |rows: &[(u32, u32)]| {
        let mut made = empty.like();
        rows.iter().try_for_each(|&(d, n)| made.row(columns.fields(&row(d as usize, n as usize))))?;
        Ok(made)
    };
    rows.par_chunks(PIECE).map(piece).collect()
}

fn write(
    run: &mut Run<'_>,
    taps: &Taps<'_>,
    (table, kept): (Table, Option<Strokes<'_>>),
    all: &[Reduced<'_>],
) -> Result<(), Error> {
    let rows = all.iter().enumerate().flat_map(|(d, one)| {
        let n = match table {
            Table::Tuples => one.outcomes.len(),
            Table::Designs => one.strokes.len(),
            Table::Distances => one.distances.len(),
        };
        let is_kept = move |n: &u32| {
            let stroke = || (one.number, one.place(table, *n).1);
            table != Table::Tuples || kept.is_none_or(|kept| kept.binary_search(&stroke()).is_ok())
        };
        (0..n as u32).filter(is_kept).map(move |n| (d as u32, n))
    });
    let mut rows: Vec<(u32, u32)> = rows.collect();
    let first = |&(d, n): &(u32, u32)| {
        let one = &all[d as usize];
        taps.row(one.number, one.place(table, n).0)
    };
    if !taps.in_order() {
        rows.par_sort_unstable_by_key(first);
    }
    let place = |row: &(u32, u32)| {
        let (one, n) = (&all[row.0 as usize], row.1);
        let order = first(row).map_or((0, one.number, n), |row| (0, row, 0));
        Place { table, of: (one.number, one.place(table, n).1), order, charted: f32::NAN }
    };
    let setup = &run.study.setup;
    let empty = table.heading().frame_for(setup);
    for rows in rows.chunks(CHUNK as usize) {
        let pieces = match table {
            Table::Tuples => pieces(&empty, &TapRow::chosen(setup), rows, |d, n| all[d].tap(n)),
            Table::Designs => pieces(&empty, &AtDrive::chosen(setup), rows, |d, n| all[d].stroke(n)),
            Table::Distances => pieces(&empty, &AtDistance::chosen(setup), rows, |d, n| all[d].distance(n)),
        }?;
        run.writers.place(rows.iter().map(place))?;
        run.write(table, &pieces)?;
    }
    Ok(())
}
