//! A sweep of which only the designs table is written: its rows are read from charts, those outside them reduced from solved taps.

use std::time::Instant;

use rayon::prelude::*;

use super::highlights::Highlights;
use super::select::Kept;
use super::{Run, charted};
use crate::chart::{lanes::Counting, rows::RowReader};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::Task;
use crate::plan::Layout;
use crate::scene::{Convention, Tuple};
use crate::sink::{
    pack::Packed,
    rows::Rows,
    run_json::Counts,
    table::{AtDrive, Table, fields},
};
use crate::statistics::{DriveRow, Reduction};

/// Rows of one piece of text.
const PIECE: usize = 512;

/// Writes the rows of the designs of `layout` that are the run's own.
pub(super) fn run(run: &mut Run<'_>, layout: &Layout, readers: &[&RowReader]) -> Result<(), Error> {
    run.counts.chart = readers.first().map(|reader| serde_json::json!(reader.summary()));
    let (begin, end) = (run.designs.start * layout.n_drives, run.designs.end * layout.n_drives);
    let mut from = match run.resumed::<u64>()? {
        Some(row) => row,
        None => {
            for sweeps in readers.iter().map(|reader| reader.sweeps()) {
                run.counts.solved += sweeps.taps;
                run.counts.sweeps.merge(&sweeps);
            }
            begin
        }
    };
    while from < end {
        let together = (run.pace.size / layout.n_distances).max(1);
        let to = (from + together).min(end);
        some(run, layout, readers, &(from..to).collect::<Vec<_>>())?;
        run.complete((to - begin, end - begin, "rows"), |state| to.pack(state))?;
        from = to;
    }
    Ok(())
}

/// Writes the rows at `places`.
pub(super) fn some(
    run: &mut Run<'_>,
    layout: &Layout,
    readers: &[&RowReader],
    places: &[u64],
) -> Result<(), Error> {
    run.check_stop()?;
    let tuples: Vec<Tuple> = places.par_iter().map(|r| tuple(layout, *r)).collect();
    let rows = rows(run, layout, readers, &tuples)?;
    write(run, layout, places, &tuples, &rows)?;
    run.counts.taps += tuples.len() as u64 * layout.n_distances;
    run.show(0);
    Ok(())
}

/// Design and stroke of row `r`.
fn tuple(layout: &Layout, r: u64) -> Tuple {
    layout.stroke(&layout.design(r / layout.n_drives), r % layout.n_drives)
}

/// The rows of `tuples`, read or solved.
fn rows(
    run: &mut Run<'_>,
    layout: &Layout,
    readers: &[&RowReader],
    tuples: &[Tuple],
) -> Result<Vec<DriveRow>, Error> {
    let start = Instant::now();
    let found = match readers {
        [reader] => {
            let (found, words) = reader.read(tuples, Counting::OnWhisker);
            charted::note(&mut run.counts, &words);
            found
        }
        _ => {
            let mut all = vec![None; tuples.len()];
            for (rig, reader) in (0..).zip(readers) {
                let places: Vec<usize> = (0..tuples.len()).filter(|&i| tuples[i].rig == rig).collect();
                let own: Vec<Tuple> = places.iter().map(|&i| tuples[i]).collect();
                let (found, words) = reader.read(&own, Counting::OnWhisker);
                charted::note(&mut run.counts, &words);
                places.into_iter().zip(found).for_each(|(i, row)| all[i] = row);
            }
            all
        }
    };
    run.solve += start.elapsed();
    let hard: Vec<usize> = (0..tuples.len()).filter(|&i| found[i].is_none()).collect();
    run.counts.interpolated += (tuples.len() - hard.len()) as u64 * layout.n_distances;
    for row in found.iter().flatten() {
        row.row.strain_max().into_iter().for_each(|strain| run.counts.strain.push(strain));
    }
    let mut all: Vec<DriveRow> =
        found.into_iter().map(|f| f.map_or_else(DriveRow::default, |f| f.row)).collect();
    let these: Vec<Tuple> = hard.iter().map(|&i| tuples[i]).collect();
    hard.into_iter().zip(solved(run, layout, &these)?).for_each(|(i, row)| all[i] = row);
    Ok(all)
}

