//! What a key may hold: the form of its value, from which the JSON Schema of specs is made.

use super::Section;
use crate::design::MOST;
use crate::scene::{Amount, Property, RankBy, Term};

/// A range of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Smallest and largest number.
    pub ends: [f64; 2],
    /// Whether the range excludes its lower and its upper end.
    pub open: [bool; 2],
}

/// Form of a value.
#[derive(Debug, Clone, Copy)]
pub enum Form {
    /// true or false.
    Flag,
    /// A text that is not empty.
    Text,
    /// A whole number from … to.
    Whole(u64, u64),
    /// A number.
    Number(Range),
    /// A number, or many of them: a list, a range or samples.
    Axis(Range),
    /// [smallest, largest].
    Ends(Range),
    /// As many numbers.
    Numbers(usize),
    /// One of these words.
    Words(&'static [&'static str]),
    /// Two or more different ones of these words.
    Several(&'static [&'static str]),
    /// From … to so many rows of numbers.
    Matrix(usize, usize),
    /// [[s, diameter], …].
    Pairs,
    /// An inline table, with at least and at most as many keys.
    Table(&'static Section, usize, usize),
    /// Any of these.
    Any(&'static [Form]),
}

/// `low` and larger numbers.
pub const fn from(low: f64) -> Range {
    within(low, MOST)
}

/// Numbers larger than `low`.
pub const fn above(low: f64) -> Range {
    Range { open: [true, false], ..from(low) }
}

/// Numbers from `low` to `high`, both included.
pub const fn within(low: f64, high: f64) -> Range {
    Range { ends: [low, high], open: [false; 2] }
}

/// Numbers between `low` and `high`, both excluded.
pub const fn between(low: f64, high: f64) -> Range {
    Range { ends: [low, high], open: [true; 2] }
}

/// Numbers from `low` up to, but not `high`.
pub const fn below(low: f64, high: f64) -> Range {
    Range { ends: [low, high], open: [false, true] }
}

/// Largest whole number.
pub const LARGEST: u64 = i64::MAX as u64;
/// Columns to rank by.
pub const RANKED: Form = Form::Words(&[
    "K_sd",
    "error_rms_mm",
    "error_max_mm",
    "noise_rms_mm",
    "total_rms_mm",
    "strain_max",
    "force_max_N",
    RankBy::BIAS,
]);
/// Any number that a whisker could have.
pub const ANY: Range = within(-MOST, MOST);
/// A number that is larger than zero.
pub const POSITIVE: Form = Form::Number(above(0.0));
/// A number that may be zero.
pub const NOT_NEGATIVE: Form = Form::Number(from(0.0));
/// An axis of lengths that are larger than zero.
pub const LENGTHS: Form = Form::Axis(above(0.0));
/// An axis of numbers that may be zero.
pub const PLACES: Form = Form::Axis(from(0.0));
/// Angles of the object's edge.
pub const LEANING: Form = Form::Axis(between(-90.0, 90.0));
/// Tap angles.
pub const ANGLES: Range = between(0.0, 90.0);

/// Values that `property` may have.
pub const fn of(property: Property) -> Range {
    match property {
        Property::Exponent => within(0.25, 4.0),
        Property::Scale => Range { open: [true, false], ..within(0.0, 1e3) },
        Property::CoreModulus => between(0.0, 1e7),
        Property::Curvature | Property::CurvatureSlope => within(-1.0, 1.0),
        Property::Turn | Property::Across | Property::Along | Property::Modulus => above(0.0),
        Property::Nu => within(0.0, 0.5),
        Property::Foil => between(0.0, 5e4),
        Property::Noise => below(0.0, 0.5),
        Property::Bore | Property::Core | Property::Hub | Property::PoleRadius | Property::Friction => {
            from(0.0)
        }
    }
}

/// An axis of such values.
pub const fn axis(property: Property) -> Form {
    Form::Axis(of(property))
}

/// A clamp by name, or where the rod begins, in base diameters.
const CLAMPS: [Form; 2] =
    [Form::Words(&["rigid", "bonded", "glued", "socket"]), Form::Number(within(-1.0, 0.2))];

/// Values of an effect of the model.
pub const fn of_term(term: &Term) -> Form {
    match term.trial {
        Amount::Flag(_) => Form::Flag,
        Amount::Number(_) => axis(Property::PoleRadius),
        Amount::Word(_) if term.words.len() > 2 => Form::Any(&CLAMPS),
        Amount::Word(_) => Form::Words(term.words),
    }
}
