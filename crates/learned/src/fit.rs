//! From rows to a curve: base, scales, learned numbers, and the mean over what these may be.

use nalgebra::{DMatrix, DVector};

use crate::base::{Base, Power, power};
use crate::columns::{Columns, Effects, Scales, Term, terms};
use crate::curve::{Curve, Spread};
use crate::evidence::{Problem, Solved};
use crate::hyper::Hyper;
use crate::newton::{Peak, approach, climb};
use crate::rows::{Cell, Row, cells};

/// A peak that is less likely by so much in ln has no say.
const HEARD: f64 = 6.0;
/// Of more cells a part is looked at first.
const MANY: usize = 500;
/// Points over which the learned numbers are averaged: of few cells, of more, of many.
const POINTS: [usize; 3] = [120, 60, 20];
/// Of so many cells the learned numbers are uncertain, and points cost little.
const FEW: usize = 60;

/// The |signal| of a whisker at a (mm) by a drive.
pub type Whisker<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// What is fitted to.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// All rows.
    pub rows: &'a [Row],
    /// The whisker's curve, where it is known.
    pub known: Option<Whisker<'a>>,
    /// Step of the converter.
    pub step: f64,
    /// Whether a drift is looked for.
    pub drift: bool,
}

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Fewer than two positions.
    OnePosition,
    /// No power law and no whisker gives such signals.
    NoCurve,
    /// Numbers overflow.
    Overflow,
}

/// A fit.
pub struct Fit {
    /// The curve.
    pub curve: Curve,
    /// The power law, where there is no whisker.
    pub power: Option<Power>,
    /// What is added to the drive of a whisker that is known.
    pub offset: f64,
    /// Logarithms of the most likely learned numbers.
    pub at: Vec<f64>,
    /// Second derivatives there.
    pub hessian: DMatrix<f64>,
    /// What is learned.
    pub hypers: Vec<Hyper>,
    /// The cells of the rows.
    pub cells: Vec<Cell>,
    /// Of each cell the measured less the expected signal, and its standard deviation if one of its rows were left out: in the unit of
    /// the signal, at the most likely learned numbers.
    pub deleted: Vec<[f64; 2]>,
    /// Of each cell the expected signal, effects of run, position and drift included.
    pub expected: Vec<f64>,
    /// The zero of each cell: that of its run, and the drift.
    pub zeros: Vec<f64>,
    /// ln of the likelihood times priors, integrated over the learned numbers.
    pub evidence: f64,
    /// Independent numbers that the rows leave for the noise.
    pub freedom: f64,
}

impl Fit {
    /// Hands the base of the curve to `then`.
    pub fn base<T>(&self, task: &Task<'_>, then: impl FnOnce(&Base<'_>) -> T) -> T {
        match (self.power, task.known) {
            (Some(power), _) => then(&Base::Power(power)),
            (None, Some(curve)) => then(&Base::Known(curve, self.offset)),
            (None, None) => unreachable!("a fit has a base"),
        }
    }

    /// A fit of nothing, for what is not fitted yet.
    pub fn empty() -> Self {
        let scales = Scales { a: [0.0, 1.0], u: [0.0; 2], sizes: [1.0; 2], offset: 0.0 };
        let curve = Curve {
            unit: 1.0,
            base_unit: 1.0,
            zero: 0.0,
            scales,
            terms: Vec::new(),
            mean: Vec::new(),
            deviations: Vec::new(),
            spread: Spread::default(),
        };
        Self {
            curve,
            power: None,
            offset: 0.0,
            at: Vec::new(),
            hessian: DMatrix::zeros(0, 0),
            hypers: Vec::new(),
            cells: Vec::new(),
            deleted: Vec::new(),
            expected: Vec::new(),
            zeros: Vec::new(),
            evidence: f64::NEG_INFINITY,
            freedom: 0.0,
        }
    }
}

/// The base and the scale of the signals.
struct Start<'a> {
    base: Base<'a>,
    power: Option<Power>,
    /// Unit of the signals, zero, unit of the base.
    numbers: [f64; 3],
}

/// Where a free constant is worth so much in ln of the sum of squares a row, it is there.
const WORTH: f64 = 10.0;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

