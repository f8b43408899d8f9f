//! A pass over the bent rod under trial forces, and the closure: by how much the pole's centre misses the object.
//!
//! Everything is the difference to linear theory under the same force, so that small taps keep their digits: the terms of first order, a matrix times
//! the change of the force and the motion of the contact, are added apart.

use super::ground::{Fixed, Ground};
use super::lane::Lane;
use super::panel::Carried;
use super::rule::{Turns, dot};
use super::tilt::Seen;
use super::vector::{Two, add, columns, cross, dot2, square, times, turned};

/// Three points of Gauss's rule and their weights.
const THREE: [[f64; 2]; 3] =
    [[0.112_701_665_379_258_3, 5.0 / 18.0], [0.5, 4.0 / 9.0], [0.887_298_334_620_741_7, 5.0 / 18.0]];

/// Unknowns of a pack.
#[derive(Debug, Clone, Copy)]
pub struct State<P> {
    /// P over that at which the iteration begins, less 1.
    pub force: P,
    /// c/a less that of linear theory; of a sticking contact T less that of linear theory, over its P.
    pub other: P,
}

/// Forces at a contact: P, T and c − 1.
#[derive(Debug, Clone, Copy)]
pub struct Contact<P> {
    pub push: P,
    pub drag: P,
    pub x: P,
}

/// The bent rod of a state.
#[derive(Debug, Clone, Copy)]
pub struct Closed<P> {
    /// Position of the pole's centre less that of the object.
    pub miss: Two<P>,
    /// Its derivatives by the unknowns, at a shape that follows the force only.
    pub columns: [Two<P>; 2],
    pub carried: Carried<P>,
    /// c/a − 1 of that shape.
    pub x: P,
}

impl<P: Lane> Closed<P> {
    /// Numbers of the answer: those `before` in lanes that were done.
    #[inline(always)]
    pub fn kept(&self, before: &Self, done: P) -> Self {
        let pick = |old: P, new: P| P::of(0.0).if_less(done, old, new);
        let mut kept = *self;
        for k in 0..4 {
            let (k, m) = (k / 2, k % 2);
            kept.columns[k][m] = pick(before.columns[k][m], self.columns[k][m]);
        }
        let (now, old) = (&self.carried, &before.carried);
        kept.carried.lag = pick(old.lag, now.lag);
        kept.carried.load = pick(old.load, now.load);
        kept.carried.beyond = pick(old.beyond, now.beyond);
        kept.x = pick(before.x, self.x);
        kept
    }
}

/// The contact on the resting whisker, moved from a to c.
struct Touch<P> {
    normal: Two<P>,
    /// R there.
    radius: P,
    /// From the axis to the skin, less the same at a.
    lift: Two<P>,
    /// The motion of the pole's centre, less x times that by a unit of c.
    beyond: Two<P>,
}

impl<P: Lane, const N: usize, const S: usize> Ground<P, N, S> {
    /// Forces and place of the contact.
    #[inline(always)]
    pub fn contact(&self, state: &State<P>) -> Contact<P> {
        let push = self.drive * self.first[0] * (P::of(1.0) + state.force);
        match self.effects.stick {
            true => {
                let drag = self.drive * (self.first[1] + self.first[0] * state.other);
                let mut x = P::of(0.0);
                if self.effects.roll {
                    let force = self.force_at(self.normal, push, drag);
                    x = self.roll * (self.turn + dot2(self.beta, force) + self.later);
                }
                Contact { push, drag, x }
            }
            false => Contact { push, drag: self.ratio * push, x: self.drive * self.first[2] + state.other },
        }
    }

    /// Both parts of the depth by which the contact gives way under P.
    #[inline(always)]
    pub fn depth(&self, push: P) -> Two<P> {
        let of = P::of;
        let [hertz, plain] = self.hertz;
        // Both parts of opposite signs: the depth is largest at this force.
        let ratio = of(-2.0 / 3.0) * hertz / plain.min(of(-1e-30));
        let most = plain.if_less(of(0.0), of(0.0).if_less(hertz, ratio * ratio * ratio, push), push);
        let size = push.min(most);
        [hertz * size.pow(of(2.0 / 3.0)), plain * size]
    }

