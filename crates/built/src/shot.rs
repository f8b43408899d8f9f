//! The closure of a tap: the distance by which a rod under a load misses the object.

use vibrissa_kernel::cpu::Packed;

use super::lanes::{Bent, Fixed, Ground, Load};

pub const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// A bent rod, and its miss over a.
#[derive(Default)]
pub struct Shot<P> {
    pub load: Load<P>,
    pub bent: Bent<P>,
    pub miss: [P; 2],
    pub wrench: [P; 3],
}

/// `v` rotated by the angle with this 1 − cos and sin.
#[inline(always)]
fn rotated<P: Packed>(v: [P; 2], [versine, sine]: [P; 2]) -> [P; 2] {
    [v[0] - versine * v[0] - sine * v[1], v[1] - versine * v[1] + sine * v[0]]
}

#[inline(always)]
fn rotated_back<P: Packed>(v: [P; 2], [versine, sine]: [P; 2]) -> [P; 2] {
    [v[0] - versine * v[0] + sine * v[1], v[1] - versine * v[1] - sine * v[0]]
}

impl<P: Packed> Ground<P> {
    /// Shoots with the unknowns P/`force` and (c − a)/a, or T/`force` of a sticking contact, at `share` of the drive.
    #[inline(always)]
    pub fn shoot(&self, fixed: &Fixed<P::Scalar>, share: P, z: [P; 2], judging: bool) -> Shot<P> {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let normal = self.force * z[0];
        let (x, tangential) = match self.effects.stick {
            true => (zero, self.force * z[1]),
            false => (self.a * z[1], self.ratio * normal),
        };
        let load = self.load(self.a + x, normal, tangential);
        let bent = self.bend(fixed, &load, judging);
        let [turned, along, across, _, rest_x, rest_y] = bent.state;

        let (base_x, base_y) = (load.arc - along - rest_x, load.height - across - rest_y);
        let moment = base_x * load.force[1] - base_y * load.force[0];
        // From the contact's frame into that of the resting base: rotated by the rest angle.
        let (mut behind, mut leaned) = (zero, zero);
        if self.shape.curved {
            [behind, leaned] = self.rest(fixed, zero, load.arc);
        }
        let [k_theta, k_x, k_y] = self.root;
        let beta = moment * k_theta - turned;
        let by = fixed.turn(beta);
        let force = rotated(rotated_back(load.force, [behind, leaned]), by);
        let moved = rotated_back([along, across], [behind, leaned]);

        let ([pole_x, pole_y], shift) = self.poles(fixed, &load, x);
        let theta = self.turn * share;
        let [versine_t, sine_t] = fixed.turn(theta);
        // Rot(β) − Rot(−θ) = 2 sin((β + θ)/2) Rot((β − θ)/2 + 90°).
        let half = P::of(0.5);
        let [_, apart] = fixed.turn(half * (beta + theta));
        let [mean_v, mean_s] = fixed.turn(half * (beta - theta));
        let mean_c = one - mean_v;
        let twice = apart + apart;
        let swing =
            [zero - twice * (mean_s * pole_x + mean_c * pole_y), twice * (mean_c * pole_x - mean_s * pole_y)];
        let carried = rotated([shift[0] - moved[0], shift[1] - moved[1]], by);
        let miss_x = force[0] * k_x + carried[0] + swing[0] + self.hub * versine_t;
        let miss_y = force[1] * k_y + carried[1] + swing[1] + self.hub * sine_t + self.lift * share;
        let scale = one / self.a;
        Shot { load, bent, miss: [miss_x * scale, miss_y * scale], wrench: [moment, force[0], force[1]] }
    }

    /// 1 − cos and sin of the angle by which the resting whisker turns from the arc `to` back to `from`.
    #[inline(always)]
    fn rest(&self, fixed: &Fixed<P::Scalar>, from: P, to: P) -> [P; 2] {
        let [base, rising] = self.curvature;
        fixed.turn((to - from) * (base + P::of(0.5) * rising * (to + from)))
    }

    /// Vector along the resting whisker from one arc to another, by Gauss's rule of four points on each of `parts`.
    #[inline(always)]
    fn path(&self, fixed: &Fixed<P::Scalar>, from: P, to: P, parts: usize) -> [P; 2] {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let (mut px, mut py) = (zero, zero);
        let part = (to - from) * P::of(1.0 / parts as f64);
        for k in 0..parts {
            for [node, weight] in GAUSS {
                let s = from + part * P::of(k as f64 + node);
                let [behind, leaned] = self.rest(fixed, zero, s);
                let weight = part * P::of(weight);
                px = px + weight * (one - behind);
                py = py - weight * leaned;
            }
        }
        [px, py]
    }

    /// The pole's centre, from the base, on the resting whisker with contact at a; and its shift for contact at the arc a + `x` of `load`.
    #[inline(always)]
    fn poles(&self, fixed: &Fixed<P::Scalar>, load: &Load<P>, x: P) -> ([P; 2], [P; 2]) {
        let zero = P::of(0.0);
        let (height, tilt) = self.touched(self.a);
        let here = [self.pole * tilt[0], height + self.pole * tilt[1]];
        let there = [self.pole * load.tilt[0], load.height + self.pole * load.tilt[1]];
        if !self.shape.curved {
            return ([self.a + here[0], here[1]], [x + there[0] - here[0], there[1] - here[1]]);
        }
        let base = self.path(fixed, zero, self.a, 6);
        let way = self.path(fixed, self.a, self.a + x, 2);
        // Rot(ψ₀(a)): ψ₀ = −(the turn of the resting whisker).
        let rest = self.rest(fixed, zero, self.a);
        let [more, less] = self.rest(fixed, self.a, self.a + x);
        let moved = [
            there[0] - here[0] - more * there[0] + less * there[1],
            there[1] - here[1] - more * there[1] - less * there[0],
        ];
        let (at, moved) = (rotated_back(here, rest), rotated_back(moved, rest));
        ([base[0] + at[0], base[1] + at[1]], [way[0] + moved[0], way[1] + moved[1]])
    }
}
