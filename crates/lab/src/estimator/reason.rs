//! Reasons for which a row is not used.

use crate::fields::plain;
use crate::scene::Drive;

/// Reason for which a row is not used, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// A field is empty or not a finite number.
    NotANumber,
    /// The value means "missing": a usual code, or one value at several places far from all others.
    Missing(f64),
    /// The labels are outside the whisker or the domain of the drive.
    OutsideDomain,
    /// The contact is at or inside the gauge's near end.
    NoStrain,
    /// The signal is exactly 0 despite contact.
    ZeroSignal,
    /// The sign is that of the other side, which has too few taps to be calibrated.
    OtherSide,
    /// The sensor is at its end stop.
    Saturated,
    /// The signal is off by this number of decades: another unit.
    Unit(i32),
    /// The signal fits another distance, mm.
    LooksLikeDistance(f64),
    /// The signal fits another drive.
    LooksLikeDrive(f64),
    /// Off the smooth surface through the other cells by this share.
    Off(f64),
    /// A zero reading off its neighbours.
    ZeroOutlier,
    /// The pole is tilted: such a row serves the second gauge only.
    Tilted,
}

impl Reason {
    /// Reason as one word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::NotANumber => "not_a_number",
            Self::Missing(_) => "missing_value",
            Self::OutsideDomain => "outside_domain",
            Self::NoStrain => "no_strain",
            Self::ZeroSignal => "zero_signal",
            Self::OtherSide => "opposite_sign",
            Self::Saturated => "saturated",
            Self::Unit(_) => "wrong_unit",
            Self::LooksLikeDistance(_) | Self::LooksLikeDrive(_) => "mislabelled",
            Self::Off(_) => "outlier",
            Self::ZeroOutlier => "zero_outlier",
            Self::Tilted => "tilted",
        }
    }

    /// True if the row is suspect; false if it is valid but not used here.
    pub fn is_doubt(&self) -> bool {
        *self != Self::Tilted
    }

    /// Reason with its evidence, for a table.
    pub fn text(&self, kind: Drive) -> String {
        let percent = |x: f64| format!("{:+.2} %", 100.0 * x);
        let more = match self {
            Self::Unit(decades) => format!("about 1e{decades} of what is expected"),
            Self::LooksLikeDistance(a) => format!("reads as a_mm = {a}"),
            Self::LooksLikeDrive(d) => format!("reads as {} = {d}", kind.column()),
            Self::Off(x) => format!("{} off the surface through the other rows", percent(*x)),
            Self::OutsideDomain => "a or the drive is outside the whisker or below zero".to_owned(),
            Self::Missing(x) => format!("{} stands for no value", plain(*x)),
            Self::Tilted => "for the second gauge only".to_owned(),
            _ => return self.word().to_owned(),
        };
        format!("{}: {more}", self.word())
    }
}
