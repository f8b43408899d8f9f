//! A zero that was never read: the constant that makes the signals of all drives fit together, where the data determine it.
//!
//! Without theory: at each distance the signal goes with the drive as b (u + κ u²), u = drive + drive offset, above a constant that all
//! distances share. Lines of different slopes b meet in one point, which is the zero and the drive at which contact begins. With a whisker:
//! factor and drive offset of its model and the constant, by least squares.

use nalgebra::{DMatrix, DVector};

use crate::estimator::cells::Cell;
use crate::estimator::fit::Fit;
use crate::estimator::model::exact::Parameter;
use crate::estimator::taps::Tap;

/// Steps of Gauss and Newton at most.
const STEPS: usize = 60;
/// A constant is determined where its standard error is below this share of what half of the taps give.
const DETERMINED: f64 = 0.02;
/// And is there where it is more than so many standard errors.
const THERE: f64 = 5.0;
/// Without theory this share of what half of the taps give is uncertain: a whisker does not follow the form better.
const FORM: f64 = 0.01;

/// A constant of the signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    /// In the unit of the signal.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// What half of the taps give above it.
    pub size: f64,
}

impl Constant {
    /// Whether the data say what it is.
    pub fn determined(&self) -> bool {
        self.error < DETERMINED * self.size
    }

    /// Whether it is certainly not zero.
    pub fn is_there(&self) -> bool {
        self.determined() && self.value.abs() > THERE * self.error
    }
}

/// One row of a least-squares problem: residual and its derivatives.
type Row = (f64, Vec<f64>);

/// Minimises the squares of what `rows` gives, from `start`; parameters and their covariance for the scatter that is left. `None`
/// where the data do not determine them.
fn least_squares(
    start: Vec<f64>,
    rows: &dyn Fn(&[f64]) -> Option<Vec<Row>>,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let sum = |rows: &[Row]| rows.iter().map(|r| r.0 * r.0).sum::<f64>();
    let mut x = start;
    let mut now = rows(&x)?;
    let m = x.len();
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let mut n = DMatrix::<f64>::zeros(m, m);
        let mut b = DVector::<f64>::zeros(m);
        for (r, d) in &now {
            let d = DVector::from_column_slice(d);
            n.ger(1.0, &d, &d, 1.0);
            b.axpy(-r, &d, 1.0);
        }
        let mut better = None;
        while damping < 1e12 {
            let damped = DMatrix::from_fn(m, m, |i, k| n[(i, k)] * if i == k { 1.0 + damping } else { 1.0 });
            let step = damped.cholesky().map(|c| c.solve(&b));
            let next: Option<Vec<f64>> = step.map(|s| x.iter().zip(s.iter()).map(|(x, s)| x + s).collect());
            let tried = next.and_then(|next| rows(&next).map(|r| (next, r)));
            match tried {
                Some((next, r)) if sum(&r) <= sum(&now) => {
                    better = Some((next, r));
                    break;
                }
                _ => damping *= 10.0,
            }
        }
        let Some((next, r)) = better else { break };
        let gained = sum(&now) - sum(&r);
        let done = gained <= 1e-12 * sum(&now);
        (x, now) = (next, r);
        damping = (damping * 0.1).max(1e-12);
        if done {
            break;
        }
    }
    let mut n = DMatrix::<f64>::zeros(m, m);
    for (_, d) in &now {
        let d = DVector::from_column_slice(d);
        n.ger(1.0, &d, &d, 1.0);
    }
    let scale: Vec<f64> = (0..m).map(|i| n[(i, i)].sqrt()).collect();
    if now.len() <= m || !scale.iter().all(|s| *s > 0.0 && s.is_finite()) {
        return None;
    }
    let inverse = DMatrix::from_fn(m, m, |i, k| n[(i, k)] / (scale[i] * scale[k])).cholesky()?.inverse();
    let variance = sum(&now) / (now.len() - m) as f64;
    let covariance = DMatrix::from_fn(m, m, |i, k| variance * inverse[(i, k)] / (scale[i] * scale[k]));
    covariance.iter().all(|c| c.is_finite()).then_some((x, covariance))
}

