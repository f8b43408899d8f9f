//! What is kept of a fit: the curve with its uncertainty, and what else moves a new reading.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::base::{Base, STEP};
use crate::columns::{OFFSETS, Scales, Term, values};
use crate::tails::{PARTS, Tails};

/// Numbers that a new run has: an effect of each position, gain, zero.
pub const OF_RUN: usize = 3;

/// Variances of what moves a reading beside the curve, in units of the signal; that of `gain` goes with the signal
/// of the tap, those of `position` and `visit` are of ln a.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Noise that all readings have, the converter's steps included.
    pub floor: f64,
    /// Noise that goes with the signal.
    pub relative: f64,
    /// Effect of a position.
    pub position: f64,
    /// Effect of a position in one run.
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
    /// Signal of which all are in units.
    pub unit: f64,
    /// What the base is divided by.
    pub base_unit: f64,
    /// The zero of the signal without run, in its own unit; the coefficient of [`Term::Zero`] is above it.
    pub zero: f64,
    /// Scales of ln a and ln u.
    pub scales: Scales,
    /// Terms of the curve.
    pub terms: Vec<Term>,
    /// Their coefficients.
    pub mean: Vec<f64>,
    /// Standard deviations of them together: each entry moves all coefficients, independently of the others.
    pub deviations: Vec<Vec<f64>>,
    /// What else moves a reading.
    pub spread: Spread,
    /// How well that is known.
    pub tails: Tails,
}

/// What is expected of a tap, in the unit of the signal, above the zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Mean.
    pub signal: f64,
    /// Variance that the calibration leaves.
    pub of_curve: f64,
    /// Variance of one reading in the same run, at the same position.
    pub of_noise: f64,
    /// Variance that a position brings.
    pub of_position: f64,
    /// Variance that a new run brings, its zero left out.
    pub of_run: f64,
}

/// How readings count in an answer, by their weights w, signals y and slopes dy/d ln a.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Weights {
    /// Σ w.
    pub sum: f64,
    /// Σ w².
    pub of_noise: f64,
    /// Σ (w y)².
    pub of_relative: f64,
    /// Σ w dy/d ln a.
    pub of_slope: f64,
    /// Σ w y.
    pub of_signal: f64,
}

impl Weights {
    /// One more reading, of this signal and slope, whose weight is `w`; its zero brings `share` of the variance of a reading.
    pub fn add(&mut self, w: f64, [y, slope]: [f64; 2], share: f64) {
        self.sum += w;
        self.of_noise += w * w * (1.0 + share);
        self.of_relative += (w * y).powi(2);
        self.of_slope += w * slope;
        self.of_signal += w * y;
    }
}

/// By how much the drives of a calibration are off: contact begins at minus this.
#[derive(Debug, Clone, PartialEq)]
pub struct Offset {
    /// Mean.
    pub mean: f64,
    /// By how much one standard deviation of each number that is shared ([`Curve::moved`]) moves it.
    pub moved: Vec<f64>,
    /// Standard deviation beside those.
    pub own: f64,
}

impl Curve {
    /// Eigenvectors of a covariance, as many as matter.
    pub fn deviations(covariance: DMatrix<f64>) -> Vec<Vec<f64>> {
        let eigen = SymmetricEigen::new(covariance);
        let most = eigen.eigenvalues.max();
        let mut order: Vec<usize> =
            (0..eigen.eigenvalues.len()).filter(|k| eigen.eigenvalues[*k] > 1e-12 * most).collect();
        order.sort_by(|i, k| eigen.eigenvalues[*k].total_cmp(&eigen.eigenvalues[*i]));
        let vector = |k: &usize| eigen.eigenvectors.column(*k).map(|x| x * eigen.eigenvalues[*k].sqrt());
        order.iter().take(24).map(|k| vector(k).iter().copied().collect()).collect()
    }

