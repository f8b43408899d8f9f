//! A panel of the rod: its nodes, and one pass of the equations over it, from its end at the contact to that at the base.

use vibrissa_kernel::cpu::Packed;

use super::Effects;
use super::lane::Lane;
use super::rod::Piece;
use super::rule::{Rule, Turns, dot};
use super::section::{Charted, Section, Whisker};
use super::vector::{Two, dot2};

/// Sections at the nodes of a panel and its state; lengths in contact distances, forces in E a².
#[derive(Debug, Clone)]
pub struct Panel<P, const N: usize> {
    pub part: Piece<P>,
    /// s at its end at the contact, its length, √(R there/R at its other end).
    pub place: [P; 3],
    /// −ds at the nodes.
    pub weight: [P; N],
    /// Arc lengths s of the nodes.
    pub arc: [P; N],
    pub section: [Section<P>; N],
    /// d1 of the resting whisker against that at a.
    pub along: [[P; 2]; N],
    /// h₀ − r₀(s): levers of a force at the contact.
    pub lever: [[P; 2]; N],
    /// Turn against the contact by a unit force along and across.
    pub turn: [[P; 2]; N],
    /// Turn against the contact by a unit moment.
    pub give: [P; N],
    /// b: turn against the contact, less the linear one.
    pub lag: [P; N],
    /// Axial strain that the section law adds.
    pub extra: [P; N],
    /// dM/dσ less the linear one, times the weight.
    pub pull: [P; N],
    /// Moment and turn less the linear ones at the end at the contact, and the lever there.
    pub entry: [P; 2],
    pub begin: Two<P>,
}

/// Values carried from panel to panel.
#[derive(Debug, Clone, Copy)]
pub struct Carried<P> {
    /// Moment less the linear one.
    pub moment: P,
    /// Turn against the contact, less the linear one.
    pub lag: P,
    /// Position, less the resting and the linear one.
    pub shift: Two<P>,
    /// Σ turn d2: the motion by a unit of the relative force.
    pub swept: Two<P>,
    /// Moment, turn and motion by a unit of friction (sticking contact).
    pub friction: [P; 4],
    /// Motion by a unit moment along the rod.
    pub pivoted: Two<P>,
    /// Largest loads of a fibre, and of the chart.
    pub load: P,
    pub beyond: P,
}

