//! Strain deviation and error estimate from a converged state. Twin of `shaders/gauge.wgsl`.

use super::super::pack::Packed;
use super::sweep::State;
use super::tables::{Tables, dot};
use crate::{Effects, Rule, Solution, Tap, rule::limits::*};

/// Change of the strain per error of the arc, relative to max(|ε|, 1e-3 θ f_max), for a contact at 1 + `x`: dℓ/dc / ℓ there, times the weight of the
/// strain. From a start next to the gauge ℓ may grow by orders during the iteration, as the square of the bent part of the gauge; an `offset` force
/// adds strain proportional to the bent part itself.
#[inline(always)]
pub fn sensitivity<P: Packed>(offset: bool, tap: &Tap<P>, x: P) -> P {
    let of = P::of;
    let (one, tiny) = (of(1.0), of(TINY));
    let (near, far) = ((tap.near + x).max(tiny), tap.far + x);
    let (u1, u2) = (tap.taper.mul_add(tap.near, tap.rest), tap.taper.mul_add(tap.far, tap.rest));
    let clear = (u1 + u2) / (near * u2 + far * u1).max(tiny);
    let on_gauge = of(2.0) / near + tap.taper / tap.rest;
    let growth = (near / tap.near.max(tiny)).min(of(MOST_GROWTH));
    let share = if offset { growth.max(growth * growth) } else { growth * growth };
    let weight = (tap.weight * share).min(one);
    one + weight * far.if_less(of(0.0), on_gauge, clear)
}

/// Change of the strain per relative error of W and of H (per W₀), relative to max(|ε|, 1e-3 θ f_max); at least 1. More where bending and the force
/// along the whisker nearly cancel at the gauge, as next to the clamp. Third: the same per error of the section law, which acts on the strains of
/// both, and on the forces of a sticking contact.
#[inline(always)]
pub fn shares<P: Packed>(effects: &Effects, tap: &Tap<P>) -> [P; 3] {
    let of = P::of;
    let (zero, one, half) = (of(0.0), of(1.0), of(0.5));
    if !effects.offset {
        return [one; 3];
    }
    let (b1, b2) = (
        one / tap.taper.mul_add(tap.near, tap.rest),
        one / tap.taper.mul_add(tap.far, tap.rest).max(of(TINY)),
    );
    let end = tap.far.if_less(zero, one / tap.rest, b2);
    let bent = tap.far.if_less(zero, tap.near.max(zero) / tap.width, one);
    let lever = tap.far.if_less(
        zero,
        half * tap.near * b1 * b1 * bent / tap.rest,
        half * b1 * b2 * (tap.near * b1 + tap.far * b2),
    );
    let mut along = tap.contact_radius * half * bent * b1 * end * (b1 + end);
    if effects.extension {
        along = along + of(0.25) * tap.radius * bent * b1 * end;
    }
    let scale = tap.weight * tap.radius / tap.strain.abs().max(of(TINY));
    let (lever, along) = (scale * lever.abs(), scale * along.abs());
    let (across, along, held) = (tap.force.abs() * lever, tap.force.abs() * along, tap.along.abs() * along);
    let strains = across + if effects.stick { along.max(held) } else { held };
    [across.max(one), along.max(one), strains.max(one)]
}

