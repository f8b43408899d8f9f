//! Statistics by which charts rank rows.

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
    /// All, with their names in shaders.
    pub const NAMED: [(&str, Self); 4] = [
        ("ERROR_RMS", Self::Rms),
        ("ERROR_MAX", Self::Max),
        ("NOISE_RMS", Self::Noise),
        ("TOTAL_RMS", Self::Total),
    ];

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
}