impl<P: Lane, const N: usize> Panel<P, N> {
    /// Makes panel `k` of `panels`, or appends it, from `near` to `far`, where s = `far` is towards the contact. A panel of a pack that was solved keeps
    /// `lever`, `turn`, `give` and `begin` until `Ground::linear` sets them (slides never do), and `along` until `curve` does.
    #[inline(always)]
    pub fn new<'a>(
        panels: &'a mut Vec<Self>,
        k: usize,
        rule: &Rule<P::Scalar, N>,
        (effects, whisker): (&Effects, &Whisker<P>),
        part: &Piece<P>,
        [near, far]: [P; 2],
        even: bool,
    ) -> &'a mut Self {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        if k == panels.len() {
            panels.push(Self {
                part: *part,
                place: [zero; 3],
                weight: [zero; N],
                arc: [zero; N],
                section: [Section::default(); N],
                along: [[one, zero]; N],
                lever: [[zero; 2]; N],
                turn: [[zero; 2]; N],
                give: [zero; N],
                lag: [zero; N],
                extra: [zero; N],
                pull: [zero; N],
                entry: [zero; 2],
                begin: [zero; 2],
            });
        }
        let panel = &mut panels[k];
        panel.part = *part;
        panel.place[2] = if even {
            one
        } else {
            let thick = part.radius(effects, whisker, near);
            (part.radius(effects, whisker, far) / thick).max(of(1e-3)).sqrt()
        };
        for i in 0..rule.nodes() {
            (panel.lag[i], panel.extra[i], panel.pull[i]) = (zero, zero, zero);
        }
        panel.entry = [zero; 2];
        panel.put(rule, effects, whisker, [near, far]);
        panel
    }

    /// Sections between other ends; the state stays.
    #[inline(always)]
    pub fn put(
        &mut self,
        rule: &Rule<P::Scalar, N>,
        effects: &Effects,
        whisker: &Whisker<P>,
        [near, far]: [P; 2],
    ) {
        let n = rule.nodes();
        (self.place[0], self.place[1]) = (far, far - near);
        for i in 0..n {
            let [s, rate] = self.at(P::splat(rule.points[i]));
            self.weight[i] = rate;
            self.arc[i] = s;
            self.section[i] = self.part.section(effects, whisker, s);
        }
    }

    /// s and −ds/dw at the place `w`: R = R(contact end)/y², y linear in w.
    #[inline(always)]
    pub fn at(&self, w: P) -> [P; 2] {
        let one = P::of(1.0);
        let [far, length, q] = self.place;
        let y = one + (q - one) * w;
        let scale = length * q * q / ((one + q) * y * y);
        [far - scale * w * (one + y), (scale + scale) / y]
    }

    /// The place w of the arc `to`, and by how much that of `from` is larger; without a difference of places, so that a point may be a stretch.
    #[inline(always)]
    pub fn stretch(&self, [from, to]: [P; 2]) -> [P; 2] {
        let (zero, one) = (P::of(0.0), P::of(1.0));
        let [far, length, q] = self.place;
        let length = length.if_less(zero, length, zero.if_less(length, length, one));
        // share = (far − s)/length = q² w (1 + y)/(y² (1 + q)): 1/y² = 1 + share (1/q² − 1).
        // At a tie the place counts: its derivative is not 0.
        let share = zero.max((far - to) / length).min(P::of(1.5));
        let part = (to - from) / length;
        let grows = one / (q * q) - one;
        let [first, last] = [share, share + part].map(|share| (one + share * grows).max(P::of(1e-9)).sqrt());
        let scale = (one + q) / (q * q);
        [share * scale / (first * (first + one)), part * scale / (first * last * (first + last))]
    }

    /// Directions of the resting whisker.
    #[inline(always)]
    pub fn curve(&mut self, n: usize, turns: &Turns<P::Scalar>, whisker: &Whisker<P>) {
        for i in 0..n.min(N) {
            let [versine, sine] = turns.rotation(whisker.rest_angle(self.arc[i]));
            self.along[i] = [P::of(1.0) - versine, sine];
        }
    }

    /// One pass; lanes that are `done` keep their shape. `whole`: the carried moment and turn have no linear part.
    #[inline(always)]
    pub fn pass(
        &mut self,
        rule: &Rule<P::Scalar, N>,
        (turns, law): (&Turns<P::Scalar>, Option<&Charted<P::Scalar>>),
        effects: &Effects,
        (force, tangent): (Two<P>, Two<P>),
        (done, whole): (P, bool),
        carried: &Carried<P>,
    ) -> Carried<P> {
        let of = P::of;
        let (zero, one, two, half) = (of(0.0), of(1.0), of(2.0), of(0.5));
        let n = rule.nodes();
        let mut next = *carried;
        self.entry = [
            zero.if_less(done, self.entry[0], carried.moment),
            zero.if_less(done, self.entry[1], carried.lag),
        ];
        let [fx, fy] = force;
        let (mut twist, mut bends, mut friction) = ([zero; N], [zero; N], [zero; N]);
        let (mut sines, mut versines, mut overs) = ([zero; N], [zero; N], [zero; N]);
        for i in 0..n {
            let turn = self.lag[i] + dot2(self.turn[i], force);
            let [versine, over] = turns.of(turn);
            let sine = turn - over;
            (sines[i], versines[i], overs[i]) = (sine, versine, over);
            let [x, y] = local(effects, self.along[i], force);
            let mut pull = zero - versine * y - sine * x;
            if whole {
                pull = pull + y;
            }
            if effects.extension || effects.shear {
                let (n, q) = (x - versine * x + sine * y, y - versine * y - sine * x);
                let stretched =
                    if effects.extension { self.section[i].stretch * n + self.extra[i] } else { zero };
                pull = pull + stretched * q - self.section[i].slack * q * n;
            }
            self.pull[i] = zero.if_less(done, self.pull[i], pull * self.weight[i]);
            if effects.stick {
                let [x, y] = local(effects, self.along[i], tangent);
                twist[i] = (y - versine * y - sine * x) * self.weight[i];
            }
        }
        for i in 0..n {
            let mut moment = carried.moment + dot(n, &rule.integral[i], &self.pull);
            if let Some(law) = law {
                let all = moment + self.lever[i][0] * fy - self.lever[i][1] * fx;
                let Section { radius, bare, stretch, .. } = self.section[i];
                let [x, y] = local(effects, self.along[i], force);
                let axial = (x - versines[i] * x + sines[i] * y) * stretch;
                let b = (all * radius * bare).abs();
                let [extra, chi, beyond] = law.section(axial, b);
                self.extra[i] = zero.if_less(done, self.extra[i], extra);
                moment = moment + all * chi;
                let (e, kr) = (axial + extra, b * (one + chi));
                // A panel that only neighbours reach has no length, and may have radii that no whisker has.
                let real = self.place[1].abs();
                next.load = next.load.max(zero.if_less(real, (e + kr).max(two * (kr - e)), zero));
                next.beyond = next.beyond.max(zero.if_less(real, beyond, zero));
            }
            bends[i] = moment * self.section[i].flex * self.weight[i];
        }
        if effects.stick {
            for i in 0..n {
                let moment = carried.friction[0] + dot(n, &rule.integral[i], &twist);
                friction[i] = moment * self.section[i].flex * self.weight[i];
            }
            next.friction[0] = carried.friction[0] + dot(n, &rule.weights, &twist);
            next.friction[1] = carried.friction[1] - dot(n, &rule.weights, &friction);
        }
        next.moment = carried.moment + dot(n, &rule.weights, &self.pull);
        next.lag = carried.lag - dot(n, &rule.weights, &bends);
        for i in 0..n {
            let lag = carried.lag - dot(n, &rule.integral[i], &bends);
            let lag = zero.if_less(done, self.lag[i], lag);
            // The turn has advanced by a little since its sine was taken.
            let step = lag - self.lag[i];
            self.lag[i] = lag;
            let cosine = one - versines[i];
            let versine = versines[i] + (sines[i] + half * cosine * step) * step;
            let sine = sines[i] + (cosine - half * sines[i] * step) * step;
            let linear = dot2(self.turn[i], force);
            let turn = lag + linear;
            let weight = P::splat(rule.weights[i]) * self.weight[i];
            let cosine = one - versine;
            // sin ψ less the linear turn, without a difference.
            let (mut x, mut y) = (zero - versine, lag - overs[i] + (sine - sines[i] - step));
            let (mut cx, mut cy) = (zero - sine * turn, cosine * turn);
            if effects.extension || effects.shear {
                let [along, across] = local(effects, self.along[i], force);
                let more = sine * across - versine * along;
                let less = zero - versine * across - sine * along;
                if effects.extension {
                    let stretched = self.section[i].stretch * more + self.extra[i];
                    let all = self.section[i].stretch * along + stretched;
                    x = x + (if whole { all } else { stretched }) - all * versine;
                    y = y + all * sine;
                    cx = cx + all;
                }
                if effects.shear {
                    let slack = self.section[i].slack;
                    let all = slack * (across + less);
                    x = x - all * sine;
                    y = y + (if whole { all } else { slack * less }) - all * versine;
                    cy = cy + all;
                }
            }
            gather(effects, self.along[i], weight, &mut next.shift, [x, y]);
            gather(effects, self.along[i], weight, &mut next.swept, [cx, cy]);
            if effects.stick {
                let turn = carried.friction[1] - dot(n, &rule.integral[i], &friction);
                let [along, across] = local(effects, self.along[i], tangent);
                let slid = self.section[i].slack * across;
                let mut both = [next.friction[2], next.friction[3]];
                gather(
                    effects,
                    self.along[i],
                    weight,
                    &mut both,
                    [self.section[i].stretch * along - turn * sine, turn * cosine + slid],
                );
                (next.friction[2], next.friction[3]) = (both[0], both[1]);
            } else if !whole {
                gather(
                    effects,
                    self.along[i],
                    weight,
                    &mut next.pivoted,
                    [zero - sine * self.give[i], cosine * self.give[i]],
                );
            }
        }
        next
    }

    /// The last `few` coefficients of the series of bending, of bending by all that linear theory has not, and of the moment's growth, summed.
    #[inline(always)]
    pub fn tails(&self, rule: &Rule<P::Scalar, N>, [fx, fy]: Two<P>, few: usize) -> [P; 3] {
        let (zero, n) = (P::of(0.0), rule.nodes());
        let (mut bends, mut lags) = ([zero; N], [zero; N]);
        for i in 0..n {
            let moment = self.entry[0] + dot(n, &rule.integral[i], &self.pull);
            let flex = self.section[i].flex * self.weight[i];
            lags[i] = moment * flex;
            bends[i] = lags[i] + (self.lever[i][0] * fy - self.lever[i][1] * fx) * flex;
        }
        let mut sums = [zero; 3];
        for k in n - few..n {
            for (sum, y) in sums.iter_mut().zip([&bends, &lags, &self.pull]) {
                *sum = *sum + dot(n, &rule.legendre[k], y).abs();
            }
        }
        sums
    }
}

/// Components of a force along and across the resting section.
#[inline(always)]
pub fn local<P: Packed>(effects: &Effects, [c, s]: [P; 2], [x, y]: [P; 2]) -> [P; 2] {
    if effects.curved { [x * c + y * s, y * c - x * s] } else { [x, y] }
}

/// Adds `weight` times a vector along and across the resting section.
#[inline(always)]
fn gather<P: Packed>(effects: &Effects, [c, s]: [P; 2], weight: P, sum: &mut [P; 2], [x, y]: [P; 2]) {
    let [x, y] = if effects.curved { [x * c - y * s, x * s + y * c] } else { [x, y] };
    *sum = [weight.mul_add(x, sum[0]), weight.mul_add(y, sum[1])];
}
