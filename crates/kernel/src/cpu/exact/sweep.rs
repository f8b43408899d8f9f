//! One Picard sweep with a Newton step for the two unknowns of the contact. Twin of `shaders/sweep.wgsl`.

use super::super::pack::{Packed, Scalar};
use super::newton::{Bent, Step, step};
use super::tables::{Tables, dot};
use crate::{Effects, Rule, Tap, rule::limits::*};

/// State passed between sweeps: W = W₀(1 + w) across and H = H₀ + W₀k along the whisker at the contact, arc c = 1 + x₀ + z.
#[derive(Clone)]
pub struct State<P, const N: usize> {
    /// w.
    pub force: P,
    /// k.
    pub along: P,
    /// z.
    pub arc: P,
    /// Δψ at the nodes.
    pub lag: [P; N],
    /// ψ at the nodes.
    pub angle: [P; N],
    /// Integrand of Δξ over y³.
    pub shortening: [P; N],
    /// Integrand of η over y³.
    pub climb: [P; N],
    /// Integrand of Δψ.
    pub bending: [P; N],
    /// e₀ − t at the nodes: the axial strain added by the section law.
    pub extra: [P; N],
    /// Last Newton steps of w and of z (or k), before they were bounded.
    pub steps: [P; 2],
    /// Rounding errors of w and of z (or k).
    pub noise: [P; 2],
    /// Last Newton step of z of a rolling contact; 0 otherwise.
    pub rolled: P,
    /// Determinant of the last Jacobian, positive while it has the sign of the unloaded rod's; 1 where it cannot vanish.
    pub fold: P,
    /// |ψ| at the base.
    pub base: P,
    /// Largest load of a fibre: above 1 it leaves the range of the law.
    pub load: P,
    /// Largest load of a section on its chart: above 1 it is outside the chart.
    pub beyond: P,
}

impl<P: Packed, const N: usize> State<P, N> {
    /// Restores `before` in the lanes where `done` is above zero.
    #[inline(always)]
    pub fn keep(&mut self, n: usize, done: P, before: &Self) {
        let zero = P::of(0.0);
        let pick = |new: &mut P, old: P| *new = zero.if_less(done, old, *new);
        pick(&mut self.force, before.force);
        pick(&mut self.along, before.along);
        pick(&mut self.arc, before.arc);
        pick(&mut self.noise[0], before.noise[0]);
        pick(&mut self.noise[1], before.noise[1]);
        pick(&mut self.fold, before.fold);
        pick(&mut self.base, before.base);
        pick(&mut self.load, before.load);
        pick(&mut self.beyond, before.beyond);
        for i in 0..n {
            pick(&mut self.lag[i], before.lag[i]);
            pick(&mut self.angle[i], before.angle[i]);
            pick(&mut self.shortening[i], before.shortening[i]);
            pick(&mut self.climb[i], before.climb[i]);
            pick(&mut self.bending[i], before.bending[i]);
            pick(&mut self.extra[i], before.extra[i]);
        }
    }
}

/// (1 + a)(1 + b) − 1: growth by a, then by b.
#[inline(always)]
fn then<P: Packed>(a: P, b: P) -> P {
    a.mul_add(b, a + b)
}

