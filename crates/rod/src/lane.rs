//! Packs of numbers with functions that vectors lack, number by number.

use vibrissa_core::physics::real::Real;
use vibrissa_kernel::cpu::pack::{Pack, Packed, Scalar};

/// Packs whose numbers can be taken out.
pub trait Lane: Packed {
    /// A number of the pack.
    type One: Real;

    /// Number `i` is `of(i)`.
    fn collect(of: impl FnMut(usize) -> Self::One) -> Self;

    /// Number `i`.
    fn one(&self, i: usize) -> Self::One;

    /// self to the power n, 0 where self is not above 0.
    #[inline(always)]
    fn pow(self, n: Self) -> Self {
        Self::collect(|i| {
            let x = self.one(i);
            if x.value() > 0.0 { x.powf(n.one(i)) } else { <Self::One as vibrissa_core::physics::number::Number>::of(0.0) }
        })
    }
}

impl<T: Scalar, const L: usize, const SET: u8> Lane for Pack<T, L, SET> {
    type One = f64;

    #[inline(always)]
    fn collect(of: impl FnMut(usize) -> f64) -> Self {
        Self::gather(of)
    }

    #[inline(always)]
    fn one(&self, i: usize) -> f64 {
        self.lane(i)
    }
}
