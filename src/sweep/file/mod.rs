//! Sweep over a tuple file too large to hold: its rows are read again where they are needed.
//!
//! Rows go through in the order of the designs rows they belong to, so that each is reduced and written as soon as it is complete.
//! Where that is also the order of the file, the taps are written on the way; else they are solved a second time, in file order.

mod read;
mod reduce;
mod write;

use super::{KEEP, Run};
use crate::design::Design;
use crate::error::Error;
use crate::profile::Profile;
use crate::scene::Setup;
use crate::scene::listed::{Groups, Listed};
use crate::sink::table::Table;
use crate::statistics::Reduction;
use read::{Reader, Tap, last_run, longest, order, solve};
use reduce::Reduced;
use write::{write_distances, write_tuples};

/// Evaluates the rows of `file` and writes their tables.
pub(super) fn run(run: &mut Run<'_>, file: &Listed) -> Result<(), Error> {
    let (study, groups) = (run.study, file.groups());
    let distances = run.writers.wants(Table::Distances);
    let order = order(groups, study.output.top.is_some());
    let once = order.is_none() && study.output.top.is_none() && longest(&groups.drives) <= KEEP;
    let rows = if distances { file.len() } else { 0 };
    let mut all = Reduced::new(rows, if once { 0 } else { groups.counts[1] as usize }, study.output.top);
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

/// The model's own curves of the designs rows of these taps, where distances are told by it.
fn profiles<'t>(
    run: &mut Run<'_>,
    groups: &Groups,
    designs: &[Design],
    taps: impl Iterator<Item = &'t Tap>,
) -> Result<Vec<Option<Profile>>, Error> {
    let row = |tap: &Tap| (tap.design, tap.drive, groups.reach[groups.designs[tap.row as usize] as usize]);
    run.profiles(designs, taps.map(row), None)
}

/// The reduction of one designs row of design `number`.
fn reduction<'a>(setup: &Setup, groups: &Groups, design: &'a Design, number: u32) -> Reduction<'a> {
    Reduction::new(setup, design, groups.reach[number as usize], (1, 1))
}
