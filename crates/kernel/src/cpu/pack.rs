//! Lanes: `L` numbers in the same arithmetic, as vectors of an instruction set that the caller enables; for other sizes, left to the auto-vectoriser.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[cfg(target_arch = "x86_64")]
use super::vectors::*;
use vibrissa_core::physics::number::Number;

#[cfg(not(target_arch = "x86_64"))]
macro_rules! kinds {
    ($($any:tt)*) => {};
}

mod sealed {
    /// Vector packs tell f32 from f64 by size: no other type may be a [`super::Scalar`].
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// f32 or f64.
pub trait Scalar:
    sealed::Sealed
    + Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Largest relative error of one rounding.
    const ROUNDING: f64;
    /// Rounded from f64.
    fn of(x: f64) -> Self;
    /// Widened to f64.
    fn get(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// a b + c, rounded once.
    fn fma(self, b: Self, c: Self) -> Self;
}

macro_rules! scalar {
    ($t:ty) => {
        impl Scalar for $t {
            const ROUNDING: f64 = 0.5 * <$t>::EPSILON as f64;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn get(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                self.mul_add(b, c)
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

/// Numbers in the same arithmetic; kernels are written in these.
pub trait Packed:
    Copy
    + Default
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// Type of each number.
    type Scalar: Scalar;

    /// Lane `i` is `of(i)`.
    fn gather(of: impl FnMut(usize) -> f64) -> Self;

    /// The number of lane `i`.
    fn lane(&self, i: usize) -> f64;

    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;

    /// The same number in every lane.
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(Self::Scalar::of(x))
    }

    /// self · b + c.
    fn mul_add(self, b: Self, c: Self) -> Self;

    /// self + `k` · `y`.
    #[inline(always)]
    fn plus(self, k: Self::Scalar, y: Self) -> Self {
        Self::splat(k).mul_add(y, self)
    }

    /// Square root.
    fn sqrt(self) -> Self;

    /// The larger; the second where the first is NaN.
    fn max(self, o: Self) -> Self;

    /// The smaller; the second where the first is NaN.
    fn min(self, o: Self) -> Self;

    /// Absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }

    /// Per lane `yes` where self < `o`, else `no`.
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self;

    /// True if self ≤ `o` in every lane; false where either is NaN.
    fn all_at_most(self, o: Self) -> bool;

    /// Σ c_k z^k.
    #[inline(always)]
    fn polynomial(c: &[Self::Scalar], z: Self) -> Self {
        let Some((&last, others)) = c.split_last() else { return Self::of(0.0) };
        let mut sum = Self::splat(last);
        for &next in others.iter().rev() {
            sum = sum.mul_add(z, Self::splat(next));
        }
        sum
    }

    /// Σ c_jk x^k y^j. Loops, no closure: code not inlined has neither the caller's vectors nor its fused operations.
    #[inline(always)]
    fn plane(c: &[Vec<Self::Scalar>], x: Self, y: Self) -> Self {
        let mut sum = Self::of(0.0);
        for row in c.iter().rev() {
            sum = sum.mul_add(y, Self::polynomial(row, x));
        }
        sum
    }
}

/// Instructions of packs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// Those that every CPU has.
    Unfused,
    /// With fused multiply–add; without it a fused operation would be a library call per lane.
    Fused,
    /// The same, with packs of [`WIDEST`] or 16 f32, or of 8 f64, as AVX2 vectors: the auto-vectoriser uses vectors of two for some sums.
    Avx2,
}

/// A set of instructions, by which its packs compute.
///
/// # Safety
/// Packs of this type must exist only where the CPU has the instructions: behind a [`Vectors`](super::Vectors), or where every CPU has them.
pub unsafe trait Set: Debug + Copy + PartialEq {
    /// The instructions.
    const HAS: Instructions;
}

/// The set that every CPU has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plain;

// SAFETY: every CPU has it.
unsafe impl Set for Plain {
    const HAS: Instructions = Instructions::Unfused;
}

/// f32 of the widest packs that are vectors.
pub const WIDEST: usize = 32;

/// `L` lanes of `T`, by the instructions of `S`, which the caller must enable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Pack<T, const L: usize, S>(pub [T; L], PhantomData<S>);

impl<T: Scalar, const L: usize, S: Set> Default for Pack<T, L, S> {
    fn default() -> Self {
        Packed::of(0.0)
    }
}

impl<T: Scalar, const L: usize, S: Set> Pack<T, L, S> {
    #[inline(always)]
    pub(crate) fn map2(mut self, o: Self, f: impl Fn(T, T) -> T) -> Self {
        if const { L == 1 } {
            self.0[0] = f(self.0[0], o.0[0]);
            return self;
        }
        for i in 0..L {
            self.0[i] = f(self.0[i], o.0[i]);
        }
        self
    }

    /// A pack of these numbers.
    #[inline(always)]
    pub fn new(numbers: [T; L]) -> Self {
        Self(numbers, PhantomData)
    }
}

impl<T: Scalar, const L: usize, S: Set> Packed for Pack<T, L, S> {
    type Scalar = T;

    #[inline(always)]
    fn gather(mut of: impl FnMut(usize) -> f64) -> Self {
        Self::new(std::array::from_fn(|i| T::of(of(i))))
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> f64 {
        self.0[i].get()
    }

    #[inline(always)]
    fn splat(x: T) -> Self {
        kinds!(same, x);
        Self::new([x; L])
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        kinds!(vectors, mul_add(self, b, c));
        let mut r = self;
        for i in 0..L {
            r.0[i] = if const { matches!(S::HAS, Instructions::Unfused) } {
                self.0[i] * b.0[i] + c.0[i]
            } else {
                self.0[i].fma(b.0[i], c.0[i])
            };
        }
        r
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        kinds!(vectors, sqrt(self));
        let mut r = self;
        for x in &mut r.0 {
            *x = x.sqrt();
        }
        r
    }

    #[inline(always)]
    fn max(self, o: Self) -> Self {
        kinds!(vectors, max(self, o));
        self.map2(o, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min(self, o: Self) -> Self {
        kinds!(vectors, min(self, o));
        self.map2(o, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        kinds!(vectors, if_less(self, o, yes, no));
        let mut r = no;
        for i in 0..L {
            r.0[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        r
    }

    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        kinds!(all_vectors, all_at_most(self, o));
        let mut all = true;
        for i in 0..L {
            all &= self.0[i] <= o.0[i];
        }
        all
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<T: Scalar, const L: usize, S: Set> $trait for Pack<T, L, S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                kinds!(vectors, $name(self, o));
                self.map2(o, $trait::$name)
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<T: Scalar, const L: usize, S: Set> Neg for Pack<T, L, S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        <Self as Packed>::of(0.0) - self
    }
}

/// Closed forms of several taps: no operation is fused.
impl<const L: usize> Number for Pack<f64, L, Plain> {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Packed::of(x)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Packed::sqrt(self)
    }
}
