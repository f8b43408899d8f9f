//! What a sensor reads.

/// What the sensor of a whisker reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Signal {
    /// Mean strain under a gauge.
    #[default]
    Strain,
    /// M₀, the moment at the base, N·mm.
    Moment,
    /// F_y, the force across the whisker at the base, N.
    Force,
}

impl Signal {
    /// All, by the words of a spec.
    pub const WORDS: [(&'static str, Self); 3] =
        [("strain", Self::Strain), ("moment", Self::Moment), ("force", Self::Force)];

    /// The word of a spec.
    pub fn word(self) -> &'static str {
        Self::WORDS[self as usize].0
    }

    /// Its unit; none of a strain.
    pub fn unit(self) -> &'static str {
        ["", "N mm", "N"][self as usize]
    }

    /// The quantity that `reads` stands for in [M₀, F_x, F_y].
    pub fn of(self, [moment, _, across]: [f64; 3]) -> Option<f64> {
        match self {
            Self::Strain => None,
            Self::Moment => Some(moment),
            Self::Force => Some(across),
        }
    }
}