fn start<'a>(task: &Task<'a>, cells: &[Cell]) -> Result<Start<'a>, Fault> {
    let rests: Vec<f64> = cells.iter().filter(|c| !c.row.touches()).map(|c| c.row.y).collect();
    let taps: Vec<[f64; 3]> =
        cells.iter().filter(|c| c.row.touches()).map(|c| [c.row.a, c.row.u, c.row.y]).collect();
    let read = (!rests.is_empty()).then(|| median(rests));
    if let Some(curve) = task.known {
        let free = of_known(curve, &taps, read, offset(curve, &taps, read)).ok_or(Fault::NoCurve)?;
        let plain = of_known(curve, &taps, read, 0.0);
        let gain = plain.as_ref().map_or(f64::INFINITY, |p| taps.len() as f64 * (p.1 / free.1).ln());
        return Ok(plain.filter(|_| gain <= WORTH).unwrap_or(free).0);
    }
    let tared = power(&taps, Some(read.unwrap_or(0.0)));
    let several = taps.iter().any(|t| t[1] != taps[0][1]);
    let free = if read.is_none() && several && taps.len() > 6 { power(&taps, None) } else { None };
    let fitted = match (tared, free) {
        (Some(tared), Some(free)) => {
            let gain = taps.len() as f64 * (tared.squares / free.squares).ln();
            if gain > WORTH { free } else { tared }
        }
        (tared, free) => tared.or(free).ok_or(Fault::NoCurve)?,
    };
    let unit = median(taps.iter().map(|t| (t[2] - fitted.zero).abs()).collect());
    match unit > 0.0 {
        true => Ok(Start {
            base: Base::Power(fitted.power),
            power: Some(fitted.power),
            numbers: [unit, fitted.zero, unit / fitted.factor],
        }),
        false => Err(Fault::NoCurve),
    }
}

/// The base of a whisker that is known, its drive moved by `offset`, and the sum of squares that gain and zero leave.
fn of_known<'a>(
    curve: Whisker<'a>,
    taps: &[[f64; 3]],
    read: Option<f64>,
    offset: f64,
) -> Option<(Start<'a>, f64)> {
    let m: Vec<f64> = taps.iter().map(|t| curve(t[0], t[1] + offset)).collect();
    let y: Vec<f64> = taps.iter().map(|t| t[2] - read.unwrap_or(0.0)).collect();
    let tared = median(y.iter().zip(&m).map(|(y, m)| y / m).collect());
    let squares = |gain: f64, zero: f64| {
        let mut all: Vec<f64> = y.iter().zip(&m).map(|(y, m)| (y - zero - gain * m).powi(2)).collect();
        // Without the worst tenth, which may be wrong.
        all.sort_by(f64::total_cmp);
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
    let unit = median(m.iter().map(|m| gain * m).collect());
    let numbers = [unit, read.unwrap_or(0.0) + zero, unit / gain];
    let sound =
        gain > 0.0 && unit > 0.0 && numbers.iter().all(|x| x.is_finite()) && m.iter().all(|m| m.is_finite());
    sound.then(|| (Start { base: Base::Known(curve, offset), power: None, numbers }, squares(gain, zero)))
}

/// What is best added to the drive of a whisker that is known, within what its curve was made for.
fn offset(curve: Whisker<'_>, taps: &[[f64; 3]], read: Option<f64>) -> f64 {
    let drives = || taps.iter().map(|t| t[1]);
    let (least, largest) = (drives().fold(f64::INFINITY, f64::min), drives().fold(0.0, f64::max));
    if least == largest {
        return 0.0;
    }
    let of = |offset: f64| of_known(curve, taps, read, offset).map_or(f64::INFINITY, |f| f.1);
    let ends = [-0.9 * least.min(0.5 * largest), 0.9 * least.max(0.1 * largest)];
    let at = |k: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / 16.0;
    let best = (0..=16).min_by(|i, k| of(at(*i)).total_cmp(&of(at(*k)))).unwrap_or(0);
    let (mut lo, mut hi) = (at(best.saturating_sub(1)), at((best + 1).min(16)));
    for _ in 0..24 {
        let (p, q) = (lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo));
        if of(p) < of(q) {
            hi = q;
        } else {
            lo = p;
        }
    }
    0.5 * (lo + hi)
}

