//! Taps in lanes: what stays constant during a solve, and the rod under a trial load.

use vibrissa_core::physics::tableau::{A, B, C, STAGES};
use vibrissa_kernel::cpu::law::{Law, polynomial};
use vibrissa_kernel::cpu::{Packed, Scalar, series};
use vibrissa_kernel::{Chart, rule::limits::TINY};

use super::{Effects, Piece, Shape, Tap, newton};

/// Accurate up to |x| = 2 rad.
pub const TERMS: usize = 14;

/// The largest ratio of radii over which 1/R is linear within a step.
pub const STEEPEST: f64 = 30.0;

/// A floor for squares: above underflow, and its root is below every error of interest.
pub fn least_square(rounding: f64) -> f64 {
    if rounding > 1e-10 { 1e-36 } else { 1e-300 }
}

pub struct Fixed<T> {
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
    pub law: Option<Law<T>>,
}

impl<T: Scalar> Fixed<T> {
    pub fn new(chart: Option<&Chart>) -> Self {
        let of = |first| series(TERMS, first).into_iter().map(T::of).collect();
        Self { one_minus_cos: of(2), x_minus_sin: of(3), law: chart.map(Law::new) }
    }

    #[inline(always)]
    pub fn turn<P: Packed<Scalar = T>>(&self, x: P) -> [P; 2] {
        let z = x * x;
        [z * polynomial(&self.one_minus_cos, z), x - x * z * polynomial(&self.x_minus_sin, z)]
    }
}

pub struct Lane<P> {
    near: P,
    far: P,
    radius: [P; 2],
    inner: [P; 2],
    gauge: P,
    steps: usize,
}

pub struct Ground<P> {
    pub effects: Effects,
    pub shape: Shape,
    pub strides: usize,
    pieces: Vec<Lane<P>>,
    /// R(0) − R(L_a), R(L_a), 1/L_a and n of each lane.
    power: [P; 4],
    pub a: P,
    pub hub: P,
    pub turn: P,
    pub lift: P,
    pub ratio: P,
    pub force: P,
    pub least: P,
    pub pole: P,
    pub gauge: [P; 2],
    pub root: [P; 3],
    pub curvature: [P; 2],
    moduli: [P; 2],
    /// π E, and ¾ + ν/2.
    skin: [P; 2],
    /// R and R′ at a.
    contact: [P; 2],
}

/// The rod under a load, integrated from the contact to the base, in the contact frame.
#[derive(Clone, Copy, Default)]
pub struct Bent<P> {
    /// ψ and the x, y of the base, as differences to the resting whisker; ∫ of the gauge's fibre strain; the resting base, (c, 0) added.
    pub state: [P; 6],
    /// Estimated errors of ψ, of y and of the fibre integral.
    pub errors: [P; 3],
    /// Largest load of a fibre; `beyond`: that of a section on its chart.
    pub load: P,
    pub beyond: P,
}

impl<P: Packed> Bent<P> {
    /// Restores `before` in lanes whose contact lies below the piece (`length` ≤ 0): other lanes integrate it, these skip it.
    #[inline(always)]
    fn keep(&mut self, length: P, before: &Self) {
        let zero = P::of(0.0);
        let pick = |new: &mut P, old: P| *new = zero.if_less(length, *new, old);
        for m in 0..self.state.len() {
            pick(&mut self.state[m], before.state[m]);
        }
        for m in 0..self.errors.len() {
            pick(&mut self.errors[m], before.errors[m]);
        }
        pick(&mut self.load, before.load);
        pick(&mut self.beyond, before.beyond);
    }
}

/// P and T, in N, at the arc c, in mm.
#[derive(Clone, Copy, Default)]
pub struct Load<P> {
    pub arc: P,
    pub normal: P,
    pub tangential: P,
    pub tilt: [P; 2],
    /// R on the surface, else 0.
    pub height: P,
    /// Along and across the whisker at the contact.
    pub force: [P; 2],
}

