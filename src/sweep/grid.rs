//! Sweep over a grid: designs in order, many small ones at a time or one large one in parts.

use rayon::prelude::*;

use super::at::{At, pack_ranked};
use super::charted::Rankers;
use super::design::{Axes, Rendered, Visit, Wanted, competing, render};
use super::parted::Place;
use super::select::{Best, Kept};
use super::{CHUNK, KEEP, Run, charted, rows};
use crate::chart::lanes::Found;
use crate::curve::{Curve, both::Both};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Outcome, Task};
use crate::plan::{Layout, Way};
use crate::scene::{Direction, Tuple};
use crate::sink::{
    pack::{Packed, Packer},
    rows::Rows,
    table::Table,
};

/// Evaluates the designs of `layout` that are the run's own and writes their tables.
pub(super) fn run(run: &mut Run<'_>, layout: &Layout) -> Result<(), Error> {
    let plan = run.plan;
    // Which taps of a row are near a threshold only its taps tell.
    let readers = plan.row_readers();
    if !readers.is_empty() && !run.evaluator.is_guarded() {
        return rows::run(run, layout, &readers);
    }
    let every: Vec<Table> = Table::ALL.into_iter().filter(|t| run.writers.wants(*t)).collect();
    let Some(top) = run.study.output.top else {
        let from = run.resumed::<u64>()?.unwrap_or(run.designs.start);
        return all(run, layout, from, &every);
    };
    let at = match run.resumed::<At>()? {
        Some(At::Kept(kept, next)) => (kept, next),
        ranked => {
            let kept = match Rankers::of(plan) {
                Some(rankers) => charted::run(run, layout, &rankers, (top, ranked))?,
                None => ranked_rows(run, layout, (top, ranked))?,
            };
            write_kept(run, &kept, &|row| row.index.0)?;
            (kept.iter().map(|k| k.index).collect(), 0)
        }
    };

    // The taps and designs of the kept rows, in row order.
    let rest: Vec<Table> = every.into_iter().filter(|t| *t != Table::Designs).collect();
    if rest.is_empty() {
        return Ok(());
    }
    let (mut places, from) = at;
    places.sort_unstable();
    let of_design = |rows: &[(u64, u32)]| (rows[0].0, rows.iter().map(|(_, j)| *j).collect());
    let order: Vec<(u64, Vec<u32>)> = places.chunk_by(|p, q| p.0 == q.0).map(of_design).collect();
    let drives = |k: u64| order.binary_search_by_key(&k, |(k, _)| *k).ok().map(|at| order[at].1.clone());
    let mut designs = order.iter().map(|(k, _)| *k).skip(from as usize);
    let (mut next, of) = (from, order.len() as u64);
    while let Some(group) = group(run, layout, &mut designs) {
        ahead(run, layout, (&group, (next, of)), |to| At::Kept(places.clone(), next).pack(to))?;
        let before = run.counts.clone();
        pass(run, layout, &group, &rest, &drives, &mut |_, _| Ok(()))?;
        (run.counts.taps, run.counts.status) = (before.taps, before.status);
        run.counts.combinations = before.combinations;
        next += group.len() as u64;
        run.complete((next, of, "kept designs"), |to| At::Kept(places.clone(), next).pack(to))?;
    }
    Ok(())
}

/// All rows of the designs from `from` on, in `tables`.
fn all(run: &mut Run<'_>, layout: &Layout, from: u64, tables: &[Table]) -> Result<(), Error> {
    let (range, mut designs) = (run.designs.clone(), from..run.designs.end);
    while let Some(group) = group(run, layout, &mut designs) {
        let at = (group[0] - range.start, range.end - range.start);
        ahead(run, layout, (&group, at), |to| group[0].pack(to))?;
        pass(run, layout, &group, tables, &|_| None, &mut |run, rendered| {
            rendered.candidates.iter().for_each(|row| run.best.offer(row));
            Ok(())
        })?;
        let next = designs.start;
        run.complete((next - range.start, range.end - range.start, "designs"), |to| next.pack(to))?;
    }
    Ok(())
}

