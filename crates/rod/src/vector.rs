//! Vectors of the plane, in packs.

use vibrissa_kernel::cpu::Packed;

/// Components along and across the resting whisker at the contact.
pub type Two<P> = [P; 2];

/// a + b.
#[inline(always)]
pub fn add<P: Packed>(a: Two<P>, b: Two<P>) -> Two<P> {
    [a[0] + b[0], a[1] + b[1]]
}

/// x a.
#[inline(always)]
pub fn times<P: Packed>(x: P, a: Two<P>) -> Two<P> {
    [x * a[0], x * a[1]]
}

/// `v` turned by 90°.
#[inline(always)]
pub fn square<P: Packed>([x, y]: Two<P>) -> Two<P> {
    [P::of(0.0) - y, x]
}

/// The change of `v` when it turns by the angle with this 1 − cos and sin.
#[inline(always)]
pub fn turned<P: Packed>(v: Two<P>, [versine, sine]: Two<P>) -> Two<P> {
    [P::of(0.0) - versine * v[0] - sine * v[1], sine * v[0] - versine * v[1]]
}

/// a × b.
#[inline(always)]
pub fn cross<P: Packed>(a: Two<P>, b: Two<P>) -> P {
    a[0] * b[1] - a[1] * b[0]
}

/// a · b.
#[inline(always)]
pub fn dot2<P: Packed>(a: Two<P>, b: Two<P>) -> P {
    a[0] * b[0] + a[1] * b[1]
}

/// Σ of the columns by the components of `v`.
#[inline(always)]
pub fn columns<P: Packed>(columns: &[Two<P>; 2], v: Two<P>) -> Two<P> {
    add(times(v[0], columns[0]), times(v[1], columns[1]))
}