/// The rows of `tuples` from their taps.
fn solved(run: &mut Run<'_>, layout: &Layout, tuples: &[Tuple]) -> Result<Vec<DriveRow>, Error> {
    if tuples.is_empty() {
        return Ok(Vec::new());
    }
    let (setup, n) = (&run.study.setup, layout.n_distances as usize);
    let designs: Vec<Design> = tuples.par_iter().map(|t| Design::new(setup, *t)).collect();
    let task = |t: usize| {
        Task::of((t / n) as u32, &Tuple { a: layout.distance((t % n) as u64), ..designs[t / n].tuple })
    };
    let tasks: Vec<Task> = (0..tuples.len() * n).into_par_iter().map(task).collect();
    let outcomes = run.evaluate(&designs, &tasks)?;
    let one = |at: usize| {
        let (taps, mut counts) = (&outcomes[at * n..(at + 1) * n], Counts::default());
        let mut reduced = Reduction::new(setup, &designs[at], layout.reach(), (n, 1));
        let place = |i: usize| (layout.distance(i as u64), designs[at].tuple.drive);
        taps.iter().enumerate().for_each(|(i, tap)| reduced.count((i, 0), place(i), tap));
        reduced.calibrate();
        for (i, tap) in taps.iter().enumerate() {
            counts.note(tap.status | reduced.estimate((i, 0), place(i), tap).status, 1);
        }
        (reduced.drives[0], counts)
    };
    let rows: Vec<(DriveRow, Counts)> = (0..tuples.len()).into_par_iter().map(one).collect();
    for (_, counts) in &rows {
        run.absorb(counts);
    }
    Ok(rows.into_iter().map(|(row, _)| row).collect())
}

/// Writes the rows of `tuples`, which are those at `places`, and offers the complete ones for the summary.
fn write(
    run: &mut Run<'_>,
    layout: &Layout,
    places: &[u64],
    tuples: &[Tuple],
    rows: &[DriveRow],
) -> Result<(), Error> {
    let (study, form) = (run.study, run.writers.form);
    let by = study.listed_by();
    let unit = |t: &Tuple| match study.setup.estimate.convention {
        Convention::Mean => 1.0,
        Convention::Elongation => Design::new(&study.setup, *t).elongation(&study.setup).unwrap_or(1.0),
    };
    let piece = |(p, (tuples, rows)): (usize, (&[Tuple], &[DriveRow]))| {
        let (mut out, mut values, mut best) = (Rows::new(form), Vec::new(), Highlights::default());
        for (i, (design, row)) in tuples.iter().zip(rows).enumerate() {
            let unit = unit(design);
            let (direction, drive) = (design.direction(), design.drive);
            let (rank, row) = (row.rank(by, unit), row.figures());
            let row = AtDrive { design, direction, drive, row, unit };
            fields(&AtDrive::COLUMNS, &study.setup, &row, &mut values);
            out.row(&mut values)?;
            if let Some(rank) = rank {
                let r = places[p * PIECE + i];
                best.offer(&Kept::of(&row, rank, (r / layout.n_drives, (r % layout.n_drives) as u32)));
            }
        }
        Ok((out, best, rows.len() as u64))
    };
    let pieces = tuples.par_chunks(PIECE).zip(rows.par_chunks(PIECE)).enumerate().map(piece);
    let pieces: Vec<(Rows, Highlights, u64)> = pieces.collect::<Result<_, Error>>()?;
    for (out, best, rows) in pieces {
        run.write(Table::Designs, out, rows)?;
        run.best.merge(&best);
    }
    Ok(())
}
