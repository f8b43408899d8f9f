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
    /// Its taps cannot be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// No backend could be opened.
    #[error(transparent)]
    NotOpened(#[from] Error),
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
