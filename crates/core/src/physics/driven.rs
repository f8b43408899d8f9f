//! The drive of a tap, in the units of the physics.

use super::number::Number;
use crate::scene::model::Drive;

/// The drive of a tap: one number, or a lane of numbers of several taps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Driven<T = f64> {
    /// θ, by which the base turns.
    Radians(T),
    /// δ, by which the object moves.
    Millimetres(T),
}

impl<T: Number> Driven<T> {
    /// From the number of a spec or a table: degrees, or mm. Only this function and [`Driven::to_users`] convert drives.
    #[inline(always)]
    pub fn of_users(kind: Drive, number: T) -> Self {
        match kind {
            Drive::Angle => Self::Radians(number * T::of(1f64.to_radians())),
            Drive::Displacement => Self::Millimetres(number),
        }
    }

    /// A drive of the same kind by the size `f` of this one.
    #[inline(always)]
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Driven<U> {
        match self {
            Self::Radians(size) => Driven::Radians(f(size)),
            Self::Millimetres(size) => Driven::Millimetres(f(size)),
        }
    }

    /// θ, or δ: linear theory gives strains, forces and wrenches per radian or mm.
    #[inline(always)]
    pub fn size(self) -> T {
        match self {
            Self::Radians(size) | Self::Millimetres(size) => size,
        }
    }
}

impl Driven {
    /// The drive of a tap at `a` mm, from that of charts: θ, or δ/a.
    pub fn of_chart(kind: Drive, drive: f64, a: f64) -> Self {
        match kind {
            Drive::Angle => Self::Radians(drive),
            Drive::Displacement => Self::Millimetres(drive * a),
        }
    }

    /// Degrees, or mm.
    pub fn to_users(self) -> f64 {
        match self {
            Self::Radians(theta) => theta.to_degrees(),
            Self::Millimetres(delta) => delta,
        }
    }

    /// Angle or displacement.
    pub fn kind(self) -> Drive {
        if matches!(self, Self::Radians(_)) { Drive::Angle } else { Drive::Displacement }
    }

    /// θ and δ; one of them is 0.
    pub fn turn_and_lift(self) -> [f64; 2] {
        match self {
            Self::Radians(theta) => [theta, 0.0],
            Self::Millimetres(delta) => [0.0, delta],
        }
    }

    /// `x` of a base that turns, such as r₀; else 0.
    pub fn if_turned(self, x: f64) -> f64 {
        if matches!(self, Self::Radians(_)) { x } else { 0.0 }
    }

    /// Path of the pole towards the base, mm, at `reach` mm from the motor's axis.
    pub fn path(self, reach: f64) -> f64 {
        match self {
            Self::Radians(theta) => theta * reach,
            Self::Millimetres(delta) => delta,
        }
    }
}
