//! What is a polynomial of what in [`super::polynomial`].

use serde::{Deserialize, Serialize};

use crate::error::{Error, SolveError};

/// Highest total degree that is tried.
const DEGREES: usize = 4;

/// What is a polynomial of what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Form {
    /// Total degree in ln signal and the drive.
    pub degree: usize,
    /// Degree in the drive.
    pub drive_degree: usize,
    /// Whether ln a is fitted, in place of a.
    pub log_a: bool,
    /// Whether ln drive counts, in place of the drive.
    pub log_drive: bool,
}

impl Form {
    /// Exponents of ln signal and the drive, term by term.
    pub(super) fn powers(&self) -> Vec<[i32; 2]> {
        let to = |i: usize| self.drive_degree.min(self.degree.saturating_sub(i));
        (0..=self.degree).flat_map(|i| (0..=to(i)).map(move |j| [i as i32, j as i32])).collect()
    }

    /// Number of terms, of any degrees that a file may hold.
    pub fn terms_in_all(&self) -> usize {
        let most = self.drive_degree.min(self.degree);
        let all = (most + 1).saturating_mul(self.degree.saturating_add(1));
        all.saturating_sub(most.saturating_mul(most + 1) / 2)
    }

    /// All that are tried where there are so many positions and drives, the simplest first.
    pub(super) fn all(positions: usize, drives: usize) -> Vec<Self> {
        let mut all = Vec::new();
        for degree in 1..=DEGREES.min(positions.saturating_sub(2)).max(1) {
            for log_a in [true, false] {
                for log_drive in [false, true] {
                    let drive_degree = degree.min(drives.saturating_sub(1));
                    if drives > 1 || !log_drive {
                        all.push(Self { degree, drive_degree, log_a, log_drive });
                    }
                }
            }
        }
        all
    }
}

impl Form {
    pub(super) fn drive(&self, drive: f64) -> f64 {
        if self.log_drive { drive.ln() } else { drive }
    }

    /// What is fitted of a distance.
    pub(super) fn target(&self, a: f64) -> f64 {
        if self.log_a { a.ln() } else { a }
    }

    pub(super) fn distance(&self, y: f64) -> f64 {
        if self.log_a { y.exp() } else { y }
    }

    /// Terms at ln signal = `x`, and their slopes over x.
    pub(super) fn terms(
        &self,
        powers: &[[i32; 2]],
        scale: [[f64; 2]; 2],
        x: f64,
        drive: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let [[x0, dx], [v0, dv]] = scale;
        let (u, v) = ((x - x0) / dx, (self.drive(drive) - v0) / dv);
        let term = |[i, j]: &[i32; 2]| u.powi(*i) * v.powi(*j);
        let slope =
            |[i, j]: &[i32; 2]| if *i == 0 { 0.0 } else { f64::from(*i) * u.powi(i - 1) * v.powi(*j) / dx };
        (powers.iter().map(term).collect(), powers.iter().map(slope).collect())
    }
}

/// Why a model could not be solved over the distances and drives of interest.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// There is no distance beyond the gauge.
    #[error("all distances lie at or inside the gauge")]
    InsideGauge,
    /// The taper ends before the distances do.
    #[error("the whisker cannot be continued so far")]
    TooFar,
    /// Most taps that were measured have no solution.
    #[error("the model of the spec has solutions for {found} of {of} measured distances and drives")]
    FewTaps {
        /// Those that have.
        found: usize,
        /// All.
        of: usize,
    },
    /// Its taps cannot be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// No backend could be opened.
    #[error(transparent)]
    NotOpened(#[from] Error),
}

impl ModelError {
    /// Whether it says that this whisker has no such taps, and not that the computer failed.
    pub fn is_of_whisker(&self) -> bool {
        match self {
            Self::InsideGauge | Self::TooFar | Self::FewTaps { .. } | Self::Solve(SolveError::TooHard) => {
                true
            }
            Self::Solve(_) | Self::NotOpened(_) => false,
        }
    }

    /// What was found, if the whisker has it.
    ///
    /// # Errors
    /// What [`Self::is_of_whisker`] is false of.
    pub fn of_run<T>(found: Result<T, Self>) -> Result<Option<T>, Error> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(e) if e.is_of_whisker() => Ok(None),
            Err(e) => Err(e.into()),
        }
    }
}

impl From<ModelError> for Error {
    fn from(e: ModelError) -> Self {
        match e {
            ModelError::NotOpened(e) => e,
            ModelError::Solve(e) => e.into(),
            other => Self::Run(other.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_counted_without_listing_them() {
        for degree in 0..=5 {
            for drive_degree in 0..=6 {
                let form = Form { degree, drive_degree, log_a: true, log_drive: false };
                assert_eq!(form.terms_in_all(), form.powers().len(), "{form:?}");
            }
        }
        // A number that a fuzzer wrote into a calibration, whose terms took 18 s and 1 GB.
        let form = Form { degree: 145_360_818, drive_degree: 1, log_a: false, log_drive: true };
        assert_eq!(form.terms_in_all(), 290_721_637);
        let most = i64::MAX as usize;
        Form { degree: most, drive_degree: most, log_a: false, log_drive: true }.terms_in_all();
    }
}
