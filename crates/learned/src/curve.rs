//! Result of a fit: the curve with its uncertainty, the variances of a new reading, and the tails of an answer.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::base::{Base, STEP};
use crate::columns::{OFFSETS, Scales, Term, values};

/// Shared numbers that a new run brings: visit of the position, gain, zero.
pub const OF_RUN: usize = 3;

/// Variances of a reading about the curve, in units of the signal; `gain` in shares of the signal, `position` and `visit` in ln a.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Noise independent of the signal, quantisation included.
    pub floor: f64,
    /// Noise in proportion to the signal.
    pub relative: f64,
    /// Error of a position.
    pub position: f64,
    /// Error of a position in one run.
    pub visit: f64,
    /// Zero of a run.
    pub zero: f64,
    /// Gain of a run.
    pub gain: f64,
    /// Drift of the zero over the file.
    pub drift: f64,
}

/// A learned curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Unit of the signal; everything else is in this unit.
    pub unit: f64,
    /// Divisor of the base.
    pub base_unit: f64,
    /// Zero of the signal without run effects, in the signal's own unit; the coefficient of [`Term::Zero`] adds to it.
    pub zero: f64,
    /// Scales of ln a and ln u.
    pub scales: Scales,
    /// Terms of the curve.
    pub terms: Vec<Term>,
    /// Coefficients of the terms.
    pub mean: Vec<f64>,
    /// Columns D of the covariance D Dᵀ of the coefficients: independent standard deviations, each of which moves all coefficients.
    pub deviations: Vec<Vec<f64>>,
    /// Variances of a reading about the curve.
    pub spread: Spread,
    /// Uncertainty of these variances.
    pub tails: Tails,
}

/// Expected tap, in the unit of the signal, above the zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Mean signal.
    pub signal: f64,
    /// Variance from the calibration.
    pub of_curve: f64,
    /// Variance of one reading in the same run at the same position.
    pub of_noise: f64,
    /// Variance from the error of a position.
    pub of_position: f64,
    /// Variance from a new run, without that of its zero.
    pub of_run: f64,
}

/// A reading of an answer: its weight w, its signal y, its slope dy/d ln a, and the variance of its zero over that of a reading.
pub type Weighted = [f64; 4];

/// Offset of the drives of a calibration: contact begins at minus this.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Offset {
    pub mean: f64,
    /// Change of the offset by one standard deviation of each shared number ([`Curve::moved`]).
    pub moved: Vec<f64>,
    /// Standard deviation independent of the shared numbers.
    pub own: f64,
}

impl Curve {
    /// Scaled eigenvectors of a covariance, down to 1e-12 of the largest eigenvalue.
    pub fn deviations(covariance: DMatrix<f64>) -> Vec<Vec<f64>> {
        let eigen = SymmetricEigen::new(covariance);
        let most = eigen.eigenvalues.max();
        let mut order: Vec<usize> =
            (0..eigen.eigenvalues.len()).filter(|k| eigen.eigenvalues[*k] > 1e-12 * most).collect();
        order.sort_by(|i, k| eigen.eigenvalues[*k].total_cmp(&eigen.eigenvalues[*i]));
        let vector = |k: &usize| eigen.eigenvectors.column(*k).map(|x| x * eigen.eigenvalues[*k].sqrt());
        order.iter().take(24).map(|k| vector(k).iter().copied().collect()).collect()
    }

    /// Expected tap at a (mm) and drive u; with `tared` readings the zero is already subtracted.
    pub fn expected(&self, base: &Base, a: f64, u: f64, tared: bool) -> Expected {
        let mut shared = Vec::with_capacity(self.shared());
        let [signal, of_noise] = self.moved(base, (a, u), tared, &mut shared);
        let sum = |of: &[f64]| of.iter().map(|x| x * x).sum::<f64>();
        let (of_curve, rest) = shared.split_at(self.deviations.len());
        let [of_curve, of_position, of_run] = [of_curve, &rest[..1], &rest[1..OF_RUN]].map(sum);
        Expected { signal, of_curve, of_noise, of_position, of_run }
    }

    /// Count of numbers that [`Self::moved`] writes.
    pub fn shared(&self) -> usize {
        self.deviations.len() + 1 + OF_RUN
    }

    /// Signal of a tap and variance of its noise; `shared` gets its change by one standard deviation of each shared number, last the [`OF_RUN`].
    pub fn moved(&self, base: &Base, (a, u): (f64, f64), tared: bool, shared: &mut Vec<f64>) -> [f64; 2] {
        let about = base.about(self.base_unit, a, u);
        let mut row = values(&about, &self.scales, &self.terms, a, u);
        if tared {
            self.terms.iter().zip(&mut row).filter(|(t, _)| **t == Term::Zero).for_each(|(_, x)| *x = 0.0);
        }
        let dot = |c: &[f64]| c.iter().zip(&row).map(|(c, x)| c * x).sum::<f64>();
        let s = &self.spread;
        let m = about.value;
        let [lo, hi] = [-STEP, STEP].map(|share| {
            let row = values(&about.beside(share), &self.scales, &self.terms, a * (1.0 + share), u);
            row.iter().zip(&self.mean).map(|(x, c)| c * x).sum::<f64>()
        });
        let slope = (hi - lo) / (2.0 * STEP);
        shared.extend(self.deviations.iter().map(|d| self.unit * dot(d)));
        let zero = if tared { 0.0 } else { s.zero.sqrt() };
        let rest = [slope * s.position.sqrt(), slope * s.visit.sqrt(), m * s.gain.sqrt(), zero];
        shared.extend(rest.map(|x| self.unit * x));
        [self.unit * dot(&self.mean), self.unit * self.unit * (s.floor + m * m * s.relative)]
    }

