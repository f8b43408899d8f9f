//! A pack of taps before it is solved: its whisker at the nodes, and linear theory.

use vibrissa_core::physics::number::Number;
use vibrissa_core::physics::real::Real;

use super::lane::Lane;
use super::panel::Panel;
use super::rod::Piece;
use super::rule::{Rule, Turns, dot, dots};
use super::section::{Charted, Whisker};
use super::tilt::Axis;
use super::vector::{Two, add, columns, cross, dot2, square, times};
use super::{Effects, Tap};

/// Constants of a rung of the ladder.
pub struct Fixed<T, const N: usize, const S: usize> {
    /// Nodes of the panels.
    pub rule: Rule<T, N>,
    /// Nodes of the stretch between a and c.
    pub slide: Rule<T, S>,
    /// Series of turns.
    pub turns: Turns<T>,
    /// Section law, if it is not Hooke's.
    pub law: Option<Charted<T>>,
    /// Gauss points on the gauge and their weights.
    pub gauge: Vec<(T, T)>,
    /// The same along a resting whisker.
    pub path: Vec<(T, T)>,
}

/// Panels of the whisker and those between the contact and where it was at rest.
pub type Panels<P, const N: usize, const S: usize> = (Vec<Panel<P, N>>, Vec<Panel<P, S>>);

/// A pack of taps. Lengths in contact distances, forces in E a²; axes along and across the resting whisker at the contact.
pub struct Ground<P, const N: usize, const S: usize> {
    pub effects: Effects,
    pub whisker: Whisker<P>,
    pub parts: Vec<Piece<P>>,
    /// From the contact at rest to the base.
    pub panels: Vec<Panel<P, N>>,
    /// From the contact to where it was at rest: towards the base, then towards the tip.
    pub slides: Vec<Panel<P, S>>,
    /// θ, and θ or δ/a.
    pub turn: P,
    pub drive: P,
    /// T/P of a sliding contact.
    pub ratio: P,
    /// Pole radius ρ.
    pub pole: P,
    /// The pole, where it is tilted.
    pub axis: Axis<P>,
    /// R and R′ at a, 0 on the centreline; the normal there; κ0.
    pub radius: P,
    pub slope: P,
    pub normal: Two<P>,
    pub bend: P,
    /// Hertz's and the linear part of δ(P), in P^⅔ and P.
    pub hertz: Two<P>,
    /// From the base section to the pole's centre, and from the motor's axis.
    pub centre: Two<P>,
    pub arm: Two<P>,
    /// 1/k_theta, and the displacements of the root by a unit force along and across.
    pub soft: P,
    pub root: [Two<P>; 2],
    /// By a unit force along and across: motion of the pole's centre; motion and turn of the base against the contact; moment at the base.
    pub give: [Two<P>; 2],
    pub bent: [Two<P>; 2],
    pub beta: Two<P>,
    pub moment: Two<P>,
    /// Turn of the contact against the motor by a unit moment.
    pub pivot: P,
    /// Motion of the pole's centre by a unit of c.
    pub slid: Two<P>,
    /// ρ cos α of a contact that rolls, and the turn of the base against the contact less the linear one, of the last pass.
    pub roll: P,
    pub later: P,
    /// c/a − 1 of the last pass.
    pub last: P,
    /// P, T and c − 1 of linear theory per unit of the drive, and its strains; where the contact gives way by P^⅔, P and strain at which it begins.
    pub first: [P; 3],
    /// 1 less P of a contact that does not give way over that P.
    pub lack: P,
    pub strain: Two<P>,
    pub gauge: Two<P>,
    /// Mean of R/EI under the gauge.
    pub mean: P,
    pub least: P,
    /// Units of length and force, mm and N.
    pub unit: [P; 2],
}

