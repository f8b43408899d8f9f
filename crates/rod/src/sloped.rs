//! Four numbers with their derivatives by one number each, as two vectors of AVX2. One type and no packs of packs: LLVM takes minutes for those.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use vibrissa_core::physics::real::Dual as One;
use vibrissa_kernel::cpu::pack::Packed;

use super::lane::Lane;

/// Numbers and derivatives. It may exist only where the CPU has AVX2 and fused operations.
#[derive(Debug, Clone, Copy)]
pub struct Sloped([__m256d; 2]);

/// Numbers of a pack.
pub const NUMBERS: usize = 4;

impl Sloped {
    #[inline(always)]
    fn new(values: [f64; NUMBERS], slopes: [f64; NUMBERS]) -> Self {
        // SAFETY: both are eight numbers.
        Self(unsafe { std::mem::transmute::<[[f64; NUMBERS]; 2], [__m256d; 2]>([values, slopes]) })
    }

    #[inline(always)]
    fn numbers(&self) -> [[f64; NUMBERS]; 2] {
        // SAFETY: both are eight numbers.
        unsafe { std::mem::transmute::<[__m256d; 2], [[f64; NUMBERS]; 2]>(self.0) }
    }
}

impl Default for Sloped {
    #[inline(always)]
    fn default() -> Self {
        Self::new([0.0; NUMBERS], [0.0; NUMBERS])
    }
}

/// An operation of values `[v, w]` and slopes `[s, t]` of both.
macro_rules! operator {
    ($trait:ident, $name:ident, |$v:ident, $w:ident, $s:ident, $t:ident| $value:expr, |$result:ident| $slope:expr) => {
        impl $trait for Sloped {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let ([$v, $s], [$w, $t]) = (self.0, o.0);
                // SAFETY: where the type exists the CPU has the instructions.
                unsafe {
                    let $result = $value;
                    let _ = ($v, $w);
                    Self([$result, $slope])
                }
            }
        }
    };
}
operator!(Add, add, |v, w, s, t| _mm256_add_pd(v, w), |_r| _mm256_add_pd(s, t));
operator!(Sub, sub, |v, w, s, t| _mm256_sub_pd(v, w), |_r| _mm256_sub_pd(s, t));
operator!(Mul, mul, |v, w, s, t| _mm256_mul_pd(v, w), |_r| _mm256_fmadd_pd(s, w, _mm256_mul_pd(v, t)));
operator!(Div, div, |v, w, s, t| _mm256_div_pd(v, w), |r| _mm256_div_pd(_mm256_fnmadd_pd(r, t, s), w));

impl Neg for Sloped {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::default() - self
    }
}

// SAFETY of all below: where the type exists the CPU has the instructions.
impl Packed for Sloped {
    type Scalar = f64;

    #[inline(always)]
    fn gather(of: impl FnMut(usize) -> f64) -> Self {
        Self::new(std::array::from_fn(of), [0.0; NUMBERS])
    }
    #[inline(always)]
    fn lane(&self, i: usize) -> f64 {
        self.numbers()[0][i]
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        unsafe { Self([_mm256_set1_pd(x), _mm256_setzero_pd()]) }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let ([v, s], [w, t]) = (self.0, b.0);
        unsafe {
            let slope = _mm256_fmadd_pd(s, w, _mm256_fmadd_pd(v, t, c.0[1]));
            Self([_mm256_fmadd_pd(v, w, c.0[0]), slope])
        }
    }
    #[inline(always)]
    fn plus(self, k: f64, y: Self) -> Self {
        unsafe {
            let k = _mm256_set1_pd(k);
            Self([_mm256_fmadd_pd(k, y.0[0], self.0[0]), _mm256_fmadd_pd(k, y.0[1], self.0[1])])
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe {
            let root = _mm256_sqrt_pd(self.0[0]);
            Self([root, _mm256_div_pd(_mm256_mul_pd(_mm256_set1_pd(0.5), self.0[1]), root)])
        }
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        o.if_less(self, self, o)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        self.if_less(o, self, o)
    }
    #[inline(always)]
    fn if_less(self, o: Self, yes: Self, no: Self) -> Self {
        unsafe {
            let less = _mm256_cmp_pd::<_CMP_LT_OQ>(self.0[0], o.0[0]);
            Self([_mm256_blendv_pd(no.0[0], yes.0[0], less), _mm256_blendv_pd(no.0[1], yes.0[1], less)])
        }
    }
    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0[0], o.0[0])) == 0xf }
    }
}

impl Lane for Sloped {
    type One = One<1>;

    #[inline(always)]
    fn collect(mut of: impl FnMut(usize) -> One<1>) -> Self {
        let mut numbers = [[0.0; NUMBERS]; 2];
        for i in 0..NUMBERS {
            let one = of(i);
            (numbers[0][i], numbers[1][i]) = (one.value, one.slope[0]);
        }
        Self::new(numbers[0], numbers[1])
    }

    #[inline(always)]
    fn one(&self, i: usize) -> One<1> {
        let [values, slopes] = self.numbers();
        One { value: values[i], slope: [slopes[i]] }
    }

    #[inline(always)]
    fn size(self) -> Self {
        let slope = unsafe { Self([self.0[1], _mm256_setzero_pd()]) };
        self.abs().max(slope.abs())
    }

    #[inline(always)]
    fn grown(self, by: Self) -> Self {
        unsafe { Self([self.0[0], _mm256_add_pd(self.0[1], by.0[0])]) }
    }
}
