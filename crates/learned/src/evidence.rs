//! Restricted likelihood of the learned numbers, its gradient, and the posterior of the coefficients, at a cost of cells · columns².
//! B = 1 + Λ^½ Hᵀ W H Λ^½, with columns H, prior variances Λ and variances W⁻¹ of readings, gives both determinant and covariance.
//! Learned are standard deviations and length scales of the rig, each with a log-normal prior in units of the signal. No prior was fitted to data. A
//! spread of 1.5 in ln allows a factor of 20 either way within two standard deviations.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::columns::{Column, Columns, Term, WAVES, frequency};
use crate::{fit::Start, rows::Cell};

/// Least variance of a reading, in units of the signal squared: curves are solved to a relative 1e-7.
const LEAST: f64 = 1e-14;

pub(crate) fn ln_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>()
}

pub struct Problem {
    pub model: Columns,
    y: DVector<f64>,
    repeats: Vec<[f64; 2]>,
    size2: Vec<f64>,
    /// Variance of the quantisation.
    pub steps: f64,
    pub priors: Vec<Prior>,
}

/// Coefficients for given learned numbers.
pub struct Solved {
    /// −ln(likelihood × prior).
    pub value: f64,
    pub mean: DVector<f64>,
    root: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Measured − expected signal of each cell.
    pub residual: DVector<f64>,
    pub variance: Vec<f64>,
    scaled: DMatrix<f64>,
}

impl Solved {
    /// L⁻¹ of B = L Lᵀ, rows and columns from `from` on; B⁻¹ itself is not needed.
    fn inverse_factor(&self, from: usize) -> DMatrix<f64> {
        let l = self.factor.l_dirty();
        let n = l.nrows() - from;
        let below = l.view((from, from), (n, n));
        below.solve_lower_triangular(&DMatrix::identity(n, n)).expect("a factor has no zeros on its diagonal")
    }

    pub fn covariance(&self, places: &[usize]) -> DMatrix<f64> {
        let from = places.iter().copied().min().unwrap_or(0);
        let own: Vec<usize> = places.iter().map(|place| place - from).collect();
        let mut halves = self.inverse_factor(from).select_columns(&own);
        places.iter().zip(halves.column_iter_mut()).for_each(|(p, mut column)| column *= self.root[*p]);
        halves.transpose() * &halves
    }

    /// Variance of the expected signal of each cell, from all data.
    pub fn leverage(&self, repeats: impl Fn(usize) -> f64) -> Vec<f64> {
        let t = self.inverse_factor(0) * self.scaled.transpose();
        let of = |i: usize| t.column(i).norm_squared() * self.variance[i] / repeats(i);
        (0..self.scaled.nrows()).map(of).collect()
    }
}

impl Problem {
    /// Problem of `cells` with signals (y − zero)/unit; `step` is that of the converter, `position` the prior of errors of labels.
    pub fn new(model: Columns, cells: &[Cell], start: &Start, step: f64, position: Prior) -> Self {
        let ([unit, zero, _], known) = (start.numbers, start.power.is_none());
        let mut priors: Vec<Prior> = model.hypers.iter().map(|h| Prior::new(h.prior(known))).collect();
        if let Some(k) = model.hypers.iter().position(|h| *h == Hyper::Position) {
            priors[k] = position;
        }
        let curve = model.columns.iter().position(|c| c.term == Term::Curve(0, 0));
        let size2 = (0..cells.len()).map(|i| curve.map_or(0.0, |j| model.matrix[(i, j)].powi(2))).collect();
        let y = DVector::from_iterator(cells.len(), cells.iter().map(|c| (c.row.y - zero) / unit));
        let repeats = cells.iter().map(|c| [c.n, c.squares / (unit * unit)]).collect();
        Self { y, repeats, size2, steps: (step / unit).powi(2) / 12.0, priors, model }
    }

    fn place(&self, hyper: Hyper) -> Option<usize> {
        self.model.hypers.iter().position(|h| *h == hyper)
    }

