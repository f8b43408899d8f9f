//! Closed forms of the linear theory (model §2), dimensionless. Twin of `shaders/linear.wgsl`.
//!
//! ε a/(D θ) = (3/2)(1 − τa)(1 + r₀/a) ℓ/(1 + S/a²), ℓ the mean of (a − s)₊/(1 − τs)³ over the gauge, in units of a.

use super::pack::{Pack, Scalar};
use crate::kernel::{Solution, Tap, rule::limits::TINY};

/// Evaluates `L` taps at once.
#[inline(always)]
pub fn taps<T: Scalar, const L: usize, const FMA: bool>(
    tap: &Tap<Pack<T, L, FMA>>,
) -> Solution<Pack<T, L, FMA>> {
    let of = Pack::<T, L, FMA>::of;
    let (zero, one, tiny) = (of(0.0), of(1.0), of(TINY));
    let b1 = one / tap.taper.mul_add(tap.near, tap.rest);
    let b2 = one / tap.taper.mul_add(tap.far, tap.rest).max(tiny);
    let clear = of(0.5) * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let on_gauge = tap.near * tap.near * b1 * b1 / (of(2.0) * tap.rest * tap.width);
    let lever = zero.if_less(tap.near, tap.far.if_less(zero, on_gauge, clear), zero);
    let strain = of(1.5) * tap.rest * (one + tap.hub) * lever / (one + tap.shear);
    Solution { strain, ..Solution::gather(|_| zero) }
}