impl<P: Lane, const N: usize, const S: usize> Ground<P, N, S> {
    #[inline(always)]
    pub fn new<'a>(
        fixed: &Fixed<P::Scalar, N, S>,
        effects: Effects,
        lane: impl Fn(usize) -> &'a Tap<'a, P::One>,
        (mut panels, mut slides): Panels<P, N, S>,
    ) -> Self {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let pack = |f: &dyn Fn(&Tap<'a, P::One>) -> P::One| P::collect(|i| f(lane(i)));
        let count = lane(0).rod.pieces.len();
        let infinite = |x: P::One, a: P::One| if x.value() > 1e30 { P::One::of(1e30) } else { x / a };
        let mut parts: Vec<Piece<P>> = Vec::with_capacity(count);
        for k in 0..count {
            parts.push(Piece {
                near: pack(&|t| t.rod.pieces[k].near / t.a),
                far: pack(&|t| infinite(t.rod.pieces[k].far, t.a)),
                radius: [pack(&|t| t.rod.pieces[k].radius[0] / t.a), pack(&|t| t.rod.pieces[k].radius[1])],
                inner: [pack(&|t| t.rod.pieces[k].inner[0] / t.a), pack(&|t| t.rod.pieces[k].inner[1])],
                bends: pack(&|t| t.rod.pieces[k].bends),
            });
        }
        let power = |k: usize| {
            pack(&|t| match t.rod.power {
                Some([base, tip, n, length]) => [(base - tip) / t.a, tip / t.a, n, t.a / length][k],
                None => P::One::of(0.0),
            })
        };
        let [k0, k1] = [pack(&|t| t.rod.curvature[0] * t.a), pack(&|t| t.rod.curvature[1] * t.a * t.a)];
        let whisker = Whisker {
            core: pack(&|t| t.rod.moduli[1] / t.rod.moduli[0]),
            quarter: pack(&|t| t.rod.nu * P::One::of(0.5) + P::One::of(0.75)),
            curvature: [k0, k1],
            power: std::array::from_fn(power),
            rest: zero - (k0 + of(0.5) * k1),
            softer: pack(&|t| t.softer),
        };
        // The piece that holds the contact; a cone's diameter continues.
        let holder = pack(&|t| {
            P::One::of(t.rod.pieces.partition_point(|p| p.near.value() <= t.a.value()).max(1) as f64 - 1.0)
        });
        let mut contact = parts[0];
        for (k, part) in parts.iter().enumerate().skip(1) {
            let here = of(k as f64 - 0.5);
            let pick = |now: P, then: P| here.if_less(holder, now, then);
            contact = Piece {
                near: pick(part.near, contact.near),
                far: pick(part.far, contact.far),
                radius: [pick(part.radius[0], contact.radius[0]), pick(part.radius[1], contact.radius[1])],
                ..*part
            };
        }
        let (radius, slope) = if effects.surface {
            let slope = if effects.power {
                let [wider, _, n, length] = whisker.power;
                zero - wider * n * length * (one - length).pow(n - one)
            } else {
                contact.radius[1]
            };
            (contact.radius(&effects, &whisker, one), slope)
        } else {
            (zero, zero)
        };
        let bend = k0 + k1;
        let normal = Self::normal_of(radius, slope, bend);
        let pole = pack(&|t| t.pole / t.a);
        let (mut used, of_whisker) = (0, (&effects, &whisker));
        for part in parts.iter().rev() {
            let ends = [part.near.min(one), part.far.min(one)];
            if (ends[1] - ends[0]).all_at_most(zero) {
                continue;
            }
            let panel = Panel::new(&mut panels, used, &fixed.rule, of_whisker, part, ends, false);
            if effects.curved {
                panel.curve(N, &fixed.turns, &whisker);
            }
            used += 1;
        }
        panels.truncate(used);
        // A contact that moves over several pieces crosses them from c to a: towards the base, or towards the tip.
        let both = if count == 1 { 1 } else { 2 * count };
        for k in 0..both {
            let part = &parts[if k < count { count - 1 - k } else { k - count }];
            Panel::new(&mut slides, k, &fixed.slide, of_whisker, part, [one, one], true);
        }
        let [versine, sin] = fixed.turns.rotation(whisker.rest);
        let (axis, side) = ([one - versine, zero - sin], [sin, one - versine]);
        let stress = |t: &Tap<'a, P::One>| t.rod.moduli[0] * t.a;
        let [soft, soft_x, soft_y] = [
            pack(&|t| t.rod.root[0] * stress(t) * t.a * t.a),
            pack(&|t| t.rod.root[1] * stress(t)),
            pack(&|t| t.rod.root[2] * stress(t)),
        ];
        let column = |k: usize| add(times(soft_x * axis[k], axis), times(soft_y * side[k], side));
        let (turn, lift) = (pack(&|t| t.turn), pack(&|t| t.lift / t.a));
        let hertz = if effects.soft {
            [
                pack(&|t| t.soft[0] * (stress(t) * t.a).powf(P::One::of(2.0 / 3.0)) / t.a),
                pack(&|t| t.soft[1] * stress(t)),
            ]
        } else {
            [zero; 2]
        };
        let mut ground = Self {
            effects,
            whisker,
            parts,
            panels,
            slides,
            turn,
            drive: turn + lift,
            ratio: pack(&|t| t.ratio),
            pole,
            axis: if effects.tilt { Axis::new(&lane) } else { Axis::default() },
            radius,
            slope,
            normal,
            bend,
            centre: [zero; 2],
            arm: [zero; 2],
            soft,
            root: [column(0), column(1)],
            give: [[zero; 2]; 2],
            bent: [[zero; 2]; 2],
            beta: [zero; 2],
            moment: [zero; 2],
            pivot: zero,
            slid: [zero; 2],
            roll: if effects.roll { pole * normal[1] } else { zero },
            later: zero,
            last: zero,
            first: [zero; 3],
            lack: zero,
            strain: [zero; 2],
            mean: zero,
            gauge: [pack(&|t| t.rod.gauge[0] / t.a), pack(&|t| t.rod.gauge[1] / t.a)],
            least: pack(&|t| t.least),
            unit: [pack(&|t| t.a), pack(&|t| stress(t) * t.a)],
            hertz,
        };
        let hub = pack(&|t| t.hub / t.a);
        let lifted = pack(&|t| P::One::of(f64::from(t.lift.value() != 0.0)));
        ground.linear(fixed, times(hub, axis), times(lifted, side), lifted);
        ground
    }

    /// The normal of a contact at a place of this R, R′ and κ0, along and across the resting whisker there.
    #[inline(always)]
    pub fn normal_of(radius: P, slope: P, bend: P) -> Two<P> {
        let tan = P::of(0.0) - slope / (P::of(1.0) + bend * radius);
        let cos = P::of(1.0) / (P::of(1.0) + tan * tan).sqrt();
        [tan * cos, cos]
    }

    /// Linear theory, for `hub`: the way from the motor's axis to the base section; `lift`: the direction in which an object moves that moves.
    #[inline(always)]
    fn linear(&mut self, fixed: &Fixed<P::Scalar, N, S>, hub: Two<P>, lift: Two<P>, lifted: P) {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let Effects { curved, extension, shear, .. } = self.effects;
        let n = fixed.rule.nodes();
        let (mut reach, mut give, mut turn) = ([zero, self.radius], zero, [zero; 2]);
        for panel in &mut self.panels {
            panel.begin = reach;
            let mut path = [[zero; N]; 2];
            for i in 0..n {
                path[0][i] = panel.along[i][0] * panel.weight[i];
                path[1][i] = panel.along[i][1] * panel.weight[i];
            }
            let (mut flex, mut bends) = ([zero; N], [[zero; N]; 2]);
            for i in 0..n {
                panel.lever[i] = match curved {
                    true => add(reach, dots(n, &fixed.rule.integral[i], &path)),
                    false => [one - panel.arc[i], self.radius],
                };
                flex[i] = panel.section[i].flex * panel.weight[i];
                bends[0][i] = flex[i] * panel.lever[i][1];
                bends[1][i] = zero - flex[i] * panel.lever[i][0];
            }
            for i in 0..n {
                let row = &fixed.rule.integral[i];
                panel.give[i] = give + dot(n, row, &flex);
                let along =
                    if curved { turn[0] + dot(n, row, &bends[0]) } else { self.radius * panel.give[i] };
                panel.turn[i] = [along, turn[1] + dot(n, row, &bends[1])];
            }
            let weights = &fixed.rule.weights;
            reach = match curved {
                true => add(reach, dots(n, weights, &path)),
                false => [reach[0] + panel.place[1], reach[1]],
            };
            give = give + dot(n, weights, &flex);
            turn = add(turn, dots(n, weights, &bends));
        }
        let offset = times(self.pole, self.normal);
        self.centre = add(reach, offset);
        self.arm = add(self.centre, hub);
        // M₀ of a unit force along is −Y, across X.
        self.moment = [zero - reach[1], reach[0]];
        self.pivot = self.soft + give;
        self.beta = [self.soft * self.moment[0] - turn[0], self.soft * self.moment[1] - turn[1]];
        self.give = self.root;
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
                    for (on, by, d) in [(extension, section.stretch, d1), (shear, section.slack, d2)] {
                        if on {
                            let more = times(weight * by * d[k], d);
                            (self.give[k], self.bent[k]) = (add(self.give[k], more), add(self.bent[k], more));
                        }
                    }
                }
            }
        }
        let outer = add([zero, self.radius], offset);
        self.slid = add([one, self.slope], times(zero - self.bend, square(outer)));
        // A unit drive moves the pole's centre by −J V₀ or along −y.
        let wanted = add(times(lifted - one, square(self.arm)), times(zero - one, lift));
        let (push, drag) = (times(zero - one, self.normal), times(zero - one, square(self.normal)));
        let [force, other] =
            if self.effects.stick { [push, drag] } else { [add(push, times(self.ratio, drag)), [zero; 2]] };
        let first = add(columns(&self.give, force), self.rolled(force));
        let second =
            if self.effects.stick { add(columns(&self.give, other), self.rolled(other)) } else { self.slid };
        let wanted = add(wanted, times((lifted - one) * self.roll, self.slid));
        let det = one / cross(first, second);
        let (normal, rest) = (cross(wanted, second) * det, cross(first, wanted) * det);
        self.first = if self.effects.stick {
            let turn = one - lifted + dot2(self.beta, add(times(normal, push), times(rest, drag)));
            [normal, rest, self.roll * turn]
        } else {
            [normal, self.ratio * normal, rest]
        };
        if self.effects.soft {
            let give = columns(&self.give, self.begun());
            let share = self.share(dot2(give, self.normal).abs());
            self.lack = one - one / share;
            self.first[0] = self.first[0] * share;
        }
        let begun = self.begun();
        (self.strain, self.mean) = self.first_reading(fixed, begun);
    }

    /// P over that of a contact that does not give way, where the whisker alone would yield by `way`.
    #[inline(always)]
    fn share(&self, way: P) -> P {
        let of = P::of;
        let [hertz, plain] = self.depth(self.drive * self.first[0]);
        let (hertz, stiff) = (hertz / way, (of(1.0) + plain / way).max(of(0.1)));
        // Newton's method for the cube root r in stiff r³ + hertz r² = 1, from above.
        let mut root = (of(1.0) / stiff).pow(of(1.0 / 3.0)).min(of(1.0) / hertz.max(of(1e-30)).sqrt());
        for _ in 0..8 {
            let lack = (stiff * root + hertz) * root * root - of(1.0);
            root = root - lack / ((of(3.0) * stiff * root + of(2.0) * hertz) * root);
        }
        root * root * root
    }

    /// Motion of the pole's centre because a contact under `force` rolls.
    #[inline(always)]
    pub fn rolled(&self, force: Two<P>) -> Two<P> {
        if self.effects.roll { times(self.roll * dot2(self.beta, force), self.slid) } else { [P::of(0.0); 2] }
    }

    /// The force of P and T on the whisker.
    #[inline(always)]
    pub fn force_at(&self, normal: Two<P>, push: P, drag: P) -> Two<P> {
        let zero = P::of(0.0);
        add(times(zero - push, normal), times(zero - drag, square(normal)))
    }

    /// The force of linear theory at the whole drive.
    #[inline(always)]
    pub fn begun(&self) -> Two<P> {
        self.force_at(self.normal, self.drive * self.first[0], self.drive * self.first[1])
    }
}
