//! Leave one distance out: every estimator is calibrated on the other distances and asked for the one it has not seen.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::fit::Fit;
use super::taps::{Cell, Tap};
use crate::locate::paper::{Factors, Paper};
use crate::locate::table::{Curve, Knot, Table};
use crate::locate::{Estimator, Found};
use crate::measure::Rig;
use crate::reduce::Errors;
use crate::scene::Theory;

/// Used data of one side.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The whisker.
    pub rig: &'a Rig,
    /// All taps of the file.
    pub taps: &'a [Tap],
    /// Cells of the used ones.
    pub cells: &'a [Cell],
    /// Calibrated drives.
    pub drives: &'a [f64],
    /// Number of distances.
    pub distances: usize,
    /// Standard deviation of one reading.
    pub noise: f64,
}

impl Side<'_> {
    /// K̄ and its variance per drive from the cells that `wanted` keeps, for `theory`; `None` where a drive has fewer than
    /// `least` of them.
    pub fn factors(&self, theory: Theory, least: usize, wanted: impl Fn(&Cell) -> bool) -> Option<Factors> {
        let curve = self.rig.curve(theory, self.rig.setup.hub);
        let kind = self.rig.setup.drive;
        let mut sums = vec![(0.0, 0.0, 0usize); self.drives.len()];
        for c in self.cells.iter().filter(|c| wanted(c)) {
            let spec = self.rig.shared().theory.curve();
            // Within a level the mean of θ f counts; it is known for the theory of the spec.
            let linear = if *spec == curve {
                c.linear
            } else {
                crate::design::amount(kind, c.drive) * curve.value(c.a)
            };
            let sum = &mut sums[c.j];
            sum.0 += linear / c.signal;
            sum.1 += self.noise * self.noise * c.share / (c.signal * c.signal);
            sum.2 += 1;
        }
        if sums.iter().any(|s| s.2 < least) {
            return None;
        }
        Some(Factors {
            k: sums.iter().map(|s| s.0 / s.2 as f64).collect(),
            variance: sums.iter().map(|s| s.1 / (s.2 * s.2) as f64).collect(),
        })
    }

    /// Curves of the data through the cells that `wanted` keeps; `None` where a drive has fewer than two distances.
    pub fn table(&self, wanted: impl Fn(&Cell) -> bool) -> Option<Table> {
        let mut knots: Vec<Vec<Knot>> = vec![Vec::new(); self.drives.len()];
        for c in self.cells.iter().filter(|c| wanted(c)) {
            let variance = self.noise * self.noise * c.share / (c.signal * c.signal);
            knots[c.j].push(Knot { a: c.a, signal: c.signal / c.drive, variance });
        }
        let curves: Option<Vec<Curve>> = knots.iter().map(|k| Curve::new(k)).collect();
        Table::new(self.drives.to_vec(), curves?)
    }
}

/// What one estimator makes of distances it has not seen.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// Error of each tap of the file, mm; NaN where it is not used or has no answer.
    pub taps: Vec<f64>,
    /// Error of each cell's mean and its variance from noise; NaN without an answer.
    pub cells: Vec<(f64, f64)>,
}

impl HeldOut {
    /// Error beyond what noise explains, per drive, mm; NaN for a drive without an answer.
    pub fn bias(&self, cells: &[Cell], drives: usize) -> Vec<f64> {
        let bias = |j: usize| {
            let here = || {
                cells.iter().zip(&self.cells).filter(|(c, (e, _))| c.j == j && e.is_finite()).map(|x| *x.1)
            };
            let n = here().count() as f64;
            let (errors, noise) = here().fold((0.0, 0.0), |(s, v), (e, var)| (s + e * e, v + var));
            if n == 0.0 {
                return f64::NAN;
            }
            // Counted only where it is more than the noise of these few cells would do by chance in one case of a hundred: the
            // quantile of χ²/n by Wilson and Hilferty (1931).
            let ninth = 2.0 / (9.0 * n);
            let usual = noise * (1.0 - ninth + 2.326 * ninth.sqrt()).powi(3);
            if errors > usual { ((errors - noise) / n).sqrt() } else { 0.0 }
        };
        let known: Vec<f64> = (0..drives).map(bias).collect();
        let most = known.iter().copied().filter(|b| b.is_finite()).fold(0.0, f64::max);
        known.iter().map(|b| if b.is_finite() { *b } else { most }).collect()
    }

    /// Number of taps answered.
    pub fn answered(&self) -> usize {
        self.taps.iter().filter(|e| e.is_finite()).count()
    }

    /// Root mean square over the taps that `wanted` keeps, and their number.
    pub fn rms(&self, wanted: impl Fn(usize) -> bool) -> (Option<f64>, usize) {
        let mut errors = Errors::default();
        let known = self.taps.iter().enumerate().filter(|(k, e)| e.is_finite() && wanted(*k));
        let n = known.map(|(_, e)| errors.push(*e)).count();
        (errors.rms(), n)
    }

