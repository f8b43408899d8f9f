//! Rows of one design: K and its spread per drive and per distance, distance errors, extremes (model §4).
//!
//! Two passes over the taps of a design, in any order: [`Tally::count`] gathers K, then every row has its K̄, and
//! [`Tally::estimate`] gathers the errors of the distances estimated with it.

use crate::design::amount;
use crate::estimate::{Estimated, Estimator};
use crate::evaluate::Outcome;
use crate::reduce::{Errors, Largest, Spread};
use crate::scene::Drive;
use crate::status::Status;

/// Statistics of a design at one drive, over its distances: a row of designs.csv.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveRow {
    /// Taps asked.
    pub asked: u64,
    /// K − 1 of the taps that count.
    pub deviation: Spread,
    strain: Largest,
    force: Largest,
    errors: Errors,
    noise: Errors,
    /// K̄ used by the estimate, without unit.
    pub k: Option<f64>,
    /// A counting tap had no root.
    incomplete: bool,
    /// Union of its taps' words.
    pub status: Status,
}

impl DriveRow {
    /// Largest |strain| of the counting taps.
    pub fn strain_max(&self) -> Option<f64> {
        self.strain.get()
    }

    /// Largest contact force of the counting taps, N.
    pub fn force_max(&self) -> Option<f64> {
        self.force.get()
    }

    fn whole<T>(&self, value: Option<T>) -> Option<T> {
        value.filter(|_| !self.incomplete)
    }

    /// Root mean square of â − a, mm.
    pub fn error_rms(&self) -> Option<f64> {
        self.whole(self.errors.rms())
    }

    /// Largest |â − a|, mm.
    pub fn error_max(&self) -> Option<f64> {
        self.whole(self.errors.largest())
    }

    /// Mean of â − a, mm.
    pub fn error_mean(&self) -> Option<f64> {
        self.whole(self.errors.mean())
    }

    /// Root mean square of σ_a, mm.
    pub fn noise_rms(&self) -> Option<f64> {
        self.whole(self.noise.rms())
    }

    /// Errors and noise in quadrature, mm.
    pub fn total_rms(&self) -> Option<f64> {
        Some(self.error_rms()?.hypot(self.noise_rms()?))
    }
}

/// Statistics of a design at one distance, over its drives: a row of distances.csv.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DistanceRow {
    /// K − 1 of the taps that count.
    pub deviation: Spread,
    /// Union of its taps' words.
    pub status: Status,
}

/// All rows of one design.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// One per drive.
    pub drives: Vec<DriveRow>,
    /// One per distance.
    pub distances: Vec<DistanceRow>,
}

impl Tally {
    /// Of a design with so many distances and drives.
    pub fn new(distances: usize, drives: usize) -> Self {
        Self { drives: vec![DriveRow::default(); drives], distances: vec![DistanceRow::default(); distances] }
    }

    /// First pass: the tap at distance `i`, drive `j`.
    pub fn count(&mut self, i: usize, j: usize, tap: &Outcome) {
        let (row, distance) = (&mut self.drives[j], &mut self.distances[i]);
        row.asked += 1;
        row.status |= tap.status;
        distance.status |= tap.status;
        if tap.status.counts() {
            row.deviation.push(tap.deviation);
            distance.deviation.push(tap.deviation);
            row.strain.push(tap.strain.abs());
            row.force.push(tap.normal_force);
        }
    }

    /// Between the passes: K̄ of every row; none for a design that is no whisker.
    pub fn calibrate(&mut self, estimator: Option<&Estimator<'_>>) {
        for row in &mut self.drives {
            row.k = estimator.and_then(|e| e.calibration(row.deviation.n, row.deviation.mean()));
        }
    }

    /// Second pass: the estimate of the tap at distance `i` (`a` mm), drive `j` (`drive` in degrees or mm).
    pub fn estimate(
        &mut self,
        (i, j): (usize, usize),
        (a, kind, drive): (f64, Drive, f64),
        tap: &Outcome,
        estimator: Option<&Estimator<'_>>,
    ) -> Estimated {
        let row = &mut self.drives[j];
        let readable = tap.strain != 0.0 && tap.strain.is_finite() && !tap.status.has(Status::NO_STRAIN);
        let estimated = match (row.k, estimator) {
            (Some(k), Some(e)) if readable => e.estimate(k, tap.strain.abs(), amount(kind, drive)),
            _ => Estimated { distance: f64::NAN, sigma: f64::NAN, status: Status::OK },
        };
        row.status |= estimated.status;
        self.distances[i].status |= estimated.status;
        if row.k.is_some() && tap.status.counts() {
            if estimated.distance.is_finite() {
                row.errors.push(estimated.distance - a);
                row.noise.push(estimated.sigma);
            } else {
                row.incomplete = true;
            }
        }
        estimated
    }
}
