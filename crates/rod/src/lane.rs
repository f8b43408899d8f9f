//! Packs of numbers with functions that vectors lack, number by number.

use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::{Dual, Real};
use vibrissa_kernel::cpu::pack::{Pack, Packed, Scalar, Set};

/// Packs whose numbers can be taken out.
pub trait Lane: Packed {
    /// A number of the pack.
    type One: Real + 'static;

    /// Number `i` is `of(i)`.
    fn collect(of: impl FnMut(usize) -> Self::One) -> Self;

    /// Number `i`.
    fn one(&self, i: usize) -> Self::One;

    /// The larger of the magnitude and the sum of the magnitudes of the derivatives; NaN where one of them is.
    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }

    /// A number whose first derivative is larger by `by`.
    #[inline(always)]
    fn grown(self, _by: Self) -> Self {
        self
    }

    /// 1 − cos x and x − sin x by their series in x², over x² and x³.
    #[inline(always)]
    fn turn(one_minus_cos: &[Self::Scalar], x_minus_sin: &[Self::Scalar], x: Self) -> [Self; 2] {
        let z = x * x;
        [z * Self::polynomial(one_minus_cos, z), x * z * Self::polynomial(x_minus_sin, z)]
    }

    /// self to the power n, 0 where self is not above 0. It computes number by number: a copy in each caller would be no faster.
    #[inline(never)]
    fn pow(self, n: Self) -> Self {
        Self::collect(|i| {
            let x = self.one(i);
            if x.value() > 0.0 { x.powf(n.one(i)) } else { Self::One::of(0.0) }
        })
    }
}

impl<T: Scalar, const L: usize, S: Set> Lane for Pack<T, L, S> {
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

impl<const K: usize> Lane for Dual<K> {
    type One = Self;

    #[inline]
    fn size(self) -> Self {
        let slopes: f64 = self.slope.into_iter().map(f64::abs).sum();
        let value = self.value.abs();
        Self { value: if value > slopes { value } else { slopes }, ..Self::default() }
    }

    #[inline]
    fn grown(self, by: Self) -> Self {
        Self { slope: std::array::from_fn(|k| self.slope[k] + if k == 0 { by.value } else { 0.0 }), ..self }
    }

    #[inline]
    fn collect(mut of: impl FnMut(usize) -> Self) -> Self {
        of(0)
    }

    #[inline]
    fn one(&self, _: usize) -> Self {
        *self
    }
}