impl<P: Packed> Ground<P> {
    pub fn new<'a>(lane: impl Fn(usize) -> &'a Tap<'a>, effects: Effects, steps: usize) -> Self {
        let pack = |f: &dyn Fn(&Tap<'a>) -> f64| P::gather(|i| f(lane(i)));
        let pieces = (0..lane(0).rod.pieces.len()).map(|k| {
            let field = |f: &dyn Fn(&Piece) -> f64| pack(&|tap| f(&tap.rod.pieces[k]).min(1e30));
            Lane {
                near: field(&|p| p.near),
                far: field(&|p| p.far),
                radius: [field(&|p| p.radius[0]), field(&|p| p.radius[1])],
                inner: [field(&|p| p.inner[0]), field(&|p| p.inner[1])],
                gauge: field(&|p| p.gauge),
                steps: lane(0).rod.pieces[k].steps(steps),
            }
        });
        let power = |k: usize| {
            pack(&|tap| {
                let [base, tip, n] = tap.rod.power.unwrap_or([0.0; 3]);
                [base - tip, tip, 1.0 / tap.rod.length, n][k]
            })
        };
        let whisker = |f: &dyn Fn(&super::Rod) -> f64| pack(&|tap| f(tap.rod));
        Self {
            effects,
            shape: Shape::of(lane(0).rod),
            strides: newton::strides(lane(0)),
            pieces: pieces.collect(),
            power: std::array::from_fn(power),
            a: pack(&|tap| tap.a),
            hub: pack(&|tap| tap.hub),
            turn: pack(&|tap| tap.turn),
            lift: pack(&|tap| tap.lift),
            ratio: pack(&|tap| tap.ratio),
            force: pack(&|tap| tap.force),
            least: pack(&|tap| tap.least),
            pole: pack(&|tap| tap.pole),
            gauge: std::array::from_fn(|k| whisker(&|rod| rod.gauge[k])),
            root: std::array::from_fn(|k| whisker(&|rod| rod.root[k])),
            curvature: std::array::from_fn(|k| whisker(&|rod| rod.curvature[k])),
            moduli: std::array::from_fn(|k| whisker(&|rod| rod.moduli[k])),
            skin: [whisker(&|rod| std::f64::consts::PI * rod.moduli[0]), whisker(&|rod| 0.75 + 0.5 * rod.nu)],
            contact: std::array::from_fn(|k| pack(&|tap| tap.rod.radius(tap.a, tap.a)[k])),
        }
    }

    /// R and R′ at `s` of a diameter that is a power of the distance from the tip.
    #[inline(always)]
    fn powered(&self, s: P, sloped: bool) -> [P; 2] {
        let [wider, tip, length, n] = self.power;
        let v = P::of(1.0) - s * length;
        let power =
            |less: f64| P::gather(|i| if v.lane(i) > 0.0 { v.lane(i).powf(n.lane(i) - less) } else { 0.0 });
        let (vn, slope) = (power(0.0), if sloped { power(1.0) } else { P::of(0.0) });
        [tip + wider * vn, P::of(0.0) - wider * n * length * slope]
    }

    /// R and R′ at the arc `s`, by the piece that holds a.
    #[inline(always)]
    fn radius(&self, s: P) -> [P; 2] {
        if self.shape.power {
            return self.powered(s, true);
        }
        let [at, slope] = self.contact;
        [at + slope * (s - self.a), slope]
    }

    /// R and sin α, cos α of a contact at the arc `s`; 0, 0 and 1 on the centreline.
    #[inline(always)]
    pub fn touched(&self, s: P) -> (P, [P; 2]) {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        if !self.effects.surface {
            return (zero, [zero, one]);
        }
        let [radius, slope] = self.radius(s);
        let mut tan = zero - slope;
        if self.shape.curved {
            let [base, rising] = self.curvature;
            tan = tan / (one + (base + rising * s) * radius);
        }
        let cos = one / (one + tan * tan).sqrt();
        (radius, [tan * cos, cos])
    }

    #[inline(always)]
    pub fn load(&self, arc: P, normal: P, tangential: P) -> Load<P> {
        let (height, [sin, cos]) = self.touched(arc);
        let zero = P::of(0.0);
        let force = [tangential * cos - normal * sin, zero - normal * cos - tangential * sin];
        Load { arc, normal, tangential, tilt: [sin, cos], height, force }
    }

    #[inline(always)]
    pub fn bend(&self, fixed: &Fixed<P::Scalar>, load: &Load<P>, judging: bool) -> Bent<P> {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let mut bent = Bent { state: [zero; 6], errors: [zero; 3], load: zero, beyond: zero };
        let states = if self.shape.curved { 6 } else { 4 };
        let mut slopes = [[zero; 6]; STAGES];
        for k in 0..self.pieces.len() {
            let piece = &self.pieces[self.pieces.len() - 1 - k];
            let (high, low) = (piece.far.min(load.arc), piece.near.min(load.arc));
            let length = high - low;
            if length.all_at_most(zero) {
                continue;
            }
            let [thin, thick] = [self.of_piece(piece, high), self.of_piece(piece, low)];
            let ratio = (thick / thin.max(P::of(TINY))).max(P::of(1.0 / STEEPEST)).min(P::of(STEEPEST));
            let step = 1.0 / piece.steps as f64;
            let before = bent;
            for number in 0..piece.steps {
                for stage in 0..STAGES {
                    let mut state = bent.state;
                    for &(before, weight) in A[stage] {
                        let weight = P::of(step * weight);
                        for m in 0..states {
                            state[m] = weight.mul_add(slopes[before][m], state[m]);
                        }
                    }
                    let t = P::of(step * (number as f64 + C[stage]));
                    let spread = t + (one - t) * ratio;
                    let s = high - length * t / spread;
                    let rate = length * ratio / (spread * spread);
                    slopes[stage] = self.slope(fixed, load, piece, (s, rate), &state, &mut bent);
                }
                let mut errors = [[zero; 2]; 3];
                for stage in 0..STAGES {
                    let [all, fifth, third] = B[stage];
                    for m in 0..states {
                        bent.state[m] = P::of(step * all).mul_add(slopes[stage][m], bent.state[m]);
                    }
                    if judging {
                        for (error, m) in errors.iter_mut().zip([0, 2, 3]) {
                            error[0] = P::of(step * fifth).mul_add(slopes[stage][m], error[0]);
                            error[1] = P::of(step * third).mul_add(slopes[stage][m], error[1]);
                        }
                    }
                }
                if judging {
                    for (sum, [fifth, third]) in bent.errors.iter_mut().zip(errors) {
                        let (fifth, third) = (fifth * fifth, third * third);
                        let both =
                            (fifth + P::of(0.01) * third).max(P::of(least_square(P::Scalar::ROUNDING)));
                        *sum = *sum + fifth / both.sqrt();
                    }
                }
            }
            bent.keep(length, &before);
        }
        bent
    }

