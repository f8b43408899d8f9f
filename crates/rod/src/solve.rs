//! Newton's method for the two unknowns of a tap: a pass and a step in turn, or with the derivatives of the passes themselves.

use vibrissa_core::physics::real::Dual;
use vibrissa_kernel::cpu::Vectors;
use vibrissa_kernel::cpu::pack::{Packed, Scalar};
use vibrissa_kernel::rule::limits::{ASTRAY, HOPELESS, LOST, ROUNDINGS, TINY};

use super::close::{Closed, Contact, State};
use super::ground::{Fixed, Ground};
use super::lane::Lane;
use super::vector::{add, columns, cross, dot2, times, turned};
use super::{Solution, Tap};

/// Share of the tolerance at which an iteration stops.
const STOP: f64 = 0.05;

/// Longest step of the force, relative to that of linear theory, and of the contact over a; and of the friction of a sticking contact.
const LONGEST: f64 = 0.5;
const LONGEST_FRICTION: f64 = 3.0;

/// Contraction rates that are believed.
const RATES: [f64; 2] = [0.05, 0.9];

/// Least and largest c − 1, and least P over that of linear theory, less 1, while iterating.
const ARCS: [f64; 2] = [-0.95, 2.0];
const LEAST_FORCE: f64 = -0.95;

/// Turn of the contact, rad, beyond which a rod has several equilibria and only the path from the unloaded one decides.
const MOST_TURNED: f64 = 2.0;

/// Determinant of the closure over that at zero load, below which the path may fold.
const UPRIGHT: f64 = 0.02;

/// The same of a tilted pole: the reference, which takes plane after plane, must find each of them.
const TILTED: f64 = 0.2;

/// Progress of an iteration.
#[derive(Clone, Copy)]
struct Pace<P> {
    /// Relative error of the strain that is left.
    left: P,
    /// Size of the last step, and the larger of two rates at which steps shrink.
    last: P,
    rate: P,
    /// Number of passes.
    sweeps: P,
}

impl<P: Packed> Pace<P> {
    fn new() -> Self {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        Self { left: one, last: one, rate: zero, sweeps: zero }
    }

    /// After a step of this size in lanes that are not `done`. Steps are long and short in turn: the slower of two rates counts.
    #[inline(always)]
    fn after(&mut self, size: P, done: P) {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let open = |new: P, old: P| zero.if_less(done, old, new);
        let next = (size / self.last).min(P::of(RATES[1])).max(P::of(RATES[0]));
        let believed = next.max(self.rate);
        self.rate = open(next, self.rate);
        self.last = open(size.max(P::of(TINY)), self.last);
        self.left = open(size * believed / (one - believed), self.left);
        self.sweeps = self.sweeps + open(one, zero);
    }
}

impl<P: Lane, const N: usize, const S: usize> Ground<P, N, S> {
    /// Effects on the strain, relative, of a step of the second unknown and of a change of the moment.
    #[inline(always)]
    fn effect(&self) -> [P; 2] {
        let one = P::of(1.0);
        let by_moment = self.mean / (self.strain[0] + self.strain[1]).abs().max(self.least).max(P::of(TINY));
        let by_arc = (by_moment * cross([one, self.slope], self.begun())).abs().max(one);
        [if self.effects.stick { one } else { by_arc }, by_moment.abs()]
    }