/// The solution of a tap whose last sweep left `residual` and rounding `rounded`; `across` is the first of its [`shares`].
#[inline(always)]
pub fn gauge<P: Packed, const N: usize, const PLAIN: bool>(
    tables: &Tables<P::Scalar, N>,
    rule: &Rule,
    effects: &Effects,
    tap: &Tap<P>,
    state: &State<P, N>,
    [residual, rounded, across]: [P; 3],
    sweeps: P,
) -> Solution<P> {
    let of = P::of;
    let (zero, one, two, tiny) = (of(0.0), of(1.0), of(2.0), of(TINY));
    let n = tables.nodes::<PLAIN>();
    let offset = !PLAIN && effects.offset;
    let law = !PLAIN && effects.law;
    let axial = !PLAIN && effects.extension;
    let x = tap.arc + state.arc;
    let c = one + x;
    let g2 = (tap.rest - tap.taper * x).max(of(APEX) * tap.rest);
    let g = g2.sqrt();
    let m = c / (one + g);
    let k = tap.taper * m;

    let (c1, c2) = (tap.near + x, tap.far + x);
    let (u1, u2) = (tap.taper.mul_add(tap.near, tap.rest), tap.taper.mul_add(tap.far, tap.rest));
    let (b1, b2) = (one / u1, one / u2.max(tiny));
    let clear = of(0.5) * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let clear_change = of(0.5) * b1 * b2 * x * (b1 + b2) + past(c2.min(zero), b2, g2, tap.width);
    let on_gauge = tap.near * tap.near * b1 * b1 / (two * tap.rest * tap.width);
    let farther = (x / tap.near.max(tiny)).min(of(MOST_GROWTH)).max(of(-MOST_GROWTH));
    let slim = tap.taper * x / g2;
    let longer = farther * (two + farther);
    // For a contact that has left the gauge: lever of a clear one; the parabola and `past` would cancel.
    let left = of(0.5) * b1 * b2 * (c1 * b1 + c2 * b2) - on_gauge;
    let leaving = on_gauge * (longer + slim + longer * slim) - past(c2.max(zero), b2, g2, tap.width);
    let on_gauge_change = (of(LEFT) * tap.width).if_less(c2, left, leaving);
    let lever = tap.far.if_less(zero, on_gauge, clear).max(tiny);
    let change = tap.far.if_less(zero, on_gauge_change, clear_change);

    // Deviations from the lever and the first-order axial strain, averaged over the bent part of the gauge.
    let mut series = [zero; N];
    let (mut climbs, mut angles) = ([zero; N], [zero; N]);
    for i in 0..n {
        series[i] = dot(n, &tables.legendre[i], &state.shortening);
        if offset {
            climbs[i] = dot(n, &tables.legendre[i], &state.climb);
        }
        if axial {
            angles[i] = dot(n, &tables.legendre[i], &state.angle);
        }
    }
    let (w1, w2) = (place(c1, u1, c, g).min(one), place(c2, u2, c, g));
    let w_force = tap.force * (one + state.force);
    let h_force = if offset { tap.along + tap.force * state.along } else { zero };
    let contact_radius = if offset { tap.contact_radius - tap.slope * x } else { zero };
    let ig2 = one / g2;
    let ig6 = ig2 * ig2 * ig2;
    let side = of(if effects.far { -1.0 } else { 1.0 });
    let (mut sum, mut length) = (zero, zero);
    for &(point, weight) in &tables.gauge {
        let w = w2 + (w1 - w2) * P::splat(point);
        let weight = P::splat(weight);
        let y = one - k * w;
        let y2 = y * y;
        let y3 = y2 * y;
        length = length + weight / y3;
        if PLAIN {
            sum = sum + weight * primitive(n, &series, w) * y3;
            continue;
        }
        let mut moment = w_force * two * g2 * m * primitive(n, &series, w);
        if offset {
            moment = moment - h_force * two * g2 * m * primitive(n, &climbs, w);
        }
        let mut strain = zero - tap.radius * moment * y3 * y3 * ig6;
        let mut direct = zero;
        if axial {
            let angle = legendre(n, &angles, w);
            let (cosine, sine) = (tables.one_minus_cos(angle), angle - tables.x_minus_sin(angle));
            let unit = of(0.25) * tap.radius * tap.radius * y2 * y2 * ig2 * ig2;
            let excess = zero - (h_force * cosine + w_force * sine) * unit;
            direct = h_force * unit + excess;
            strain = strain + side * excess;
        }
        if law {
            let arm = g2 * m * w * (one + y) / y2;
            let b = tap.radius * (w_force * arm + h_force * contact_radius - moment) * y3 * y3 * ig6;
            let [extra, chi, _] = tables.section(direct, b.abs());
            strain = strain + b * chi + side * extra;
        }
        sum = sum + weight * strain / y3;
    }
    let bent = c2.if_less(zero, c1.max(zero) / tap.width, one);
    let (w, growth) = (state.force, one + state.force);
    let strain = if PLAIN {
        let mean = bent * two * m * sum / (g2 * g2 * length);
        w + growth * (change - mean) / lever
    } else {
        let mut more = tap.radius * tap.force * (lever * w + growth * change) + bent * sum / length;
        if offset {
            // Means of 1/(1 − τs)³ and 1/(1 − τs)² over the bent part, now and at c = 1.
            let end = c2.if_less(zero, ig2, b2);
            let first = tap.far.if_less(zero, one / tap.rest, b2);
            let share = tap.far.if_less(zero, tap.near.max(zero) / tap.width, one);
            let now = of(0.5) * bent * b1 * end * (b1 + end);
            let then = of(0.5) * share * b1 * first * (b1 + first);
            let (dh, dr) = (tap.force * state.along, zero - tap.slope * x);
            let torque = (dh * (tap.contact_radius + dr) + tap.along * dr) * now
                + tap.along * tap.contact_radius * (now - then);
            more = more + tap.radius * torque;
            if axial {
                let (now, then) = (bent * b1 * end, share * b1 * first);
                let area = of(0.25) * tap.radius * tap.radius;
                more = more + side * area * (dh * now + tap.along * (now - then));
            }
        }
        more / tap.strain
    };

    let mut error = truncation(n, tables, tap, state, &series, [m, g2, sensitivity(offset, tap, x)]);
    if offset {
        error = error * across;
    }
    error = error + residual + rounded;
    if offset {
        let height = two * g2 * m * (climbs[n - 1].abs() + climbs[n - 2].abs());
        let lost = tap.radius * h_force.abs() * height / tap.strain.abs().max(tiny);
        error = error + of(HEIGHT_TAIL) * tap.weight * lost;
    }
    // The estimate so far is relative to the first-order strain.
    error = error / (one + strain).abs().min(one).max(of(1e-3));
    let mut outside = of(rule.max_angle()).if_less(state.base, one, state.fold.if_less(zero, one, zero));
    let mut load = zero;
    if law {
        load = state.load;
        for (w, y, shorter, height) in [(zero, one, zero, zero), (one, g, series[0], climbs[0])] {
            // The fibres next to the contact and at the base, beyond the outermost nodes.
            let (y2, angle) = (y * y, if axial { legendre(n, &angles, w) } else { zero });
            let unit = of(0.25) * tap.radius * tap.radius * y2 * y2 * ig2 * ig2;
            let sine = angle - tables.x_minus_sin(angle);
            let direct = if axial {
                h_force * unit - (h_force * tables.one_minus_cos(angle) + w_force * sine) * unit
            } else {
                zero
            };
            let moment = two * g2 * m * (w_force * shorter - h_force * height);
            let arm = g2 * m * w * (one + y) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = (tap.radius * whole * (y2 * y2 * y2) * ig6).abs();
            let [extra, chi, beyond] = tables.section(direct, b);
            let (e, kr) = (direct + extra, b * (one + chi));
            load = load.max(e + kr).max(two * (kr - e));
            outside = one.if_less(beyond, one, outside);
        }
        outside = one.if_less(state.beyond, one, outside);
    }
    // Only near an equilibrium do load and range mean anything, not in an iteration that has diverged.
    let astray = residual.if_less(of(ASTRAY), zero, one);
    let ended = one.if_less(load, one, zero);
    if offset {
        error = tap.rest.if_less(of(rule.least_rest()), of(LOST), error);
    }
    let error = zero.if_less(outside.max(ended), zero.if_less(astray, of(LOST), of(HOPELESS)), error);
    let load = zero.if_less(outside.max(astray), zero, load);
    Solution { force: w, along: state.along, arc: state.arc, strain, error, load, sweeps }
}

