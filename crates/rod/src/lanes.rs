//! Taps in lanes: linear theory, passes, the closure and its Newton step, the gauge.

use vibrissa_core::physics::real::Real;
use vibrissa_core::physics::number::Number;
use vibrissa_kernel::cpu::law::Law;
use vibrissa_kernel::cpu::pack::{Packed, Scalar};

use super::lane::{Dual, Lane};
use super::panel::{Carried, Panel, Part, Stuff};
use super::rule::{Rule, Turns, dot};
use super::{Effects, Tap};

type Two<P> = [P; 2];

#[inline(always)]
fn add<P: Packed>(a: Two<P>, b: Two<P>) -> Two<P> {
    [a[0] + b[0], a[1] + b[1]]
}
#[inline(always)]
fn times<P: Packed>(x: P, a: Two<P>) -> Two<P> {
    [x * a[0], x * a[1]]
}
/// `v` turned by 90°.
#[inline(always)]
fn square<P: Packed>([x, y]: Two<P>) -> Two<P> {
    [P::of(0.0) - y, x]
}
/// (Rot − 1) v of the turn with this 1 − cos and sin.
#[inline(always)]
fn turned<P: Packed>(v: Two<P>, [versine, sine]: Two<P>) -> Two<P> {
    [P::of(0.0) - versine * v[0] - sine * v[1], sine * v[0] - versine * v[1]]
}
#[inline(always)]
fn cross<P: Packed>(a: Two<P>, b: Two<P>) -> P {
    a[0] * b[1] - a[1] * b[0]
}
/// Columns by x and by y, times F.
#[inline(always)]
fn of_force<P: Packed>(columns: &[Two<P>; 2], force: Two<P>) -> Two<P> {
    add(times(force[0], columns[0]), times(force[1], columns[1]))
}
#[inline(always)]
fn one_of<P: Packed>(pair: Two<P>, force: Two<P>) -> P {
    pair[0] * force[0] + pair[1] * force[1]
}

/// What does not change while a pack is solved.
pub struct Ground<P, const N: usize, const S: usize> {
    pub effects: Effects,
    pub stuff: Stuff<P>,
    parts: Vec<Part<P>>,
    panels: Vec<Panel<P, N>>,
    slides: Vec<Panel<P, S>>,
    turn: P,
    /// Drive: θ or δ/a.
    drive: P,
    ratio: P,
    /// ρ/a.
    pole: P,
    contact_radius: P,
    contact_slope: P,
    normal: Two<P>,
    /// κ0 at a.
    bend: P,
    /// Base section to the pole's centre, and the motor's axis to it.
    centre: Two<P>,
    arm: Two<P>,
    /// Compliances of the root: 1/k_theta, and the columns of the displacement.
    soft: P,
    shift: [Two<P>; 2],
    /// Of a unit force along and across: displacement of the pole's centre; motion of the base seen from the contact; turn of the contact; moment at the base; turn of the base by a unit moment
    give: [Two<P>; 2],
    bent: [Two<P>; 2],
    beta: Two<P>,
    moment: Two<P>,
    pivot: P,
    /// Motion of the pole's centre by a unit of arc.
    slid: Two<P>,
    /// Linear theory: P, T and x of the drive; strain.
    first: [P; 3],
    strain: P,
    /// Mean of R/EI under the gauge.
    mean: P,
    gauge: Two<P>,
    least: P,
    scale: [P; 2],
    soften: Option<[P; 2]>,
}

pub struct Fixed<T, const N: usize, const S: usize> {
    pub rule: Rule<T, N>,
    pub slide: Rule<T, S>,
    pub turns: Turns<T>,
    pub law: Option<Law<T>>,
    pub gauge: Vec<(T, T)>,
}

#[derive(Clone, Copy)]
pub struct Answer<P> {
    pub strain: P,
    /// Strain over that of linear theory, less 1.
    pub deviation: P,
    pub normal: P,
    pub tangential: P,
    pub arc: P,
    pub wrench: [P; 3],
    pub error: P,
    pub load: P,
    pub sweeps: P,
    pub tails: [P; 5],
    pub shown: P,
}

