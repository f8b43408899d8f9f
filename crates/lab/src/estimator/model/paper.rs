//! `paper` and `timoshenko`: one K per drive, and the closed form of a theory (model §4): f(â) = K̄ |ε|/θ.

use super::{Found, between};
use crate::design::amount;
use crate::measure::Rig;
use crate::physics::inverse::Inverse;
use crate::scene::Theory;

/// K̄ over the calibrated drives.
#[derive(Debug, Clone)]
pub struct Factors {
    /// K̄_j, in drive order.
    pub k: Vec<f64>,
    /// Variance of ln K̄_j that the noise of the calibration leaves.
    pub variance: Vec<f64>,
}

/// A theory with its factors.
#[derive(Debug, Clone)]
pub struct Paper {
    inverse: Inverse,
    kind: crate::scene::Drive,
    drives: Vec<f64>,
    /// K̄ and its variance.
    pub factors: Factors,
}

impl Paper {
    /// `theory` of the whisker of `rig` with K̄ at `drives`, ascending.
    pub fn new(rig: &Rig, theory: Theory, drives: &[f64], factors: Factors) -> Self {
        let inverse = Inverse::new(rig.curve(theory, rig.setup.hub));
        Self { inverse, kind: rig.setup.drive, drives: drives.to_vec(), factors }
    }

    /// Distance at which the theory gives `reading` > 0.
    pub fn find(&self, drive: f64, reading: f64) -> Option<Found> {
        let k = between(&self.drives, &self.factors.k, drive);
        let amount = amount(self.kind, drive);
        let roots = self.inverse.roots(k * reading / amount)?;
        let slope = amount * self.inverse.curve().slope(roots.far) / k;
        let variance = between(&self.drives, &self.factors.variance, drive);
        // A distance on the near side may belong to one beyond the calibration.
        let near = roots.near.or(roots.unseen.then_some(roots.far));
        Some(Found {
            a: roots.far,
            near,
            slope,
            variance: reading * reading * variance,
            sigma: f64::NAN,
            ends: [f64::NAN; 2],
            wide: false,
        })
    }

    /// Variance of the expected reading that the noise of the calibration leaves.
    pub fn variance(&self, a: f64, drive: f64) -> f64 {
        self.expected(a, drive).powi(2) * between(&self.drives, &self.factors.variance, drive)
    }

    /// Reading that the theory expects at a, mm.
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        amount(self.kind, drive) * self.inverse.curve().value(a)
            / between(&self.drives, &self.factors.k, drive)
    }
}
