//! Tables of a tuple file that follow its designs rows: taps solved again in file order, and distances.

use std::collections::HashMap;

use rayon::prelude::*;

use super::super::Run;
use super::super::select::Kept;
use super::read::{Reader, SolvedRow, is_own, solve};
use super::reduce::Reduced;
use super::{curves, pack, reduction};
use crate::design::Design;
use crate::error::Error;
use crate::scene::Convention;
use crate::scene::listed::Listed;
use crate::sink::{
    pack::Packed,
    rows::Rows,
    table::{AtDistance, Table, TapRow, fields},
};
use crate::statistics::{DistanceRow, Told};

/// Solves the rows again in file order, from place `from` on, and writes them; only those of the `kept` designs rows, if some were.
pub(super) fn write_tuples(
    run: &mut Run<'_>,
    file: &Listed,
    all: &Reduced,
    kept: &Option<Vec<Kept>>,
    from: u64,
) -> Result<(), Error> {
    let (study, groups, own, k) = (run.study, file.groups(), run.designs.clone(), &all.k);
    let chosen = kept.as_ref().map(|rows| marked(rows, &groups.drives, groups.counts[1]));
    let wanted = |row: u32| {
        is_own(groups, &own, row) && chosen.as_ref().is_none_or(|c| c[groups.drives[row as usize] as usize])
    };
    let some = chosen.is_some() || (own.end - own.start) < groups.counts[0];
    let order: Option<Vec<u32>> = some.then(|| (0..file.len() as u32).filter(|row| wanted(*row)).collect());
    let mut reader = Reader::new(file, order.as_deref())?;
    reader.skip(from as usize)?;
    let mut more = reader.at.1 < reader.len;
    while more {
        let (mut designs, mut batch) = (Vec::new(), Vec::new());
        more = solve(run, groups, &mut reader, &mut designs, &mut batch)?;
        // A tap's place among the curves of the batch is that of its designs row.
        let (mut places, mut firsts) = (HashMap::new(), Vec::new());
        for tap in &batch {
            places.entry(groups.drives[tap.row as usize]).or_insert_with(|| {
                firsts.push(tap);
                firsts.len() - 1
            });
        }
        let curves = curves(run, groups, &designs, firsts.into_iter())?;
        let form = run.writers.form;
        let text = |taps: &[SolvedRow]| -> Result<Rows, Error> {
            let (mut text, mut values) = (Rows::new(form), Vec::new());
            for tap in taps {
                let (row, design) = (tap.row as usize, &designs[tap.design as usize]);
                let mut reduced = reduction(&study.setup, groups, design, groups.designs[row]);
                reduced.calibrate_as(Some(k[groups.drives[row] as usize]).filter(|k| !k.is_nan()));
                let SolvedRow { a, direction, drive, outcome, both, .. } = tap;
                let told = Told::by(&curves, places[&groups.drives[row]]).towards(*direction);
                let told = told.or_both(both.as_ref());
                let estimated = reduced.estimate_by((0, 0), (*a, *drive), outcome, told);
                let row = TapRow::of(&reduced, design, (*a, *direction, *drive), (outcome, &estimated));
                fields(&TapRow::COLUMNS, &study.setup, &row, &mut values);
                text.row(&mut values)?;
            }
            Ok(text)
        };
        let texts: Vec<_> = batch.par_chunks(1 << 13).map(text).collect::<Result<_, _>>()?;
        texts.into_iter().try_for_each(|text| run.write(Table::Tuples, text, 0))?;
        run.count(Table::Tuples, batch.len() as u64);
        run.place(batch.iter().map(|tap| all.place(groups, Table::Tuples, tap.row)))?;
        let place = reader.at.1 as u64;
        run.complete((place, reader.len as u64, "taps"), |to| {
            pack((1, place), all, to);
            kept.pack(to);
        })?;
    }
    Ok(())
}

/// Which of `n` numbers the rows that were kept have.
pub(super) fn marked(kept: &[Kept], numbers: &[u32], n: u64) -> Vec<bool> {
    let mut marked = vec![false; n as usize];
    kept.iter().for_each(|row| marked[numbers[row.index.0 as usize] as usize] = true);
    marked
}

/// Reduces what is `left` of the rows by distance and writes that, of the `kept` designs only if some were.
pub(super) fn write_distances(
    run: &mut Run<'_>,
    file: &Listed,
    all: &Reduced,
    kept: Option<&[Kept]>,
) -> Result<(), Error> {
    let (study, groups) = (run.study, file.groups());
    let chosen = kept.map(|rows| marked(rows, &groups.designs, groups.counts[0]));
    let numbers = &groups.distances;
    let own = run.designs.clone();
    let mut order: Vec<u32> = (0..numbers.len() as u32).filter(|row| is_own(groups, &own, *row)).collect();
    order.par_sort_unstable_by_key(|&row| (numbers[row as usize], row));
    let mut runs = order.chunk_by(|p, q| numbers[*p as usize] == numbers[*q as usize]).peekable();
    let (mut reader, mut text, mut rows, mut values) = (Reader::new(file, None)?, run.rows(), 0, Vec::new());
    while let Some((row, tuple)) = reader.next()? {
        // Rows are met in the order in which distances first appear.
        let Some(same) = runs.next_if(|same| same[0] == row) else { continue };
        if chosen.as_ref().is_some_and(|c| !c[groups.designs[row as usize] as usize]) {
            continue;
        }
        let mut reduced = DistanceRow::default();
        for (deviation, status) in same.iter().map(|&row| all.left.at(row)) {
            reduced.status |= status;
            if status.counts() {
                reduced.deviation.push(deviation);
            }
        }
        // Only a K with a unit needs the curves of the whisker.
        let mut design = Design::nothing(tuple);
        if study.setup.estimate.convention == Convention::Elongation {
            design = Design::new(&study.setup, tuple);
        }
        let unit = design.elongation(&study.setup);
        let reduced = AtDistance {
            design: &design.tuple,
            a: tuple.a,
            direction: tuple.direction(),
            row: &reduced,
            unit: unit.unwrap_or(1.0),
        };
        fields(&AtDistance::COLUMNS, &study.setup, &reduced, &mut values);
        text.row(&mut values)?;
        run.place(std::iter::once(all.place(groups, Table::Distances, row)))?;
        rows += 1;
        if text.weight() > 1 << 20 {
            let text = text.take();
            run.write(Table::Distances, text, 0)?;
        }
    }
    run.write(Table::Distances, text, rows)
}