#[inline(always)]
pub fn sweep<P: Packed, const N: usize, const PLAIN: bool>(
    tables: &Tables<P::Scalar, N>,
    effects: &Effects,
    rule: &Rule,
    stepping: bool,
    tap: &Tap<P>,
    state: &mut State<P, N>,
) {
    let of = P::of;
    let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
    let n = tables.nodes::<PLAIN>();
    let shear = !PLAIN && effects.shear;
    let extension = !PLAIN && effects.extension;
    let offset = !PLAIN && effects.offset;
    let stick = !PLAIN && effects.stick;
    let rolls = !PLAIN && effects.rolls;
    let law = !PLAIN && effects.law;

    let w_force = tap.force * (one + state.force);
    let h_force = if offset { tap.along + tap.force * state.along } else { zero };
    let x = tap.arc + state.arc;
    let c = one + x;
    let g2 = (tap.rest - tap.taper * x).max(of(APEX) * tap.rest);
    let g = g2.sqrt();
    let m = c / (one + g);
    let k = tap.taper * m;
    let ig2 = one / g2;
    let g4 = ig2 * ig2;
    let lever = w_force * m * m * g4 * of(1.0 / 6.0);
    let ds = two * g2 * m;
    let contact_radius = if offset { tap.contact_radius - tap.slope * x } else { zero };
    let pivot = h_force * contact_radius * m * g4 * ig2 * of(1.0 / 3.0);
    let area = of(0.25) * tap.radius * tap.radius * g4;

    let mut y = [one; N];
    let mut psi = [zero; N];
    let mut density = [one; N];
    let mut gamma = [zero; N];
    let mut axial = [zero; N];
    let mut heights = [zero; N];
    let mut pure = [zero; N];
    for i in 0..n {
        let w = P::splat(tables.points[i]);
        y[i] = one - k * w;
        let y2 = y[i] * y[i];
        let reach = w * (one + y[i]);
        psi[i] = lever * reach * reach * y2.mul_add(two, one);
        if offset {
            psi[i] = psi[i] + pivot * reach * y2.mul_add(y2 + one, one);
        }
        let z = one / y[i];
        density[i] = z * z * z;
        let bent = psi[i] - state.lag[i];
        let cosine = tables.one_minus_cos(bent);
        let mut short = cosine;
        if shear || extension || offset {
            let sine = bent - tables.x_minus_sin(bent);
            let y4 = y2 * y2;
            if shear {
                gamma[i] = zero - (h_force * sine + w_force * (one - cosine)) * tap.shear * g4 * y4;
            }
            let mut stretch = zero;
            if extension {
                let unit = area * y4;
                let excess = zero - (h_force * cosine + w_force * sine) * unit;
                axial[i] = h_force * unit + excess;
                stretch = axial[i] + state.extra[i];
                short = cosine * (one + stretch) - (excess + state.extra[i]);
            }
            if shear {
                short = short + gamma[i] * sine;
            }
            if offset {
                state.climb[i] = ((one + stretch) * sine + gamma[i] * (one - cosine)) * density[i];
            }
            pure[i] = short * density[i];
            if extension {
                short = short - h_force * area * y4;
            }
        }
        state.shortening[i] = short * density[i];
    }
    (state.load, state.beyond) = (zero, zero);
    for i in 0..n {
        let y2 = y[i] * y[i];
        let shorter = dot(n, &tables.integral[i], &state.shortening);
        if PLAIN {
            state.bending[i] = shorter * (y2 * y2 * y[i]);
            continue;
        }
        let mut moment = w_force * ds * shorter;
        if offset {
            heights[i] = ds * dot(n, &tables.integral[i], &state.climb);
            moment = moment - h_force * heights[i];
        }
        if law {
            let w = P::splat(tables.points[i]);
            let arm = g2 * m * w * (one + y[i]) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = tap.radius * whole * (y2 * y2 * y2) * g4 * ig2;
            let [extra, chi, beyond] = tables.section(axial[i], b.abs());
            state.extra[i] = extra;
            moment = moment - whole * chi;
            let (e, kr) = (axial[i] + extra, b.abs() * (one + chi));
            state.load = state.load.max(e + kr).max(two * (kr - e));
            state.beyond = state.beyond.max(beyond);
        }
        state.bending[i] = moment * (y2 * y2 * y[i]);
    }
    let scale = if PLAIN { of(4.0) * w_force * m * m * g4 } else { two * m * g4 * ig2 };
    let (mut sines, mut nearer) = ([zero; N], [zero; N]);
    for i in 0..n {
        let before = state.lag[i];
        state.lag[i] = scale * dot(n, &tables.integral[i], &state.bending);
        state.angle[i] = psi[i] - state.lag[i];
        let behind = tables.x_minus_sin(state.angle[i]);
        if offset {
            let step = state.lag[i] - before;
            nearer[i] = (state.angle[i] - behind + of(0.5) * step) * step * density[i];
        }
        let mut sum = state.lag[i] + behind;
        if shear || extension {
            let (sine, cosine) = (state.angle[i] - behind, tables.one_minus_cos(state.angle[i]));
            if extension {
                sum = sum - (axial[i] + state.extra[i]) * sine;
            }
            if shear {
                let y2 = y[i] * y[i];
                sum = sum + tap.shear * g4 * y2 * y2 * sine * (h_force * (one - cosine) - w_force * sine);
            }
        }
        sines[i] = sum * density[i];
    }
    let lag = scale * dot(n, &tables.weights, &state.bending);
    let sigma = ds * dot(n, &tables.weights, &sines);

    // Closed forms per unit of W and H at the base: angle, height, stretch; first at c = 1, then their change with c.
    let v = tap.rest;
    let (iv, hub) = (one / v, tap.hub);
    let tx = tap.taper * x;
    let slim = tx * ig2;
    let slim2 = slim * (two + slim);
    let (square, cube) = (x * (two + x), x * x.mul_add(x + of(3.0), of(3.0)));
    let psi1 = v.mul_add(two, one) * iv * iv * of(1.0 / 6.0);
    let d_psi1 = psi1 * then(then(square, slim2), zero - two * tx / v.mul_add(two, one));
    let eta_b = iv * iv * of(1.0 / 6.0);
    let (mut eta1, mut d_eta1) = (eta_b, eta_b * then(cube, slim2));
    if shear {
        eta1 = eta1 - tap.shear * iv;
        d_eta1 = d_eta1 - tap.shear * iv * then(x, slim);
    }
    let (x0, y0) = if PLAIN { (one + hub, zero) } else { (tap.pole_x, tap.pole_y) };
    let s1 = if offset { x0 - y0 * tap.slope } else { x0 };
    let turn = if offset { x0 * x0 + y0 * y0 - hub * x0 } else { x0 };
    let turn_c = turn + x * s1;
    let mut a1 = turn * psi1 - x0 * eta1;
    let mut d_a1 = turn * d_psi1 + x * s1 * (psi1 + d_psi1) - x0 * d_eta1;
    if PLAIN {
        // c³/(3 g²) is one term; its parts would cancel.
        a1 = x0 * iv * of(1.0 / 3.0);
        d_a1 = a1 * then(cube, slim);
    }
    let mut base = w_force * (psi1 + d_psi1) - lag;
    let mut height = w_force * (eta1 + d_eta1) - sigma;
    let (mut a0, mut d_a0, mut b0, mut d_b0, mut f, mut d_f) = (zero, zero, zero, zero, zero, zero);
    // ψ at the base less that of the first-order solution, where the contact rolls.
    let mut turned =
        if rolls { tap.force * (psi1 * state.force + (one + state.force) * d_psi1) - lag } else { zero };
    let mut pivoted = zero;
    if offset {
        let slim3 = then(slim2, slim);
        let psi0 = tap.contact_radius * (one + v + v * v) * iv * iv * iv * of(1.0 / 3.0);
        let eta0 = tap.contact_radius * (two + v) * iv * iv * iv * of(1.0 / 6.0);
        let thin = zero - tap.slope * x / tap.contact_radius.max(of(TINY));
        let (g_psi, g_eta) = (zero - tx * (one + two * v - tx) / (one + v + v * v), zero - tx / (two + v));
        let d_psi0 = psi0 * then(then(thin, x), then(slim3, g_psi));
        let d_eta0 = eta0 * then(then(thin, square), then(slim3, g_eta));
        (a0, d_a0) = (turn * psi0 - x0 * eta0, turn * d_psi0 + x * s1 * (psi0 + d_psi0) - x0 * d_eta0);
        (b0, d_b0) = (eta0 + hub * psi0, d_eta0 + hub * d_psi0);
        base = base + h_force * (psi0 + d_psi0);
        if rolls {
            turned = turned + tap.force * state.along * psi0 + h_force * d_psi0;
            pivoted = psi0;
        }
        height = height + h_force * (eta0 + d_eta0);
        if extension {
            f = of(0.25) * tap.radius * tap.radius * iv;
            d_f = f * then(x, slim);
        }
    }

    // Residuals of the closure, less the first-order solution.
    let (cosine_b, sine_b) = (tables.one_minus_cos(base), tables.x_minus_sin(base));
    let beta = base - tap.angle;
    let (cosine, sine) = (tables.one_minus_cos(beta), tables.x_minus_sin(beta));
    let whole = if shear || extension || offset { &pure } else { &state.shortening };
    let mut short = ds * dot(n, &tables.weights, whole);
    if offset {
        // Second-order shortening of the angle that has advanced with the lag: without it force and lag oscillate.
        short = short - ds * dot(n, &tables.weights, &nearer);
    }
    let back_more = short + hub * cosine_b;
    let back = if offset { back_more - h_force * (f + d_f) } else { back_more };
    let rise = height + hub * (base - sine_b);
    let (step_x, step_y) = if offset { (x - back, rise - tap.slope * x) } else { (x - back, rise) };
    let (pole_x, pole_y) = (x0 + step_x, y0 + step_y);
    let mut higher = zero - back * x0 * beta - pole_x * x0 * sine + pole_y * x0 * cosine;
    if offset {
        higher = higher + rise * y0 * beta - pole_x * y0 * cosine - pole_y * y0 * sine;
    }
    let known = turn_c * lag - hub * x0 * sine_b - x0 * sigma - higher;
    let dw = state.force;
    let mut across = tap.force * (a1 * dw + (one + dw) * d_a1) - tap.angle * x * s1 - known;
    let mut along = s1 * state.arc - x0 * back_more + of(0.5) * (step_x * step_x + step_y * step_y);
    if offset {
        let dh = tap.force * state.along;
        let pulled = dh * f + h_force * d_f;
        across =
            across + dh * a0 + h_force * d_a0 + state.arc * (y0 + x0 * tap.slope) - y0 * (back_more - pulled);
        let (b1, d_b1) = (eta1 + hub * psi1, d_eta1 + hub * d_psi1);
        along = along
            + x0 * pulled
            + y0 * (tap.force * (b1 * dw + (one + dw) * d_b1) + dh * b0 + h_force * d_b0
                - sigma
                - hub * (lag + sine_b));
    }

    // Newton for (w, z), or (w, k) of a sticking contact; (w, k, z) of one that rolls.
    if !stepping {
        state.base = base.abs();
        return;
    }
    // Terms that may cancel in the residuals: each is off by a rounding or so.
    let noise = if PLAIN {
        [zero; 2]
    } else {
        let rounding = of(ROUNDINGS * P::Scalar::ROUNDING);
        let levers = [(turn * psi1).abs() + (x0 * eta1).abs(), (turn * d_psi1).abs() + (x0 * d_eta1).abs()];
        let forced = tap.force.abs() * (levers[0] * dw.abs() + (one + dw).abs() * levers[1]);
        let mut first = forced
            + (turn_c * lag).abs()
            + (x0 * sigma).abs()
            + (back * x0 * beta).abs()
            + (pole_y * x0 * cosine).abs()
            + (tap.angle * x * s1).abs();
        let mut second = (x * s1).abs() + (x0 * back_more).abs();
        if offset {
            let dh = (tap.force * state.along).abs();
            first = first
                + dh * a0.abs()
                + (h_force * d_a0).abs()
                + (rise * y0 * beta).abs()
                + (y0 * back_more).abs();
            second = second + y0.abs() * (dh * b0.abs() + sigma.abs() + (h_force * d_b0).abs() + rise.abs());
        }
        [first * rounding, second * rounding]
    };
    state.fold = one;
    let (mut dw, mut dx) = if offset || !PLAIN && rule.full {
        let bent = Bent {
            y,
            density,
            heights,
            w_force,
            h_force,
            contact_radius,
            x,
            base,
            pole: [pole_x, pole_y],
            centre: [x0, y0],
            cosine,
            sine,
            ahead: if rolls { state.arc + tap.ratio * turned } else { zero },
        };
        let Step { steps: [dw, dx], noise, rolled, fold } =
            step(tables, effects, rule.passes(), tap, state, &bent, [across, along], noise);
        // The determinant of the unloaded rod, per unit of its forces.
        let b1 = eta1 + hub * psi1;
        let unloaded = if rolls {
            // The arc of a rolling contact follows its turn.
            let (lift, reach) = (tap.ratio * (y0 + x0 * tap.slope), tap.ratio * s1);
            (a1 - lift * psi1) * (x0 * f + y0 * b0 - reach * pivoted)
                - (a0 + y0 * f - lift * pivoted) * (y0 * b1 - reach * psi1)
        } else if stick {
            a1 * (x0 * f + y0 * b0) - (a0 + y0 * f) * y0 * b1
        } else {
            let ratio = if offset { tap.ratio } else { zero };
            (a1 + ratio * (a0 + y0 * f)) * s1
                - (y0 + x0 * tap.slope) * (ratio * x0 * f + y0 * (b1 + ratio * b0))
        };
        state.noise = noise;
        state.rolled = rolled;
        state.fold = fold * unloaded * if stick { one } else { tap.force };
        (dw, dx)
    } else {
        // Frictionless on the centreline the arc does not feel the force to first order.
        let m12 = w_force * (a1 + d_a1) * (of(3.0) / c + tap.taper * ig2) - tap.angle * s1;
        let m11 = tap.force * (a1 + d_a1);
        let dx = along / pole_x;
        if !PLAIN {
            let arc = noise[1] / pole_x.abs();
            state.noise = [(noise[0] + m12.abs() * arc) / m11.abs(), arc];
        }
        ((across - m12 * dx) / m11, dx)
    };
    state.steps = [dw, dx];
    if !PLAIN && rule.full {
        let share = (of(LONGEST_STEP) * (one + state.force.abs()) / dw.abs().max(of(TINY))).min(one);
        (dw, dx) = (dw * share, dx * share);
        state.rolled = state.rolled * share;
    }
    let least = of(if stick { MOST_PULL } else { LEAST_FORCE });
    state.force = (state.force - dw).max(least).min(of(MOST_FORCE));
    if stick {
        state.along = state.along - dx;
        if rolls {
            state.arc = (state.arc - state.rolled).max(of(LEAST_ARC)).min(of(MOST_ARC));
        }
    } else {
        state.arc = (state.arc - dx).max(of(LEAST_ARC)).min(of(MOST_ARC));
        if offset {
            state.along = tap.ratio * state.force;
        }
    }
    state.base = base.abs();
}
