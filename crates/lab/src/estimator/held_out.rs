//! Cross-validation: each estimator is calibrated without one distance (of many, without some neighbours) and asked for it.

use std::ops::Range;

use rayon::prelude::*;

use super::learned::{self, Learnt};
use super::simple::{self, Paper};
use super::taps::{Cell, Tap};
use super::{Answers, Estimator, Found, Known, fit::Fit};
use crate::{measure::Rig, reduce::Errors};

const PARTS: usize = 40;

#[derive(Clone, Copy)]
pub struct Side<'a> {
    pub rig: &'a Rig,
    pub taps: &'a [Tap],
    pub cells: &'a [Cell],
    pub drives: &'a [f64],
    pub distances: usize,
    pub noise: f64,
    pub learned: &'a Learnt,
}

/// Errors of an estimator on distances left out.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// Error of each tap of the file, mm, and its standard deviation if the estimator gives it; NaN if unused or without answer.
    pub taps: Vec<[f64; 2]>,
    /// Error of each cell's mean and its variance from noise; NaN without answer.
    pub cells: Vec<(f64, f64)>,
}

impl HeldOut {
    /// Error beyond the noise at the distances `of`, per drive, mm; for a drive without answer the largest of the others.
    pub fn bias(&self, cells: &[Cell], drives: usize, of: &Range<usize>) -> Vec<f64> {
        let bias = |j: usize| {
            let wanted = |c: &Cell, e: f64| c.j == j && of.contains(&c.i) && e.is_finite();
            let here = || cells.iter().zip(&self.cells).filter(|(c, (e, _))| wanted(c, *e)).map(|x| *x.1);
            let n = here().count() as f64;
            let (errors, noise) = here().fold((0.0, 0.0), |(s, v), (e, var)| (s + e * e, v + var));
            if n == 0.0 {
                return f64::NAN;
            }
            // Counted if above the 99 % quantile of χ²/n for the noise (Wilson and Hilferty 1931).
            let ninth = 2.0 / (9.0 * n);
            let usual = noise * (1.0 - ninth + 2.326 * ninth.sqrt()).powi(3);
            if errors > usual { ((errors - noise) / n).sqrt() } else { 0.0 }
        };
        let known: Vec<f64> = (0..drives).map(bias).collect();
        let most = known.iter().copied().filter(|b| b.is_finite()).fold(0.0, f64::max);
        known.iter().map(|b| if b.is_finite() { *b } else { most }).collect()
    }

    /// RMS over the taps that `wanted` keeps, and their number.
    pub fn rms(&self, wanted: impl Fn(usize) -> bool) -> (Option<f64>, usize) {
        let mut errors = Errors::default();
        let known = self.taps.iter().enumerate().filter(|(k, [e, _])| e.is_finite() && wanted(*k));
        let n = known.map(|(_, [e, _])| errors.push(*e)).count();
        (errors.rms(), n)
    }
}

/// Answers of `estimator` for each distance left out in turn; `None` if it cannot be calibrated so. `fit` is that of the model to all distances.
pub fn held_out(side: &Side<'_>, estimator: Estimator, fit: Option<&Fit>) -> Option<HeldOut> {
    match estimator {
        Estimator::Paper => parts(side, |gone| {
            let paper = Paper::without(side, gone)?;
            Some(move |_, drive, signal| paper.find(drive, signal, Known::default()).ok())
        }),
        // The parameters stay; the reading is shifted by the effect of their step.
        Estimator::Exact => parts(side, |gone| {
            let (fit, shifts) = (fit?, fit?.shifts(side, gone)?);
            let find =
                move |k, drive, signal| fit.exact.find(&fit.exact.at(drive), drive, signal - shifts.get(&k)?);
            Some(find)
        }),
        Estimator::Curve => {
            let form = simple::form(side)?;
            parts(side, |gone| {
                let curve = simple::curve(side, form, Some(gone))?;
                Some(move |_, drive, signal| curve.find(drive, signal, Known::default()).ok())
            })
        }
        Estimator::Learned => parts(side, |gone| learned::without(side, gone)),
    }
}

/// Answers for each distance left out; `leave_out` takes distances and returns the function (cell, drive, |signal|) → distance.
fn parts<F: Fn(usize, f64, f64) -> Option<Found>>(
    side: &Side<'_>,
    leave_out: impl Fn(&Range<usize>) -> Option<F> + Sync,
) -> Option<HeldOut> {
    let (n, parts) = (side.distances, side.distances.min(PARTS));
    let groups: Vec<Range<usize>> = (0..parts).map(|k| k * n / parts..(k + 1) * n / parts).collect();
    let each = |gone: &Range<usize>| {
        let find = leave_out(gone)?;
        // Index of a cell; error of its mean and its variance from noise; index, error and σ of each of its taps.
        let answer = |(k, cell): (usize, &Cell)| {
            let error = |drive: f64, signal: f64, a: f64| find(k, drive, signal).map(|f| (f.a - a, f));
            // The other of two distances is not a bias: locate reports it as ambiguous.
            let other = |e: f64, f: &Found| f.near.is_some_and(|near| (near - cell.a).abs() < e.abs());
            let mean = error(cell.drive, cell.signal, cell.a).filter(|(e, f)| !other(*e, f));
            let mean = mean.map_or((f64::NAN, f64::NAN), |(e, f)| {
                let noise = side.noise * side.noise * cell.share;
                (e, (noise + f.variance) / (f.slope * f.slope))
            });
            let of_tap = |&t: &usize| {
                let tap = &side.taps[t];
                (t, error(tap.drive, tap.signal.abs(), tap.a).map_or([f64::NAN; 2], |(e, f)| [e, f.sigma]))
            };
            (k, mean, cell.taps.iter().map(of_tap).collect::<Vec<_>>())
        };
        let cells = side.cells.iter().enumerate().filter(|(_, c)| gone.contains(&c.i));
        Some(cells.map(answer).collect::<Vec<_>>())
    };
    let parts: Vec<Option<Vec<_>>> = groups.par_iter().map(each).collect();
    if parts.iter().all(Option::is_none) {
        return None;
    }
    let (taps, cells) = (vec![[f64::NAN; 2]; side.taps.len()], vec![(f64::NAN, f64::NAN); side.cells.len()]);
    let mut out = HeldOut { taps, cells };
    for (k, mean, taps) in parts.into_iter().flatten().flatten() {
        out.cells[k] = mean;
        taps.into_iter().for_each(|(tap, found)| out.taps[tap] = found);
    }
    Some(out)
}
