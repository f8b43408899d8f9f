//! Frames taps of different whiskers in lanes; bit-identical to [`Frame`](crate::tap::Frame). Only for taps in the middle of the domain, whose weight
//! is surely 1.

use std::array::from_fn;

use crate::cpu::{Pack, Packed};
use crate::onset::{self, Pose};
use crate::tap::Tap;
use vibrissa_core::design::MOST;
use vibrissa_core::physics::{driven::Driven, solid::is_solid, taper::Taper};
use vibrissa_core::scene::{Clamp, Contact, Drive, Geometry, Grip, Model, Setup, Side};

const LANES: usize = 4;

type Lanes = onset::Lanes<LANES>;

/// Dimensions of a tap: D, d, L_a, x_ss, l, a (mm) and the tap angle (degrees) or the displacement (mm).
pub const DIMENSIONS: usize = 7;

/// Least share of the largest linear strain at which the weight of an error is surely 1, with a margin for rounding.
const SURE: f64 = 1.001e-3;

/// Lengths (mm) and drives between which no formula of the linear strain over- or underflows; no whisker has larger ones.
const SIZES: [f64; 2] = [1e-20, MOST];

/// D(a)/D = 1 − τa, between which the rounding of the linear strain stays within the margin of [`SURE`].
const RESTS: [f64; 2] = [1e-6, 1e6];

/// The setup of taps that are framed in lanes.
#[derive(Debug, Clone, Copy)]
pub struct Framing {
    model: Model,
    side: Side,
    drive: Drive,
    /// r₀, mm; 0 for a displaced object.
    hub: f64,
    grip: Grip,
}

/// Taps framed in lanes.
#[derive(Debug, Default)]
pub struct Framed {
    /// Dimensions of the taps, one column each.
    pub columns: [Vec<f64>; DIMENSIONS],
    /// The taps, as kernels take them.
    pub taps: Vec<Tap>,
    /// True for taps that are framed.
    pub whole: Vec<bool>,
}

impl Framing {
    /// Framing for `setup`; `None` where the grip is not known beforehand, with a second gauge, and where no kernel is used.
    pub fn new(setup: &Setup) -> Option<Self> {
        let Setup { model, drive, .. } = *setup;
        let hub = if drive == Drive::Displacement { 0.0 } else { setup.hub };
        let solid = is_solid(&model) || model.clamp != Clamp::Rigid || setup.gauge.foil.is_some();
        let grip = match model.contact {
            Contact::Frictionless | Contact::Coulomb(0.0) => Grip::Slide(0.0),
            Contact::Stick => Grip::Stick,
            Contact::Coulomb(_) => return None,
        };
        let known = model.geometry == Geometry::Exact
            && setup.is_plain()
            && !solid
            && !setup.gauge.second
            && hub < SIZES[1];
        known.then_some(Self { model, side: setup.gauge.side, drive, hub, grip })
    }

    /// Frames `n` taps with dimensions `of`.
    pub fn frame(&self, n: usize, of: impl Fn(usize) -> [f64; DIMENSIONS], framed: &mut Framed) {
        let full = n.next_multiple_of(LANES);
        for column in &mut framed.columns {
            column.resize(full, f64::NAN);
        }
        for i in 0..n {
            for (column, x) in framed.columns.iter_mut().zip(of(i)) {
                column[i] = x;
            }
        }
        framed.taps.resize(full, Tap::default());
        framed.whole.resize(full, false);
        self.all(framed);
        framed.taps.truncate(n);
        framed.whole.truncate(n);
    }

    fn all(&self, framed: &mut Framed) {
        #[cfg(target_arch = "x86_64")]
        if crate::cpu::Vectors::found().is_some() {
            // SAFETY: the CPU has just been found to have AVX2.
            unsafe { self.all_avx2(framed) };
            return;
        }
        self.each(framed);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn all_avx2(&self, framed: &mut Framed) {
        self.each(framed);
    }

    #[inline(always)]
    fn each(&self, Framed { columns, taps, whole }: &mut Framed) {
        let taps = taps.chunks_exact_mut(LANES).zip(whole.chunks_exact_mut(LANES));
        for (k, (taps, whole)) in taps.enumerate() {
            let at = k * LANES;
            let dimension = |c: usize| Pack::new(from_fn(|i| columns[c][at + i]));
            self.some(from_fn(dimension), taps, whole);
        }
    }

    #[inline(always)]
    #[allow(non_snake_case)]
    fn some(&self, dimensions: [Lanes; DIMENSIONS], taps: &mut [Tap], whole: &mut [bool]) {
        let [D, d, L_a, x_ss, l, a, drive] = dimensions;
        let Self { model, side, drive: kind, hub, grip } = self;
        let (side, hub, grip) = (*side, *hub, *grip);
        let taper = Taper::new(D, d, L_a);
        let gauge = taper.gauge(x_ss, l);
        let driven = Driven::of_users(*kind, drive);
        let (tap, _) = Pose { model, side, driven, hub, taper, gauge, a, grip }.onset();
        let sure = self.are_sure(&dimensions, gauge, &tap);
        for i in 0..LANES {
            whole[i] = sure.0[i] > 0.0;
            taps[i] = tap.map(|x| x.0[i]);
        }
    }

    /// 1 for taps in the middle of the domain whose θ f (or δ g) is surely a thousandth of its largest value, else 0.
    ///
    /// f is C (u − τ) n(u) w(u), n = b₁ (1 − x1 u) + b₂ (1 − x2 u) = s − t u, and less where the contact is on the gauge; w = 1 + r₀ u, or u. As s −
    /// τ t = 2, it is at most (C/t) w(1/x1).
    #[inline(always)]
    #[allow(non_snake_case)]
    fn are_sure(&self, dimensions: &[Lanes; DIMENSIONS], [x1, x2]: [Lanes; 2], tap: &Tap<Lanes>) -> Lanes {
        let of = Lanes::of;
        let [zero, one, least, most, hub] = [0.0, 1.0, SIZES[0], SIZES[1], self.hub].map(of);
        let [D, d, L_a, x_ss, l, a, drive] = *dimensions;
        let Tap { taper, rest: v, near, far, .. } = *tap;
        let [b1, b2] = [near, far].map(|end| one / (taper * end + v));
        let (t, n) = (x1 * b1 + x2 * b2, b1 * near + b2 * far);
        let (here, highest) = match self.drive {
            Drive::Angle if self.hub == 0.0 => (one, one),
            Drive::Angle => ((a + hub) * x1, (x1 + hub) * a),
            Drive::Displacement => (x1, a),
        };
        let largest = if self.drive == Drive::Angle { of(90.0) } else { most };
        // NaN fails.
        let mut sure = x_ss.if_less(zero, zero, one);
        for size in [D, d, L_a, l, a, drive] {
            sure = least.if_less(size, sure, zero);
        }
        for (small, large) in [
            (D, most),
            (d, most),
            (L_a, most),
            (drive, largest),
            (x_ss + l, L_a),
            (a, L_a),
            (zero, far),
            (x1, x2),
            (of(RESTS[0]), v),
            (v, of(RESTS[1])),
            (of(SURE) * a * highest, v * n * t * here),
        ] {
            sure = small.if_less(large, sure, zero);
        }
        sure
    }
}