/// The constant of `taps` as recorded, without theory; three drives at three distances are needed.
pub fn without_theory(taps: &[&Tap]) -> Option<Constant> {
    let sorted = |f: fn(&Tap) -> f64| {
        let mut all: Vec<f64> = taps.iter().map(|t| f(t)).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let (distances, drives) = (sorted(|t| t.group[0]), sorted(|t| t.group[1]));
    if distances.len() < 3 || drives.len() < 3 || distances.len() > 64 {
        return None;
    }
    let place = |t: &Tap| distances.partition_point(|a| *a < t.group[0]);
    let travel = drives[drives.len() - 1] - drives[0];
    let typical = {
        let mut values: Vec<f64> = taps.iter().map(|t| t.signal).collect();
        values.sort_by(f64::total_cmp);
        (values[values.len() - 1] - values[0]).abs()
    };
    if !(travel > 0.0 && typical > 0.0) {
        return None;
    }
    // Parameters in units of travel and of the range of signals: constant, drive offset, κ, and b of each distance.
    let rows = |x: &[f64]| -> Option<Vec<Row>> {
        let (zero, offset, curve) = (x[0], x[1], x[2]);
        let row = |t: &&Tap| {
            let (i, u) = (place(t), t.drive / travel + offset);
            let b = x[3 + i];
            let h = u + curve * u * u;
            let mut d = vec![0.0; x.len()];
            d[0] = 1.0;
            d[1] = b * (1.0 + 2.0 * curve * u);
            d[2] = b * u * u;
            d[3 + i] = h;
            (zero + b * h - t.signal / typical, d)
        };
        let rows: Vec<Row> = taps.iter().map(row).collect();
        rows.iter().all(|r| r.0.is_finite()).then_some(rows)
    };
    // From straight lines through the drive's own zero.
    let slope = |i: usize| {
        let here = || taps.iter().filter(move |t| place(t) == i);
        let n = here().count() as f64;
        let (u, y) = (
            here().map(|t| t.drive / travel).sum::<f64>() / n,
            here().map(|t| t.signal / typical).sum::<f64>() / n,
        );
        let (uy, uu) = here().fold((0.0, 0.0), |(p, q), t| {
            let (du, dy) = (t.drive / travel - u, t.signal / typical - y);
            (p + du * dy, q + du * du)
        });
        (if uu > 0.0 { uy / uu } else { 0.0 }, y, u)
    };
    let lines: Vec<(f64, f64, f64)> = (0..distances.len()).map(slope).collect();
    let mut start = vec![lines.iter().map(|(b, y, u)| y - b * u).sum::<f64>() / lines.len() as f64, 0.0, 0.0];
    start.extend(lines.iter().map(|l| l.0));
    let (x, covariance) = least_squares(start, &rows)?;
    let value = x[0] * typical;
    let mut sizes: Vec<f64> = taps.iter().map(|t| (t.signal - value).abs()).collect();
    let size = crate::reduce::median(&mut sizes);
    let error = (covariance[(0, 0)].sqrt() * typical).hypot(FORM * size);
    let found = Constant { value, error, size };
    found.is_there().then_some(found)
}

/// A value beyond all signals of `taps`, on the side from which the drive leads away, where they have both signs although they are of one
/// side: at some distances the sign changes with the drive, at none are there both at one drive. `None` where they do not.
pub fn reference(taps: &[&Tap]) -> Option<f64> {
    let mut cells = std::collections::BTreeMap::<[u64; 2], [bool; 2]>::new();
    let mut changes = std::collections::BTreeMap::<u64, [bool; 2]>::new();
    for t in taps {
        let sign = usize::from(t.signal < 0.0);
        cells.entry(t.group.map(f64::to_bits)).or_default()[sign] = true;
        changes.entry(t.group[0].to_bits()).or_default()[sign] = true;
    }
    let both = |signs: &[bool; 2]| signs[0] && signs[1];
    if cells.values().any(both) || !changes.values().any(both) {
        return None;
    }
    let (lo, hi) =
        taps.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t.signal), h.max(t.signal)));
    let n = taps.len() as f64;
    let (u, y) =
        (taps.iter().map(|t| t.drive).sum::<f64>() / n, taps.iter().map(|t| t.signal).sum::<f64>() / n);
    let rising = taps.iter().map(|t| (t.drive - u) * (t.signal - y)).sum::<f64>() > 0.0;
    let room = 0.1 * (hi - lo);
    Some(if rising { lo - room } else { hi + room })
}

/// The constant that the fit of the model has found beside everything else, of a side whose signals have `sign`; `None` where the data do
/// not determine it.
pub fn of_fit(fit: &Fit, cells: &[Cell], sign: f64) -> Option<Constant> {
    let at = fit.exact.fitted.iter().position(|p| *p == Parameter::Zero)?;
    let size = crate::reduce::median(&mut cells.iter().map(|c| c.signal).collect::<Vec<_>>());
    let value = sign * fit.exact.values[Parameter::Zero as usize];
    // What the model leaves goes with distance and drive as a constant may: it counts in full.
    let n = cells.len() as f64;
    let left = (fit.residuals.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    Some(Constant { value, error: fit.exact.covariance[at][at].sqrt().hypot(left), size })
}