/// The best `top` rows, best first, every one solved.
fn ranked_rows(
    run: &mut Run<'_>,
    layout: &Layout,
    (top, before): (usize, Option<At>),
) -> Result<Vec<Kept>, Error> {
    let range = run.designs.clone();
    let (from, mut best) = match before {
        Some(At::Ranked(next, _, best)) => (next, best),
        _ => (range.start, Best::new(top)),
    };
    let mut designs = from..range.end;
    while let Some(group) = group(run, layout, &mut designs) {
        let at = (group[0] - range.start, range.end - range.start);
        ahead(run, layout, (&group, at), |to| pack_ranked((group[0], &Found::default(), &best), to))?;
        rank(run, layout, &group, &mut best)?;
        let next = designs.start;
        run.complete((next - range.start, range.end - range.start, "designs"), |to| {
            pack_ranked((next, &Found::default(), &best), to);
        })?;
    }
    run.counts.complete = Some(best.offered);
    Ok(best.into_rows())
}

/// The next designs that go together; `None` after the last.
fn group(run: &Run<'_>, layout: &Layout, designs: &mut impl Iterator<Item = u64>) -> Option<Vec<u64>> {
    // A design that is under way goes alone.
    let size = if run.under_way.is_empty() { run.pace.size } else { 1 };
    let together = (size / layout.block().max(1)).max(1) as usize;
    let group: Vec<u64> = designs.take(together).collect();
    (!group.is_empty()).then_some(group)
}

