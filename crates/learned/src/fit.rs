//! Fit of rows to a curve: base, scales, learned numbers, and the average over the learned numbers.

use nalgebra::DMatrix;

use crate::base::{Base, Fitted, Whisker};
use crate::columns::{Columns, Effects, FLAT, Scales, Term, terms};
use crate::curve::Curve;
use crate::evidence::{Hyper, Prior, Problem, ln_det};
use crate::peaks::{Mixed, Peak, Widths, held, mean, peaks, points};
use crate::rows::{Cell, Row, cells, position};
use crate::start::{Start, slopes, start};

/// With more cells than this, a part is fitted first to find a start.
pub const MANY: usize = 500;

/// Data of a fit.
#[derive(Clone)]
pub struct Task {
    /// All rows.
    pub rows: Vec<Row>,
    /// Signal of the whisker, if known.
    pub known: Option<Whisker>,
    /// Step of the converter, in the unit of the signal.
    pub step: f64,
    /// Standard deviation of the zero about 0 if no row is without contact; infinite if nothing is known.
    pub zero: f64,
    /// True if a drift of the zero is fitted.
    pub drift: bool,
}

/// Reason why a fit fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Fewer than two positions.
    OnePosition,
    /// Neither a power law nor a whisker gives such signals, or they overflow.
    NoCurve,
}

/// A fit.
pub struct Fit {
    /// The curve.
    pub curve: Curve,
    /// Fitted power law, if the whisker is unknown.
    pub power: Option<Fitted>,
    /// Curve before correction.
    pub base: Base,
    /// Logarithms of the most likely learned numbers.
    pub at: Vec<f64>,
    /// Second derivatives of −ln(likelihood × prior) at `at`, and widths of the likelihood about it.
    pub shape: (DMatrix<f64>, Widths),
    /// Learned numbers, in the order of `at`.
    pub hypers: Vec<Hyper>,
    /// Merged rows.
    pub cells: Vec<Cell>,
    /// Standard deviation of measured − expected signal of one row of each cell if left out, in the unit of the signal.
    pub deleted: Vec<f64>,
    /// Expected signal of each cell, with effects of run, position and drift.
    pub expected: Vec<f64>,
    /// Zero of each cell: of its run, with drift.
    pub zeros: Vec<f64>,
    /// ln of the likelihood times priors, integrated over the learned numbers.
    pub evidence: f64,
    /// Degrees of freedom left for the noise.
    pub freedom: f64,
}

