//! Many distances read from charts at a few Leja points, by Lagrange's polynomials. Mean and covariance over distances are a linear and a quadratic
//! form of the values at the charts: a row costs about the same for 30 distances and for 1 000.

use nalgebra::{DMatrix, SymmetricEigen};

use super::adaptive;
use crate::physics::chebyshev::{basis, matrix, placed, points, scaled};
use crate::reduce::range;
use crate::scene::{Contact, Setup};

/// Fewest distances for which this pays; below, each has its chart.
pub const FEWEST: usize = 16;

/// Numbers of charts to try.
pub const NODES: [usize; 5] = [9, 11, 13, 16, 20];

/// Most distances.
pub const MOST: u64 = 4096;

/// Eigenvalues of a form below this share of the largest are dropped.
const LEAST: f64 = 1e-14;

/// Maps values at the charts to those at all distances.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    /// For each distance, the weight of each chart.
    pub weights: Vec<Vec<f64>>,
    /// Weight of each chart in the mean over the distances.
    pub mean: Vec<f64>,
    /// Rows F: for values v at the charts, less their mean, |F v|² is the sum of squares over the distances.
    pub squares: Vec<Vec<f64>>,
    /// Rows that give, from values at the charts, the coefficients of the polynomial over the distances.
    pub coefficients: Vec<Vec<f64>>,
    /// For each distance, Chebyshev's polynomials there.
    pub basis: Vec<Vec<f64>>,
    /// Largest error of the strain found at distances without a chart, relative.
    pub error: f64,
}

/// True if `distances` are many, and contacts do not choose between sliding and sticking, which has kinks along a.
pub fn fits(setup: &Setup, distances: &[f64]) -> bool {
    let smooth =
        matches!(setup.model.contact, Contact::Frictionless | Contact::Coulomb(0.0) | Contact::Stick);
    smooth && distances.len() >= FEWEST && distances.iter().any(|a| *a != distances[0])
}

/// The first `n` distances of charts between `near` and `far`, mm.
pub fn nodes([near, far]: [f64; 2], n: usize) -> Vec<f64> {
    // Clamped: the ends must not round.
    (0..n).map(|k| placed([near, far], adaptive::point(k)).clamp(near, far)).collect()
}

/// Weights of charts at `nodes` in a value at `a`.
pub fn weights(nodes: &[f64], a: f64) -> Vec<f64> {
    let ends = range(nodes.iter().copied());
    let place = |a: f64| scaled(ends, a);
    let at: Vec<f64> = nodes.iter().map(|node| place(*node)).collect();
    let x = place(a);
    let weight = |i: usize| -> f64 {
        (0..at.len()).filter(|j| *j != i).map(|j| (x - at[j]) / (at[i] - at[j])).product()
    };
    (0..at.len()).map(weight).collect()
}

impl Between {
    /// `distances` read from charts at `nodes`.
    pub fn new(nodes: &[f64], distances: &[f64], error: f64) -> Self {
        let weights: Vec<Vec<f64>> = distances.iter().map(|a| weights(nodes, *a)).collect();
        let (n, count) = (nodes.len(), distances.len());
        let mean = (0..n).map(|i| weights.iter().map(|w| w[i]).sum::<f64>() / count as f64).collect();
        let all = DMatrix::from_fn(count, n, |d, i| weights[d][i]);
        let form = SymmetricEigen::new(all.transpose() * all);
        let most = form.eigenvalues.iter().copied().fold(0.0, f64::max);
        let squares = (0..n)
            .filter(|k| form.eigenvalues[*k] > LEAST * most)
            .map(|k| (0..n).map(|i| form.eigenvalues[k].sqrt() * form.eigenvectors[(i, k)]).collect())
            .collect();
        let ends = range(nodes.iter().copied());
        let at_points = DMatrix::from_fn(n, n, |k, i| self::weights(nodes, placed(ends, points(n)[k]))[i]);
        let back = DMatrix::from_fn(n, n, |k, j| matrix(n)[k][j]) * at_points;
        let coefficients = (0..n).map(|k| back.row(k).iter().copied().collect()).collect();
        let basis = distances.iter().map(|a| basis(n, scaled(ends, *a))).collect();
        Self { weights, mean, squares, coefficients, basis, error }
    }
}
