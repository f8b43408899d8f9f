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
}
