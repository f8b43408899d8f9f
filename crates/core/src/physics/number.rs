//! The numbers of the closed forms: one number, or a lane of several taps.

use std::ops::{Add, Div, Mul, Sub};

/// A number or a lane of numbers. Lanes round as scalars do: each gives the same bits as a single number.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// `x` in each lane.
    fn of(x: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// √(self² + o²).
    fn hypot(self, o: Self) -> Self;
    /// Angle of the point (o, self), rad.
    fn atan2(self, o: Self) -> Self;
    /// `yes` in lanes where self < `o`, else `no`.
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self;
    /// True if self ≤ `o` in all lanes.
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
