//! A fit of the model: its parameters, what it leaves, and what follows from both.

use nalgebra::{DMatrix, DVector};

use super::learnt::Inverted;
use super::least;
use super::model::polynomial::Polynomial;
use crate::estimator::model::exact::{Exact, Parameter};

/// A fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model with its parameters.
    pub exact: Exact,
    /// Asked for, but not determined by the data: held at the spec's value.
    pub undetermined: Vec<Parameter>,
    /// Standard deviation of a cell beyond noise, relative to its signal.
    pub misfit: f64,
    /// χ² per degree of freedom with noise alone; NaN without noise or freedom.
    pub chi2: f64,
    /// Places of the cells that were fitted: those for which the model has solutions.
    pub cells: Vec<usize>,
    /// d reading/dp of each of these.
    pub slopes: DMatrix<f64>,
    /// measured − expected of each.
    pub residuals: DVector<f64>,
    /// Standard deviation of each.
    pub deviations: DVector<f64>,
}

/// A tap of a fitted cell.
#[derive(Debug, Clone, Copy)]
pub struct Ordered {
    /// Place of its cell among those that were fitted.
    pub cell: usize,
    /// Taps of this cell.
    pub of: f64,
    /// Place of the tap in the file.
    pub order: f64,
    /// Measured − expected.
    pub left: f64,
}

impl Fit {
    /// The constant of the signal, which was fitted, and its standard error where the zero may also drift in the order of `rows`: a straight
    /// drift over rows that go with the distance passes for one; and what both leave of each row. `None` where nothing tells them apart.
    pub fn constant(&self, rows: &[Ordered]) -> Option<([f64; 2], DVector<f64>)> {
        let k = self.exact.fitted.iter().position(|p| *p == Parameter::Zero)?;
        let (n, m) = (rows.len(), self.slopes.ncols());
        let middle = rows.iter().map(|r| r.order).sum::<f64>() / n as f64;
        let deviation = |r: &Ordered| self.deviations[r.cell] * r.of.sqrt();
        let entry = |r: &Ordered, j: usize| if j < m { self.slopes[(r.cell, j)] } else { r.order - middle };
        let design = DMatrix::from_fn(n, m + 1, |i, j| entry(&rows[i], j) / deviation(&rows[i]));
        let left = DVector::from_iterator(n, rows.iter().map(|r| r.left / deviation(r)));
        let (step, inverse) = least::solve(&design.tr_mul(&design), &design.tr_mul(&left))?;
        let freedom = n.checked_sub(m + 1).filter(|n| *n > 0)? as f64;
        let rest = left - &design * &step;
        let error = ((rest.norm_squared() / freedom).max(1.0) * inverse[(k, k)]).sqrt();
        let value = self.exact.values[Parameter::Zero as usize] + step[k];
        Some(([value, error], DVector::from_fn(n, |i, _| rest[i] * deviation(&rows[i]))))
    }

    /// Standard errors of the fitted parameters where the zero of the signal, of which every reading is taken off, has one itself: as if all
    /// were fitted together.
    pub fn errors(&self, zero: f64) -> Vec<f64> {
        let weights = self.deviations.map(|d| 1.0 / (d * d));
        let pulled = self.slopes.tr_mul(&weights);
        let c = &self.exact.covariance;
        let shift = |i: usize| zero * c[i].iter().zip(pulled.iter()).map(|(c, p)| c * p).sum::<f64>();
        (0..c.len()).map(|i| c[i][i].max(0.0).sqrt().hypot(shift(i))).collect()
    }
}

/// What answers one side.
pub enum Shape<'a> {
    /// Distance as a polynomial of signal and drive.
    Direct(&'a Polynomial),
    /// Signal as a function of distance and drive, read backwards.
    Inverted(&'a dyn Forward),
    /// The posterior of a learned curve, from a table.
    Learned(&'a Inverted),
}

impl<'a> Shape<'a> {
    /// The learned curve, if it is one.
    pub fn learned(self) -> Option<&'a Inverted> {
        match self {
            Self::Learned(curve) => Some(curve),
            _ => None,
        }
    }
}

/// How sure an estimator is of the signal that it expects.
pub trait Forward {
    /// Variance of the signal expected of a tap at a (mm) by `drive`, which the noise of the calibration leaves.
    fn variance(&self, a: f64, drive: f64) -> f64;
}