    /// What is expected of a tap at a (mm) by the drive u: of a signal whose own zero was taken off where `tared`, else of one above
    /// [`Self::zero`].
    pub fn expected(&self, base: &Base, a: f64, u: f64, tared: bool) -> Expected {
        let mut shared = Vec::with_capacity(self.shared());
        let [signal, of_noise] = self.moved(base, (a, u), tared, &mut shared);
        let sum = |of: &[f64]| of.iter().map(|x| x * x).sum::<f64>();
        let (of_curve, rest) = shared.split_at(self.deviations.len());
        Expected {
            signal,
            of_curve: sum(of_curve),
            of_noise,
            of_position: sum(&rest[..1]),
            // The zero of a run is told apart.
            of_run: sum(&rest[1..1 + OF_RUN - 1]),
        }
    }

    /// Numbers that [`Self::moved`] writes.
    pub fn shared(&self) -> usize {
        self.deviations.len() + 1 + OF_RUN
    }

    /// Signal, and variance of its noise, of the same tap. Into `shared`: by how much the signal is moved by one standard deviation of each number
    /// that is the same for all taps of one object: those of the curve, the effect of the position, and last the [`OF_RUN`] numbers of a new run.
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

    /// By how much farther the interval of 95 % of an answer reaches than that of a normal one ([`Tails::longer`]): of readings whose weights in the answer
    /// sum up as `weights` say, and whose variance is this.
    pub fn longer(&self, weights: Weights, variance: f64, tared: bool, same_run: bool) -> f64 {
        let unit = self.unit * self.unit;
        let of_run = if same_run { 0.0 } else { 1.0 };
        let zero = if tared { 0.0 } else { weights.sum * weights.sum * unit };
        let placed = weights.of_slope * weights.of_slope;
        let parts: [f64; PARTS] = [
            weights.of_noise * unit,
            weights.of_relative,
            placed,
            of_run * placed,
            of_run * zero,
            of_run * weights.of_signal * weights.of_signal,
        ];
        self.tails.longer(parts, variance)
    }

    /// As [`Self::moved`], of the sensor without contact: signal, variance of its noise, shared numbers.
    pub fn rest(&self, tared: bool) -> Vec<f64> {
        let zero = self.terms.iter().position(|t| *t == Term::Zero).filter(|_| !tared);
        let of = |coefficients: &[f64]| zero.map_or(0.0, |k| self.unit * coefficients[k]);
        let mut all = vec![of(&self.mean), self.unit * self.unit * self.spread.floor];
        all.extend(self.deviations.iter().map(|d| of(d)));
        all.extend([0.0; OF_RUN]);
        all.push(if tared { 0.0 } else { self.unit * self.spread.zero.sqrt() });
        all
    }

    /// By how much the drive is off. Where all taps have one drive nothing tells it: its own deviation is what is usual.
    pub fn offset(&self, base: &Base) -> Offset {
        let size = self.scales.sizes[1];
        let mut moved = vec![0.0; self.shared()];
        let Some(k) = self.terms.iter().position(|t| *t == Term::OffsetU) else {
            return Offset { mean: base.offset(), moved, own: size * OFFSETS[1] };
        };
        moved.iter_mut().zip(&self.deviations).for_each(|(moved, d)| *moved = size * d[k]);
        Offset { mean: base.offset() + size * self.mean[k], moved, own: 0.0 }
    }

    /// Coefficient of `term` and its standard deviation; `None` where it is no term.
    pub fn coefficient(&self, term: Term) -> Option<[f64; 2]> {
        let k = self.terms.iter().position(|t| *t == term)?;
        Some([self.mean[k], self.deviations.iter().map(|d| d[k] * d[k]).sum::<f64>().sqrt()])
    }

    /// The zero of the signal and its standard deviation, in its unit.
    pub fn zero(&self) -> [f64; 2] {
        let [mean, sd] = self.coefficient(Term::Zero).unwrap_or([0.0; 2]);
        [self.zero + self.unit * mean, self.unit * sd]
    }
}
