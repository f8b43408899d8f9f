//! A zero that was never read: the constant that makes the signals of all drives fit together, where the data determine it.
//!
//! Without theory: at each distance the signal goes with the drive as b (u + κ u²), u = drive + drive offset, above a constant that all
//! distances share. Lines of different slopes b meet in one point, which is the zero and the drive at which contact begins. With a whisker:
//! factor and drive offset of its model and the constant, by least squares.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::drift::Trend;
use crate::estimator::cells::Cell;
use crate::estimator::fit::Fit;
use crate::estimator::model::exact::Parameter;
use crate::estimator::normal;
use crate::estimator::taps::Tap;

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
    /// The same if nothing drifts.
    pub steady: f64,
    /// What half of the taps give above it.
    pub size: f64,
}

impl Constant {
    /// Whether the data say what it is.
    pub fn determined(&self) -> bool {
        self.steady < DETERMINED * self.size
    }

    /// Whether it is certainly not zero.
    pub fn is_there(&self) -> bool {
        self.determined() && self.value.abs() > THERE * self.steady
    }
}

/// Signals above a constant that go with the drive as b (u + κ u²), u = drive + offset, b that of their distance: in units of the travel of
/// the drive and of the range of signals.
struct Lines {
    /// Number of the distance, drive and signal of each tap.
    taps: Vec<(usize, f64, f64)>,
    /// Constant, offset, κ, and b of each distance.
    x: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Lines {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let (zero, offset, curve) = (self.x[0], self.x[1], self.x[2]);
        let of_tap = |(i, drive, signal): &(usize, f64, f64)| {
            let u = drive + offset;
            zero + self.x[3 + i] * (u + curve * u * u) - signal
        };
        let r = DVector::from_iterator(self.taps.len(), self.taps.iter().map(of_tap));
        r.iter().all(|r| r.is_finite()).then_some(r)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let (offset, curve) = (self.x[1], self.x[2]);
        let mut j = DMatrix::zeros(self.taps.len(), self.x.len());
        for (k, (i, drive, _)) in self.taps.iter().enumerate() {
            let (u, b) = (drive + offset, self.x[3 + i]);
            j[(k, 0)] = 1.0;
            j[(k, 1)] = b * (1.0 + 2.0 * curve * u);
            j[(k, 2)] = b * u * u;
            j[(k, 3 + i)] = u + curve * u * u;
        }
        j.iter().all(|x| x.is_finite()).then_some(j)
    }
}

impl Lines {
    /// The constant and its standard error for the scatter that is left; `None` where the data do not determine the lines.
    fn constant(self) -> Option<[f64; 2]> {
        let (fitted, _) = LevenbergMarquardt::new().with_patience(60).minimize(self);
        let (r, j) = (fitted.residuals()?, fitted.jacobian()?);
        let freedom = r.len().checked_sub(fitted.x.len()).filter(|n| *n > 0)? as f64;
        let (_, inverse) = normal::solve(&(j.transpose() * &j), &(j.transpose() * &r))?;
        Some([fitted.x[0], (r.norm_squared() / freedom * inverse[(0, 0)]).sqrt()])
    }
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
    let taps_in_units = taps.iter().map(|t| (place(t), t.drive / travel, t.signal / typical)).collect();
    let lines = Lines { taps: taps_in_units, x: DVector::from_vec(start) };
    let [value, scatter] = lines.constant()?.map(|x| x * typical);
    let mut sizes: Vec<f64> = taps.iter().map(|t| (t.signal - value).abs()).collect();
    let size = crate::reduce::median(&mut sizes);
    let error = scatter.hypot(FORM * size);
    let found = Constant { value, error, steady: error, size };
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
pub fn of_fit(fit: &Fit, cells: &[Cell], sign: f64, trend: Option<Trend>) -> Option<Constant> {
    let at = fit.exact.fitted.iter().position(|p| *p == Parameter::Zero)?;
    let size = crate::reduce::median(&mut cells.iter().map(|c| c.signal).collect::<Vec<_>>());
    let value = sign * fit.exact.values[Parameter::Zero as usize];
    // What the model leaves goes with distance and drive as a constant may: it counts in full.
    let n = fit.residuals.len() as f64;
    let left = (fit.residuals.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let steady = fit.exact.covariance[at][at].sqrt().hypot(left);
    // A straight drift takes up some of it; one that is certain is off by all that it does.
    let [shift, error] = trend.map_or([0.0; 2], |t| t.constant);
    let shift = if trend.is_some_and(|t| t.is_there()) { shift } else { 0.0 };
    Some(Constant { value, error: steady.max(error).hypot(shift), steady, size })
}