/// Start of the learned numbers.
#[derive(Clone, Copy)]
pub enum From<'a> {
    /// No earlier fit.
    Nowhere,
    /// A fit of nearly the same rows: only the next peak is searched.
    Near(&'a Fit),
    /// A fit of more rows, whose learned numbers are kept.
    Held(&'a Fit),
}

/// Fits the rows at `places`; with `average` the result is averaged over the learned numbers.
///
/// # Errors
/// Rows that no curve follows.
pub fn fit(task: &Task, places: &[usize], from: From<'_>, average: bool) -> Result<Fit, Fault> {
    let merged = cells(&task.rows, places, task.drift);
    if !merged.iter().any(|c| c.row.touches()) {
        return Err(Fault::OnePosition);
    }
    let start = start(task, &merged, from)?;
    let scales = Scales::of(&merged, start.power.map_or(0.0, |f| f.power.offset));
    if !(scales.a[1] > 0.0 && scales.a[1].is_finite()) {
        return Err(Fault::OnePosition);
    }
    let [unit, zero, base_unit] = start.numbers;
    let known = task.known.is_some();
    let of_zero = match merged.iter().any(|c| !c.row.touches()) {
        true => Some(FLAT),
        false => task.zero.is_finite().then(|| task.zero / unit),
    };
    let effects = Effects { known, zero: of_zero, drift: task.drift };
    let slopes = slopes(&merged, &start, &scales);
    let model = Columns::new(&merged, (&start.base, base_unit), &slopes, &scales, effects);
    let of_labels = position(&merged, known, start.labels);
    let problem = Problem::new(model, &merged, [unit, zero, task.step], (known, of_labels));
    let thinned = (matches!(from, From::Nowhere) && merged.len() > MANY).then(|| {
        let every = merged.len().div_ceil(MANY);
        let kept = |k: &usize| !merged[*k].row.touches() || k.is_multiple_of(every);
        let part: Vec<usize> = (0..merged.len()).filter(kept).flat_map(|k| merged[k].rows.clone()).collect();
        fit(task, &part, From::Nowhere, false).map(|f| (f.hypers, f.at))
    });
    let begun = thinned.and_then(Result::ok).map(|(hypers, at)| {
        let of = |(h, p): (&Hyper, &Prior)| hypers.iter().position(|x| x == h).map_or(p.median, |k| at[k]);
        problem.model.hypers.iter().zip(&problem.priors).map(of).collect::<Vec<f64>>()
    });
    let held = if let From::Held(whole) = from { held(&problem, whole) } else { None };
    let warm = if let From::Near(fit) = from { Some(fit.at.as_slice()) } else { begun.as_deref() };
    let mut found = held.map_or_else(|| peaks(&problem, warm), |peak| vec![peak]);
    if found.is_empty() {
        return Err(Fault::NoCurve);
    }
    let terms = terms(known, scales.u[1] > 0.0);
    let kept: Vec<usize> = problem.model.places(&terms).collect();
    // A fold is one of many fits: fewer points are enough.
    let (fold, widths) = if let From::Held(whole) = from { (4, Some(&whole.shape.1)) } else { (1, None) };
    let points = if average { points(merged.len()) / fold } else { 0 };
    let mixed = mean(&problem, &found, &kept, points, widths);
    let peak = found.swap_remove(0);
    let leverage = peak.solved.leverage(|i| merged[i].n);
    let left = |(v, leverage): (&f64, &f64)| (v - leverage).max(1e-6 * v).sqrt() * unit;
    let deleted = peak.solved.variance.iter().zip(&leverage).map(left).collect();
    let used: f64 = (0..merged.len()).map(|i| leverage[i] / peak.solved.variance[i] * merged[i].n).sum();
    let expected = (0..merged.len()).map(|i| merged[i].row.y - peak.solved.residual[i] * unit).collect();
    let of_zero = |k: &usize| matches!(problem.model.hypers[*k], Hyper::RunZero | Hyper::Drift);
    let columns = problem.model.columns.iter().enumerate();
    let movers = columns.filter(|(_, c)| c.term == Term::Zero || c.learned.iter().any(of_zero));
    let movers: Vec<usize> = movers.map(|(j, _)| j).collect();
    let zero_of =
        |i: usize| movers.iter().map(|j| problem.model.matrix[(i, *j)] * peak.solved.mean[*j]).sum::<f64>();
    let zeros = (0..merged.len()).map(|i| zero + unit * zero_of(i)).collect();
    let d = problem.model.hypers.len() as f64;
    let log_det = peak.hessian.clone().cholesky().map_or(0.0, |c| ln_det(&c));
    let prior: f64 = problem.priors.iter().map(|p| p.width().ln() + 0.5 * std::f64::consts::TAU.ln()).sum();
    let evidence = -peak.solved.value - prior + 0.5 * d * std::f64::consts::TAU.ln()
        - 0.5 * log_det
        - places.len() as f64 * unit.ln();
    // A new reading may come at any time of a drift.
    let mut spread = mixed.spread;
    if task.drift {
        let taps = || (0..merged.len()).filter(|i| merged[*i].row.touches()).map(&zero_of);
        let n = taps().count() as f64;
        let mean = taps().sum::<f64>() / n;
        spread.zero += taps().map(|z| (z - mean).powi(2)).sum::<f64>() / n;
    }
    let Mixed { mean, covariance, tails, widths, .. } = mixed;
    let deviations = Curve::deviations(covariance);
    let curve = Curve { unit, base_unit, zero, scales, terms, mean, deviations, spread, tails };
    let (Peak { at, hessian, .. }, Start { base, power, .. }) = (peak, start);
    let (hypers, cells, freedom) = (problem.model.hypers, merged, places.len() as f64 - used);
    let shape = (hessian, widths);
    Ok(Fit { curve, power, base, at, shape, hypers, cells, deleted, expected, zeros, evidence, freedom })
}
