//! Sweep over a tuple file too large to hold: its rows are read again where they are needed.
//!
//! Rows go through in the order of the designs rows they belong to, so that each is reduced and written as soon as it is complete.
//! Where that is also the order of the file, the taps are written on the way; else they are solved a second time, in file order.

mod read;
mod reduce;
mod write;

use super::select::Kept;
use super::{KEEP, Run};
use crate::curve::Curve;
use crate::design::Design;
use crate::error::{Error, InputError};
use crate::scene::Setup;
use crate::scene::listed::{Groups, Listed};
use crate::sink::pack::{Packed, Packer, Unpacker};
use crate::sink::table::Table;
use crate::statistics::Reduction;
use read::{Reader, SolvedRow, last_run, longest, order, solve};
use reduce::Reduced;
use write::{write_distances, write_tuples};

/// Evaluates the rows of `file` and writes their tables.
pub(super) fn run(run: &mut Run<'_>, file: &Listed) -> Result<(), Error> {
    let (study, groups) = (run.study, file.groups());
    let distances = run.writers.wants(Table::Distances);
    let order = order(groups, study.output.top.is_some(), &run.designs);
    let in_file_order = order.as_ref().is_none_or(|rows| rows.is_sorted());
    let once = in_file_order && study.output.top.is_none() && longest(&groups.drives) <= KEEP;
    if study.setup.channels.is_some() && !once && run.writers.wants(Table::Tuples) {
        let message = "of several channels tuples.csv needs the rows of each whisker and drive together in a file of this size";
        let error = InputError::new(message).key("tuples.file");
        return Err(error
            .allowed("rows sorted by whisker and drive and no top, or tuples = false in [output]")
            .into());
    }
    let rows = if distances { file.len() } else { 0 };
    let (from, mut all, kept) = match run.resumed::<At>()? {
        Some(At::Reduced(from, all)) => (from, all, None),
        Some(At::Written(from, all, kept)) => (from, all, Some(kept)),
        None => {
            let numbers = if once { 0 } else { groups.counts[1] as usize };
            (0, Reduced::new(rows, numbers, study.output.top), None)
        }
    };
    if run.part {
        all = all.with_firsts(groups);
    }
    let (kept, from) = match kept {
        Some(kept) => (kept, from),
        None => {
            reduce_all(run, file, &mut all, (order.as_deref(), once), from)?;
            (all.finish(run, groups)?, 0)
        }
    };
    drop(order);
    if !once && run.writers.wants(Table::Tuples) {
        write_tuples(run, file, &all, &kept, from)?;
    }
    if distances {
        write_distances(run, file, &all, kept.as_deref())?;
    }
    Ok(())
}

/// How far a sweep is.
enum At {
    /// So many rows, in the order in which they are reduced, are reduced to this.
    Reduced(u64, Reduced),
    /// All are; the taps of so many, in file order, are written, of the kept designs rows if some were.
    Written(u64, Reduced, Option<Vec<Kept>>),
}

impl Packed for At {
    fn pack(&self, to: &mut Packer<'_>) {
        match self {
            Self::Reduced(place, all) => pack((0, *place), all, to),
            Self::Written(place, all, kept) => {
                pack((1, *place), all, to);
                kept.pack(to);
            }
        }
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        match from.take::<u8>()? {
            0 => Some(Self::Reduced(from.take()?, from.take()?)),
            1 => Some(Self::Written(from.take()?, from.take()?, from.take()?)),
            _ => None,
        }
    }
}

/// Packs [`At::Reduced`] (0), or [`At::Written`] (1) but for the rows kept, without taking it.
fn pack(at: (u8, u64), all: &Reduced, to: &mut Packer<'_>) {
    at.pack(to);
    all.pack(to);
}

/// Reduces the rows of the file from place `from` on, in `order`; `once`: writes their taps on the way.
fn reduce_all(
    run: &mut Run<'_>,
    file: &Listed,
    all: &mut Reduced,
    (order, once): (Option<&[u32]>, bool),
    from: u64,
) -> Result<(), Error> {
    let groups = file.groups();
    let (mut batch, mut designs) = (Vec::new(), Vec::new());
    let mut reader = Reader::new(file, order)?;
    if from > 0 && from == reader.len as u64 {
        return Ok(());
    }
    reader.skip(from as usize)?;
    loop {
        let more = solve(run, groups, &mut reader, &mut designs, &mut batch)?;
        let open = if more { last_run(groups, &batch) } else { batch.len() };
        all.reduce(run, groups, &designs, &batch[..open], once)?;
        batch.drain(..open);
        if !more {
            let rows = reader.len as u64;
            return run.complete((rows, rows, "rows"), |to| pack((0, rows), all, to));
        }
        // The design of what is left comes first in the next batch.
        if let Some(tap) = batch.first() {
            designs.swap(0, tap.design as usize);
            designs.truncate(1);
            batch.iter_mut().for_each(|tap| tap.design = 0);
        } else {
            designs.clear();
        }
        let place = (reader.at.1 - batch.len()) as u64;
        run.complete((place, reader.len as u64, "rows"), |to| pack((0, place), all, to))?;
    }
}

/// The model's own curves of the designs rows of these taps, where distances are told by it.
fn curves<'t>(
    run: &mut Run<'_>,
    groups: &Groups,
    designs: &[Design],
    taps: impl Iterator<Item = &'t SolvedRow>,
) -> Result<Vec<Option<Curve>>, Error> {
    let row = |tap: &SolvedRow| {
        let reach = groups.reach[groups.designs[tap.row as usize] as usize];
        (tap.design, tap.direction, tap.drive, reach)
    };
    run.curves(designs, taps.map(row), None)
}

/// The reduction of one designs row of design `number`.
fn reduction<'a>(setup: &Setup, groups: &Groups, design: &'a Design, number: u32) -> Reduction<'a> {
    Reduction::new(setup, design, groups.reach[number as usize], (1, 1))
}
