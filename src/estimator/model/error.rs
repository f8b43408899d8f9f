//! Why a model cannot answer.

use crate::error::{Error, SolveError};

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