    /// `state` after a step of bounded length; lanes that are `done` keep theirs.
    #[inline(always)]
    fn step(&self, state: &State<P>, by: [P; 2], done: P) -> State<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let stick = self.effects.stick;
        let room = of(if stick { LONGEST_FRICTION } else { LONGEST });
        let most = (by[0].abs() / of(LONGEST)).max(by[1].abs() / room).max(one);
        let mut next = State { force: state.force - by[0] / most, other: state.other - by[1] / most };
        if !stick {
            let first = self.drive * self.first[2];
            next.other = next.other.max(of(ARCS[0]) - first).min(of(ARCS[1]) - first);
            next.force = next.force.max(of(LEAST_FORCE));
        }
        let pick = |new: P, old: P| zero.if_less(done, old, new);
        State { force: pick(next.force, state.force), other: pick(next.other, state.other) }
    }

    /// Solves the pack in at most `most` passes. Each pass is a call of `passed`: LLVM takes a minute to compile passes and steps in one function.
    #[inline(always)]
    pub fn solve<'a>(
        &mut self,
        has: Vectors,
        fixed: &Fixed<P::Scalar, N, S>,
        (tolerance, most): (f64, usize),
        lane: &impl Fn(usize) -> &'a Tap<'a, P::One>,
    ) -> Solution<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let mut state = State { force: zero, other: zero };
        let (mut done, mut pace, [by_other, by_moment]) = (zero, Pace::new(), self.effect());
        let stop = of((STOP * tolerance).max(4.0 * P::Scalar::ROUNDING));
        let (mut moment, mut kept, mut count) = (zero, None, 0);
        let kept = loop {
            count += 1;
            // SAFETY: `has` proves it.
            let closed = unsafe { self.passed(has, fixed, &state, done) };
            let det = one / cross(closed.columns[0], closed.columns[1]);
            let step =
                [cross(closed.miss, closed.columns[1]) * det, cross(closed.columns[0], closed.miss) * det];
            // The moment at the gauge may still change where the force does no more.
            let moved = ((closed.carried.moment - moment) * by_moment).size();
            moment = closed.carried.moment;
            let size =
                step[0].size().max((by_other * step[1]).size()).max(if count > 1 { moved } else { zero });
            state = self.step(&state, step, done);
            pace.after(size, done);
            // A lane that is done keeps what it was found with, so that no tap depends on its neighbours.
            let found = kept.map_or(closed, |before| closed.kept(&before, done));
            // The rate of one step is unknown: K − 1 of small drives needs the second.
            if count > 1 {
                done = stop.if_less(pace.left, done, one);
            }
            if one.all_at_most(done) || count == most {
                break found;
            }
            kept = Some(found);
        };
        self.answer(fixed, (&state, &kept), [pace.left, pace.sweeps], lane)
    }

    /// # Safety
    /// The CPU must have the instructions that `Vectors` prove.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    unsafe fn passed(
        &mut self,
        _: Vectors,
        fixed: &Fixed<P::Scalar, N, S>,
        state: &State<P>,
        done: P,
    ) -> Closed<P> {
        self.pass(fixed, state, done)
    }

    #[inline(always)]
    fn answer<'a>(
        &mut self,
        fixed: &Fixed<P::Scalar, N, S>,
        (state, closed): (&State<P>, &Closed<P>),
        [left, sweeps]: [P; 2],
        lane: &impl Fn(usize) -> &'a Tap<'a, P::One>,
    ) -> Solution<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        let Contact { push, drag, x } = self.contact(state);
        let (force, moment) = self.settle(fixed, state, closed.x);
        let beta = dot2(self.beta, force) + self.soft * moment - closed.carried.lag;
        let [mut axial, bending] = self.reading(fixed, force, lane);
        let mut strain = axial + bending;
        if !self.effects.distorting {
            let smooth = !(self.effects.curved || self.effects.power || self.effects.stick);
            let first = if smooth {
                times(one + state.force, self.strain)
            } else {
                self.first_reading(fixed, force).0
            };
            axial = first[0] + axial;
            strain = first[0] + first[1] + strain;
        }
        let measure = strain.abs().max(self.least).max(of(TINY));
        let shown = self.mean * cross([one, self.slope], force).abs() / measure;
        let rounding = of(ROUNDINGS * P::Scalar::ROUNDING) * (one + shown * x.abs());
        let mut error = left + self.truncated(fixed, force, measure) + rounding;
        if let Some(charted) = &fixed.law {
            error = error + of(2.0 * charted.error());
        }
        let second = match self.effects.stick {
            true => {
                let drag = self.force_at(self.normal, zero, self.drive * self.first[0]);
                add(columns(&self.give, drag), self.rolled(drag))
            }
            false => self.slid,
        };
        let begun = self.begun();
        let begun = cross(add(columns(&self.give, begun), self.rolled(begun)), second);
        let upright = cross(closed.columns[0], closed.columns[1]) / begun;
        let lost = of(if self.effects.tilt { TILTED } else { UPRIGHT })
            .if_less(upright, zero, one)
            .max(beta.abs().if_less(of(MOST_TURNED), zero, one));
        // Only near an equilibrium do range and fold mean anything.
        let hopeless = of(ASTRAY).if_less(left, of(LOST), of(HOPELESS));
        error = zero.if_less(lost, hopeless, error);
        error = one.if_less(closed.carried.beyond, hopeless, error);
        let moment = dot2(self.moment, force) + moment;
        let force = add(force, turned(force, fixed.turns.rotation(beta)));
        let base = add(force, turned(force, fixed.turns.rotation(self.whisker.rest)));
        let [length, unit] = self.unit;
        Solution {
            strain,
            axial,
            turned: zero - beta,
            normal: push * unit,
            tangential: drag * unit,
            arc: (one + x) * length,
            wrench: [moment * unit * length, base[0] * unit, base[1] * unit],
            error,
            load: closed.carried.load,
            sweeps,
        }
    }
}