    /// ln share of each wave in the variance and its derivative by ln length, in ln a and ln u: a Matérn process of order 9/2, too smooth for noise.
    fn spectra(&self, at: &[f64]) -> [(Vec<f64>, Vec<f64>); 2] {
        let spectrum = |hyper: Hyper, n: usize| {
            let Some(k) = self.place(hyper) else { return (vec![0.0; n], vec![0.0; n]) };
            // Lengths are in ranges, frequencies in 1/half range.
            let length = 2.0 * at[k].exp();
            let x: Vec<f64> = (0..n).map(|k| (frequency(k) * length).powi(2)).collect();
            let density: Vec<f64> = x.iter().map(|x| (9.0 + x).powi(-5)).collect();
            let sum: f64 = density.iter().sum();
            let rise = |x: &f64| -10.0 * x / (9.0 + x);
            let mean = density.iter().zip(&x).map(|(d, x)| d / sum * rise(x)).sum::<f64>();
            (density.iter().map(|d| (d / sum).ln()).collect(), x.iter().map(|x| rise(x) - mean).collect())
        };
        [spectrum(Hyper::LengthA, WAVES[0]), spectrum(Hyper::LengthU, WAVES[1])]
    }

    /// Learned number itself, not its logarithm; 0 if not learned.
    pub fn learned(&self, at: &[f64], hyper: Hyper) -> f64 {
        self.place(hyper).map_or(0.0, |k| at[k].exp())
    }

    /// Variance of one reading of each cell.
    pub fn variances(&self, at: &[f64]) -> Vec<f64> {
        let [floor, relative] = [Hyper::Floor, Hyper::Relative].map(|h| self.learned(at, h).powi(2));
        self.size2.iter().map(|m| floor + relative * m + self.steps + LEAST).collect()
    }

    /// Prior standard deviations of the coefficients.
    pub fn roots(&self, at: &[f64]) -> DVector<f64> {
        let spectra = self.spectra(at);
        let of_prior = |c: &Column| {
            let wave = match c.term {
                Term::Wave(j, k) => spectra[0].0[usize::from(j)] + spectra[1].0[usize::from(k)],
                _ => 0.0,
            };
            (0.5 * (c.fixed + wave) + c.learned.iter().map(|k| at[*k]).sum::<f64>()).exp()
        };
        DVector::from_iterator(self.model.columns.len(), self.model.columns.iter().map(of_prior))
    }

    /// Likelihood, prior and coefficients; `None` on overflow.
    pub fn solve(&self, at: &[f64]) -> Option<Solved> {
        let h = &self.model.matrix;
        let variance = self.variances(at);
        let root = self.roots(at);
        let weight: Vec<f64> = variance.iter().zip(&self.repeats).map(|(v, r)| (r[0] / v).sqrt()).collect();
        let mut scaled = h.clone();
        for (j, mut column) in scaled.column_iter_mut().enumerate() {
            column.iter_mut().zip(&weight).for_each(|(x, w)| *x *= w * root[j]);
        }
        let b = scaled.transpose() * &scaled + DMatrix::identity(h.ncols(), h.ncols());
        let factor = b.cholesky()?;
        let wy = DVector::from_iterator(weight.len(), weight.iter().zip(self.y.iter()).map(|(w, y)| w * y));
        let mut coefficients = factor.solve(&scaled.tr_mul(&wy));
        // One step of iterative refinement: flat columns lose digits.
        let left = &wy - &scaled * &coefficients;
        coefficients += factor.solve(&(scaled.tr_mul(&left) - &coefficients));
        let weighted = &wy - &scaled * &coefficients;
        let mut twice = weighted.norm_squared() + coefficients.norm_squared();
        twice += ln_det(&factor);
        for (v, [n, squares]) in variance.iter().zip(&self.repeats) {
            twice += n * v.ln() + squares / v;
        }
        twice += at.iter().zip(&self.priors).map(|(x, prior)| prior.twice(*x)).sum::<f64>();
        let mean = coefficients.component_mul(&root);
        let left = weighted.iter().zip(&weight).map(|(e, w)| if *w > 0.0 { e / w } else { 0.0 });
        let residual = DVector::from_iterator(weight.len(), left);
        let value = 0.5 * twice;
        value.is_finite().then_some(Solved { value, mean, root, factor, residual, variance, scaled })
    }