impl<P: Lane, const N: usize, const S: usize> Ground<P, N, S> {
    #[inline(always)]
    pub fn new<'a>(
        fixed: &Fixed<P::Scalar, N, S>,
        effects: Effects,
        lane: impl Fn(usize) -> &'a Tap<'a, P::One>,
    ) -> Self
    where
        P::One: 'a,
    {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let pack = |f: &dyn Fn(&Tap<'a, P::One>) -> P::One| P::collect(|i| f(lane(i)));
        let count = lane(0).rod.pieces.len();
        let infinite = |x: P::One, a: P::One| if x.value() > 1e30 { P::One::of(1e30) } else { x / a };
        let parts: Vec<Part<P>> = (0..count)
            .map(|k| Part {
                near: pack(&|t| t.rod.pieces[k].near / t.a),
                far: pack(&|t| infinite(t.rod.pieces[k].far, t.a)),
                radius: [pack(&|t| t.rod.pieces[k].radius[0] / t.a), pack(&|t| t.rod.pieces[k].radius[1])],
                inner: [pack(&|t| t.rod.pieces[k].inner[0] / t.a), pack(&|t| t.rod.pieces[k].inner[1])],
                bends: pack(&|t| t.rod.pieces[k].bends),
            })
            .collect();
        let power = |k: usize| {
            pack(&|t| match t.rod.power {
                Some([base, tip, n, length]) => [(base - tip) / t.a, tip / t.a, n, t.a / length][k],
                None => P::One::of(0.0),
            })
        };
        let [k0, k1] = [pack(&|t| t.rod.curvature[0] * t.a), pack(&|t| t.rod.curvature[1] * t.a * t.a)];
        let stuff = Stuff {
            core: pack(&|t| t.rod.moduli[1] / t.rod.moduli[0]),
            quarter: pack(&|t| t.rod.nu * 0.5 + 0.75),
            curvature: [k0, k1],
            power: std::array::from_fn(power),
            rest: zero - (k0 + of(0.5) * k1),
            softer: pack(&|t| t.softer),
        };
        // The piece that holds the contact; a cone's diameter continues.
        let holder = pack(&|t| P::One::of(t.rod.pieces.partition_point(|p| p.near.value() <= t.a.value()).max(1) as f64 - 1.0));
        let mut contact = parts[0];
        for (k, part) in parts.iter().enumerate().skip(1) {
            let here = of(k as f64 - 0.5);
            let pick = |now: P, then: P| here.if_less(holder, now, then);
            contact = Part {
                near: pick(part.near, contact.near),
                far: pick(part.far, contact.far),
                radius: [pick(part.radius[0], contact.radius[0]), pick(part.radius[1], contact.radius[1])],
                ..*part
            };
        }
        let (contact_radius, contact_slope) = if effects.surface {
            let slope = if effects.power {
                let [wider, _, n, length] = stuff.power;
                zero - wider * n * length * (one - length).pow(n - one)
            } else {
                contact.radius[1]
            };
            (contact.radius(&effects, &stuff, one), slope)
        } else {
            (zero, zero)
        };
        let bend = k0 + k1;
        let normal = Self::normal_of(contact_radius, contact_slope, bend);
        let pole = pack(&|t| t.pole / t.a);
        let mut panels: Vec<Panel<P, N>> = Vec::with_capacity(count);
        for part in parts.iter().rev() {
            let ends = [part.near.min(one), part.far.min(one)];
            if (ends[1] - ends[0]).all_at_most(zero) {
                continue;
            }
            let mut panel = Panel::new(&fixed.rule, &effects, &stuff, part, ends, false);
            if effects.curved {
                panel.curve(&fixed.turns, &stuff);
            }
            panels.push(panel);
        }
        let slides = match count {
            1 => vec![Panel::new(&fixed.slide, &effects, &stuff, &parts[0], [one, one], true)],
            _ => parts.iter().rev().chain(&parts).map(|part| Panel::new(&fixed.slide, &effects, &stuff, part, [one, one], true)).collect(),
        };
        let (axis, side) = {
            let [versine, over] = fixed.turns.of(stuff.rest);
            let (cos, sin) = (one - versine, stuff.rest - over);
            ([cos, zero - sin], [sin, cos])
        };
        let stress = |t: &Tap<'a, P::One>| t.rod.moduli[0] * t.a;
        let [soft, soft_x, soft_y] = [
            pack(&|t| t.rod.root[0] * stress(t) * t.a * t.a),
            pack(&|t| t.rod.root[1] * stress(t)),
            pack(&|t| t.rod.root[2] * stress(t)),
        ];
        let column = |k: usize| add(times(soft_x * axis[k], axis), times(soft_y * side[k], side));
        let (turn, lift) = (pack(&|t| t.turn), pack(&|t| t.lift / t.a));
        let mut ground = Self {
            effects,
            stuff,
            parts,
            panels,
            slides,
            turn,
            drive: turn + lift,
            ratio: pack(&|t| t.ratio),
            pole,
            contact_radius,
            contact_slope,
            normal,
            bend,
            centre: [zero; 2],
            arm: [zero; 2],
            soft,
            shift: [column(0), column(1)],
            give: [[zero; 2]; 2],
            bent: [[zero; 2]; 2],
            beta: [zero; 2],
            moment: [zero; 2],
            pivot: zero,
            slid: [zero; 2],
            first: [zero; 3],
            strain: zero,
            mean: zero,
            gauge: [pack(&|t| t.rod.gauge[0] / t.a), pack(&|t| t.rod.gauge[1] / t.a)],
            least: pack(&|t| t.least),
            scale: [pack(&|t| t.a), pack(&|t| stress(t) * t.a)],
            soften: None,
        };
        let hub = pack(&|t| t.hub / t.a);
        let lifted = pack(&|t| P::One::of(f64::from(t.lift.value() != 0.0)));
        ground.linear(fixed, times(hub, axis), times(lifted, side), lifted);
        ground
    }

    #[inline(always)]
    fn normal_of(radius: P, slope: P, bend: P) -> Two<P> {
        let tan = P::of(0.0) - slope / (P::of(1.0) + bend * radius);
        let cos = P::of(1.0) / (P::of(1.0) + tan * tan).sqrt();
        [tan * cos, cos]
    }

    #[inline(always)]
    fn linear(&mut self, fixed: &Fixed<P::Scalar, N, S>, hub: Two<P>, lift: Two<P>, lifted: P) {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let Effects { curved, extension, shear, .. } = self.effects;
        let n = fixed.rule.count.min(N);
        let (mut reach, mut give, mut turn) = ([zero, self.contact_radius], zero, [zero; 2]);
        for panel in &mut self.panels {
            let mut path = [[zero; N]; 2];
            for i in 0..n {
                path[0][i] = panel.along[i][0] * panel.weight[i];
                path[1][i] = panel.along[i][1] * panel.weight[i];
            }
            let (mut flex, mut bends) = ([zero; N], [[zero; N]; 2]);
            for i in 0..n {
                panel.lever[i] = if curved {
                    add(reach, [dot(n, &fixed.rule.integral[i], &path[0]), dot(n, &fixed.rule.integral[i], &path[1])])
                } else {
                    [one - panel.arc[i], self.contact_radius]
                };
                flex[i] = panel.section[i].flex * panel.weight[i];
                bends[0][i] = flex[i] * panel.lever[i][1];
                bends[1][i] = zero - flex[i] * panel.lever[i][0];
            }
            for i in 0..n {
                let row = &fixed.rule.integral[i];
                panel.give[i] = give + dot(n, row, &flex);
                let along = if curved { turn[0] + dot(n, row, &bends[0]) } else { self.contact_radius * panel.give[i] };
                panel.turn[i] = [along, turn[1] + dot(n, row, &bends[1])];
            }
            reach = if curved {
                add(reach, [dot(n, &fixed.rule.weights, &path[0]), dot(n, &fixed.rule.weights, &path[1])])
            } else {
                [reach[0] + panel.place[1], reach[1]]
            };
            give = give + dot(n, &fixed.rule.weights, &flex);
            turn = add(turn, [dot(n, &fixed.rule.weights, &bends[0]), dot(n, &fixed.rule.weights, &bends[1])]);
        }
        let offset = times(self.pole, self.normal);
        self.centre = add(reach, offset);
        self.arm = add(self.centre, hub);
        // M₀ of a unit force along is −Y, across X.
        self.moment = [zero - reach[1], reach[0]];
        self.pivot = self.soft + give;
        self.beta = [self.soft * self.moment[0] - turn[0], self.soft * self.moment[1] - turn[1]];
        self.give = self.shift;
        for k in 0..2 {
            self.give[k] = add(self.give[k], times(self.soft * self.moment[k], square(self.centre)));
        }
        for panel in &self.panels {
            for i in 0..n {
                let weight = P::splat(fixed.rule.weights[i]) * panel.weight[i];
                let [c, s] = panel.along[i];
                let section = &panel.section[i];
                let (d1, d2) = ([c, s], [zero - s, c]);
                let swing = square(add(panel.lever[i], offset));
                let lever = [zero - panel.lever[i][1], panel.lever[i][0]];
                for k in 0..2 {
                    self.give[k] = add(self.give[k], times(weight * section.flex * lever[k], swing));
                    self.bent[k] = add(self.bent[k], times(weight * panel.turn[i][k], d2));
                    let (mut more, mut any) = ([zero; 2], false);
                    if extension {
                        (more, any) = (add(more, times(weight * section.stretch * d1[k], d1)), true);
                    }
                    if shear {
                        (more, any) = (add(more, times(weight * section.slack * d2[k], d2)), true);
                    }
                    if any {
                        self.give[k] = add(self.give[k], more);
                        self.bent[k] = add(self.bent[k], more);
                    }
                }
            }
        }
        let outer = add([zero, self.contact_radius], offset);
        self.slid = add([one, self.contact_slope], times(zero - self.bend, square(outer)));
        // A unit drive moves the pole's centre by −J V₀ or along −y.
        let wanted = add(times(lifted - one, square(self.arm)), times(zero - one, lift));
        let (push, drag) = (times(zero - one, self.normal), times(zero - one, square(self.normal)));
        let [force, other] = if self.effects.stick {
            [push, drag]
        } else {
            [add(push, times(self.ratio, drag)), [zero; 2]]
        };
        let first = of_force(&self.give, force);
        let second = if self.effects.stick { of_force(&self.give, other) } else { self.slid };
        let det = one / cross(first, second);
        let (normal, rest) = (cross(wanted, second) * det, cross(first, wanted) * det);
        self.first = if self.effects.stick { [normal, rest, zero] } else { [normal, self.ratio * normal, rest] };
        let begun = self.force_at(self.normal, self.drive * self.first[0], self.drive * self.first[1]);
        self.strain = self.read(fixed, begun, true);
        self.mean = self.read_mean(fixed);
    }

    /// The force of P and T on the whisker, along and across it at rest at a.
    #[inline(always)]
    fn force_at(&self, normal: Two<P>, push: P, drag: P) -> Two<P> {
        let zero = P::of(0.0);
        add(times(zero - push, normal), times(zero - drag, square(normal)))
    }

    /// Mean strain of the gauge by the linear moment of `force`, or by all that is not linear.
    #[inline(always)]
    fn read(&self, fixed: &Fixed<P::Scalar, N, S>, force: Two<P>, linear: bool) -> P {
        let mut sum = P::of(0.0);
        for panel in &self.panels {
            sum = sum + self.under(fixed, &fixed.rule, panel, force, linear, false);
        }
        if !linear {
            for panel in &self.slides {
                if !panel.place[1].abs().all_at_most(P::of(0.0)) {
                    sum = sum + self.under(fixed, &fixed.slide, panel, force, false, true);
                }
            }
        }
        sum / (self.gauge[1] - self.gauge[0])
    }

    #[inline(always)]
    fn read_mean(&self, fixed: &Fixed<P::Scalar, N, S>) -> P {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let [x1, x2] = self.gauge;
        let mut sum = zero;
        for panel in &self.panels {
            let [end, length, _] = panel.place;
            let inside = |s: P| s.max(x1).min(x2);
            let (from, to) = (inside(end - length), inside(end));
            for &(point, weight) in &fixed.gauge {
                let section = panel.part.section(&self.effects, &self.stuff, from + (to - from) * P::splat(point));
                sum = sum + P::splat(weight) * (to - from) * section.radius * section.bare;
            }
        }
        let _ = one;
        sum / (x2 - x1)
    }

    /// Last coefficients of the series of bending and of the moment's growth: over the turn of the base, and over the moment at the gauge.
    #[inline(always)]
    fn tails(&self, fixed: &Fixed<P::Scalar, N, S>, closed: &Closed<P>, strain: P) -> [P; 5] {
        let zero = P::of(0.0);
        let n = fixed.rule.count.min(N);
        let [fx, fy] = closed.force;
        let (mut bend, mut pull, mut lag) = (zero, zero, zero);
        for panel in &self.panels {
            let (mut bends, mut lags) = ([zero; N], [zero; N]);
            for i in 0..n {
                let moment = panel.entry[0] + dot(n, &fixed.rule.integral[i], &panel.pull);
                let whole = moment + panel.lever[i][0] * fy - panel.lever[i][1] * fx;
                bends[i] = whole * panel.section[i].flex * panel.weight[i];
                lags[i] = moment * panel.section[i].flex * panel.weight[i];
            }
            for k in n - 2..n {
                bend = bend + dot(n, &fixed.rule.legendre[k], &bends).abs();
                lag = lag + dot(n, &fixed.rule.legendre[k], &lags).abs();
                pull = pull + dot(n, &fixed.rule.legendre[k], &panel.pull).abs();
            }
        }
        let (mut slid, mut drawn) = (zero, zero);
        let m = fixed.slide.count.min(S);
        for panel in &self.slides {
            if panel.place[1].abs().all_at_most(zero) {
                continue;
            }
            let mut lags = [zero; S];
            for i in 0..m {
                let moment = panel.entry[0] + dot(m, &fixed.slide.integral[i], &panel.pull);
                lags[i] = moment * panel.section[i].flex * panel.weight[i];
            }
            for k in m - 1..m {
                slid = slid + dot(m, &fixed.slide.legendre[k], &lags).abs();
                drawn = drawn + dot(m, &fixed.slide.legendre[k], &panel.pull).abs();
            }
        }
        [bend / self.drive, lag / self.drive, pull * self.mean / strain.abs(), slid / self.drive, drawn * self.mean / strain.abs()]
    }

    #[inline(always)]
    fn under<const M: usize>(
        &self,
        fixed: &Fixed<P::Scalar, N, S>,
        rule: &Rule<P::Scalar, M>,
        panel: &Panel<P, M>,
        force: Two<P>,
        linear: bool,
        whole: bool,
    ) -> P {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let Effects { curved, extension, law, far, .. } = self.effects;
        let n = rule.count.min(M);
        let [x1, x2] = self.gauge;
        let [end, length, _] = panel.place;
        let inside = |s: P| s.max(x1).min(x2);
        let (from, to) = (inside(end - length), inside(end));
        if (to - from).abs().all_at_most(zero) {
            return zero;
        }
        let [w1, w2] = [from, to].map(|s| panel.place_of(s).max(zero).min(one));
        let w1 = (to - from).abs().if_less(of(1e-30), w2, w1);
        let side = if far { of(-1.0) } else { one };
        let mut pulls = [zero; M];
        let (mut angles, mut levers) = ([zero; M], [[zero; M]; 2]);
        for k in 0..n {
            pulls[k] = dot(n, &rule.legendre[k], &panel.pull);
        }
        if extension {
            let mut turns = [zero; M];
            for i in 0..n {
                turns[i] = panel.lag[i] + panel.turn[i][0] * force[0] + panel.turn[i][1] * force[1];
            }
            for k in 0..n {
                angles[k] = dot(n, &rule.legendre[k], &turns);
            }
        }
        if curved {
            let (mut x, mut y) = ([zero; M], [zero; M]);
            for i in 0..n {
                (x[i], y[i]) = (panel.lever[i][0], panel.lever[i][1]);
            }
            for k in 0..n {
                levers[0][k] = dot(n, &rule.legendre[k], &x);
                levers[1][k] = dot(n, &rule.legendre[k], &y);
            }
        }
        let mut sum = zero;
        for &(point, weight) in &fixed.gauge {
            let w = w2 + (w1 - w2) * P::splat(point);
            let [s, rate] = panel.at(w);
            let section = panel.part.section(&self.effects, &self.stuff, s);
            let [base, rising] = self.stuff.curvature;
            let local = if curved {
                let angle = zero - (base + of(0.5) * rising * s) * s - self.stuff.rest;
                let [versine, over] = fixed.turns.of(angle);
                let (cos, sin) = (one - versine, angle - over);
                [force[0] * cos + force[1] * sin, force[1] * cos - force[0] * sin]
            } else {
                force
            };
            let lever = match (whole, curved) {
                (true, _) => zero,
                (_, false) => (one - s) * force[1] - self.contact_radius * force[0],
                _ => {
                    series(n, &levers[0], w) * force[1] - series(n, &levers[1], w) * force[0]
                }
            };
            let bending = section.radius * section.bare;
            let strain = if linear {
                let axial = if extension { section.stretch * local[0] } else { zero };
                axial - side * bending * lever
            } else {
                let mut moment = panel.entry[0] + primitive(n, &pulls, w);
                let (mut axial, mut stretched) = (zero, zero);
                if extension {
                    let [versine, over] = fixed.turns.of(series(n, &angles, w));
                    let sine = series(n, &angles, w) - over;
                    stretched = section.stretch * (sine * local[1] - versine * local[0]);
                    axial = section.stretch * local[0] + stretched;
                }
                if whole {
                    stretched = axial;
                }
                if let (Some(chart), true) = (&fixed.law, law) {
                    let whole = lever + moment;
                    let [extra, chi, _] = chart.section(axial, (whole * bending).abs());
                    stretched = stretched + extra;
                    moment = moment + whole * chi;
                }
                stretched - side * bending * moment
            };
            sum = sum + P::splat(weight) * (w1 - w2) * rate * strain;
        }
        sum
    }
}

