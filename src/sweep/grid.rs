//! Sweep over a grid: designs in order, many small ones at a time or one large one in parts.

use rayon::prelude::*;

use super::design::{Axes, Rendered, Visit, Wanted, competing, render};
use super::select::{Best, Kept};
use super::{CHUNK, KEEP, Run, charted};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Outcome, Task};
use crate::plan::{Layout, Way};
use crate::profile::Profile;
use crate::sink::{
    columns::{Block, Rows},
    table::Table,
};

/// Evaluates `layout` and writes its tables.
pub(super) fn run(run: &mut Run<'_>, layout: &Layout) -> Result<(), Error> {
    let every: Vec<Table> = [Table::Tuples, Table::Designs, Table::Distances]
        .into_iter()
        .filter(|t| run.writers.wants(*t))
        .collect();
    let Some(top) = run.study.output.top else {
        return pass(run, layout, &mut (0..layout.n_designs), &every, &|_| None, &mut |run, rows| {
            rows.into_iter().for_each(|row| run.best.offer(row));
            Ok(())
        });
    };
    let kept = match &run.plan.ranker {
        Some(ranker) => charted::run(run, layout, ranker, top)?,
        None => {
            let mut best_rows = Best::new(top);
            rank(run, layout, &mut (0..layout.n_designs), &mut best_rows)?;
            run.counts.complete = Some(best_rows.offered);
            best_rows.into_rows()
        }
    };
    write_kept(run, &kept)?;

    // The taps and designs of the kept rows, in row order.
    let rest: Vec<Table> = every.into_iter().filter(|t| *t != Table::Designs).collect();
    if rest.is_empty() {
        return Ok(());
    }
    let mut order: Vec<(u64, Vec<u32>)> = Vec::new();
    let mut places: Vec<_> = kept.iter().map(|k| k.index).collect();
    places.sort_unstable();
    for (k, j) in places {
        match order.last_mut() {
            Some((last, drives)) if *last == k => drives.push(j),
            _ => order.push((k, vec![j])),
        }
    }
    let drives = |k: u64| order.binary_search_by_key(&k, |(k, _)| *k).ok().map(|at| order[at].1.clone());
    let (taps, status) = (run.counts.taps, run.counts.status.clone());
    pass(run, layout, &mut order.iter().map(|(k, _)| *k), &rest, &drives, &mut |_, _| Ok(()))?;
    (run.counts.taps, run.counts.status) = (taps, status);
    Ok(())
}

/// Offers the complete rows of `designs` to `best`.
pub(super) fn rank(
    run: &mut Run<'_>,
    layout: &Layout,
    designs: &mut dyn Iterator<Item = u64>,
    best: &mut Best,
) -> Result<(), Error> {
    let per = run.study.output.per;
    pass(run, layout, designs, &[], &|_| None, &mut |_, rows| {
        competing(per, rows).into_iter().for_each(|row| best.offer(row));
        Ok(())
    })
}

/// Writes designs.csv of the kept rows, best first.
pub(super) fn write_kept(run: &mut Run<'_>, kept: &[Kept]) -> Result<(), Error> {
    run.counts.kept = Some(kept.len() as u64);
    let (mut rows, mut values) = (Rows::new(run.writers.form), Vec::new());
    for row in kept {
        row.fields(&mut values);
        rows.row(&mut values)?;
        run.best.offer(row.clone());
    }
    run.write(Table::Designs, rows.into_block(), kept.len() as u64)
}

/// What is done with the complete rows of a design.
type Each<'e> = dyn FnMut(&mut Run<'_>, Vec<Kept>) -> Result<(), Error> + 'e;

/// Goes through `designs` in order, writes `tables` and hands every design's candidates to `each`.
fn pass(
    run: &mut Run<'_>,
    layout: &Layout,
    designs: &mut dyn Iterator<Item = u64>,
    tables: &[Table],
    drives: &(dyn Fn(u64) -> Option<Vec<u32>> + Sync),
    each: &mut Each<'_>,
) -> Result<(), Error> {
    let together = (CHUNK / layout.block().max(1)).max(1) as usize;
    loop {
        let group: Vec<u64> = designs.take(together).collect();
        if group.is_empty() {
            return Ok(());
        }
        if layout.block() > CHUNK {
            let rendered = large(run, layout, group[0], tables, drives)?;
            finish(run, rendered, each)?;
            continue;
        }
        for (blocks, rendered) in small(run, layout, &group, tables, drives)? {
            for block in blocks {
                run.write(Table::Tuples, block, 0)?;
            }
            finish(run, rendered, each)?;
        }
    }
}

