//! Unread zero of the signal.

use vibrissa_learned::rows::range;

use crate::error::Error;
use crate::estimator::cells::grouped;
use crate::estimator::fit::{Ordered, Task};
use crate::estimator::learnt::Learnt;
use crate::estimator::model::exact::{Opener, Parameter};
use crate::estimator::taps::{Sorted, Tap};
use crate::measure::zero::{Tared, TaredBy};
use crate::measure::{Data, Rig};
use crate::scene::Side;

/// Relative accuracy of solved models: smaller offsets count as 0.
const SOLVED: f64 = 3e-7;

/// Zero of one side and its error from a model that fits within the noise; a free curve would take an offset of the drive for one of the signal.
pub(super) fn of_model(
    (rig, taps): (&Rig, &[Tap]),
    (sign, gauge): (f64, Side),
    noise: f64,
    fit: &[Parameter],
    open: Opener<'_>,
) -> Result<Option<[f64; 2]>, Error> {
    let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == sign;
    let ([distances, _], cells) = grouped(taps, rig, here);
    let Some(at) = super::extent(rig, taps, sign, gauge).filter(|_| distances.len() > 1) else {
        return Ok(None);
    };
    let task = Task { rig, at, cells: &cells, noise, sought: true, open };
    let found = match task.fit(fit) {
        Ok(found) if found.undetermined.is_empty() => found,
        Err(why) if !why.is_of_whisker() => return Err(why.into()),
        _ => return Ok(None),
    };
    let rows = found.cells.iter().enumerate().flat_map(|(cell, at)| {
        let c = &cells[*at];
        c.taps.iter().map(move |k| (cell, c.n(), &taps[*k]))
    });
    let rows: Vec<(Ordered, f64)> = rows
        .map(|(cell, of, t)| {
            let left = t.signal.abs() - found.exact.expected(t.a, t.drive);
            (Ordered { cell, of, order: t.place as f64, left }, t.signal.abs())
        })
        .filter(|(row, _)| row.left.is_finite())
        .collect();
    let said = found.constant(&rows.iter().map(|r| r.0).collect::<Vec<_>>());
    let Some((constant, left)) = said else { return Ok(None) };
    let n = left.len() as f64;
    let within = left.norm_squared() <= noise * noise * (n + 2.0 * (2.0 * n).sqrt());
    let exact = || rows.iter().zip(left.iter()).all(|((_, signal), e)| e.abs() <= SOLVED * signal);
    Ok((within || exact()).then_some(constant))
}

pub(super) fn tare((data, rig): (&Data, &Rig), rows: &mut Sorted, [value, error]: [f64; 2]) {
    for tap in &mut rows.taps {
        tap.zero += value;
        tap.signal = data.unit.above(tap.signal, value, rig.setup.gauge.factor);
    }
    (rows.tared.from, rows.tared.error) = (TaredBy::Fitted, error);
    rows.tared.value += value;
}

pub(super) fn wandering(data: &Data, rig: &Rig, learnt: &Learnt) -> String {
    let [least, largest] = range(learnt.fit.zeros.iter().copied());
    format!(
        "{}: no zero was read, and what the curve leaves goes with the order of the lines, as if the zero drifted by {:.2e} {} over the file; \
         a drift is taken into account. Read the zero now and then (rows with {} = 0)",
        data.file,
        largest - least,
        data.unit.common(),
        rig.setup.drive.column()
    )
}

pub(super) fn untared(data: &Data, rig: &Rig, tared: &Tared, unread: f64) -> Option<String> {
    let (kind, unit) = (rig.setup.drive.column(), data.unit.common());
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted, \
             as it will be from readings without a zero of their own. A drift of the zero would do much of that: rows with {kind} = 0 now and \
             then would tell",
            data.file, tared.value, unread
        )),
        TaredBy::None if tared.error == 0.0 => Some(format!(
            "{}: no zero was read, and these data cannot tell a constant offset of the signal from a tap: it is taken as tared. Rows \
             with {kind} = 0 say what the sensor shows without contact",
            data.file
        )),
        _ => None,
    }
}
