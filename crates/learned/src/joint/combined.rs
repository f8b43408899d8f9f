//! What taps by known drives tell together, as tables: for a program that knows nothing of a model.

use nalgebra::{DMatrix, DVector};

use super::Joint;
use crate::invert::POINTS;

/// At each point in ln a: ln of the posterior of signals y is `height` − ½ |`root` (y − `signals`)|².
#[derive(Debug, Clone)]
pub struct Combined {
    /// Signal of each tap.
    pub signals: Vec<Vec<f64>>,
    /// ln of the prior and of the density at its middle.
    pub heights: Vec<f64>,
    /// Inverse of Cholesky's factor of the covariance, its lower triangle row by row.
    pub roots: Vec<Vec<f64>>,
}

impl Joint {
    /// Of taps by `drives`, each of a new run, above one zero that is known; `None` where a covariance has no root.
    pub fn combined(&self, drives: &[f64]) -> Option<Combined> {
        let (n, width) = (drives.len(), self.width());
        let slices: Vec<Vec<f64>> = drives.iter().map(|u| self.slice(*u, false, 0..POINTS)).collect();
        let mut all = Combined { signals: Vec::new(), heights: Vec::new(), roots: Vec::new() };
        for k in 0..POINTS {
            let points: Vec<&[f64]> = slices.iter().map(|s| &s[k * width..(k + 1) * width]).collect();
            let shared = DMatrix::from_fn(n, width - 2, |i, j| points[i][2 + j]);
            let noise = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| points[i][1]));
            let factor = (&shared * shared.transpose() + noise).cholesky()?.l();
            let root = factor.solve_lower_triangular(&DMatrix::identity(n, n))?;
            all.signals.push(points.iter().map(|p| p[0]).collect());
            all.heights.push(
                self.prior(self.x(k), [0.0; 2]) - factor.diagonal().iter().map(|x| x.ln()).sum::<f64>(),
            );
            all.roots.push((0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| root[at]).collect());
        }
        Some(all)
    }
}
