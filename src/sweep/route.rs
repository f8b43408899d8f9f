//! The order in which a sweep visits the designs: all of them, or ranked first and then those of the kept rows.

use super::Run;
use super::best::Kept;
use super::charted;
use super::group::{Group, Strokes};
use super::output::Place;
use super::taps::Taps;
use crate::error::Error;
use crate::scene::Per;
use crate::sink::table::{AtDrive, Table};

pub(super) fn run(run: &mut Run<'_>, taps: &Taps<'_>) -> Result<(), Error> {
    let every: Vec<Table> = Table::ALL.into_iter().filter(|t| run.writers.wants(*t)).collect();
    let own = (run.designs.clone(), run.designs.end - run.designs.start, "designs");
    if run.study.output.top.is_none() {
        return chunks(run, taps, own, (&every, None), |run, complete| {
            complete.iter().flatten().for_each(|row| run.reached.shown.offer(row));
        });
    }
    if run.reached.kept.is_none() {
        let kept = match (&run.plan.rankers, taps) {
            (Some(rankers), Taps::Grid { layout, .. }) => charted::run(run, (taps, layout), rankers)?,
            _ => {
                chunks(run, taps, own, (&[], None), offer)?;
                let best = std::mem::take(&mut run.reached.best);
                run.reached.counts.complete = Some(best.offered);
                best.into_rows()
            }
        };
        write_kept(run, taps, &kept)?;
    }

    let rest: Vec<Table> = every.into_iter().filter(|t| *t != Table::Designs).collect();
    if rest.is_empty() {
        return Ok(());
    }
    let kept = run.reached.kept.clone().unwrap_or_default();
    let mut designs: Vec<u64> = kept.iter().map(|(k, _)| *k).collect();
    designs.dedup();
    let of = designs.len() as u64;
    let before = run.reached.counts.clone();
    chunks(run, taps, (designs.into_iter(), of, "kept designs"), (&rest, Some(&kept)), |run, _| {
        run.reached.counts.taps = before.taps;
        run.reached.counts.combinations.clone_from(&before.combinations);
    })
}

/// Solves and writes the remaining designs of `of`, chunk by chunk; `take` receives the complete rows of each design.
fn chunks(
    run: &mut Run<'_>,
    taps: &Taps<'_>,
    (designs, of, what): (impl Iterator<Item = u64>, u64, &str),
    (tables, kept): (&[Table], Option<Strokes<'_>>),
    mut take: impl FnMut(&mut Run<'_>, Vec<Vec<Kept>>),
) -> Result<(), Error> {
    let mut designs = designs.skip(run.reached.next as usize).peekable();
    // Rows of designs that alternate are written all at once.
    let all = !taps.in_order() && !tables.is_empty();
    while let Some(group) = Group::next(run, taps, (&mut designs, all))? {
        let complete = group.finish(run, taps, (tables, kept))?;
        take(run, complete);
        run.complete(group.numbers.len() as u64, (of, what))?;
    }
    Ok(())
}

/// Offers the complete rows of `designs` to the best ones; does not count as a chunk.
pub(super) fn rank(run: &mut Run<'_>, taps: &Taps<'_>, designs: &[u64]) -> Result<(), Error> {
    let mut designs = designs.iter().copied().peekable();
    while let Some(group) = Group::next(run, taps, (&mut designs, false))? {
        let complete = group.finish(run, taps, (&[], None))?;
        offer(run, complete);
    }
    Ok(())
}

fn offer(run: &mut Run<'_>, complete: Vec<Vec<Kept>>) {
    let best = &mut run.reached.best;
    for rows in complete {
        match run.study.output.per {
            Per::Row => rows.into_iter().for_each(|row| best.offer(row)),
            Per::Design => rows.into_iter().min_by(Kept::order).into_iter().for_each(|row| best.offer(row)),
        }
    }
}

fn write_kept(run: &mut Run<'_>, taps: &Taps<'_>, kept: &[Kept]) -> Result<(), Error> {
    let n = kept.len() as u64;
    run.reached.handed.note("kept rows", [1, n, n]);
    run.reached.counts.kept = Some(n);
    run.kept = kept.iter().map(|row| row.at.design).collect();
    let setup = &run.study.setup;
    let (columns, mut rows) = (AtDrive::chosen(setup), Table::Designs.heading().frame_for(setup));
    for row in kept {
        rows.row(columns.fields(&row.at))?;
        run.reached.shown.offer(row);
    }
    run.write(Table::Designs, &[rows])?;
    run.writers.place(kept.iter().map(|row| Place::of(row, taps.design_of(row.index))))?;
    let mut places: Vec<(u64, u32)> = kept.iter().map(|k| (taps.design_of(k.index), k.index.1)).collect();
    places.sort_unstable();
    (run.reached.next, run.reached.kept) = (0, Some(places));
    Ok(())
}
