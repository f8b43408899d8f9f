//! Statistics by which charts rank rows. A new one is added here, and in the two `match`es of `lanes/estimate.rs`.

use crate::scene::RankBy;

/// A statistic of the distance errors of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OfErrors {
    Rms,
    Max,
    Noise,
    Total,
}

impl OfErrors {
    /// The statistic of `by`; `Some(None)` for the spread of K, `None` where charts cannot rank.
    pub fn of(by: RankBy) -> Option<Option<Self>> {
        match by {
            RankBy::KSd => Some(None),
            RankBy::ErrorRms => Some(Some(Self::Rms)),
            RankBy::ErrorMax => Some(Some(Self::Max)),
            RankBy::NoiseRms => Some(Some(Self::Noise)),
            RankBy::TotalRms => Some(Some(Self::Total)),
            RankBy::StrainMax | RankBy::ForceMax => None,
        }
    }

    /// Its value in WGSL: `squares` and `noises` are the mean squares of errors and of noise, `largest` the largest absolute error.
    pub fn wgsl(self) -> &'static str {
        match self {
            Self::Rms => "sqrt(squares)",
            Self::Max => "largest",
            Self::Noise => "sqrt(noises)",
            Self::Total => "sqrt(squares + noises)",
        }
    }
}