    /// Root mean square over the taps of each drive.
    pub fn rms_by_drive(&self, cells: &[Cell], drives: usize) -> Vec<Option<f64>> {
        let mut errors = vec![Errors::default(); drives];
        for cell in cells {
            let known = cell.taps.iter().map(|k| self.taps[*k]).filter(|e| e.is_finite());
            known.for_each(|e| errors[cell.j].push(e));
        }
        errors.iter().map(Errors::rms).collect()
    }
}

/// Answers of `estimator` for every distance left out in turn; `None` where it cannot be calibrated so. `fit` belongs to `exact`.
pub fn held_out(side: &Side<'_>, estimator: Estimator, fit: Option<&Fit>) -> Option<HeldOut> {
    let groups: Vec<usize> = (0..side.distances).collect();
    let each = |g: &usize| left_out(side, estimator, fit, *g);
    let parts: Vec<Option<Vec<(usize, CellAnswer)>>> = groups.par_iter().map(each).collect();
    if parts.iter().all(Option::is_none) {
        return None;
    }
    let mut out = HeldOut {
        taps: vec![f64::NAN; side.taps.len()],
        cells: vec![(f64::NAN, f64::NAN); side.cells.len()],
    };
    for (k, answer) in parts.into_iter().flatten().flatten() {
        out.cells[k] = answer.mean;
        for (tap, error) in answer.taps {
            out.taps[tap] = error;
        }
    }
    Some(out)
}

struct CellAnswer {
    mean: (f64, f64),
    taps: Vec<(usize, f64)>,
}

/// Answers for the cells of distance `g`.
fn left_out(
    side: &Side<'_>,
    estimator: Estimator,
    fit: Option<&Fit>,
    g: usize,
) -> Option<Vec<(usize, CellAnswer)>> {
    let others = |c: &Cell| c.i != g;
    let find: Box<dyn Fn(usize, f64, f64) -> Option<Found>> = match estimator {
        Estimator::Paper | Estimator::Timoshenko => {
            let theory =
                if estimator == Estimator::Paper { Theory::EulerBernoulli } else { Theory::Timoshenko };
            let paper = Paper::new(side.rig, theory, side.drives, side.factors(theory, 1, others)?);
            Box::new(move |_, drive, signal| paper.find(drive, signal))
        }
        Estimator::Table => {
            let table = side.table(others)?;
            Box::new(move |_, drive, signal| table.find(drive, signal))
        }
        Estimator::Exact => {
            let fit = fit?;
            let step = step_without(side, fit, g)?;
            // The model keeps its parameters; the reading is moved by what the step would do to it.
            let shift = &fit.slopes * step;
            Box::new(move |k, drive, signal| fit.exact.find(drive, signal - shift[k]))
        }
    };
    let answer = |(k, cell): (usize, &Cell)| {
        let error = |drive: f64, signal: f64, a: f64| find(k, drive, signal).map(|f| (f.a - a, f));
        // The other of two distances is no bias: locate says that it is ambiguous.
        let other = |e: f64, f: &Found| f.near.is_some_and(|near| (near - cell.a).abs() < e.abs());
        let mean = error(cell.drive, cell.signal, cell.a).filter(|(e, f)| !other(*e, f));
        let mean = mean.map_or((f64::NAN, f64::NAN), |(e, f)| {
            let noise = side.noise * side.noise * cell.share;
            (e, (noise + f.variance) / (f.slope * f.slope))
        });
        let of_tap = |&t: &usize| {
            let tap = &side.taps[t];
            (t, error(tap.drive, tap.signal.abs(), tap.a).map_or(f64::NAN, |(e, _)| e))
        };
        (k, CellAnswer { mean, taps: cell.taps.iter().map(of_tap).collect() })
    };
    Some(side.cells.iter().enumerate().filter(|(_, c)| c.i == g).map(answer).collect())
}

/// Change of the parameters where the cells of distance `g` are left out: one Gauss–Newton step, which is all it takes.
fn step_without(side: &Side<'_>, fit: &Fit, g: usize) -> Option<DVector<f64>> {
    let m = fit.slopes.ncols();
    let (mut n, mut b) = (DMatrix::<f64>::zeros(m, m), DVector::<f64>::zeros(m));
    let mut scale = DVector::<f64>::repeat(m, 0.0);
    for k in (0..side.cells.len()).filter(|&k| side.cells[k].i != g) {
        let row = fit.slopes.row(k) / fit.deviations[k];
        n += row.transpose() * &row;
        b += row.transpose() * (fit.residuals[k] / fit.deviations[k]);
    }
    for i in 0..m {
        scale[i] = n[(i, i)].sqrt();
        if scale[i] == 0.0 {
            return None;
        }
    }
    let scaled = DMatrix::from_fn(m, m, |i, j| n[(i, j)] / (scale[i] * scale[j]));
    let solved = scaled.cholesky()?.solve(&b.component_div(&scale));
    Some(solved.component_div(&scale))
}
