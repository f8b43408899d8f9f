//! Packs of numbers with functions that vectors lack, number by number.

use std::ops::{Add, Div, Mul, Neg, Sub};

use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::{Dual as One, Real};
use vibrissa_kernel::cpu::pack::{Pack, Packed, Scalar, Set};

/// Packs whose numbers can be taken out.
pub trait Lane: Packed {
    /// A number of the pack.
    type One: Real;

    /// Number `i` is `of(i)`.
    fn collect(of: impl FnMut(usize) -> Self::One) -> Self;

    /// Number `i`.
    fn one(&self, i: usize) -> Self::One;

    /// The largest magnitude of a number and its derivatives.
    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }

    /// A number whose derivative is larger by `by`.
    #[inline(always)]
    fn grown(self, _by: Self) -> Self {
        self
    }

    /// self to the power n, 0 where self is not above 0.
    #[inline(always)]
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

/// A pack with its derivatives by `K` numbers.
#[derive(Debug, Clone, Copy)]
pub struct Dual<P, const K: usize> {
    pub value: P,
    pub slope: [P; K],
}

impl<P: Packed, const K: usize> Dual<P, K> {
    /// `value` with the derivative 1 by number `k`.
    #[inline]
    pub fn seed(value: P, k: usize) -> Self {
        let mut slope = [P::of(0.0); K];
        slope[k] = P::of(1.0);
        Self { value, slope }
    }

    /// The slopes p·self + q·o.
    #[inline]
    fn both(self, o: Self, value: P, p: P, q: P) -> Self {
        let mut slope = self.slope;
        for k in 0..K {
            slope[k] = p.mul_add(self.slope[k], q * o.slope[k]);
        }
        Self { value, slope }
    }

    #[inline]
    fn scaled(self, value: P, p: P) -> Self {
        let mut slope = self.slope;
        for k in 0..K {
            slope[k] = p * self.slope[k];
        }
        Self { value, slope }
    }
}

impl<P: Packed, const K: usize> Default for Dual<P, K> {
    fn default() -> Self {
        Self { value: P::default(), slope: [P::of(0.0); K] }
    }
}

impl<P: Packed, const K: usize> Neg for Dual<P, K> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.scaled(-self.value, P::of(-1.0))
    }
}
impl<P: Packed, const K: usize> Add for Dual<P, K> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..K {
            slope[k] = slope[k] + o.slope[k];
        }
        Self { value: self.value + o.value, slope }
    }
}
impl<P: Packed, const K: usize> Sub for Dual<P, K> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..K {
            slope[k] = slope[k] - o.slope[k];
        }
        Self { value: self.value - o.value, slope }
    }
}
impl<P: Packed, const K: usize> Mul for Dual<P, K> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        self.both(o, self.value * o.value, o.value, self.value)
    }
}
impl<P: Packed, const K: usize> Div for Dual<P, K> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let over = P::of(1.0) / o.value;
        let value = self.value * over;
        self.both(o, value, over, -(value * over))
    }
}

impl<P: Packed, const K: usize> Packed for Dual<P, K> {
    type Scalar = P::Scalar;

    #[inline]
    fn gather(of: impl FnMut(usize) -> f64) -> Self {
        Self { value: P::gather(of), ..Self::default() }
    }
    #[inline]
    fn lane(&self, i: usize) -> f64 {
        self.value.lane(i)
    }
    #[inline]
    fn splat(x: P::Scalar) -> Self {
        Self { value: P::splat(x), slope: [P::of(0.0); K] }
    }
    #[inline]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.scaled(root, P::of(0.5) / root)
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
        let mut slope = no.slope;
        for k in 0..K {
            slope[k] = self.value.if_less(o.value, yes.slope[k], no.slope[k]);
        }
        Self { value: self.value.if_less(o.value, yes.value, no.value), slope }
    }
    #[inline]
    fn all_at_most(self, o: Self) -> bool {
        self.value.all_at_most(o.value)
    }
}

impl<P: Lane<One = f64>, const K: usize> Lane for Dual<P, K> {
    type One = One<K>;

    #[inline]
    fn size(self) -> Self {
        let most = self.slope.into_iter().fold(self.value.abs(), |most, slope| most.max(slope.abs()));
        Self { value: most, ..Self::default() }
    }

    #[inline]
    fn grown(self, by: Self) -> Self {
        Self { slope: self.slope.map(|slope| slope + by.value), ..self }
    }

    #[inline]
    fn collect(mut of: impl FnMut(usize) -> One<K>) -> Self {
        let mut known = [One::<K>::of(0.0); 16];
        let value = P::collect(|i| {
            known[i] = of(i);
            known[i].value
        });
        let mut slope = [P::of(0.0); K];
        for k in 0..K {
            slope[k] = P::collect(|i| known[i].slope[k]);
        }
        Self { value, slope }
    }

    #[inline]
    fn one(&self, i: usize) -> One<K> {
        let mut one = One::<K>::of(self.value.one(i));
        for k in 0..K {
            one.slope[k] = self.slope[k].one(i);
        }
        one
    }
}
