//! What sections that distort make of the strain of linear theory (model §8 b), in lanes: twin of [`crate::function::sections`].

use super::Lanes;
use crate::physics::solid::SKIN;

/// Coefficients of e^(−z) by powers of z, up to 1.
const TAYLOR: [f64; 10] = [
    1.0,
    -1.0,
    0.5,
    -1.0 / 6.0,
    1.0 / 24.0,
    -1.0 / 120.0,
    1.0 / 720.0,
    -1.0 / 5040.0,
    1.0 / 40320.0,
    -1.0 / 362880.0,
];

/// e^(−z) of 0 ≤ z ≤ 16, good to 1e-6 of itself; beyond that what it is there.
#[inline(always)]
fn decay<const FMA: bool>(z: Lanes<FMA>) -> Lanes<FMA> {
    let of = Lanes::<FMA>::of;
    let part = z.min(of(16.0)) * of(1.0 / 16.0);
    let mut sum = of(TAYLOR[9]);
    for k in (0..9).rev() {
        sum = sum.mul_add(part, of(TAYLOR[k]));
    }
    let fourth = (sum * sum) * (sum * sum);
    (fourth * fourth) * (fourth * fourth)
}

/// Whiskers of which S is asked, lengths over a.
pub(super) struct Distorted<T> {
    base: T,
    /// p/D.
    fades: T,
    /// c₂ t² and c₁ t D/2.
    taper: [T; 2],
}

impl<const FMA: bool> Distorted<Lanes<FMA>> {
    /// Of D/a and τa.
    #[inline(always)]
    pub fn new(base: Lanes<FMA>, p: Lanes<FMA>) -> Self {
        let of = Lanes::<FMA>::of;
        let [_, fades, _, c1, c2] = SKIN;
        let tan = of(0.5) * base * p;
        Self { base, fades: of(fades) / base, taper: [of(c2) * tan * tan, of(0.5 * c1) * tan * base] }
    }

    /// (S − 1)(1 − s) at s = x/a, `room` 1 − s, `u` 1 − τx.
    #[inline(always)]
    pub fn less_1_times_room(&self, s: Lanes<FMA>, room: Lanes<FMA>, u: Lanes<FMA>) -> Lanes<FMA> {
        let of = Lanes::<FMA>::of;
        let [a, _, b, ..] = SKIN;
        let near = decay(self.fades * s);
        let shear = (of(b) * self.base).mul_add(near, self.taper[1] * u);
        room.mul_add(of(-a).mul_add(near, self.taper[0]), shear)
    }
}