    #[inline(always)]
    fn touch(&self, turns: &Turns<P::Scalar>, x: P) -> Touch<P> {
        let of = P::of;
        let (zero, one, half) = (of(0.0), of(1.0), of(0.5));
        let effects = &self.effects;
        let wider = self.slope * x;
        if !(effects.curved || effects.power && effects.surface) {
            let radius = self.radius + wider;
            return Touch { normal: self.normal, radius, lift: [zero, wider], beyond: [zero; 2] };
        }
        let (mut radius, mut slope, c) = (self.radius + wider, self.slope, one + x);
        if effects.power && effects.surface {
            let [wide, tip, n, length] = self.whisker.power;
            let v = one - c * length;
            radius = tip + wide * v.pow(n);
            slope = zero - wide * n * length * v.pow(n - one);
        }
        let [k0, k1] = self.whisker.curvature;
        let turn = turns.rotation(zero - (self.bend + half * k1 * x) * x);
        let normal = Self::normal_of(radius, slope, k0 + k1 * c);
        let normal = add(normal, turned(normal, turn));
        // The way along the resting whisker, less a straight one.
        let mut beyond = [zero; 2];
        for [point, weight] in THREE {
            let part = x * of(point);
            let [versine, sine] = turns.rotation(zero - (self.bend + half * k1 * part) * part);
            beyond = add(beyond, times(of(weight) * x, [zero - versine, sine]));
        }
        let lift = add(turned([zero, radius], turn), [zero, radius - self.radius]);
        let unit =
            times(self.bend * x, add(square([zero, self.radius]), times(self.pole, square(self.normal))));
        let grown = add(lift, times(self.pole, [normal[0] - self.normal[0], normal[1] - self.normal[1]]));
        beyond = add(beyond, add(add(grown, [zero, zero - wider]), unit));
        Touch { normal, radius, lift, beyond }
    }

    /// One pass; lanes that are `done` keep their shape.
    #[inline(always)]
    pub fn pass(&mut self, fixed: &Fixed<P::Scalar, N, S>, state: &State<P>, done: P) -> Closed<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let effects = self.effects;
        let Contact { push, drag, x } = self.contact(state);
        // The stretch between a and c stays as the shape of a lane that is done found it.
        let x = zero.if_less(done, self.last, x);
        self.last = x;
        let Touch { normal, radius, lift, mut beyond } = self.touch(&fixed.turns, x);
        let force = self.force_at(normal, push, drag);
        let tangent = times(of(-1.0), square(normal));
        let law = (&fixed.turns, fixed.law.as_ref().filter(|_| effects.law));
        // Between a and c the whole moment is carried, on the panels that of linear theory is not.
        let linear = cross([zero, self.radius], force);
        let (moment, [shift, swept, pivoted]) = (linear + cross(lift, force), [[zero; 2]; 3]);
        let ([lag, load], friction) = ([zero; 2], [zero; 4]);
        let mut carried = Carried { moment, lag, shift, swept, friction, pivoted, load, beyond: zero };
        if effects.stick {
            carried.friction[0] = cross([zero, radius], tangent);
        }
        let (c, count) = (one + x, self.parts.len());
        for (k, slide) in self.slides.iter_mut().enumerate() {
            let part = slide.part;
            let ends = match count {
                1 => [one, c],
                _ => {
                    let end = if k < count { c.max(one) } else { c.min(one) };
                    [one.max(part.near).min(part.far), end.max(part.near).min(part.far)]
                }
            };
            let length = zero.if_less(done, one, slide.place[1].abs());
            slide.put(&fixed.slide, &effects, &self.whisker, ends);
            // A slide that had no length starts from the turn at its end towards the contact.
            for i in 0..S {
                slide.lag[i] = zero.if_less(length, slide.lag[i], carried.lag);
                slide.extra[i] = zero.if_less(length, slide.extra[i], zero);
            }
            if (ends[1] - ends[0]).abs().all_at_most(zero) {
                slide.pull = [zero; S];
                continue;
            }
            if effects.curved {
                slide.curve(S, &fixed.turns, &self.whisker);
            }
            carried = slide.pass(&fixed.slide, law, &effects, (force, tangent), (done, true), &carried);
        }
        carried.moment = carried.moment - linear;
        for panel in &mut self.panels {
            carried = panel.pass(&fixed.rule, law, &effects, (force, tangent), (done, false), &carried);
        }