    /// Factor by which the 95 % interval of the answer of `readings` exceeds that of a normal distribution ([`Tails::longer`]).
    pub fn longer(&self, readings: &[Weighted], variance: f64, tared: bool, same_run: bool) -> f64 {
        let unit = self.unit * self.unit;
        let of_run = if same_run { 0.0 } else { 1.0 };
        let sum = |of: fn(&Weighted) -> f64| readings.iter().map(of).sum::<f64>();
        let of_noise = sum(|[w, _, _, share]| w * w * (1.0 + share));
        let of_relative = sum(|[w, y, ..]| (w * y).powi(2));
        let placed = sum(|[w, _, slope, _]| w * slope).powi(2);
        let zero = if tared { 0.0 } else { sum(|[w, ..]| *w).powi(2) * unit };
        let [visit, zero, gain] = [placed, zero, sum(|[w, y, ..]| w * y).powi(2)].map(|x| of_run * x);
        let parts: [f64; PARTS] = [of_noise * unit, of_relative, placed, visit, zero, gain];
        self.tails.longer(parts, variance)
    }

    /// Without contact: signal, variance of its noise, and shared numbers of [`Self::moved`].
    pub fn rest(&self, tared: bool) -> Vec<f64> {
        let zero = self.terms.iter().position(|t| *t == Term::Zero).filter(|_| !tared);
        let of = |coefficients: &[f64]| zero.map_or(0.0, |k| self.unit * coefficients[k]);
        let mut all = vec![of(&self.mean), self.unit * self.unit * self.spread.floor];
        all.extend(self.deviations.iter().map(|d| of(d)));
        all.extend([0.0; OF_RUN]);
        all.push(if tared { 0.0 } else { self.unit * self.spread.zero.sqrt() });
        all
    }

    /// Offset of the drive. A calibration at one drive does not determine it: then the usual deviation counts.
    pub(crate) fn offset(&self, base: &Base) -> Offset {
        let size = self.scales.sizes[1];
        let mut moved = vec![0.0; self.shared()];
        let Some(k) = self.terms.iter().position(|t| *t == Term::OffsetU) else {
            return Offset { mean: base.offset(), moved, own: size * OFFSETS[1] };
        };
        moved.iter_mut().zip(&self.deviations).for_each(|(moved, d)| *moved = size * d[k]);
        Offset { mean: base.offset() + size * self.mean[k], moved, own: 0.0 }
    }

    /// Coefficient of `term` and its standard deviation; `None` if the curve has no such term.
    pub fn coefficient(&self, term: Term) -> Option<[f64; 2]> {
        let k = self.terms.iter().position(|t| *t == term)?;
        Some([self.mean[k], self.deviations.iter().map(|d| d[k] * d[k]).sum::<f64>().sqrt()])
    }

    /// Zero of the signal and its standard deviation, in its unit.
    pub fn zero(&self) -> [f64; 2] {
        let [mean, sd] = self.coefficient(Term::Zero).unwrap_or([0.0; 2]);
        [self.zero + self.unit * mean, self.unit * sd]
    }
}

/// Number of variances of a reading: independent noise, proportional noise, position, visit, zero and gain of a run.
pub const PARTS: usize = 6;

/// Tails of an answer: its variances come from few runs and positions, so that readings have longer tails than a normal distribution. A normal number
/// with an uncertain variance V, Var V = c² V², has the kurtosis 3 + 3c² to first order, as Student's distribution of 4 + 2/c² degrees of freedom,
/// whose quantiles are used. Covariance of these variances.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tails(pub [[f64; PARTS]; PARTS]);

/// Half width of the 95 % interval of a standard normal number.
pub const OF_95: f64 = 1.959_964;

impl Tails {
    /// Ratio of the half width of the 95 % interval to [`OF_95`] σ; `parts` are the derivatives of `variance` by the learned variances.
    pub fn longer(&self, parts: [f64; PARTS], variance: f64) -> f64 {
        let row = |row: &[f64; PARTS]| row.iter().zip(parts).map(|(c, p)| c * p).sum::<f64>();
        let uncertain =
            self.0.iter().zip(parts).map(|(r, p)| p * row(r)).sum::<f64>() / (variance * variance);
        if uncertain.is_nan() || uncertain <= 0.0 {
            return 1.0;
        }
        let inverse = 1.0 / (4.0 + 2.0 / uncertain);
        student(OF_95, inverse) / student(1.0, inverse) / OF_95
    }
}

/// Quantile of Student's distribution of 1/`inverse` ≥ 4 degrees of freedom where the normal one is x, to 0.3 % (Abramowitz and Stegun 26.7.5).
fn student(x: f64, inverse: f64) -> f64 {
    let y = x * x;
    let g1 = (y + 1.0) / 4.0;
    let g2 = ((5.0 * y + 16.0) * y + 3.0) / 96.0;
    let g3 = (((3.0 * y + 19.0) * y + 17.0) * y - 15.0) / 384.0;
    x * (1.0 + inverse * (g1 + inverse * (g2 + inverse * g3)))
}