/// The part of the lever mean beyond the contact, which has no moment.
#[inline(always)]
fn past<P: Packed>(end: P, b2: P, g2: P, width: P) -> P {
    end * end * b2 * b2 / (P::of(2.0) * g2 * width)
}

/// Place w on the rod of a point at distance `from_contact`, u² = 1 − τs there.
#[inline(always)]
pub fn place<P: Packed>(from_contact: P, u: P, c: P, g: P) -> P {
    let root = u.max(P::of(TINY)).sqrt();
    from_contact.max(P::of(0.0)) * (P::of(1.0) + g) / (c * root * (root + g))
}

/// Bound on the truncation error of the strain from the last two Legendre coefficients of both integrands. Sums over Gauss nodes converge faster than
/// the interpolant, hence the power; factors fitted to 20 000 random taps (d/D 0.02…1.3, θ 0.1…60°, gauges of all lengths) at n = 6…16. The
/// shortening is the error of the arc.
#[inline(always)]
fn truncation<P: Packed, const N: usize>(
    n: usize,
    tables: &Tables<P::Scalar, N>,
    tap: &Tap<P>,
    state: &State<P, N>,
    series: &[P; N],
    [m, g2, sensitivity]: [P; 3],
) -> P {
    let of = P::of;
    // No closure: one called twice may not be inlined, and then lacks the caller's instruction set.
    let mut last = of(0.0);
    for k in n - 2..n {
        last = last + dot(n, &tables.legendre[k], &state.bending).abs();
    }
    let bending = of(12.0) * m * m * (of(1.0) + tap.hub) * tap.rest / (g2 * g2) * last;
    let shortening = of(2.0) * g2 * m * (series[n - 1].abs() + series[n - 2].abs());
    of(BENDING_TAIL) * bending * bending.sqrt() + of(SHORTENING_TAIL) * sensitivity * shortening
}

/// ∫₀^w of a series of shifted Legendre polynomials; unrolled in shaders (`gpu/shader.rs`), as is [`legendre`].
#[inline(always)]
fn primitive<P: Packed, const N: usize>(n: usize, series: &[P; N], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = series[0] * w;
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        sum = sum + series[k] * (next - before) * of(0.5 / (2.0 * kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}

/// Their series at `w`.
#[inline(always)]
fn legendre<P: Packed, const N: usize>(n: usize, series: &[P; N], w: P) -> P {
    let of = P::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = series[0];
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..n {
        sum = sum + series[k] * now;
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}
