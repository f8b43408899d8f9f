//! Status words: the closed list of errors of a row.

use std::fmt;

/// A set of status words; `ok` when empty.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash, serde::Serialize, serde::Deserialize,
)]
pub struct Status(u16);

macro_rules! status {
    ($($(#[$doc:meta])+ $name:ident = $bit:literal, $word:literal;)+) => {
        impl Status {
            $($(#[$doc])+ pub const $name: Self = Self(1 << $bit);)+

            /// All words in the order in which tables join them.
            pub const ALL: [(Self, &str); [$($bit),+].len()] = [$((Self::$name, $word)),+];
        }
    };
}

status! {
    /// The tuple lies outside its domain.
    INVALID_GEOMETRY = 0, "invalid_geometry";
    /// The contact is at or inside the gauge's near end.
    NO_STRAIN = 1, "no_strain";
    /// The tolerance was not met.
    NOT_CONVERGED = 2, "not_converged";
    /// A fibre leaves the range of its material law.
    MATERIAL_LIMIT = 3, "material_limit";
    /// The contact has reached a corner of a tabled profile, which is not modelled.
    AT_KNOT = 10, "at_knot";
    /// The contact has run past the tip (c > L_a); values are those of a continued taper.
    SLIPPED_OFF = 4, "slipped_off";
    /// |strain| exceeds the gauge's limit.
    STRAIN_LIMIT = 5, "strain_limit";
    /// No distance gives this reading.
    NO_ROOT = 6, "no_root";
    /// A second distance in the range of interest gives this reading, or one beyond the farthest that is known.
    AMBIGUOUS = 7, "ambiguous";
    /// The drive, the side or the distance lies outside the calibration, or beyond a widening whisker.
    OUTSIDE_CALIBRATION = 8, "outside_calibration";
    /// Taps of one object contradict each other.
    INCONSISTENT = 11, "inconsistent";
    /// The input line could not be read.
    BAD_INPUT = 9, "bad_input";
}

impl Status {
    /// Nothing to report.
    pub const OK: Self = Self(0);

    /// Words of taps without a strain that changes smoothly with its inputs. Past the tip it does, on the continued taper.
    pub const NO_READING: Self =
        Self(Self::INVALID_GEOMETRY.0 | Self::NO_STRAIN.0 | Self::NOT_CONVERGED.0 | Self::MATERIAL_LIMIT.0);

    /// A bit a word. Python has the same: a new word takes the next bit, wherever it stands among the words.
    pub fn bits(self) -> u16 {
        self.0
    }

    /// True if a word of `other` is in this set.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// This set less the words of `other`.
    pub fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The words of this set that `other` has too.
    pub fn only(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// True if the tap enters the statistics of its row.
    pub fn counts(self) -> bool {
        !self.has(Self::NO_READING | Self::AT_KNOT | Self::SLIPPED_OFF)
    }

    /// True if a tap strains the gauge beyond its limit.
    pub fn is_strained(self) -> bool {
        self.has(Self::STRAIN_LIMIT)
    }

    /// The set of the words that `text` joins by `+`; unknown words are skipped.
    pub fn of_words(text: &str) -> Self {
        let known = Self::ALL.iter().filter(|(_, word)| text.split('+').any(|w| w == *word));
        known.fold(Self::OK, |all, (one, _)| all | *one)
    }

    /// Words of this set, in order; empty for `ok`.
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        Self::ALL.into_iter().filter(move |(s, _)| self.has(*s)).map(|(_, w)| w)
    }
}

impl std::ops::BitOr for Status {
    type Output = Self;
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
}

impl std::ops::BitOrAssign for Status {
    fn bitor_assign(&mut self, o: Self) {
        self.0 |= o.0;
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::OK => f.write_str("ok"),
            _ => f.write_str(&self.words().collect::<Vec<_>>().join("+")),
        }
    }
}
