//! Four numbers with their derivatives by three others each, as vectors of AVX2. One type and no packs of packs: LLVM takes minutes for those.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use vibrissa_core::physics::real::Dual;
use vibrissa_kernel::cpu::pack::Packed;

use super::SLOPES;
use super::lane::Lane;

/// Numbers, then their derivatives by each of the others. It may exist only where the CPU has AVX2 and fused operations.
#[derive(Debug, Clone, Copy)]
pub struct Sloped(__m256d, [__m256d; SLOPES]);

/// Numbers of a pack.
pub const NUMBERS: usize = 4;

/// The numbers of a vector.
#[inline(always)]
fn numbers(v: __m256d) -> [f64; NUMBERS] {
    // SAFETY: both are four numbers.
    unsafe { std::mem::transmute(v) }
}

/// `$of` of each derivative, whose place is `$k`. No closure: code in one has neither the vectors nor the fused operations of its caller.
macro_rules! each {
    (|$k:ident| $of:expr) => {
        [each!(@ $k 0 $of), each!(@ $k 1 $of), each!(@ $k 2 $of)]
    };
    (@ $k:ident $place:literal $of:expr) => {{
        let $k = $place;
        $of
    }};
}

/// An operation of values `[v, w]` and slopes `[s, t]` of both.
macro_rules! operator {
    ($trait:ident, $name:ident, |$v:ident, $w:ident, $s:ident, $t:ident| $value:expr, |$result:ident| $slope:expr) => {
        impl $trait for Sloped {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let ($v, $w) = (self.0, o.0);
                // SAFETY: where the type exists the CPU has the instructions.
                unsafe {
                    let $result = $value;
                    let slopes = each!(|k| {
                        let ($s, $t) = (self.1[k], o.1[k]);
                        $slope
                    });
                    Self($result, slopes)
                }
            }
        }
    };
}
operator!(Add, add, |v, w, s, t| _mm256_add_pd(v, w), |_r| _mm256_add_pd(s, t));
operator!(Sub, sub, |v, w, s, t| _mm256_sub_pd(v, w), |_r| _mm256_sub_pd(s, t));
operator!(Mul, mul, |v, w, s, t| _mm256_mul_pd(v, w), |_r| _mm256_fmadd_pd(s, w, _mm256_mul_pd(v, t)));
operator!(Div, div, |v, w, s, t| _mm256_div_pd(v, w), |r| _mm256_mul_pd(
    _mm256_fnmadd_pd(r, t, s),
    _mm256_div_pd(_mm256_set1_pd(1.0), w)
));

impl Neg for Sloped {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::default() - self
    }
}

impl Default for Sloped {
    #[inline(always)]
    fn default() -> Self {
        Self::of(0.0)
    }
}

impl Sloped {
    /// A function of this number with these values and derivatives by it.
    #[inline(always)]
    fn chain(self, value: __m256d, by: __m256d) -> Self {
        // SAFETY: where the type exists the CPU has the instructions.
        unsafe { Self(value, each!(|k| _mm256_mul_pd(by, self.1[k]))) }
    }
}

/// Σ c_k z^k, and its derivative.
#[inline(always)]
fn series(c: &[f64], z: __m256d) -> [__m256d; 2] {
    // SAFETY: where `Sloped` exists the CPU has the instructions.
    unsafe {
        let [mut sum, mut by] = [_mm256_setzero_pd(); 2];
        for &next in c.iter().rev() {
            by = _mm256_fmadd_pd(by, z, sum);
            sum = _mm256_fmadd_pd(sum, z, _mm256_set1_pd(next));
        }
        [sum, by]
    }
}

// SAFETY of all below: where the type exists the CPU has the instructions.
impl Packed for Sloped {
    type Scalar = f64;

