//! Why a model cannot answer.

use crate::error::Error;
use crate::evaluate::TOO_HARD;

/// Why a model could not be solved over the distances and drives of interest.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// There is no distance beyond the gauge.
    #[error("all distances lie at or inside the gauge")]
    InsideGauge,
    /// The taper ends before the distances do.
    #[error("the whisker cannot be continued so far")]
    TooFar,
    /// Too many taps have no solution, or only the reference finds it.
    #[error("{TOO_HARD}")]
    TooHard,
    /// A backend that fails, in its own words.
    #[error("{0}")]
    Backend(String),
    /// No backend could be opened.
    #[error(transparent)]
    NotOpened(#[from] Error),
}

/// Of what an evaluator says.
impl From<String> for ModelError {
    fn from(why: String) -> Self {
        if why == TOO_HARD { Self::TooHard } else { Self::Backend(why) }
    }
}

impl From<ModelError> for Error {
    fn from(e: ModelError) -> Self {
        match e {
            ModelError::NotOpened(e) => e,
            other => Self::Run(other.to_string()),
        }
    }
}
