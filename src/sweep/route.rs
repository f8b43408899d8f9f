//! How a sweep goes through the designs of its space: all of them, or ranked, and then those of the rows that are kept.

use super::Run;
use super::about::Place;
use super::best::{Best, Kept, Reached, Reaching};
use super::charted::{self, Rankers};
use super::group::Group;
use super::taps::Taps;
use crate::chart::lanes::Found;
use crate::error::Error;
use crate::scene::{Per, Tuple};
use crate::sink::{
    pack::Packer,
    table::{AtDrive, Table},
};

/// Evaluates the designs that are the run's own and writes their tables.
pub(super) fn run(run: &mut Run<'_>, taps: &Taps<'_>) -> Result<(), Error> {
    let every: Vec<Table> = Table::ALL.into_iter().filter(|t| run.writers.wants(*t)).collect();
    let Some(top) = run.study.output.top else { return all(run, taps, &every) };
    let (mut kept, from) = match run.resumed::<Reached>()? {
        Some(Reached::Kept(kept, next)) => (kept, next),
        ranked => {
            let kept = match (Rankers::of(run.plan), taps) {
                (Some(rankers), Taps::Grid { layout, .. }) => {
                    charted::run(run, (taps, layout), &rankers, (top, ranked))?
                }
                _ => ranked_rows(run, taps, (top, ranked))?,
            };
            write_kept(run, taps, &kept)?;
            (kept.iter().map(|k| (taps.design_of(k.index), k.index.1)).collect(), 0)
        }
    };

    // The taps and designs of the kept rows, in row order.
    let rest: Vec<Table> = every.into_iter().filter(|t| *t != Table::Designs).collect();
    if rest.is_empty() {
        return Ok(());
    }
    kept.sort_unstable();
    let mut order: Vec<u64> = kept.iter().map(|(k, _)| *k).collect();
    order.dedup();
    let (mut next, of) = (from, order.len() as u64);
    let mut designs = order.into_iter().skip(from as usize).peekable();
    let before = run.counts.clone();
    loop {
        let pack = |to: &mut Packer<'_>| to.put(&Reaching::Kept(&kept, next));
        let these = (&mut designs, !taps.in_order());
        let Some(group) = Group::next(run, taps, these, Some(((next, of), &pack)))? else { return Ok(()) };
        group.finish(run, taps, (&rest, Some(&kept)))?;
        // They were counted when they were ranked.
        (run.counts.taps, run.counts.combinations) = (before.taps, before.combinations.clone());
        next += group.numbers.len() as u64;
        run.complete((next, of, "kept designs"), |to| to.put(&Reaching::Kept(&kept, next)))?;
    }
}

/// All rows of the designs, in `tables`.
fn all(run: &mut Run<'_>, taps: &Taps<'_>, tables: &[Table]) -> Result<(), Error> {
    let range = run.designs.clone();
    let mut next = run.resumed::<u64>()?.unwrap_or(range.start);
    let mut designs = (next..range.end).peekable();
    loop {
        let (done, of) = (next - range.start, range.end - range.start);
        let these = (&mut designs, !taps.in_order());
        let Some(group) =
            Group::next(run, taps, these, Some(((done, of), &|to: &mut Packer<'_>| to.put(&next))))?
        else {
            return Ok(());
        };
        let complete = group.finish(run, taps, (tables, None))?;
        complete.iter().flatten().for_each(|row| run.best.offer(row));
        next += group.numbers.len() as u64;
        run.complete((next - range.start, of, "designs"), |to| to.put(&next))?;
    }
}

/// The best `top` rows, best first, every one solved.
fn ranked_rows(
    run: &mut Run<'_>,
    taps: &Taps<'_>,
    (top, before): (usize, Option<Reached>),
) -> Result<Vec<Kept>, Error> {
    let range = run.designs.clone();
    let (mut next, mut best) = match before {
        Some(Reached::Ranked(next, _, best)) => (next, best),
        _ => (range.start, Best::new(top)),
    };
    let mut designs = (next..range.end).peekable();
    loop {
        let (done, of) = (next - range.start, range.end - range.start);
        let pack = |to: &mut Packer<'_>| to.put(&Reaching::Ranked(next, &Found::default(), &best));
        let Some(group) = Group::next(run, taps, (&mut designs, false), Some(((done, of), &pack)))? else {
            break;
        };
        let complete = group.finish(run, taps, (&[], None))?;
        offer(run.study.output.per, &mut best, complete);
        next += group.numbers.len() as u64;
        run.complete((next - range.start, of, "designs"), |to| {
            to.put(&Reaching::Ranked(next, &Found::default(), &best));
        })?;
    }
    run.counts.complete = Some(best.offered);
    Ok(best.into_rows())
}

/// Offers the complete rows of `designs` to `best`, and writes `tables`.
pub(super) fn rank(
    run: &mut Run<'_>,
    taps: &Taps<'_>,
    (designs, tables): (&[u64], &[Table]),
    best: &mut Best,
) -> Result<(), Error> {
    let mut designs = designs.iter().copied().peekable();
    while let Some(group) = Group::next(run, taps, (&mut designs, false), None)? {
        let complete = group.finish(run, taps, (tables, None))?;
        offer(run.study.output.per, best, complete);
    }
    Ok(())
}

/// Offers the rows that compete, of each design: all, or its best.
fn offer(per: Per, best: &mut Best, complete: Vec<Vec<Kept>>) {
    for rows in complete {
        match per {
            Per::Row => rows.into_iter().for_each(|row| best.offer(row)),
            Per::Design => rows.into_iter().min_by(Kept::order).into_iter().for_each(|row| best.offer(row)),
        }
    }
}

/// Writes the designs table of the kept rows, best first.
fn write_kept(run: &mut Run<'_>, taps: &Taps<'_>, kept: &[Kept]) -> Result<(), Error> {
    let n = kept.len() as u64;
    run.handed.note((n, n, "kept rows"));
    run.counts.kept = Some(n);
    run.kept =
        kept.iter().map(|row| Tuple { drive: row.drive, ..row.design.towards(row.direction) }).collect();
    let setup = &run.study.setup;
    let (columns, mut rows) = (AtDrive::chosen(setup), Table::Designs.heading().frame_for(setup));
    for row in kept {
        rows.row(columns.fields(&row.at_drive()))?;
        run.best.offer(row);
    }
    run.write(Table::Designs, &[rows])?;
    run.place(kept.iter().map(|row| Place::of(row, taps.design_of(row.index))))
}