    #[inline(always)]
    fn gather(mut of: impl FnMut(usize) -> f64) -> Self {
        let [a, b, c, d] = [of(0), of(1), of(2), of(3)];
        Self(unsafe { _mm256_setr_pd(a, b, c, d) }, Self::default().1)
    }
    #[inline(always)]
    fn lane(&self, i: usize) -> f64 {
        numbers(self.0)[i]
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        unsafe { Self(_mm256_set1_pd(x), [_mm256_setzero_pd(); SLOPES]) }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let (v, w) = (self.0, b.0);
        unsafe {
            let slopes = each!(|k| _mm256_fmadd_pd(self.1[k], w, _mm256_fmadd_pd(v, b.1[k], c.1[k])));
            Self(_mm256_fmadd_pd(v, w, c.0), slopes)
        }
    }
    #[inline(always)]
    fn plus(self, k: f64, y: Self) -> Self {
        unsafe {
            let factor = _mm256_set1_pd(k);
            let slopes = each!(|k| _mm256_fmadd_pd(factor, y.1[k], self.1[k]));
            Self(_mm256_fmadd_pd(factor, y.0, self.0), slopes)
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe {
            let root = _mm256_sqrt_pd(self.0);
            self.chain(root, _mm256_div_pd(_mm256_set1_pd(0.5), root))
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
            let less = _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, o.0);
            let slopes = each!(|k| _mm256_blendv_pd(no.1[k], yes.1[k], less));
            Self(_mm256_blendv_pd(no.0, yes.0, less), slopes)
        }
    }
    #[inline(always)]
    fn all_at_most(self, o: Self) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, o.0)) == 0xf }
    }
    #[inline(always)]
    fn polynomial(c: &[f64], z: Self) -> Self {
        let [sum, by] = series(c, z.0);
        z.chain(sum, by)
    }
    #[inline(always)]
    fn plane(c: &[Vec<f64>], x: Self, y: Self) -> Self {
        unsafe {
            let [mut sum, mut by_x, mut by_y] = [_mm256_setzero_pd(); 3];
            for row in c.iter().rev() {
                let [value, slope] = series(row, x.0);
                by_y = _mm256_fmadd_pd(by_y, y.0, sum);
                by_x = _mm256_fmadd_pd(by_x, y.0, slope);
                sum = _mm256_fmadd_pd(sum, y.0, value);
            }
            Self(sum, each!(|k| _mm256_fmadd_pd(by_x, x.1[k], _mm256_mul_pd(by_y, y.1[k]))))
        }
    }
}

impl Lane for Sloped {
    type One = Dual<SLOPES>;

    #[inline(always)]
    fn collect(mut of: impl FnMut(usize) -> Self::One) -> Self {
        let [a, b, c, d] = [of(0), of(1), of(2), of(3)];
        unsafe {
            let slopes = each!(|k| _mm256_setr_pd(a.slope[k], b.slope[k], c.slope[k], d.slope[k]));
            Self(_mm256_setr_pd(a.value, b.value, c.value, d.value), slopes)
        }
    }
    #[inline(always)]
    fn one(&self, i: usize) -> Self::One {
        Dual { value: numbers(self.0)[i], slope: each!(|k| numbers(self.1[k])[i]) }
    }
    #[inline(always)]
    fn size(self) -> Self {
        let plain = |v| Self(v, Self::default().1);
        let [a, b, c] = each!(|k| plain(self.1[k]).abs());
        // A sum keeps NaN, which `max` may drop.
        plain(self.0).abs().max(a + b + c)
    }
    #[inline(always)]
    fn grown(mut self, by: Self) -> Self {
        self.1[0] = unsafe { _mm256_add_pd(self.1[0], by.0) };
        self
    }
    #[inline(always)]
    fn turn(one_minus_cos: &[f64], x_minus_sin: &[f64], x: Self) -> [Self; 2] {
        let z = unsafe { _mm256_mul_pd(x.0, x.0) };
        let (versine, over) = (series(one_minus_cos, z)[0], series(x_minus_sin, z)[0]);
        unsafe {
            let versine = _mm256_mul_pd(z, versine);
            let over = _mm256_mul_pd(_mm256_mul_pd(x.0, z), over);
            [x.chain(versine, _mm256_sub_pd(x.0, over)), x.chain(over, versine)]
        }
    }
}
