//! Why a row is not used.

use crate::fields::plain;
use crate::scene::Drive;

/// A reason, with what makes it plausible.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// A field is empty or no finite number.
    NotANumber,
    /// It stands for no value: what is usual for that, or the same value at several places, far from all others.
    Missing(f64),
    /// The labels lie outside the whisker or outside the domain of the drive.
    OutsideDomain,
    /// The contact is at or inside the gauge's near end.
    NoStrain,
    /// The signal is exactly zero although there is contact.
    ZeroSignal,
    /// The sign is that of the other side, of which there is too little to calibrate.
    OtherSide,
    /// The sensor stands at its end stop.
    Saturated,
    /// Off by so many decades: another unit.
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
    /// The reason in one word.
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

    /// Whether the row is in doubt, and not only of no use here.
    pub fn is_doubt(&self) -> bool {
        *self != Self::Tilted
    }

    /// The reason and what makes it plausible, for a table.
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
