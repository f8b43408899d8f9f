//! Fit of rows to a curve: base, scales, learned numbers, and the average over the learned numbers.

use nalgebra::{DMatrix, DVector};
use vibrissa_core::reduce::{median, range, sorted};

use crate::base::{Base, Fitted, WORTH, Whisker, again, power};
use crate::columns::{Columns, Effects, FLAT, Scales, Term, terms};
use crate::curve::Curve;
use crate::evidence::{Hyper, Prior, Problem, ln_det};
use crate::peaks::{Mixed, Peak, Widths, held, mean, peaks, points};
use crate::rows::{Cell, Row, cells, contradicted, position};

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
/// Errors: rows that no curve follows.
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
    let read = merged.iter().any(|c| !c.row.touches());
    let of_zero = if read { Some(FLAT) } else { task.zero.is_finite().then(|| task.zero / unit) };
    let effects = Effects { known, zero: of_zero, drift: task.drift };
    let model = Columns::new(&merged, &start, &scales, effects);
    let of_labels = position(&merged, known, start.labels);
    let problem = Problem::new(model, &merged, &start, task.step, of_labels);
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

/// Least exponent of 1/a of a whisker's signal.
const SHALLOW: f64 = 0.3;

pub(crate) struct Start {
    pub base: Base,
    pub power: Option<Fitted>,
    /// Unit of the signals, zero, unit of the base.
    pub numbers: [f64; 3],
    /// Largest contradiction of labels in ln a, if the whisker is unknown ([`contradicted`]).
    pub labels: Option<f64>,
}

/// Start of the model of `cells`; with [`From::Near`] or [`From::Held`] from the base of that fit.
pub(crate) fn start(task: &Task, cells: &[Cell], from: From<'_>) -> Result<Start, Fault> {
    let mut rests: Vec<f64> = cells.iter().filter(|c| !c.row.touches()).map(|c| c.row.y).collect();
    let taps: Vec<[f64; 3]> =
        cells.iter().filter(|c| c.row.touches()).map(|c| [c.row.a, c.row.u, c.row.y]).collect();
    let read = if rests.is_empty() { task.zero.is_finite().then_some(0.0) } else { Some(median(&mut rests)) };
    let near: Option<&Fit> = if let From::Near(fit) | From::Held(fit) = from { Some(fit) } else { None };
    if let Some(curve) = &task.known {
        if let From::Held(fit) = from
            && let Some(found) = of_known(curve, &taps, read, fit.base.offset())
        {
            return Ok(found.0);
        }
        let plain = of_known(curve, &taps, read, 0.0);
        let [least, most] = range(taps.iter().map(|t| t[1]));
        let squares = |offset: f64| of_known(curve, &taps, read, offset).map_or(f64::INFINITY, |f| f.1);
        let ends = [-0.9 * least.min(0.5 * most), 0.9 * least.max(0.1 * most)];
        let offset = if least == most { 0.0 } else { lowest(squares, ends, 16) };
        let free = of_known(curve, &taps, read, offset);
        // An offset is used if it is worth it, or if the curve has no values without it.
        let worth = |(p, f): (&(Start, f64), &(Start, f64))| taps.len() as f64 * (p.1 / f.1).ln() > WORTH;
        let moved = plain.as_ref().zip(free.as_ref()).is_some_and(worth);
        let found = if moved { free } else { plain.or(free) };
        return found.map(|f| f.0).ok_or(Fault::NoCurve);
    }
    let labels = contradicted(cells);
    let fitted = match near.and_then(|fit| again(&taps, Some(read.unwrap_or(0.0)), fit.power.as_ref()?)) {
        Some(fitted) => fitted,
        None => law(&taps, read, labels.is_none())?,
    };
    let unit = median(&mut taps.iter().map(|t| (t[2] - fitted.zero).abs()).collect::<Vec<_>>());
    let (base, numbers) = (Base::Power(fitted.power), [unit, fitted.zero, unit / fitted.factor]);
    let start = Start { base, power: Some(fitted), numbers, labels };
    (unit > 0.0).then_some(start).ok_or(Fault::NoCurve)
}

fn law(taps: &[[f64; 3]], read: Option<f64>, ends: bool) -> Result<Fitted, Fault> {
    let tared = power(taps, Some(read.unwrap_or(0.0)), ends);
    let several = taps.iter().any(|t| t[1] != taps[0][1]);
    // One drive determines no zero, unless signals have both signs or follow no whisker's law without a zero.
    let flat = |f: &Fitted| f.power.q < SHALLOW;
    let needed = tared.as_ref().is_none_or(flat) || taps.iter().any(|t| t[2] < 0.0);
    let free = read.is_none() && taps.len() > 6 && (several || needed);
    let free = if free { power(taps, None, ends) } else { None };
    // Too few taps to fit a zero: take one below the weakest signal; the model corrects it.
    let beyond = || {
        let [lo, hi] = range(taps.iter().map(|t| t[2]));
        power(taps, Some(lo - 0.5 * (hi - lo)), ends)
    };
    let free = free.or_else(|| if read.is_none() && needed { beyond() } else { None });
    match (tared, free) {
        (Some(tared), Some(free)) => {
            let gain = taps.len() as f64 * (tared.squares / free.squares).ln();
            Ok(if gain > WORTH { free } else { tared })
        }
        (tared, free) => tared.or(free).ok_or(Fault::NoCurve),
    }
}