/// Solves the taps of a design that has more of them than go together, some at a time, so that what is solved can be kept, with what `route` packs before
/// that design; `done` of the designs are complete. Not of one whose outcomes have no place in memory.
fn ahead(
    run: &mut Run<'_>,
    layout: &Layout,
    (group, done): (&[u64], (u64, u64)),
    route: impl Fn(&mut Packer<'_>),
) -> Result<(), Error> {
    let block = layout.block();
    let [k] = group else { return Ok(()) };
    if block > KEEP || run.under_way.is_empty() && block <= run.pace.size {
        return Ok(());
    }
    let design = [Design::new(&run.study.setup, layout.design(*k))];
    while (run.under_way.len() as u64) < block {
        let from = run.under_way.len() as u64;
        // Whole runs over the drives of a distance.
        let to = block.min(from + run.pace.size.next_multiple_of(layout.n_drives));
        let tasks: Vec<Task> = (from..to).into_par_iter().map(|t| task(layout, &design[0], 0, t)).collect();
        let outcomes = solve(run, layout, &design, &tasks)?;
        run.under_way.extend(outcomes);
        run.show(to);
        run.complete_within((done, block), &route)?;
    }
    Ok(())
}

/// Outcomes of `tasks`, which come in runs over the drives of `layout`.
fn solve(
    run: &mut Run<'_>,
    layout: &Layout,
    designs: &[Design],
    tasks: &[Task],
) -> Result<Vec<Outcome>, Error> {
    match layout.drives().filter(|_| run.plan.solved == Way::OverDrives) {
        Some(drives) => run.evaluate_over(designs, tasks, &drives.iter().collect::<Vec<f64>>()),
        None => run.read(designs, tasks),
    }
}

/// Offers the complete rows of `designs` to `best`.
pub(super) fn rank(
    run: &mut Run<'_>,
    layout: &Layout,
    designs: &[u64],
    best: &mut Best,
) -> Result<(), Error> {
    let per = run.study.output.per;
    pass(run, layout, designs, &[], &|_| None, &mut |_, rendered| {
        competing(per, rendered.candidates).into_iter().for_each(|row| best.offer(row));
        Ok(())
    })
}

/// Writes the designs table of the kept rows, best first; `design` numbers their designs.
pub(super) fn write_kept(
    run: &mut Run<'_>,
    kept: &[Kept],
    design: &dyn Fn(&Kept) -> u64,
) -> Result<(), Error> {
    let n = kept.len() as u64;
    run.handed.note((n, n, "kept rows"));
    run.counts.kept = Some(n);
    run.kept =
        kept.iter().map(|row| Tuple { drive: row.drive, ..row.design.towards(row.direction) }).collect();
    let (mut rows, mut values) = (run.rows(), Vec::new());
    for row in kept {
        row.fields(&run.study.setup, &mut values);
        rows.row(&mut values)?;
        run.best.offer(row);
    }
    run.write(Table::Designs, rows, kept.len() as u64)?;
    run.place(kept.iter().map(|row| Place::of(row, design(row))))
}

/// Goes through `designs`, in order, writes `tables` and hands every design's candidates to `each`.
fn pass(
    run: &mut Run<'_>,
    layout: &Layout,
    designs: &[u64],
    tables: &[Table],
    drives: &(dyn Fn(u64) -> Option<Vec<u32>> + Sync),
    each: &mut dyn FnMut(&mut Run<'_>, Rendered) -> Result<(), Error>,
) -> Result<(), Error> {
    for group in designs.chunks((CHUNK / layout.block().max(1)).max(1) as usize) {
        if layout.block() > CHUNK {
            let rendered = large(run, layout, group[0], tables, drives)?;
            finish(run, rendered, each)?;
            continue;
        }
        for (texts, rendered) in small(run, layout, group, tables, drives)? {
            for text in texts {
                run.write(Table::Tuples, text, 0)?;
            }
            finish(run, rendered, each)?;
        }
    }
    Ok(())
}

fn finish(
    run: &mut Run<'_>,
    mut rendered: Rendered,
    each: &mut dyn FnMut(&mut Run<'_>, Rendered) -> Result<(), Error>,
) -> Result<(), Error> {
    run.count(Table::Tuples, rendered.rows[0]);
    run.write(Table::Designs, rendered.designs.take(), rendered.rows[1])?;
    run.write(Table::Distances, rendered.distances.take(), rendered.rows[2])?;
    run.absorb(&rendered.counts);
    each(run, rendered)
}

/// A rendered design and its tuple rows.
pub(super) type Part = (Vec<Rows>, Rendered);

/// Designs that fit into one chunk together: evaluated at once, reduced in parallel.
pub(super) fn small(
    run: &mut Run<'_>,
    layout: &Layout,
    group: &[u64],
    tables: &[Table],
    drives: &(dyn Fn(u64) -> Option<Vec<u32>> + Sync),
) -> Result<Vec<Part>, Error> {
    let study = run.study;
    let designs: Vec<Design> =
        group.par_iter().map(|&k| Design::new(&study.setup, layout.design(k))).collect();
    let block = layout.block() as usize;
    let tasks: Vec<Task> = (0..group.len() * block)
        .into_par_iter()
        .map(|t| task(layout, &designs[t / block], (t / block) as u32, (t % block) as u64))
        .collect();
    let drives_of_all = layout.drives().filter(|_| run.plan.solved == Way::OverDrives);
    let drives_of_all: Option<Vec<f64>> = drives_of_all.map(|axis| axis.iter().collect());
    let outcomes = match std::mem::take(&mut run.under_way) {
        ahead if ahead.len() == tasks.len() => ahead,
        _ => solve(run, layout, &designs, &tasks)?,
    };
    let rows = (0..designs.len()).flat_map(|d| rows(layout, &designs[d], d as u32));
    let curves = run.curves(&designs, rows, drives_of_all.as_deref())?;
    let both = run.both(&designs, (&tasks, &outcomes), |_| layout.reach())?;
    let (n_drives, form) = (layout.n_drives as usize, run.writers.form);
    let one = |d: usize| {
        let (k, taps) = (group[d], &outcomes[d * block..(d + 1) * block]);
        let both = both.get(d * block..(d + 1) * block).unwrap_or_default();
        let kept = drives(k);
        let mut texts = Vec::new();
        let curves = curves.get(d * n_drives..(d + 1) * n_drives).unwrap_or_default();
        let rendered = with_axes(layout, &designs[d], curves, |axes| {
            let wanted = Wanted { tables: &|t| tables.contains(&t), form, drives: kept.as_deref() };
            let mut go = |f: &mut Visit<'_>| {
                taps.iter().enumerate().try_for_each(|(t, tap)| f(layout.place(t as u64), tap, both.get(t)))
            };
            render(study, (k, &designs[d]), axes, &wanted, &mut go, &mut |text| {
                texts.push(text);
                Ok(())
            })
        })?;
        Ok((texts, rendered))
    };
    (0..group.len()).into_par_iter().map(one).collect()
}

/// One design larger than a chunk.
fn large(
    run: &mut Run<'_>,
    layout: &Layout,
    k: u64,
    tables: &[Table],
    drives: &(dyn Fn(u64) -> Option<Vec<u32>> + Sync),
) -> Result<Rendered, Error> {
    let study = run.study;
    let design = [Design::new(&study.setup, layout.design(k))];
    let (kept, block) = (drives(k), layout.block());
    let (curves, form) = (run.curves(&design, rows(layout, &design[0], 0), None)?, run.writers.form);
    // Text waits in a cell because evaluating and writing both need the run.
    let (mut memory, mut known): (Vec<Outcome>, Vec<Option<Both>>) =
        (std::mem::take(&mut run.under_way), Vec::new());
    for (from, outcomes) in (0..).step_by(CHUNK as usize).zip(memory.chunks(CHUNK as usize)) {
        let tasks: Vec<Task> =
            (from..).take(outcomes.len()).map(|t| task(layout, &design[0], 0, t)).collect();
        known.extend(run.both(&design, (&tasks, outcomes), |_| layout.reach())?);
    }
    let run = std::cell::RefCell::new(run);
    let (passes, mut passed) = (if block > KEEP { 2 } else { 1 }, 0);
    with_axes(layout, &design[0], &curves, |axes| {
        let wanted = Wanted { tables: &|t| tables.contains(&t), form, drives: kept.as_deref() };
        let mut go = |f: &mut Visit<'_>| {
            if memory.len() as u64 == block {
                let mut taps = memory.iter().enumerate();
                return taps.try_for_each(|(t, tap)| f(layout.place(t as u64), tap, known.get(t)));
            }
            let mut from = 0;
            while from < block {
                let to = (from + CHUNK).min(block);
                let tasks: Vec<Task> =
                    (from..to).into_par_iter().map(|t| task(layout, &design[0], 0, t)).collect();
                let outcomes = run.borrow_mut().read(&design, &tasks)?;
                let both = run.borrow_mut().both(&design, (&tasks, &outcomes), |_| layout.reach())?;
                for (i, (t, tap)) in (from..).zip(&outcomes).enumerate() {
                    f(layout.place(t), tap, both.get(i))?;
                }
                if block <= KEEP {
                    memory.extend(outcomes);
                    known.extend(both);
                }
                run.borrow_mut().show((passed * block + to) / passes);
                from = to;
            }
            passed += 1;
            Ok(())
        };
        render(study, (k, &design[0]), axes, &wanted, &mut go, &mut |text| {
            run.borrow_mut().write(Table::Tuples, text, 0)
        })
    })
}

pub(super) fn task(layout: &Layout, design: &Design, place: u32, t: u64) -> Task {
    let (i, j) = (t / layout.n_drives, t % layout.n_drives);
    Task::of(place, &Tuple { a: layout.distance(i), ..layout.stroke(&design.tuple, j) })
}

/// The designs rows of one design: its place, a stroke, and the ends of its distances.
fn rows<'a>(
    layout: &'a Layout,
    design: &'a Design,
    place: u32,
) -> impl Iterator<Item = (u32, Direction, f64, [f64; 2])> + use<'a> {
    let reach = layout.reach();
    (0..layout.n_drives).map(move |j| {
        let stroke = layout.stroke(&design.tuple, j);
        (place, stroke.direction(), stroke.drive, reach)
    })
}

fn with_axes<R>(
    layout: &Layout,
    design: &Design,
    curves: &[Option<Curve>],
    f: impl FnOnce(&Axes<'_>) -> R,
) -> R {
    f(&Axes {
        curves,
        n: ((layout.n_distances * layout.n_directions) as usize, layout.n_drives as usize),
        reach: layout.reach(),
        distance: &|i| {
            let (i, direction) = (i as u64 / layout.n_directions, i as u64 % layout.n_directions);
            (layout.distance(i), layout.direction(&design.tuple, direction * layout.drives_each()))
        },
        stroke: &|j| layout.stroke(&design.tuple, j as u64),
    })
}
