//! The plane in which a whisker bends against a pole that is not upright (model §6). It follows from the turn of the contact alone, in closed form: a
//! contact pushes square to the pole. In it the pole is a point, whose place is compared with that of the plane in which the iteration began.

use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::pole::Space;
use vibrissa_core::physics::real::Real;

use super::Tap;
use super::lane::Lane;
use super::vector::Two;

/// A pole in the frame of the base, with contact distances as the unit of length.
#[derive(Debug, Clone, Copy, Default)]
pub struct Axis<P> {
    point: Space<P>,
    along: Space<P>,
    /// Cosine and sine of the azimuth at which the iteration begins.
    first: Two<P>,
}

/// The pole in a plane of bending.
#[derive(Default)]
pub struct Seen<P> {
    /// Its place less that in the first plane.
    pub moved: Two<P>,
    /// Derivative of the place by the turn of the contact.
    pub swept: Two<P>,
}

impl<P: Lane> Axis<P> {
    /// The poles of a pack; every tap has one.
    #[inline(always)]
    pub fn new<'a>(lane: &impl Fn(usize) -> &'a Tap<'a, P::One>) -> Self {
        let of = |f: &dyn Fn(&super::Tilt<P::One>) -> P::One| {
            P::collect(|i| lane(i).tilt.as_ref().map_or(P::One::of(0.0), f))
        };
        let length = P::collect(|i| lane(i).a);
        Self {
            point: std::array::from_fn(|k| of(&|tilt| tilt.point[k]) / length),
            along: std::array::from_fn(|k| of(&|tilt| tilt.along[k])),
            first: [of(&|tilt| tilt.azimuth.sin_cos().1), of(&|tilt| tilt.azimuth.sin_cos().0)],
        }
    }

    /// The pole where the contact's normal, cosine and sine of its angle against y₁, has turned so far.
    #[inline(always)]
    pub fn seen(&self, [cos, sin]: Two<P>) -> Seen<P> {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let [x, y, z] = self.along;
        let level = one / (y * y + z * z).sqrt();
        let tan = sin / cos;
        let s = zero - tan * x * level;
        let c = (one - s * s).sqrt();
        let (cos, sin) = ((c * z + s * y) * level, (s * z - c * y) * level);
        let turned = zero - (one + tan * tan) * x * level / c;
        let ((there, slide), (begun, _)) = (self.place([cos, sin]), self.place(self.first));
        // The contact lies in the plane, so that its motion along the pole alone moves it there.
        let across = z * cos - y * sin;
        let out = |k: usize| self.point[k] + slide * self.along[k];
        let slid = turned * (out(1) * cos + out(2) * sin) / across;
        Seen {
            moved: [there[0] - begun[0], there[1] - begun[1]],
            swept: [slid * x, slid * (y * cos + z * sin)],
        }
    }

    /// The place of the pole in the plane of an azimuth, along and across the whisker at its clamp, and λ.
    #[inline(always)]
    fn place(&self, [cos, sin]: Two<P>) -> (Two<P>, P) {
        let ([px, py, pz], [x, y, z]) = (self.point, self.along);
        let slide = (py * sin - pz * cos) / (z * cos - y * sin);
        ([px + slide * x, (py + slide * y) * cos + (pz + slide * z) * sin], slide)
    }
}
