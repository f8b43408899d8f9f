//! What closed forms are written in: one number, or those of several taps that go through the same operations.

use std::ops::{Add, Div, Mul, Sub};

/// A number, or several. An operation does to each what IEEE 754 says of one, so that several are told to the bits of one after the other.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// `x`, for all.
    fn of(x: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// √(self² + o²).
    fn hypot(self, o: Self) -> Self;
    /// Angle of the point (o, self), rad.
    fn atan2(self, o: Self) -> Self;
    /// `yes` of those less than their like in `o`, else `no`.
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self;
    /// Whether all are at most their like in `o`.
    fn all_at_most(self, o: Self) -> bool;
}

impl Number for f64 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    #[inline(always)]
    fn hypot(self, o: Self) -> Self {
        Self::hypot(self, o)
    }
    #[inline(always)]
    fn atan2(self, o: Self) -> Self {
        Self::atan2(self, o)
    }
    #[inline(always)]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        if self < o { yes } else { no }
    }
    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        self <= o
    }
}
