//! Taps of whiskers of their own, framed in lanes: what [`Frame`](crate::tap::Frame) makes of one after the other, to the same bits. Only
//! where that takes few operations, and for taps in the middle of the domain; others are left to it.

use std::array::from_fn;

use crate::cpu::Pack;
use crate::tap::Tap;
use vibrissa_core::physics::{linear::shear_length2, taper::Taper};
use vibrissa_core::scene::{Contact, Drive, Geometry, Model, Setup};

/// Taps that go through the same arithmetic.
const LANES: usize = 4;

type Lanes = Pack<f64, LANES, false>;

/// Dimensions of a tap: D, d, L_a, x_ss, l, a (mm) and the tap angle (degrees).
pub const DIMENSIONS: usize = 7;

/// Least share of the largest linear strain at which the weight of an error is surely 1, with something to spare for rounding.
const SURE: f64 = 1.001e-3;

/// What taps of a setup share that are framed in lanes.
#[derive(Debug, Clone, Copy)]
pub struct Framing {
    /// Poisson's ratio, where the rod shears.
    shear: Option<f64>,
    /// Radius of the pole, mm.
    pole: f64,
}

/// Taps framed in lanes.
#[derive(Debug, Default)]
pub struct Framed {
    /// Dimensions of the taps, those of each kind together.
    pub columns: [Vec<f64>; DIMENSIONS],
    /// The taps, as kernels take them.
    pub taps: Vec<Tap<f64>>,
    /// Which of them are framed.
    pub whole: Vec<bool>,
}

impl Framing {
    /// Of taps of `setup`; `None` where the onset takes more than these few operations: friction, contact on the surface, a hub, a displaced object,
    /// a second gauge.
    pub fn new(setup: &Setup) -> Option<Self> {
        // Without friction no force along the whisker stretches it; the law is the kernel's.
        let Model { geometry, shear, extension: _, surface, pole_radius, nu, contact, material: _ } =
            setup.model;
        let few = geometry == Geometry::Exact
            && matches!(contact, Contact::Frictionless | Contact::Coulomb(0.0))
            && !surface
            && !setup.gauge.second
            && setup.drive == Drive::Angle
            && setup.hub == 0.0;
        few.then_some(Self { shear: shear.then_some(nu), pole: pole_radius })
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
        if crate::cpu::fused() {
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
            let dimension = |c: usize| Pack(from_fn(|i| columns[c][at + i]));
            self.some(from_fn(dimension), taps, whole);
        }
    }

    /// Frames the taps of one pack. Operations and their order are those of `Design`, `Frame` and `Groups` where α, H, μ and ζ are 0, so that
    /// every bit is theirs.
    #[inline(always)]
    #[allow(non_snake_case)]
    fn some(
        &self,
        [D, d, L_a, x1, l, a, theta]: [Lanes; DIMENSIONS],
        taps: &mut [Tap<f64>],
        whole: &mut [bool],
    ) {
        let [zero, one] = [0.0, 1.0].map(Lanes::of);
        let of = Lanes::of;
        let tau = (D - d) / (D * L_a);
        let tan = (D - d) / (of(2.0) * L_a);
        let cos = one / (one + tan * tan).sqrt();
        let x2 = x1 + l * cos;
        let taper = tau * a;
        let v = one - taper;
        let [near, far, width] = [(a - x1) / a, (a - x2) / a, (x2 - x1) / a];
        let radius = of(0.5) * D / a;
        let shear = match self.shear {
            Some(nu) => {
                let taper = |i: usize| Taper { D: D.0[i], tau: tau.0[i], tan_alpha: tan.0[i] };
                Pack(from_fn(|i| shear_length2(&taper(i), nu))) / (of(3.0) * a * a)
            }
            None => zero,
        };
        let angle = Pack(theta.0.map(f64::to_radians));
        let pole = if self.pole == 0.0 { zero } else { of(self.pole) / a };

        let psi = (one + of(2.0) * v) / (of(6.0) * v * v);
        let bare = one / (of(6.0) * v * v);
        let eta = if self.shear.is_some() { bare - shear / v } else { bare };
        let square = one + pole * pole;
        let across = square * psi - eta;
        let right = angle * square;
        let pull = pole * eta;
        let det = across - pole * pull;
        let force = right / det;
        let arc = if self.pole == 0.0 { zero } else { (zero - pull * right) / det };
        let [b1, b2] = [near, far].map(|end| one / (taper * end + v));
        let lever = of(0.5) * b1 * b2 * (near * b1 + far * b2);
        let strain = radius * (force * lever);

        // θ f ≥ 10⁻³ θ f_max, the curve being (u − τ)(s − t u) but for a factor.
        let (s, t) = (b1 + b2, x1 * b1 + x2 * b2);
        let (here, most) = (of(4.0) * t * v * (s * a - t), s * a - taper * t);
        let most = of(SURE) * most * most;
        // What is no number fails the first of these.
        let mut fine = one;
        for positive in [&strain, &across, &det, &near, &v, &theta, &a, &l, &L_a, &d, &D] {
            fine = zero.if_less(*positive, fine, zero);
        }
        for (small, large) in [
            (&zero, &far),
            (&zero, &x1),
            (&most, &here),
            (&(x1 + l), &L_a),
            (&a, &L_a),
            (&theta, &of(89.0)),
            (&strain, &of(f64::MAX)),
            (&(D + d + L_a), &of(f64::MAX)),
        ] {
            fine = large.if_less(*small, zero, fine);
        }
        for i in 0..LANES {
            let at = |x: Lanes| x.0[i];
            whole[i] = at(fine) > 0.0;
            taps[i] = Tap {
                taper: at(taper),
                rest: at(v),
                angle: at(angle),
                hub: 0.0,
                near: at(near),
                far: at(far),
                width: at(width),
                shear: at(shear),
                weight: 1.0,
                radius: at(radius),
                contact_radius: 0.0,
                slope: 0.0,
                pole_x: 1.0,
                pole_y: at(pole),
                ratio: 0.0,
                force: at(force),
                along: 0.0,
                arc: at(arc),
                strain: at(strain),
            };
        }
    }
}
