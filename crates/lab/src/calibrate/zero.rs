//! Unread zero of the signal.

use crate::reduce::range;
use nalgebra::{DMatrix, DVector};

use crate::error::Error;
use crate::estimator::fit::Task;
use crate::estimator::learned::Learnt;
use crate::estimator::least;
use crate::estimator::taps::{Cell, Sorted, Tap, grouped};
use crate::estimator::{Opener, Parameter};
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
        let Cell { taps: of_cell, .. } = &cells[*at];
        let deviation = found.deviations[cell] * (of_cell.len() as f64).sqrt();
        of_cell.iter().map(move |k| (cell, deviation, &taps[*k]))
    });
    // Measured − expected signal, in standard deviations.
    let off = |sd: f64, t: &Tap| (t.signal.abs() - found.exact.expected(t.a, t.drive)) / sd;
    let rows = rows.map(|(cell, sd, t)| (cell, sd, t, off(sd, t)));
    let rows: Vec<(usize, f64, &Tap, f64)> = rows.filter(|row| row.3.is_finite()).collect();
    // The zero may also drift in the order of the rows.
    let (n, m) = (rows.len(), found.slopes.ncols());
    let middle = rows.iter().map(|r| r.2.place as f64).sum::<f64>() / n as f64;
    let design = DMatrix::from_fn(n, m + 1, |i, j| {
        let (cell, sd, t, _) = rows[i];
        (if j < m { found.slopes[(cell, j)] } else { t.place as f64 - middle }) / sd
    });
    let left = DVector::from_iterator(n, rows.iter().map(|r| r.3));
    let zero = found.exact.fitted.iter().position(|p| *p == Parameter::Zero).filter(|_| n > m + 1);
    let solved = least::solve(&design.tr_mul(&design), &design.tr_mul(&left));
    let Some((k, (step, inverse))) = zero.zip(solved) else { return Ok(None) };
    let rest = left - &design * &step;
    let error = ((rest.norm_squared() / (n - m - 1) as f64).max(1.0) * inverse[(k, k)]).sqrt();
    let constant = [found.exact.values[Parameter::Zero as usize] + step[k], error];
    let squares: f64 = rows.iter().zip(&rest).map(|(r, e)| (e * r.1).powi(2)).sum();
    let within = squares <= noise * noise * (n as f64 + 2.0 * (2.0 * n as f64).sqrt());
    let exact = || rows.iter().zip(&rest).all(|(r, e)| (e * r.1).abs() <= SOLVED * r.2.signal.abs());
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

pub(super) fn untared(data: &Data, rig: &Rig, tared: &Tared) -> Option<String> {
    let (kind, unit) = (rig.setup.drive.column(), data.unit.common());
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted, \
             as it will be from readings without a zero of their own. A drift of the zero would do much of that: rows with {kind} = 0 now and \
             then would tell",
            data.file, tared.value, tared.error
        )),
        TaredBy::None if tared.error == 0.0 => Some(format!(
            "{}: no zero was read, and these data cannot tell a constant offset of the signal from a tap: it is taken as tared. Rows \
             with {kind} = 0 say what the sensor shows without contact",
            data.file
        )),
        _ => None,
    }
}