/// Base of a known whisker with its drive moved by `offset`, and the sum of squares after gain and zero.
fn of_known(curve: &Whisker, taps: &[[f64; 3]], read: Option<f64>, offset: f64) -> Option<(Start, f64)> {
    let m: Vec<f64> = taps.iter().map(|t| curve(t[0], t[1] + offset)).collect();
    let y: Vec<f64> = taps.iter().map(|t| t[2] - read.unwrap_or(0.0)).collect();
    let tared = median(&mut y.iter().zip(&m).map(|(y, m)| y / m).collect::<Vec<_>>());
    let squares = |gain: f64, zero: f64| {
        let all = sorted(y.iter().zip(&m).map(|(y, m)| (y - zero - gain * m).powi(2)));
        all[..all.len() - all.len() / 10].iter().sum::<f64>().max(f64::MIN_POSITIVE)
    };
    let (mut gain, mut zero) = (tared, 0.0);
    if read.is_none() && taps.len() > 6 {
        let n = taps.len() as f64;
        let (mm, my) = (m.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        let slope = m.iter().zip(&y).map(|(m, y)| (m - mm) * (y - my)).sum::<f64>()
            / m.iter().map(|m| (m - mm).powi(2)).sum::<f64>();
        let free = (slope, my - slope * mm);
        if slope > 0.0 && n * (squares(tared, 0.0) / squares(free.0, free.1)).ln() > WORTH {
            (gain, zero) = free;
        }
    }
    let unit = median(&mut m.iter().map(|m| gain * m).collect::<Vec<_>>());
    let numbers = [unit, read.unwrap_or(0.0) + zero, unit / gain];
    let sound =
        gain > 0.0 && unit > 0.0 && numbers.iter().all(|x| x.is_finite()) && m.iter().all(|m| m.is_finite());
    let base = Base::Known(curve.clone(), offset);
    sound.then(|| (Start { base, power: None, numbers, labels: None }, squares(gain, zero)))
}

/// Argument of the minimum between two ends: beside the lowest of so many `looks` by golden section, to 1e-5 of a look.
pub fn lowest(of: impl Fn(f64) -> f64, [lo, hi]: [f64; 2], looks: usize) -> f64 {
    let at = |k: usize| lo + (hi - lo) * k as f64 / looks as f64;
    let lowest = || (0..=looks).min_by(|i, k| of(at(*i)).total_cmp(&of(at(*k))));
    let best = if looks == 1 { 0 } else { lowest().unwrap_or(0) };
    let [mut lo, mut hi] = [at(best.saturating_sub(1)), at((best + 1).min(looks))];
    for _ in 0..24 {
        let (p, q) = (lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo));
        (lo, hi) = if of(p) < of(q) { (lo, q) } else { (p, hi) };
    }
    0.5 * (lo + hi)
}

/// ∂ signal/∂ ln a of each cell, in units of the signal: of the whisker's curve, or of the power law times a fitted quadratic.
pub(crate) fn slopes(cells: &[Cell], start: &Start, scales: &Scales) -> Vec<f64> {
    const RIDGE: f64 = 1e-4;
    let [unit, zero, base_unit] = start.numbers;
    let base = |a: f64, u: f64| start.base.value(a, u) / base_unit;
    let row = |a: f64, u: f64| {
        let [x, v] = scales.place(a, u);
        [1.0, x, v, x * x, x * v, v * v]
    };
    let mut factor = DVector::from_vec(vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    if start.power.is_some() {
        let (mut n, mut b) = (DMatrix::identity(6, 6) * (RIDGE * cells.len() as f64), DVector::zeros(6));
        for c in cells.iter().filter(|c| c.row.touches()) {
            let h = DVector::from_row_slice(&row(c.row.a, c.row.u));
            b += &h * ((c.row.y - zero) / unit / base(c.row.a, c.row.u) - 1.0);
            n += &h * h.transpose();
        }
        factor += n.cholesky().map_or(DVector::zeros(6), |c| c.solve(&b));
    }
    let value =
        |a: f64, u: f64| base(a, u) * row(a, u).iter().zip(factor.iter()).map(|(x, f)| x * f).sum::<f64>();
    const H: f64 = 1e-3;
    let of =
        |c: &Cell| (value(c.row.a * (1.0 + H), c.row.u) - value(c.row.a * (1.0 - H), c.row.u)) / (2.0 * H);
    cells.iter().map(|c| if c.row.touches() { of(c) } else { 0.0 }).collect()
}
