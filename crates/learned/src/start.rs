//! Start of a fit: base of the curve, zero, units. All are approximate; the model corrects them.

use nalgebra::{DMatrix, DVector};
use vibrissa_core::reduce::{median, range, sorted};

use crate::base::{Base, Fitted, WORTH, Whisker, again, power};
use crate::columns::Scales;
use crate::fit::{Fault, Fit, From, Task};
use crate::rows::{Cell, contradicted};

/// Least exponent of 1/a of a whisker's signal.
const FLAT: f64 = 0.3;

/// Start of a fit.
pub struct Start {
    /// Curve that the model corrects.
    pub base: Base,
    /// Fitted power law, if the whisker is unknown.
    pub power: Option<Fitted>,
    /// Unit of the signals, zero, unit of the base.
    pub numbers: [f64; 3],
    /// Largest contradiction of labels in ln a, if the whisker is unknown ([`contradicted`]).
    pub labels: Option<f64>,
}

/// Start of the model of `cells`; with [`From::Near`] or [`From::Held`] from the base of that fit.
pub fn start(task: &Task, cells: &[Cell], from: From<'_>) -> Result<Start, Fault> {
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
    match unit > 0.0 {
        true => Ok(Start { base, power: Some(fitted), numbers, labels }),
        false => Err(Fault::NoCurve),
    }
}

fn law(taps: &[[f64; 3]], read: Option<f64>, ends: bool) -> Result<Fitted, Fault> {
    let tared = power(taps, Some(read.unwrap_or(0.0)), ends);
    let several = taps.iter().any(|t| t[1] != taps[0][1]);
    // One drive determines no zero, unless signals have both signs or follow no whisker's law without a zero.
    let flat = |f: &Fitted| f.power.q < FLAT;
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
    let best = match looks {
        1 => 0,
        _ => (0..=looks).min_by(|i, k| of(at(*i)).total_cmp(&of(at(*k)))).unwrap_or(0),
    };
    let [mut lo, mut hi] = [at(best.saturating_sub(1)), at((best + 1).min(looks))];
    for _ in 0..24 {
        let (p, q) = (lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo));
        (lo, hi) = if of(p) < of(q) { (lo, q) } else { (p, hi) };
    }
    0.5 * (lo + hi)
}

/// ∂ signal/∂ ln a of each cell, in units of the signal: of the whisker's curve, or of the power law times a fitted quadratic.
pub fn slopes(cells: &[Cell], start: &Start, scales: &Scales) -> Vec<f64> {
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