/// Σ c_k P_k(2w − 1).
#[inline(always)]
fn series<P: Packed, const M: usize>(n: usize, c: &[P; M], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = c[0];
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        sum = sum + c[k] * now;
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}

/// ∫₀^w of the series.
#[inline(always)]
fn primitive<P: Packed, const M: usize>(n: usize, c: &[P; M], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = c[0] * w;
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        sum = sum + c[k] * (next - before) * of(0.5 / (2.0 * kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}

/// Unknowns of a pack: P over that of linear theory, less 1; c − 1 less that of linear theory, or T less that of linear theory, over its P.
#[derive(Clone, Copy)]
struct State<P> {
    force: P,
    other: P,
}

struct Closed<P> {
    miss: Two<P>,
    columns: [Two<P>; 2],
    force: Two<P>,
    normal: P,
    tangential: P,
    x: P,
    beta: P,
    moment: P,
    carried: Carried<P>,
}

impl<P: Lane, const N: usize, const S: usize> Ground<P, N, S> {
    #[inline(always)]
    fn contact(&self, state: &State<P>) -> (P, P, P) {
        let push = self.drive * self.first[0] * (P::of(1.0) + state.force);
        if self.effects.stick {
            (push, self.drive * (self.first[1] + self.first[0] * state.other), P::of(0.0))
        } else {
            (push, self.ratio * push, self.drive * self.first[2] + state.other)
        }
    }

    /// One pass over the rod and the closure.
    #[inline(always)]
    fn sweep(&mut self, fixed: &Fixed<P::Scalar, N, S>, state: &State<P>, done: P) -> Closed<P> {
        let of = P::of;
        let (zero, one, half) = (of(0.0), of(1.0), of(0.5));
        let effects = self.effects;
        let (push, drag, x) = self.contact(state);
        let c = one + x;
        // The contact's frame against that at rest at a.
        let (mut normal, mut radius, mut ahead) = (self.normal, self.contact_radius, [zero; 2]);
        let mut leaned = [zero; 2];
        if effects.surface {
            radius = radius + self.contact_slope * x;
        }
        if effects.curved || effects.power && effects.surface {
            let mut slope = self.contact_slope;
            if effects.power && effects.surface {
                let [wider, tip, n, length] = self.stuff.power;
                let v = one - c * length;
                radius = tip + wider * v.pow(n);
                slope = zero - wider * n * length * v.pow(n - one);
            }
            let [k0, k1] = self.stuff.curvature;
            let bend = k0 + k1 * c;
            let f = zero - (self.bend + half * k1 * x) * x;
            let [versine, over] = fixed.turns.of(f);
            let turn = [versine, f - over];
            normal = Self::normal_of(radius, slope, bend);
            normal = add(normal, turned(normal, turn));
            // The way along the resting whisker, less a straight one.
            for &(point, weight) in &[(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)] {
                let part = x * of(point);
                let angle = zero - (self.bend + half * k1 * part) * part;
                let [versine, over] = fixed.turns.of(angle);
                ahead = add(ahead, times(of(weight) * x, [zero - versine, angle - over]));
            }
            let tip = [zero, radius];
            leaned = add(add(turned(tip, turn), [zero, radius - self.contact_radius - self.contact_slope * x]), times(self.bend * x, square([zero, self.contact_radius])));
        }
        let force = self.force_at(normal, push, drag);
        let tangent = times(of(-1.0), square(normal));
        // M(c) − M of the same force at rest.
        let lift = if effects.curved || effects.power { turned_tip(leaned, self, x) } else { [zero, radius - self.contact_radius] };
        let mut carried = Carried { moment: cross(lift, force), ..Carried::default() };
        if effects.stick {
            carried.friction[0] = cross([zero, radius], tangent);
        }
        // The stretch between a and c: its moment is all of it.
        let whole = cross([zero, self.contact_radius], force);
        carried.moment = carried.moment + whole;
        let count = self.parts.len();
        for (k, slide) in self.slides.iter_mut().enumerate() {
            let ends = match count {
                1 => [one, c],
                _ => {
                    let part = &slide.part;
                    let inside = |s: P| s.max(part.near).min(part.far);
                    if k < count { [inside(one), inside(c.max(one))] } else { [inside(one), inside(c.min(one))] }
                }
            };
            slide.put(&fixed.slide, &effects, &self.stuff, ends);
            if (ends[1] - ends[0]).abs().all_at_most(zero) {
                continue;
            }
            if effects.curved {
                slide.curve(&fixed.turns, &self.stuff);
            }
            carried = slide.pass(&fixed.slide, (&fixed.turns, fixed.law.as_ref()), &effects, (force, tangent), done, true, &carried);
        }
        carried.moment = carried.moment - whole;
        for panel in &mut self.panels {
            carried = panel.pass(&fixed.rule, (&fixed.turns, fixed.law.as_ref()), &effects, (force, tangent), done, false, &carried);
        }
        // Closure.
        let begun = self.force_at(self.normal, self.drive * self.first[0], self.drive * self.first[1]);
        let mut change = if effects.stick {
            let unit = self.drive * self.first[0];
            self.force_at(self.normal, unit * state.force, unit * state.other)
        } else {
            times(state.force, begun)
        };
        let mut beyond = add(add(carried.shift, ahead), leaned);
        if effects.curved || effects.power {
            let dn = [normal[0] - self.normal[0], normal[1] - self.normal[1]];
            change = add(change, self.force_at(dn, push, drag));
            beyond = add(beyond, times(self.pole, add(dn, times(self.bend * x, square(self.normal)))));
        }
        let moment = one_of(self.moment, force) + carried.moment;
        let later = self.soft * carried.moment - carried.lag;
        let beta = one_of(self.beta, force) + later;
        let [versine, over] = fixed.turns.of(beta);
        let by = [versine, beta - over];
        let moved = add(add(of_force(&self.bent, force), times(x, self.slid)), beyond);
        let place = add(self.centre, moved);
        let mut miss = add(of_force(&self.give, change), beyond);
        if !effects.stick {
            miss = add(miss, times(state.other, self.slid));
        }
        miss = add(miss, times(later - over, square(self.centre)));
        miss = add(miss, times(zero - versine, self.centre));
        miss = add(miss, turned(moved, by));
        let turned_force = turned(force, by);
        miss = add(miss, of_force(&self.shift, turned_force));
        let [versine_t, over_t] = fixed.turns.of(self.turn);
        miss = add(miss, add(times(versine_t, self.arm), times(zero - over_t, square(self.arm))));

        let rotate = |v: Two<P>| add(v, turned(v, by));
        let root = of_force(&self.shift, add(force, turned_force));
        let share = one / (one + state.force);
        let by_force = times(share, add(rotate(add(carried.swept, times(beta, square(place)))), root));
        let by_other = if effects.stick {
            let [m, t, vx, vy] = carried.friction;
            let beta_t = self.soft * m - t;
            let column = add(rotate(add([vx, vy], times(beta_t, square(place)))), of_force(&self.shift, rotate(tangent)));
            times(self.drive * self.first[0], column)
        } else {
            let q = cross([one, self.contact_slope], force);
            let v = add(self.slid, times(zero - q, carried.pivoted));
            rotate(add(v, times(q * self.pivot, square(place))))
        };
        Closed { miss, columns: [by_force, by_other], force, normal: push, tangential: drag, x, beta, moment, carried }
    }

    #[inline(always)]
    pub fn solve(&mut self, fixed: &Fixed<P::Scalar, N, S>, tolerance: f64, most: usize) -> Answer<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let mut state = State { force: zero, other: zero };
        let mut done = zero;
        let mut sweeps = zero;
        let mut error = of(1.0);
        let mut last = of(1.0);
        let mut rate = zero;
        let stop = of((0.1 * tolerance).max(4.0 * P::Scalar::ROUNDING));
        let mut closed = self.sweep(fixed, &state, done);
        let trace = std::env::var("TRACE").is_ok();
        for count in 1..=most {
            let det = one / cross(closed.columns[0], closed.columns[1]);
            let step = [cross(closed.miss, closed.columns[1]) * det, cross(closed.columns[0], closed.miss) * det];
            let size = step[0].abs().max(step[1].abs());
            if trace {
                eprintln!("{count} p {:.9} o {:.9} step {:.3e} {:.3e} miss {:.3e} {:.3e}", state.force.lane(0), state.other.lane(0), step[0].lane(0), step[1].lane(0), closed.miss[0].lane(0), closed.miss[1].lane(0));
            }
            let pick = |new: P, old: P| zero.if_less(done, old, new);
            let share = one.min(of(0.5) / size.max(of(1e-30)));
            state.force = pick(state.force - share * step[0], state.force);
            state.other = pick(state.other - share * step[1], state.other);
            rate = pick((size / last).max(of(0.5) * rate).min(of(0.9)).max(of(0.05)), rate);
            last = pick(size, last);
            error = pick(size * rate / (one - rate), error);
            sweeps = sweeps + pick(one, zero);
            done = stop.if_less(error, done, one);
            if one.all_at_most(done) {
                break;
            }
            closed = self.sweep(fixed, &state, done);
        }
        self.answer(fixed, &state, &closed, error, sweeps)
    }

    #[inline(always)]
    fn answer(&self, fixed: &Fixed<P::Scalar, N, S>, state: &State<P>, closed: &Closed<P>, error: P, sweeps: P) -> Answer<P> {
        let one = P::of(1.0);
        let (push, drag, x) = self.contact(state);
        let dev = self.read(fixed, closed.force, false);
        let ratio = dev / self.strain;
        let deviation = state.force + ratio;
        let linear = if self.effects.curved || self.effects.power || self.effects.stick { self.read(fixed, closed.force, true) } else { self.strain * (one + state.force) };
        let strain = linear + dev;
        let [versine, over] = fixed.turns.of(closed.beta);
        let force = add(closed.force, turned(closed.force, [versine, closed.beta - over]));
        let base = {
            let [versine, over] = fixed.turns.of(self.stuff.rest);
            add(force, turned(force, [versine, self.stuff.rest - over]))
        };
        let [length, unit] = self.scale;
        Answer {
            strain,
            deviation,
            normal: push * unit,
            tangential: drag * unit,
            arc: (one + x) * length,
            wrench: [closed.moment * unit * length, base[0] * unit, base[1] * unit],
            error,
            load: closed.carried.load,
            sweeps,
            tails: self.tails(fixed, closed, strain),
            shown: self.mean * cross([one, self.contact_slope], closed.force).abs() / strain.abs(),
        }
    }
}

/// The part of a shift of the contact's edge that turns its lever.
#[inline(always)]
fn turned_tip<P: Lane, const N: usize, const S: usize>(leaned: Two<P>, ground: &Ground<P, N, S>, x: P) -> Two<P> {
    // R_c Rot(f) ŷ − R_a ŷ = leaned + x (R′ ŷ − κ J R_a ŷ)…, less the growth that is counted apart.
    let zero = P::of(0.0);
    let linear = add([zero, ground.contact_slope * x], times(zero - ground.bend * x, square([zero, ground.contact_radius])));
    let all = add(leaned, linear);
    [all[0], all[1]]
}

impl<Q: Lane<One = f64>, const K: usize, const N: usize, const S: usize> Ground<Dual<Q, K>, N, S> {
    /// Newton's method with the derivatives of the passes themselves: for taps on which the shape follows slowly.
    #[inline(always)]
    pub fn solve_exactly(&mut self, fixed: &Fixed<Q::Scalar, N, S>, tolerance: f64, most: usize) -> Answer<Dual<Q, K>> {
        let of = Q::of;
        let (zero, one) = (of(0.0), of(1.0));
        let mut z = [zero; 2];
        let mut done = zero;
        let (mut error, mut sweeps) = (one, zero);
        let stop = of((0.1 * tolerance).max(4.0 * Q::Scalar::ROUNDING));
        let seeds = |z: [Q; 2]| State { force: Dual::seed(z[0], 0), other: Dual::seed(z[1], 1) };
        let mut frozen = Dual::default();
        let mut closed = self.sweep(fixed, &seeds(z), frozen);
        let trace = std::env::var("TRACE").is_ok();
        for count in 1..=most {
            let [[ex, ey], [fx, fy]] = [[closed.miss[0].slope[0], closed.miss[1].slope[0]], [closed.miss[0].slope[1], closed.miss[1].slope[1]]];
            let miss = [closed.miss[0].value, closed.miss[1].value];
            let det = one / (ex * fy - ey * fx);
            let step = [(miss[0] * fy - miss[1] * fx) * det, (ex * miss[1] - ey * miss[0]) * det];
            let size = step[0].abs().max(step[1].abs());
            if trace {
                eprintln!("exact {count} p {:.9} o {:.9} step {:.3e} {:.3e} miss {:.3e} {:.3e}", z[0].lane(0), z[1].lane(0), step[0].lane(0), step[1].lane(0), miss[0].lane(0), miss[1].lane(0));
            }
            let share = one.min(of(0.5) / size.max(of(1e-30)));
            let step = [zero.if_less(done, zero, share * step[0]), zero.if_less(done, zero, share * step[1])];
            z = [z[0] - step[0], z[1] - step[1]];
            for panel in &mut self.panels {
                follow(&mut panel.lag, step);
            }
            for panel in &mut self.slides {
                follow(&mut panel.lag, step);
            }
            error = zero.if_less(done, error, size);
            sweeps = sweeps + zero.if_less(done, zero, one);
            done = stop.if_less(error, done, one);
            if one.all_at_most(done) {
                break;
            }
            frozen.value = done;
            closed = self.sweep(fixed, &seeds(z), frozen);
        }
        let plain = |x: Q| Dual { value: x, ..Dual::default() };
        self.answer(fixed, &seeds(z), &closed, plain(error), plain(sweeps))
    }
}

/// The shape follows a step of the unknowns.
#[inline(always)]
fn follow<Q: Packed, const K: usize, const N: usize>(lag: &mut [Dual<Q, K>; N], step: [Q; 2]) {
    for i in 0..N {
        lag[i].value = lag[i].value - step[0] * lag[i].slope[0] - step[1] * lag[i].slope[1];
    }
}