    #[inline(always)]
    fn of_piece(&self, piece: &Lane<P>, s: P) -> P {
        if self.shape.power {
            return self.powered(s, false)[0];
        }
        piece.radius[0] + piece.radius[1] * (s - piece.near)
    }

    /// Derivatives of the state at the arc `s` by the step variable t; `rate` = −ds/dt.
    #[inline(always)]
    fn slope(
        &self,
        fixed: &Fixed<P::Scalar>,
        load: &Load<P>,
        piece: &Lane<P>,
        (s, rate): (P, P),
        state: &[P; 6],
        seen: &mut Bent<P>,
    ) -> [P; 6] {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let Effects { shear, extension, law, far, .. } = self.effects;
        let Shape { curved, inner, .. } = self.shape;
        let [turned, along, across, _, rest_x, rest_y] = *state;
        let [fx, fy] = load.force;
        let distance = load.arc - s;
        let [versine, sine] = fixed.turn(turned);
        let (mut arm_x, mut arm_y) = (distance - along, load.height - across);
        let (mut behind, mut leaned) = (zero, zero);
        if curved {
            let [base, rising] = self.curvature;
            [behind, leaned] = fixed.turn(distance * (base + of(0.5) * rising * (load.arc + s)));
            (arm_x, arm_y) = (arm_x - rest_x, arm_y - rest_y);
        }
        let upright = one - behind;
        let (dx, dy) = match curved {
            true => (zero - upright * versine - leaned * sine, upright * sine - leaned * versine),
            false => (zero - versine, sine),
        };
        let (cos, sin) = (upright + dx, leaned + dy);
        let moment = arm_x * fy - arm_y * fx;
        let axial = fx * cos + fy * sin;

        let r = self.of_piece(piece, s);
        let r2 = r * r;
        let [skin, quarter] = self.skin;
        let (mut area, mut inertia) = (skin * r2, of(0.25) * skin * r2 * r2);
        let (mut p, mut g) = (zero, zero);
        if inner {
            let i = piece.inner[0] + piece.inner[1] * (s - piece.near);
            let i2 = i * i;
            g = self.moduli[1] / self.moduli[0];
            p = i2 / r2;
            let other = skin * (g - one);
            area = area + other * i2;
            inertia = inertia + of(0.25) * other * i2 * i2;
        }
        let mut bending = moment * r / inertia;
        let mut stretch = if extension { axial / area } else { zero };
        if let Some(chart) = fixed.law.as_ref().filter(|_| law) {
            let [extra, chi, beyond] = chart.section(stretch, bending.abs());
            stretch = stretch + extra;
            bending = bending * (one + chi);
            let size = bending.abs();
            seen.load = seen.load.max(stretch + size).max(of(2.0) * (size - stretch));
            seen.beyond = seen.beyond.max(beyond);
        }
        let fibre = if far { stretch + bending } else { stretch - bending };
        let (mut ux, mut uy) = (zero - dx, zero - dy);
        if extension {
            (ux, uy) = (ux - stretch * cos, uy - stretch * sin);
        }
        if shear {
            let across = fy * cos - fx * sin;
            let over = zero - (one - g) * quarter * (one - p) / (one + g - (one - g) * p);
            let (b, a) = (p * over, p * over - quarter);
            let j = of(0.25) * a * (one - p * p)
                + of(0.5) * b * (one - p)
                + of(1.0 / 24.0) * (one - p * p * p)
                + g * (of(0.25) * (a + over) * p * p + of(1.0 / 24.0) * p * p * p);
            let slide = zero - across * skin * r2 * r2 * r2 * j / (inertia * inertia);
            (ux, uy) = (ux + slide * sin, uy - slide * cos);
        }
        [
            zero - rate * bending / r,
            rate * ux,
            rate * uy,
            rate * piece.gauge * fibre,
            rate * behind,
            zero - rate * leaned,
        ]
    }
}