/// ∂ signal/∂ ln a of each cell, in units of the signal: of the whisker's curve, or of the power law times a quadratic that is nearest
/// to the taps.
fn slopes(cells: &[Cell], start: &Start<'_>, scales: &Scales) -> Vec<f64> {
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

/// Points of a low-discrepancy sequence as normal deviates (Halton; Acklam's inverse).
fn deviates(point: usize, dim: usize) -> Vec<f64> {
    const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
    let radical = |base: usize| {
        let (mut k, mut share, mut x) = (point + 20, 1.0, 0.0);
        while k > 0 {
            share /= base as f64;
            x += share * (k % base) as f64;
            k /= base;
        }
        x
    };
    (0..dim).map(|d| normal_quantile(radical(PRIMES[d % PRIMES.len()]).clamp(1e-9, 1.0 - 1e-9))).collect()
}

/// Quantile of the normal distribution, to 1e-9 (Acklam 2003).
pub fn normal_quantile(p: f64) -> f64 {
    const A: [f64; 6] = [
        -39.69683028665376,
        220.9460984245205,
        -275.9285104469687,
        138.357751867269,
        -30.66479806614716,
        2.506628277459239,
    ];
    const B: [f64; 5] =
        [-54.47609879822406, 161.5858368580409, -155.6989798598866, 66.80131188771972, -13.28068155288572];
    const C: [f64; 6] = [
        -0.007784894002430293,
        -0.3223964580411365,
        -2.400758277161838,
        -2.549732539343734,
        4.374664141464968,
        2.938163982698783,
    ];
    const D: [f64; 4] = [0.007784695709041462, 0.3224671290700398, 2.445134137142996, 3.754408661907416];
    let series = |c: &[f64], x: f64| c.iter().fold(0.0, |s, c| s * x + c);
    if p > 0.5 {
        return -normal_quantile(1.0 - p);
    }
    if p < 0.02425 {
        let q = (-2.0 * p.ln()).sqrt();
        return series(&C, q) / (series(&D, q) * q + 1.0);
    }
    let q = p - 0.5;
    let r = q * q;
    series(&A, r) * q / (series(&B, r) * r + 1.0)
}

/// Where the learned numbers come from.
#[derive(Clone, Copy)]
pub enum From<'a> {
    /// Nothing is known.
    Nowhere,
    /// Those of nearly the same rows: the next peak is theirs.
    Near(&'a [f64]),
    /// Those of this fit, of more rows, as they are.
    Held(&'a Fit),
}

/// Fits the rows at `places`, and takes the mean over the learned numbers where wanted.
///
/// # Errors
/// Rows that no curve follows.
pub fn fit(task: &Task<'_>, places: &[usize], from: From<'_>, average: bool) -> Result<Fit, Fault> {
    let merged = cells(task.rows, places, task.drift);
    let start = start(task, &merged)?;
    let scales = Scales::of(&merged, start.power.map_or(0.0, |p| p.offset));
    if !(scales.a[1] > 0.0 && scales.a[1].is_finite()) {
        return Err(Fault::OnePosition);
    }
    let [unit, zero, base_unit] = start.numbers;
    let known = task.known.is_some();
    let effects = Effects { known, zeros: merged.iter().any(|c| !c.row.touches()), drift: task.drift };
    let slopes = slopes(&merged, &start, &scales);
    let model = Columns::new(&merged, (&start.base, base_unit), &slopes, &scales, effects);
    let problem = Problem::new(model, &merged, [unit, zero, task.step], known);
    let thinned = (matches!(from, From::Nowhere) && merged.len() > MANY).then(|| {
        let every = merged.len().div_ceil(MANY);
        let kept = |k: &usize| !merged[*k].row.touches() || k % every == 0;
        let part: Vec<usize> = (0..merged.len()).filter(kept).flat_map(|k| merged[k].rows.clone()).collect();
        fit(task, &part, From::Nowhere, false).map(|f| (f.hypers, f.at))
    });
    // The same numbers, of which the part may lack some.
    let begun = thinned.and_then(Result::ok).map(|(hypers, at)| {
        let of = |(h, p): (&Hyper, &[f64; 2])| hypers.iter().position(|x| x == h).map_or(p[0], |k| at[k]);
        problem.model.hypers.iter().zip(&problem.priors).map(of).collect::<Vec<f64>>()
    });
    let held = if let From::Held(whole) = from { held(&problem, whole) } else { None };
    let warm = if let From::Near(at) = from { Some(at) } else { begun.as_deref() };
    let mut found = held.map_or_else(|| peaks(&problem, warm), |peak| vec![peak]);
    if found.is_empty() {
        return Err(Fault::Overflow);
    }
    let terms = terms(known, scales.u[1] > 0.0);
    let kept: Vec<usize> = (0..terms.len()).collect();
    // One fold of many need not be averaged as finely.
    let fold = if matches!(from, From::Held(_)) { 3 } else { 1 };
    let mixed = mean(&problem, &found, &kept, if average { points(merged.len()) / fold } else { 0 });
    let peak = found.swap_remove(0);
    let leverage = peak.solved.leverage(|i| merged[i].n);
    let deleted = (0..merged.len())
        .map(|i| {
            let left = (peak.solved.variance[i] - leverage[i]).max(1e-6 * peak.solved.variance[i]);
            [peak.solved.residual[i] * unit, left.sqrt() * unit]
        })
        .collect();
    let used: f64 = (0..merged.len()).map(|i| leverage[i] / peak.solved.variance[i] * merged[i].n).sum();
    let expected = (0..merged.len()).map(|i| merged[i].row.y - peak.solved.residual[i] * unit).collect();
    let own = |h: Hyper| problem.model.hypers.iter().position(|x| *x == h);
    let moves_zero = |j: usize| {
        let c = &problem.model.columns[j];
        c.term == Term::Zero
            || [Hyper::RunZero, Hyper::Drift].iter().any(|h| own(*h).is_some_and(|k| c.learned.contains(&k)))
    };
    let movers: Vec<usize> = (0..problem.model.columns.len()).filter(|j| moves_zero(*j)).collect();
    let zero_of =
        |i: usize| movers.iter().map(|j| problem.model.matrix[(i, *j)] * peak.solved.mean[*j]).sum::<f64>();
    let zeros = (0..merged.len()).map(|i| zero + unit * zero_of(i)).collect();
    let d = problem.dim() as f64;
    let log_det = 2.0
        * peak
            .hessian
            .clone()
            .cholesky()
            .map_or(0.0, |c| c.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>());
    let prior: f64 = problem.priors.iter().map(|p| p[1].ln() + 0.5 * std::f64::consts::TAU.ln()).sum();
    let evidence = -peak.solved.value - prior + 0.5 * d * std::f64::consts::TAU.ln()
        - 0.5 * log_det
        - places.len() as f64 * unit.ln();
    // A reading comes at any time of a drift.
    let mut spread = mixed.spread;
    if task.drift {
        let taps = || (0..merged.len()).filter(|i| merged[*i].row.touches()).map(&zero_of);
        let n = taps().count() as f64;
        let mean = taps().sum::<f64>() / n;
        spread.zero += taps().map(|z| (z - mean).powi(2)).sum::<f64>() / n;
    }
    let curve = Curve {
        unit,
        base_unit,
        zero,
        scales,
        terms,
        mean: mixed.mean,
        deviations: Curve::deviations(mixed.covariance),
        spread,
    };
    let freedom = places.len() as f64 - used;
    let hypers = problem.model.hypers.clone();
    let offset = if let Base::Known(_, offset) = start.base { offset } else { 0.0 };
    Ok(Fit {
        curve,
        power: start.power,
        offset,
        at: peak.at,
        hessian: peak.hessian,
        hypers,
        cells: merged,
        deleted,
        expected,
        zeros,
        evidence,
        freedom,
    })
}

/// The numbers of a fit of more rows, where the same are learned.
fn held(problem: &Problem, whole: &Fit) -> Option<Peak> {
    let same = problem.model.hypers == whole.hypers;
    let solved = problem.solve(&whole.at).filter(|_| same)?;
    Some(Peak { at: whole.at.clone(), solved, hessian: whole.hessian.clone() })
}

/// The peaks that three starts lead to, the highest first: little noise, much, and positions that are not where they are said to be.
fn peaks(problem: &Problem, warm: Option<&[f64]>) -> Vec<Peak> {
    let from = |noise: f64, position: f64| -> Vec<f64> {
        let of = |(h, p): (&Hyper, &[f64; 2])| match h {
            Hyper::Floor | Hyper::Relative => f64::ln(noise),
            Hyper::Position => f64::ln(position),
            _ => p[0],
        };
        problem.model.hypers.iter().zip(&problem.priors).map(of).collect()
    };
    if let Some(warm) = warm.filter(|w| w.len() == problem.dim())
        && let Some(found) = climb(problem, &approach(problem, warm).map_or(warm.to_vec(), |a| a.0))
    {
        return vec![found];
    }
    let starts = [[3e-3, 3e-3], [5e-2, 3e-3], [1e-2, 1e-1]];
    let mut ends: Vec<(Vec<f64>, f64)> = Vec::new();
    for end in starts.into_iter().filter_map(|[noise, position]| approach(problem, &from(noise, position))) {
        if !ends.iter().any(|(at, _)| at.iter().zip(&end.0).all(|(x, y)| (x - y).abs() < 0.3)) {
            ends.push(end);
        }
    }
    let best = ends.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
    let near = ends.into_iter().filter(|(_, value)| *value < best + HEARD);
    let mut all: Vec<Peak> = near.filter_map(|(at, _)| climb(problem, &at)).collect();
    all.sort_by(|p, q| p.solved.value.total_cmp(&q.solved.value));
    if std::env::var("DBG").is_ok() {
        for p in &all {
            eprint!("{:.2}:", p.solved.value);
            for (h, x) in problem.model.hypers.iter().zip(&p.at) {
                eprint!(" {h:?} {:.1e}", x.exp());
            }
            eprintln!();
        }
    }
    all
}

/// Points for so many cells.
fn points(cells: usize) -> usize {
    POINTS[usize::from(cells > FEW) + usize::from(cells > MANY)]
}

/// Means over the learned numbers.
struct Mixed {
    mean: Vec<f64>,
    covariance: DMatrix<f64>,
    spread: Spread,
}

/// The mean over points about the peaks, weighted by what likelihood and prior make of them.
fn mean(problem: &Problem, peaks: &[Peak], kept: &[usize], points: usize) -> Mixed {
    // Half of the points as far as the curvature says, half farther: few data leave long tails.
    const WIDER: [f64; 2] = [1.0, 1.5];
    let (d, first) = (problem.dim(), &peaks[0]);
    let mut all: Vec<(f64, Vec<f64>, Option<Solved>)> = Vec::new();
    let heard: Vec<&Peak> = peaks.iter().filter(|p| p.solved.value < first.solved.value + HEARD).collect();
    for peak in &heard {
        let factor = peak.hessian.clone().cholesky().expect("it was made positive").l();
        let width: f64 = factor.diagonal().iter().map(|x| x.ln()).sum();
        for k in 0..points / heard.len() {
            let z = DVector::from_vec(deviates(k, d)) * WIDER[k % 2];
            let density = |s: &f64| (-0.5 * z.norm_squared() / (s * s)).exp() * s.powi(-(d as i32));
            let proposal = (WIDER.iter().map(density).sum::<f64>()).max(1e-300).ln() + width;
            let Some(step) = factor.transpose().solve_upper_triangular(&z) else { continue };
            let at: Vec<f64> =
                peak.at.iter().zip(step.iter()).map(|(x, s)| (x + s).clamp(-30.0, 12.0)).collect();
            if let Some(solved) = problem.solve(&at) {
                all.push((first.solved.value - solved.value - proposal, at, Some(solved)));
            }
        }
    }
    if all.is_empty() {
        all.push((0.0, first.at.clone(), None));
    }
    let top = all.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|p| (p.0 - top).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let n = kept.len();
    let (mut mean, mut square, mut spread) = (DVector::zeros(n), DMatrix::zeros(n, n), Spread::default());
    for ((_, at, solved), weight) in all.iter().zip(&weights) {
        let (w, solved) = (weight / sum, solved.as_ref().unwrap_or(&first.solved));
        // About the first peak: differences of large numbers cost digits.
        let here = DVector::from_iterator(n, kept.iter().map(|k| solved.mean[*k] - first.solved.mean[*k]));
        square += (solved.covariance(kept) + &here * here.transpose()) * w;
        mean += here * w;
        let of = |h: Hyper| w * problem.learned(at, h).powi(2);
        spread.floor += of(Hyper::Floor) + w * problem.steps;
        spread.relative += of(Hyper::Relative);
        spread.position += of(Hyper::Position);
        spread.visit += of(Hyper::Visit);
        spread.zero += of(Hyper::RunZero);
        spread.gain += of(Hyper::RunGain);
        spread.drift += of(Hyper::Drift);
    }
    let covariance = square - &mean * mean.transpose();
    let mean = kept.iter().zip(mean.iter()).map(|(k, x)| x + first.solved.mean[*k]).collect();
    Mixed { mean, covariance, spread }
}
