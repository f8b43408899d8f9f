//! Curves of readings over distance and their inversion: closed forms, data, the exact model with fitted parameters.

pub mod exact;
pub mod parameter;
pub mod polynomial;
pub mod surface;

use crate::error::{Error, SolveError};

pub use vibrissa_learned::invert::Found;

pub(crate) use crate::measure::group::ROUNDING as SAME;

/// Linear interpolation of `ys` over ascending `xs`, held at both ends.
pub(crate) fn between(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let x = x.clamp(xs[0], xs[xs.len() - 1]);
    let j = xs.partition_point(|v| *v <= x).saturating_sub(1).min(xs.len().saturating_sub(2));
    match xs.get(j + 1) {
        Some(next) => ys[j] + (x - xs[j]) / (next - xs[j]) * (ys[j + 1] - ys[j]),
        None => ys[j],
    }
}

/// Failure to solve a model over the distances and drives of a side.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error("all distances lie at or inside the gauge")]
    InsideGauge,
    #[error("the whisker cannot be continued so far")]
    TooFar,
    /// Most measured taps have no solution.
    #[error("the model of the spec has solutions for {found} of {of} measured distances and drives")]
    FewTaps { found: usize, of: usize },
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error(transparent)]
    NotOpened(#[from] Error),
}

impl ModelError {
    /// True if the whisker has no such taps; false if the computation failed.
    pub fn is_of_whisker(&self) -> bool {
        match self {
            Self::Solve(why) => *why == SolveError::TooHard,
            Self::NotOpened(_) => false,
            Self::InsideGauge | Self::TooFar | Self::FewTaps { .. } => true,
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