fn finish(run: &mut Run<'_>, rendered: Rendered, each: &mut Each<'_>) -> Result<(), Error> {
    run.count(Table::Tuples, rendered.rows[0]);
    run.write(Table::Designs, rendered.designs, rendered.rows[1])?;
    run.write(Table::Distances, rendered.distances, rendered.rows[2])?;
    run.absorb(&rendered.counts);
    each(run, rendered.candidates)
}

/// A rendered design and its tuple rows.
pub(super) type Part = (Vec<Block>, Rendered);

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
    let outcomes = match &drives_of_all {
        Some(drives) => run.evaluate_over(&designs, &tasks, drives)?,
        None => run.read(&designs, &tasks)?,
    };
    let rows = (0..designs.len()).flat_map(|d| rows(layout, &designs[d], d as u32));
    let profiles = run.profiles(&designs, rows, drives_of_all.as_deref())?;
    let (n_drives, form) = (layout.n_drives as usize, run.writers.form);
    let one = |d: usize| {
        let (k, taps) = (group[d], &outcomes[d * block..(d + 1) * block]);
        let kept = drives(k);
        let mut blocks = Vec::new();
        let profiles = profiles.get(d * n_drives..(d + 1) * n_drives).unwrap_or_default();
        let rendered = with_axes(layout, &designs[d], profiles, |axes| {
            let wanted = Wanted { tables: &|t| tables.contains(&t), drives: kept.as_deref(), form };
            let mut go = |f: &mut Visit<'_>| {
                taps.iter().enumerate().try_for_each(|(t, tap)| f((t / axes.n.1, t % axes.n.1), tap))
            };
            render(study, (k, &designs[d]), axes, &wanted, &mut go, &mut |block| {
                blocks.push(block);
                Ok(())
            })
        })?;
        Ok((blocks, rendered))
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
    let profiles = run.profiles(&design, rows(layout, &design[0], 0), None)?;
    let form = run.writers.form;
    // The run waits in a cell because evaluating and writing both need the run.
    let run = std::cell::RefCell::new(run);
    let mut memory: Vec<Outcome> = Vec::new();
    let (passes, mut passed) = (if block > KEEP { 2 } else { 1 }, 0);
    with_axes(layout, &design[0], &profiles, |axes| {
        let wanted = Wanted { tables: &|t| tables.contains(&t), drives: kept.as_deref(), form };
        let mut go = |f: &mut Visit<'_>| {
            let place = |t: usize| (t / axes.n.1, t % axes.n.1);
            if memory.len() as u64 == block {
                return memory.iter().enumerate().try_for_each(|(t, tap)| f(place(t), tap));
            }
            let mut from = 0;
            while from < block {
                let to = (from + CHUNK).min(block);
                let tasks: Vec<Task> =
                    (from..to).into_par_iter().map(|t| task(layout, &design[0], 0, t)).collect();
                let outcomes = run.borrow_mut().read(&design, &tasks)?;
                for (t, tap) in (from as usize..).zip(&outcomes) {
                    f(place(t), tap)?;
                }
                if block <= KEEP {
                    memory.extend(outcomes);
                }
                run.borrow_mut().show((passed * block + to) / passes);
                from = to;
            }
            passed += 1;
            Ok(())
        };
        render(study, (k, &design[0]), axes, &wanted, &mut go, &mut |block| {
            run.borrow_mut().write(Table::Tuples, block, 0)
        })
    })
}

pub(super) fn task(layout: &Layout, design: &Design, place: u32, t: u64) -> Task {
    let (i, j) = (t / layout.n_drives, t % layout.n_drives);
    Task { design: place, a: layout.distance(i), drive: layout.drive(&design.tuple, j) }
}

/// The designs rows of one design: its place, a drive, and the ends of its distances.
fn rows<'a>(
    layout: &'a Layout,
    design: &'a Design,
    place: u32,
) -> impl Iterator<Item = (u32, f64, [f64; 2])> + use<'a> {
    let reach = layout.reach();
    (0..layout.n_drives).map(move |j| (place, layout.drive(&design.tuple, j), reach))
}

fn with_axes<R>(
    layout: &Layout,
    design: &Design,
    profiles: &[Option<Profile>],
    f: impl FnOnce(&Axes<'_>) -> R,
) -> R {
    f(&Axes {
        profiles,
        n: (layout.n_distances as usize, layout.n_drives as usize),
        reach: layout.reach(),
        distance: &|i| layout.distance(i as u64),
        drive: &|j| layout.drive(&design.tuple, j as u64),
    })
}
