//! One design: two passes over its taps, then its rows.

use super::select::Kept;
use crate::curve::{Curve, both::Both};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::scene::{Direction, Per, Study, Tuple};
use crate::sink::{
    rows::{Form, Rows},
    run_json::Counts,
    table::{AtDistance, AtDrive, Table, TapRow, fields},
};
use crate::statistics::{Reduction, Told};

/// A tap's place in its design: distance (and direction of the pole), and stroke (the same direction, and drive).
pub(super) type Place = (usize, usize);

/// What is done with one tap, and with what the model takes its two strains for where distances are told so.
pub(super) type Visit<'a> = dyn FnMut(Place, &Outcome, Option<&Option<Both>>) -> Result<(), Error> + 'a;

/// Goes through the taps of a design in row order; may be asked more than once.
pub(super) type Taps<'a> = dyn FnMut(&mut Visit<'_>) -> Result<(), Error> + 'a;

/// What to render of a design.
pub(super) struct Wanted<'a> {
    /// Tables of which rows are asked.
    pub tables: &'a dyn Fn(Table) -> bool,
    /// What rows are on their way.
    pub form: Form,
    /// Strokes whose taps are written; all without `top`.
    pub drives: Option<&'a [u32]>,
}

/// Rows of one design.
pub(super) struct Rendered {
    pub designs: Rows,
    pub distances: Rows,
    /// Rows in tuples, designs, distances.
    pub rows: [u64; 3],
    pub counts: Counts,
    /// Complete rows, for `top` and for the summary.
    pub candidates: Vec<Kept>,
}

/// Axes of a design: its distances, mm, each with every direction of the pole, and its strokes: directions and drives, degrees or mm.
pub(super) struct Axes<'a> {
    pub n: (usize, usize),
    pub reach: [f64; 2],
    pub distance: &'a (dyn Fn(usize) -> (f64, Direction) + Sync),
    pub stroke: &'a (dyn Fn(usize) -> Tuple + Sync),
    /// The model's own curve at each drive, where distances are told by it.
    pub curves: &'a [Option<Curve>],
}

/// Reduces and renders design `k`; `taps` goes through its taps in row order, `tuples` takes text of tuple rows.
pub(super) fn render(
    study: &Study,
    (k, design): (u64, &Design),
    axes: &Axes<'_>,
    wanted: &Wanted<'_>,
    taps: &mut Taps<'_>,
    tuples: &mut dyn FnMut(Rows) -> Result<(), Error>,
) -> Result<Rendered, Error> {
    let none = || Rows::new(wanted.form);
    let mut reduced = Reduction::new(&study.setup, design, axes.reach, axes.n);
    taps(&mut |(i, j), tap, _| {
        reduced.count((i, j), ((axes.distance)(i).0, (axes.stroke)(j).drive), tap);
        Ok(())
    })?;
    reduced.calibrate();

    let mut out = Rendered {
        designs: none(),
        distances: none(),
        rows: [0; 3],
        counts: Counts::default(),
        candidates: Vec::new(),
    };
    let (mut text, mut values, mut waiting) = (none(), Vec::new(), 0);
    let write_tuples = (wanted.tables)(Table::Tuples);
    taps(&mut |(i, j), tap, both| {
        let ((a, direction), drive) = ((axes.distance)(i), (axes.stroke)(j).drive);
        let told = Told::by(axes.curves, j).towards(direction).or_both(both);
        let estimated = reduced.estimate_by((i, j), (a, drive), tap, told);
        out.counts.taps += 1;
        out.counts.note(tap.status | estimated.status, 1);
        if write_tuples && wanted.drives.is_none_or(|kept| kept.contains(&(j as u32))) {
            let row = TapRow::of(&reduced, design, (a, direction, drive), (tap, &estimated));
            fields(&TapRow::COLUMNS, &study.setup, &row, &mut values);
            text.row(&mut values)?;
            out.rows[0] += 1;
            waiting += 1;
            if waiting == 1 << 14 {
                tuples(text.take())?;
                waiting = 0;
            }
        }
        Ok(())
    })?;
    tuples(text)?;

    let unit = reduced.unit();
    for (j, row) in reduced.drives.iter().enumerate() {
        let stroke = (axes.stroke)(j);
        let (direction, drive, row) = (stroke.direction(), stroke.drive, row.figures());
        let at = AtDrive { design: &design.tuple, direction, drive, row, unit };
        if (wanted.tables)(Table::Designs) {
            fields(&AtDrive::COLUMNS, &study.setup, &at, &mut values);
            out.designs.row(&mut values)?;
            out.rows[1] += 1;
        }
        let rank = reduced.rank(j, study.listed_by());
        out.candidates.extend(rank.map(|rank| Kept::of(&at, rank, (k, j as u32))));
    }
    if (wanted.tables)(Table::Distances) {
        for (i, row) in reduced.distances.iter().enumerate() {
            let (a, direction) = (axes.distance)(i);
            let row = AtDistance { design: &design.tuple, a, direction, row, unit };
            fields(&AtDistance::COLUMNS, &study.setup, &row, &mut values);
            out.distances.row(&mut values)?;
            out.rows[2] += 1;
        }
    }
    Ok(out)
}

/// The candidates that compete: every row, or each design's best.
pub(super) fn competing(per: Per, candidates: Vec<Kept>) -> Vec<Kept> {
    match per {
        Per::Row => candidates,
        Per::Design => candidates.into_iter().min_by(Kept::order).into_iter().collect(),
    }
}