        // The force less that of linear theory.
        let mut change = if effects.stick {
            let unit = self.drive * self.first[0];
            self.force_at(self.normal, unit * state.force, unit * state.other)
        } else {
            times(self.lack + state.force, self.begun())
        };
        if effects.curved || effects.power {
            let leaned = [normal[0] - self.normal[0], normal[1] - self.normal[1]];
            change = add(change, self.force_at(leaned, push, drag));
        }
        beyond = add(beyond, carried.shift);
        let mut yields = [zero; 2];
        if effects.soft {
            let [hertz, plain] = self.depth(push);
            beyond = add(beyond, times(zero - hertz - plain, normal));
            yields = times(of(-2.0 / 3.0) * hertz - plain, normal);
        }
        let later = self.soft * carried.moment - carried.lag;
        let beta = dot2(self.beta, force) + later;
        let [versine, over] = fixed.turns.of(beta);
        let by = [versine, beta - over];
        let moved = add(add(columns(&self.bent, force), times(x, self.slid)), beyond);
        let mut miss = add(columns(&self.give, change), add(beyond, turned(moved, by)));
        if !effects.stick {
            miss = add(miss, times(state.other, self.slid));
        }
        if effects.roll {
            miss = add(miss, add(self.rolled(change), times(self.roll * self.later, self.slid)));
            self.later = zero.if_less(done, self.later, later);
        }
        miss = add(miss, times(later - over, square(self.centre)));
        miss = add(miss, times(zero - versine, self.centre));
        let leaned = turned(force, by);
        miss = add(miss, columns(&self.root, leaned));
        let [versine, over] = fixed.turns.of(self.turn);
        miss = add(miss, add(times(versine, self.arm), times(zero - over, square(self.arm))));
        let mut seen = Seen::default();
        if effects.tilt {
            let (cos, sin) = (one - by[0], by[1]);
            seen = self.axis.seen([
                self.normal[1] * cos + self.normal[0] * sin,
                self.normal[0] * cos - self.normal[1] * sin,
            ]);
            miss = add(miss, times(of(-1.0), seen.moved));
        }

        let place = add(self.centre, moved);
        let swept = add(add(carried.swept, yields), times(beta, square(place)));
        let root = columns(&self.root, add(force, leaned));
        let root = add(root, self.rolled(force));
        let mut by_force = add(add(swept, turned(swept, by)), root);
        if effects.tilt {
            by_force = add(by_force, times(dot2(self.beta, force), seen.swept));
        }
        let by_force = times(one / (one + state.force), by_force);
        let by_other = if effects.stick {
            let [moment, turn, vx, vy] = carried.friction;
            let v = add([vx, vy], times(self.soft * moment - turn, square(place)));
            let root = add(columns(&self.root, add(tangent, turned(tangent, by))), self.rolled(tangent));
            times(self.drive * self.first[0], add(add(v, turned(v, by)), root))
        } else {
            let torque = cross([one, self.slope], force);
            let v = add(self.slid, times(zero - torque, carried.pivoted));
            let v = add(v, times(torque * self.pivot, square(place)));
            let v = add(v, turned(v, by));
            if effects.tilt { add(v, times(torque * self.pivot, seen.swept)) } else { v }
        };
        Closed { miss, columns: [by_force, by_other], carried, x }
    }

    /// The force of `state`, and the moment at the base less that of linear theory; the shape stays, that of a contact at `before`.
    #[inline(always)]
    pub fn settle(&mut self, fixed: &Fixed<P::Scalar, N, S>, state: &State<P>, before: P) -> (Two<P>, P) {
        let Contact { push, drag, x } = self.contact(state);
        let Touch { normal, lift, .. } = self.touch(&fixed.turns, x);
        let force = self.force_at(normal, push, drag);
        let linear = cross([P::of(0.0), self.radius], force);
        let mut moment = linear + cross(lift, force) + (x - before) * force[1];
        for slide in &mut self.slides {
            slide.entry[0] = moment;
            if !slide.place[1].abs().all_at_most(P::of(0.0)) {
                moment = moment + dot(fixed.slide.nodes(), &fixed.slide.weights, &slide.pull);
            }
        }
        moment = moment - linear;
        for panel in &mut self.panels {
            panel.entry[0] = moment;
            moment = moment + dot(fixed.rule.nodes(), &fixed.rule.weights, &panel.pull);
        }
        (force, moment)
    }
}
