//! A zero that drifts and was never read: repeats of the same tap tell how fast; without them what a model leaves tells that it does.

use nalgebra::{DMatrix, DVector};

use crate::estimator::cells::{Cell, Levels, cells};
use crate::estimator::fit::Fit;
use crate::estimator::model::exact::Parameter;
use crate::estimator::normal;
use crate::estimator::taps::Tap;
use crate::measure::Rig;
use crate::reduce::median;

/// A slope is one beyond so many of its standard errors, and where it carries the zero by so many standard deviations of a reading.
const CERTAIN: f64 = 6.0;
/// Rows that were carried by more than so many standard deviations are named.
const NAMED: f64 = 3.0;

/// A drift of the zero, taken as straight over the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Signal per row.
    pub slope: f64,
    /// Its standard error.
    pub error: f64,
    /// Drift below which a row is not named.
    pub least: f64,
}

/// The drift that repeats of all sides show together.
pub fn of_all(rig: &Rig, taps: &[Tap], signs: &[f64]) -> Option<Drift> {
    let mut all = Vec::new();
    for sign in signs {
        let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == *sign;
        let levels = |f: fn(&Tap) -> f64| Levels::of(taps.iter().filter(|t| here(t)).map(f));
        all.extend(cells(taps, rig, &levels(|t| t.group[0]), &levels(|t| t.group[1]), here));
    }
    find(taps, &all)
}

/// The drift that repeats in `all` show, if it is certain; the slope is a median of pairs, so that single wrong rows do not count.
fn find(taps: &[Tap], all: &[Cell]) -> Option<Drift> {
    let mut slopes = Vec::new();
    for cell in all.iter().filter(|c| c.taps.len() >= 2) {
        let half = cell.taps.len() / 2;
        slopes.extend((0..half).map(|k| {
            let (p, q) = (&taps[cell.taps[k]], &taps[cell.taps[k + cell.taps.len() - half]]);
            (q.signal - p.signal) / (q.place as f64 - p.place as f64)
        }));
    }
    if slopes.len() < 5 {
        return None;
    }
    let slope = median(&mut slopes);
    let (mut spread, mut off, mut n) = (0.0, Vec::new(), 0.0);
    for cell in all.iter().filter(|c| c.taps.len() >= 2) {
        let mean = |f: &dyn Fn(&Tap) -> f64| cell.taps.iter().map(|&k| f(&taps[k])).sum::<f64>() / cell.n();
        let rest = |t: &Tap| t.signal - slope * t.place as f64;
        let (place, level) = (mean(&|t| t.place as f64), mean(&rest));
        let small = (cell.n() / (cell.n() - 1.0)).sqrt();
        for tap in cell.taps.iter().map(|&k| &taps[k]) {
            spread += (tap.place as f64 - place).powi(2);
            off.push((rest(tap) - level).abs() * small);
        }
        n += cell.n();
    }
    let noise = 1.4826 * median(&mut off);
    // A median is 1.25 times as uncertain as a mean; pairs of halves use most of the lever there is.
    let error = 1.5 * noise / spread.sqrt();
    let carried = slope.abs() * taps.len() as f64;
    let sizes: f64 = all.iter().map(|c| c.signal * c.n()).sum::<f64>() / n;
    let certain = slope.abs() > CERTAIN * error && carried > CERTAIN * noise && carried > 1e-6 * sizes;
    certain.then_some(Drift { slope, error, least: NAMED * noise })
}

/// Takes the drift off every tap, whose signal is `above` it; the first row of the file is taken as right.
pub fn remove(taps: &mut [Tap], drift: &Drift, above: impl Fn(f64, f64) -> f64) {
    for tap in taps {
        tap.drift = drift.slope * tap.place as f64;
        tap.signal = above(tap.signal, tap.drift);
    }
}

/// How what a fit leaves goes with the order of the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// Change of the signal over the file.
    pub carried: f64,
    /// Its standard error, with all parameters of the fit free.
    pub error: f64,
    /// By how much another constant goes with it, and the standard error of the constant with it.
    pub constant: [f64; 2],
}

impl Trend {
    /// Of a fit to `cells` of `taps`, in a file of so many rows; `None` where the rows go with what is fitted.
    pub fn of(fit: &Fit, cells: &[Cell], taps: &[Tap], rows: usize) -> Option<Self> {
        let m = fit.slopes.ncols();
        let one = |(c, k): (usize, usize)| {
            let deviation = fit.deviations[c] * cells[fit.cells[c]].n().sqrt();
            let tap = &taps[k];
            let left = (tap.signal.abs() - fit.exact.expected(tap.a, tap.drive)) / deviation;
            let place = tap.signal.signum() * tap.place as f64 / rows as f64;
            let row: Vec<f64> =
                fit.slopes.row(c).iter().copied().chain([place]).map(|x| x / deviation).collect();
            (row, left)
        };
        let places =
            fit.cells.iter().enumerate().flat_map(|(c, &at)| cells[at].taps.iter().map(move |k| (c, *k)));
        let (design, left): (Vec<Vec<f64>>, Vec<f64>) =
            places.map(one).filter(|(_, left)| left.is_finite()).unzip();
        let design = DMatrix::from_row_iterator(left.len(), m + 1, design.into_iter().flatten());
        let left = DVector::from_vec(left);
        let freedom = left.len().checked_sub(m + 2)? as f64;
        let (step, inverse) = normal::solve(&design.tr_mul(&design), &design.tr_mul(&left))?;
        let scatter = ((left - &design * &step).norm_squared() / freedom).max(1.0);
        let error = |i: usize| (scatter * inverse[(i, i)]).sqrt();
        let zero = fit.exact.fitted.iter().position(|p| *p == Parameter::Zero);
        let constant = zero.map_or([0.0; 2], |i| [step[i], error(i)]);
        Some(Self { carried: step[m], error: error(m), constant })
    }

    /// Whether it is certain.
    pub fn is_there(&self) -> bool {
        self.carried.abs() > CERTAIN * self.error
    }
}
