//! One design: two passes over its taps, then its rows as text.

use super::select::Kept;
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::profile::Profile;
use crate::scene::{Per, Study};
use crate::sink::{
    columns::{Block, Form, Rows},
    run_json::Counts,
    table::{AtDistance, AtDrive, Table, TapRow, fields},
};
use crate::statistics::{Reduction, Told};

/// A tap's place in its design: distance and drive.
pub(super) type Place = (usize, usize);

/// What is done with one tap.
pub(super) type Visit<'a> = dyn FnMut(Place, &Outcome) -> Result<(), Error> + 'a;

/// Goes through the taps of a design in row order; may be asked more than once.
pub(super) type Taps<'a> = dyn FnMut(&mut Visit<'_>) -> Result<(), Error> + 'a;

/// What to render of a design.
pub(super) struct Wanted<'a> {
    /// Tables of which rows are asked.
    pub tables: &'a dyn Fn(Table) -> bool,
    /// Drives whose taps are written; all without `top`.
    pub drives: Option<&'a [u32]>,
    /// What rows become.
    pub form: Form,
}

/// Rows of one design.
pub(super) struct Rendered {
    pub designs: Block,
    pub distances: Block,
    /// Rows in tuples, designs, distances.
    pub rows: [u64; 3],
    pub counts: Counts,
    /// Complete rows, for `top` and for the summary.
    pub candidates: Vec<Kept>,
}

/// Axes of a design: its distances, mm, and drives, degrees or mm.
pub(super) struct Axes<'a> {
    pub n: (usize, usize),
    pub reach: [f64; 2],
    pub distance: &'a (dyn Fn(usize) -> f64 + Sync),
    pub drive: &'a (dyn Fn(usize) -> f64 + Sync),
    /// The model's own curve at each drive, where distances are told by it.
    pub profiles: &'a [Option<Profile>],
}

/// Reduces and renders design `k`; `taps` goes through its taps in row order, `tuples` takes tuple rows.
pub(super) fn render(
    study: &Study,
    (k, design): (u64, &Design),
    axes: &Axes<'_>,
    wanted: &Wanted<'_>,
    taps: &mut Taps<'_>,
    tuples: &mut dyn FnMut(Block) -> Result<(), Error>,
) -> Result<Rendered, Error> {
    let mut reduced = Reduction::new(&study.setup, design, axes.reach, axes.n);
    let elongation = reduced.elongation;
    taps(&mut |place, tap| {
        reduced.count(place, tap);
        Ok(())
    })?;
    reduced.calibrate();

    let (mut written, mut counts, mut candidates) = ([0; 3], Counts::default(), Vec::new());
    let (mut rows, mut values, mut waiting) = (Rows::new(wanted.form), Vec::new(), 0);
    let write_tuples = (wanted.tables)(Table::Tuples);
    taps(&mut |(i, j), tap| {
        let (a, drive) = ((axes.distance)(i), (axes.drive)(j));
        let estimated = reduced.estimate_by((i, j), (a, drive), tap, Told::by(axes.profiles, j));
        counts.taps += 1;
        counts.note(tap.status | estimated.status, 1);
        if write_tuples && wanted.drives.is_none_or(|kept| kept.contains(&(j as u32))) {
            let row = TapRow { design: &design.tuple, a, drive, tap, estimated: &estimated, elongation };
            fields(&TapRow::COLUMNS, &row, &mut values);
            rows.row(&mut values)?;
            written[0] += 1;
            waiting += 1;
            if waiting == 1 << 14 {
                tuples(rows.take())?;
                waiting = 0;
            }
        }
        Ok(())
    })?;
    tuples(rows.into_block())?;

    let unit = reduced.unit();
    let (mut designs, mut distances) = (Rows::new(wanted.form), Rows::new(wanted.form));
    for (j, row) in reduced.drives.iter().enumerate() {
        let drive = (axes.drive)(j);
        if (wanted.tables)(Table::Designs) {
            fields(&AtDrive::COLUMNS, &AtDrive { design: &design.tuple, drive, row, unit }, &mut values);
            designs.row(&mut values)?;
            written[1] += 1;
        }
        let rank = row.rank(study.output.by, unit);
        candidates.extend(rank.map(|rank| Kept {
            rank,
            index: (k, j as u32),
            design: design.tuple,
            drive,
            row: *row,
            unit,
        }));
    }
    if (wanted.tables)(Table::Distances) {
        for (i, row) in reduced.distances.iter().enumerate() {
            let row = AtDistance { design: &design.tuple, a: (axes.distance)(i), row, unit };
            fields(&AtDistance::COLUMNS, &row, &mut values);
            distances.row(&mut values)?;
            written[2] += 1;
        }
    }
    let (designs, distances) = (designs.into_block(), distances.into_block());
    Ok(Rendered { designs, distances, rows: written, counts, candidates })
}

/// Best of the candidates of one design: smallest value, then smallest index.
fn best(candidates: &[Kept]) -> Option<Kept> {
    candidates.iter().min_by(|a, b| a.rank.total_cmp(&b.rank).then(a.index.cmp(&b.index))).cloned()
}

/// The candidates that compete: every row, or each design's best.
pub(super) fn competing(per: Per, candidates: Vec<Kept>) -> Vec<Kept> {
    match per {
        Per::Row => candidates,
        Per::Design => best(&candidates).into_iter().collect(),
    }
}
