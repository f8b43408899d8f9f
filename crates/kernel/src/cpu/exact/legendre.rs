//! Series of shifted Legendre polynomials at a place of the rod; unrolled in shaders (`gpu/shader.rs`).

use super::super::pack::Packed;

/// ∫₀^w of a series of shifted Legendre polynomials.
#[inline(always)]
pub fn primitive<P: Packed, const N: usize>(n: usize, series: &[P; N], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = series[0] * w;
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        sum = sum + series[k] * (next - before) * of(0.5 / (2.0 * kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}

#[inline(always)]
pub fn legendre<P: Packed, const N: usize>(n: usize, series: &[P; N], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = series[0];
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        sum = sum + series[k] * now;
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}
