//! A number with its derivatives as a pack of one.

use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::Dual;

use super::pack::Packed;

impl<const N: usize> Packed for Dual<N> {
    type Scalar = f64;

    #[inline]
    fn gather(mut of: impl FnMut(usize) -> f64) -> Self {
        Number::of(of(0))
    }
    #[inline]
    fn lane(&self, _: usize) -> f64 {
        self.value
    }
    #[inline]
    fn splat(x: f64) -> Self {
        Number::of(x)
    }
    #[inline]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline]
    fn sqrt(self) -> Self {
        Number::sqrt(self)
    }
    #[inline]
    fn max(self, o: Self) -> Self {
        o.if_less(self, self, o)
    }
    #[inline]
    fn min(self, o: Self) -> Self {
        self.if_less(o, self, o)
    }
    #[inline]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        if self.value < o.value { yes } else { no }
    }
    #[inline]
    fn all_at_most(self, o: Self) -> bool {
        self.value <= o.value
    }
}