    /// Gradient of [`Solved::value`] by the logarithms of the learned numbers.
    pub fn gradient(&self, at: &[f64], solved: &Solved) -> Vec<f64> {
        let inverse = solved.inverse_factor(0);
        let mut gradient: Vec<f64> = at.iter().zip(&self.priors).map(|(x, prior)| prior.slope(*x)).collect();
        let spectra = self.spectra(at);
        let lengths = [Hyper::LengthA, Hyper::LengthU].map(|h| self.place(h));
        for (j, column) in self.model.columns.iter().enumerate().filter(|(_, c)| !c.learned.is_empty()) {
            let coefficient = solved.mean[j] / solved.root[j];
            let slope = 1.0 - (coefficient * coefficient + inverse.column(j).norm_squared());
            column.learned.iter().for_each(|k| gradient[*k] += slope);
            if let Term::Wave(j, k) = column.term {
                for ((length, (_, rises)), n) in lengths.iter().zip(&spectra).zip([j, k]) {
                    length.iter().for_each(|l| gradient[*l] += 0.5 * slope * rises[usize::from(n)]);
                }
            }
        }
        let t = &inverse * solved.scaled.transpose();
        let places = [Hyper::Floor, Hyper::Relative].map(|h| self.place(h));
        let [floor, relative] = [Hyper::Floor, Hyper::Relative].map(|h| self.learned(at, h).powi(2));
        for (i, v) in solved.variance.iter().enumerate() {
            let [n, squares] = self.repeats[i];
            let leverage = t.column(i).norm_squared();
            let slope = (n - squares / v - n * solved.residual[i].powi(2) / v - leverage) / v;
            for (place, part) in places.iter().zip([floor, relative * self.size2[i]]) {
                place.iter().for_each(|k| gradient[*k] += slope * part);
            }
        }
        gradient
    }
}

/// Prior of the logarithm of a learned number: normal, with different spreads below and above its median.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Median, in ln.
    pub median: f64,
    pub below: f64,
    pub above: f64,
}

impl Prior {
    pub fn new([median, spread]: [f64; 2]) -> Self {
        Self { median, below: spread, above: spread }
    }

    fn spread(&self, x: f64) -> f64 {
        if x < self.median { self.below } else { self.above }
    }

    /// −2 ln(density at `x` / density at the median).
    pub fn twice(&self, x: f64) -> f64 {
        ((x - self.median) / self.spread(x)).powi(2)
    }

    /// Half of the derivative of [`Self::twice`].
    pub fn slope(&self, x: f64) -> f64 {
        (x - self.median) / self.spread(x).powi(2)
    }

    pub fn width(&self) -> f64 {
        0.5 * (self.below + self.above)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hyper {
    /// Noise of every reading, independent of the signal.
    Floor,
    /// Noise in proportion to the signal.
    Relative,
    /// Size of a quadratic in ln a.
    Bend,
    /// Size of the terms of the quadratic that contain ln u.
    Twist,
    /// Size of the smooth deviation beyond the quadratic.
    Deviation,
    /// Length of the deviation in ln a, in ranges of the data.
    LengthA,
    /// Length of the deviation in ln u, in ranges of the data.
    LengthU,
    /// Error of a position: of its label, or of the setup of the object.
    Position,
    /// Error of a position in one run only.
    Visit,
    RunZero,
    RunGain,
    /// Zero of the signal where no row is without contact.
    Zero,
    /// Drift of the zero from the first row to the last.
    Drift,
}

impl Hyper {
    /// Median (ln) and spread of the prior; `known` is true for the curve of a known whisker.
    pub fn prior(self, known: bool) -> [f64; 2] {
        let (median, spread) = match self {
            // A strain gauge on a rig: a few 1e-3 of a tap; 1e-5 with an averaging bridge, a few 1e-2 with a magnetometer.
            Self::Floor => (2e-3, 2.0),
            Self::Relative => (3e-3, 2.0),
            // A spec is right to a few per cent; a power law is wrong by as much as the true curve bends over the range.
            Self::Bend | Self::Twist | Self::Deviation if known => (0.02, 1.5),
            Self::Bend => (0.1, 1.5),
            // The signal follows the drive more closely than the distance.
            Self::Twist => (0.03, 1.5),
            Self::Deviation => (0.07, 1.5),
            // A whisker's curve has no feature shorter than the range of the data unless the data show one.
            Self::LengthA | Self::LengthU => (2.5, 0.7),
            // A stage repeats 30 mm to 0.05 mm; a hand, or a wrong label, to a few mm.
            Self::Position => (1.5e-3, 2.0),
            Self::Visit | Self::RunGain | Self::RunZero => (3e-3, 1.5),
            Self::Zero => (3e-2, 3.0),
            Self::Drift => (3e-3, 1.5),
        };
        [f64::ln(median), spread]
    }
}