impl<const N: usize, const S: usize> Ground<Dual<2>, N, S> {
    /// Newton's method with the derivatives of the passes by the two unknowns: the shape follows each step. For taps on which it follows slowly.
    #[inline(always)]
    pub fn solve_exactly<'a>(
        &mut self,
        fixed: &Fixed<f64, N, S>,
        (tolerance, most): (f64, usize),
        lane: &impl Fn(usize) -> &'a Tap<'a, Dual<2>>,
    ) -> Solution<Dual<2>> {
        let plain = <Dual<2> as Packed>::of;
        let seeds = |[force, other]: [f64; 2]| State {
            force: Dual { value: force, slope: [1.0, 0.0] },
            other: Dual { value: other, slope: [0.0, 1.0] },
        };
        let mut state = seeds([0.0; 2]);
        let (open, mut pace, by_other) = (plain(0.0), Pace::new(), plain(self.effect()[0].value));
        let stop = (STOP * tolerance).max(4.0 * f64::ROUNDING);
        let mut count = 0;
        let mut closed = loop {
            count += 1;
            let closed = self.pass(fixed, &state, open);
            let [first, second] = [0, 1].map(|k| closed.miss.map(|x| plain(x.slope[k])));
            let miss = closed.miss.map(|x| plain(x.value));
            let det = plain(1.0) / cross(first, second);
            let step = [cross(miss, second) * det, cross(first, miss) * det];
            let State { force, other } = self.step(&state, step, open);
            let next = seeds([force.value, other.value]);
            let taken = [next.force.value - state.force.value, next.other.value - state.other.value];
            follow(std::slice::from_mut(&mut self.later), taken);
            for panel in &mut self.panels {
                follow(&mut panel.lag, taken);
            }
            for panel in &mut self.slides {
                follow(&mut panel.lag, taken);
            }
            state = next;
            pace.after(step[0].abs().max(by_other * step[1].abs()), open);
            if count == most || pace.left.value.is_nan() || pace.left.value <= stop {
                break closed;
            }
        };
        for k in 0..2 {
            closed.columns[k] = closed.miss.map(|x| plain(x.slope[k]));
        }
        self.answer(fixed, (&state, &closed), [pace.left, pace.sweeps], lane)
    }
}

/// The shape follows a step of the unknowns.
fn follow(lag: &mut [Dual<2>], step: [f64; 2]) {
    for lag in lag {
        lag.value += step[0] * lag.slope[0] + step[1] * lag.slope[1];
    }
}
