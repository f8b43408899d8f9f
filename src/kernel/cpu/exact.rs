//! The exact rod, frictionless, on its centreline, Hooke (model §3): collocation in deviation form. Twin of
//! `shaders/exact.wgsl`: same functions, same names, same order.
//!
//! # Theory
//! Unit of length is the contact distance. ψ is the angle of the whisker against its direction at the contact, c the
//! contact arc, q = P/EI₀, g² = 1 − τc. With w ∈ [0, 1] from contact to base, y = 1 − (1 − g)w and m = c/(1 + g)
//! (so that (1 − τs)^(−1/2) = y/g is linear in w and nothing divides by τ):
//!
//! - ds = 2 g² m y⁻³ dw; the lever angle ∫(c − s)/(1 − τs)⁴ ds is λ = m² w² (1 + y)² (1 + 2y²)/(6 g⁴), closed;
//! - Δξ = ∫(1 − cos ψ) ds = 2 g² m X, X = ∫(1 − cos ψ) y⁻³ dw: shortening of the lever arm c − s;
//! - ψ = q λ − Δψ, Δψ = q ∫Δξ/(1 − τs)⁴ ds = 4 q m² g⁻⁴ ∫X y⁵ dw;
//! - at the base: Ω = Δξ, σ = ∫(Δψ + ψ − sin ψ) ds, η = q c³/(6 g⁴) − σ, and about the motor's axis, with r the hub,
//!   X_m = c − Ω + r cos ψ_b, Y_m = η + r sin ψ_b.
//!
//! Closure: (X_m, Y_m) has length 1 + r and angle β = ψ_b − θ. Written so that every term is a small correction:
//!
//! - q c³/(3 g²) = θ C (1 + E), C = c + r, with
//!   θ C E = −θ Ω_m + X_m (β − sin β) − Y_m (1 − cos β) + c Δψ_b + Ω ψ_b − σ + r (sin ψ_b − ψ_b cos ψ_b), Ω_m = C − X_m;
//! - c − 1 = (2 C Ω_m − Ω_m² − Y_m²)/(C + 1 + r).
//!
//! Strain: ε/(θf) − 1 = δq + (1 + δq)(h − mean Δξ/(1 − τs)³ / ℓ), ℓ the closed mean of (c − s)/(1 − τs)³ at c = 1 and h
//! its relative change with c.
//!
//! # Practice
//! One sweep evaluates all this from the last (δq, c, Δψ) and returns the next. The iteration contracts by about θ²
//! per sweep at small angles, by 3 at 60°; it needs no damping below 75°.

use super::pack::{Pack, Scalar};
use crate::kernel::{
    Rule, Solution, Tap,
    nodes::{Nodes, gauss},
    rule::limits::{
        APEX, BENDING_TAIL, HOPELESS, LARGEST_RATE, LEAST_ARC, MOST_ARC, SHORTENING_TAIL, SMALLEST_RATE, TINY,
    },
};

/// Tables of [`Nodes`] in the kernel's own precision.
#[derive(Debug, Clone)]
pub struct Tables<T, const N: usize> {
    points: [T; N],
    weights: [T; N],
    integral: [[T; N]; N],
    legendre: [[T; N]; N],
    gauge: Vec<(T, T)>,
    one_minus_cos: Vec<T>,
    x_minus_sin: Vec<T>,
}

impl<T: Scalar, const N: usize> Tables<T, N> {
    /// Tables of `rule`, which has N nodes.
    pub fn new(rule: &Rule) -> Self {
        let nodes = Nodes::new(N);
        let row = |v: &[f64]| -> [T; N] { std::array::from_fn(|i| T::of(v[i])) };
        let (points, weights) = gauss(rule.gauge_points());
        Self {
            points: row(&nodes.points),
            weights: row(&nodes.weights),
            integral: std::array::from_fn(|i| row(&nodes.integral[i])),
            legendre: std::array::from_fn(|i| row(&nodes.legendre[i])),
            gauge: points.iter().zip(&weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect(),
            one_minus_cos: series(rule.terms, 2).into_iter().map(T::of).collect(),
            x_minus_sin: series(rule.terms, 3).into_iter().map(T::of).collect(),
        }
    }
}

/// Coefficients of 1 − cos x = x² Σ c_k x^2k (`first` 2) or x − sin x = x³ Σ c_k x^2k (`first` 3).
pub fn series(terms: usize, first: u32) -> Vec<f64> {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    (0..terms as u32).map(|k| (if k % 2 == 0 { 1.0 } else { -1.0 }) / factorial(first + 2 * k)).collect()
}

/// Σ c_k z^k.
#[inline(always)]
fn polynomial<T: Scalar, const L: usize, const FMA: bool>(c: &[T], z: Pack<T, L, FMA>) -> Pack<T, L, FMA> {
    let mut sum = Pack::splat(c[c.len() - 1]);
    for &next in c[..c.len() - 1].iter().rev() {
        sum = sum.mul_add(z, Pack::splat(next));
    }
    sum
}

/// Σ row_j y_j.
#[inline(always)]
fn dot<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    row: &[T; N],
    y: &[Pack<T, L, FMA>; N],
) -> Pack<T, L, FMA> {
    let mut sum = Pack::splat(row[0]) * y[0];
    for j in 1..N {
        sum = Pack::splat(row[j]).mul_add(y[j], sum);
    }
    sum
}

/// What one sweep passes to the next.
struct State<P, const N: usize> {
    /// δq = P/P_linear − 1.
    force: P,
    /// δc = c − 1.
    arc: P,
    /// Δψ at the nodes.
    lag: [P; N],
    /// (1 − cos ψ) y⁻³ at the nodes: integrand of X.
    shortening: [P; N],
    /// X y⁵ at the nodes: integrand of Δψ.
    bending: [P; N],
    /// |ψ| at the base.
    base: P,
}

/// Solves `L` taps at once.
#[inline(always)]
pub fn taps<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    rule: &Rule,
    tolerance: f64,
    tap: &Tap<Pack<T, L, FMA>>,
) -> Solution<Pack<T, L, FMA>> {
    let of = Pack::<T, L, FMA>::of;
    let lever = lever_change(tap);
    let mut state = State {
        force: of(0.0),
        arc: of(0.0),
        lag: [of(0.0); N],
        shortening: [of(0.0); N],
        bending: [of(0.0); N],
        base: of(0.0),
    };
    let (mut error, mut last, mut sweeps) = (of(1.0), of(1.0), of(0.0));
    let stop = of(0.25 * tolerance);
    for _ in 0..rule.sweeps {
        let (force, arc) = (state.force, state.arc);
        sweep(tables, tap, &mut state);
        let change = (state.force - force).abs() + (of(1.0) + tap.weight * lever) * (state.arc - arc).abs();
        // What is left if the contraction goes on: change · ρ/(1 − ρ).
        let rate = (change / last).min(of(LARGEST_RATE)).max(of(SMALLEST_RATE));
        last = change.max(of(TINY));
        sweeps = sweeps + stop.if_less(error, of(1.0), of(0.0));
        error = change * rate / (of(1.0) - rate);
        if error.all_at_most(stop) {
            break;
        }
    }
    gauge(tables, rule, tap, &state, error, sweeps)
}

/// dℓ/dc / ℓ at c = 1: sensitivity of the lever mean to the contact arc.
#[inline(always)]
fn lever_change<T: Scalar, const L: usize, const FMA: bool>(tap: &Tap<Pack<T, L, FMA>>) -> Pack<T, L, FMA> {
    let of = Pack::<T, L, FMA>::of;
    let (u1, u2) = (tap.taper.mul_add(tap.near, tap.rest), tap.taper.mul_add(tap.far, tap.rest));
    let clear = (u1 + u2) / (tap.near * u2 + tap.far * u1).max(of(TINY));
    let on_gauge = of(2.0) / tap.near.max(of(TINY)) + tap.taper / tap.rest;
    tap.far.if_less(of(0.0), on_gauge, clear)
}

/// One Picard sweep.
#[inline(always)]
fn sweep<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    tap: &Tap<Pack<T, L, FMA>>,
    state: &mut State<Pack<T, L, FMA>, N>,
) {
    let of = Pack::<T, L, FMA>::of;
    let one = of(1.0);
    let axis = one + tap.hub;
    let q = of(3.0) * tap.angle * tap.rest * axis * (one + state.force);
    let c = one + state.arc;
    let g2 = (tap.rest - tap.taper * state.arc).max(of(APEX) * tap.rest);
    let g = g2.sqrt();
    let m = c / (one + g);
    let k = tap.taper * m;
    let g4 = one / (g2 * g2);
    let lever = q * m * m * g4 * of(1.0 / 6.0);

    let mut y = [one; N];
    let mut psi = [one; N];
    let mut density = [one; N];
    for i in 0..N {
        let w = Pack::splat(tables.points[i]);
        y[i] = one - k * w;
        let y2 = y[i] * y[i];
        let reach = w * (one + y[i]);
        psi[i] = lever * reach * reach * y2.mul_add(of(2.0), one);
        let z = one / y[i];
        density[i] = z * z * z;
        let bent = psi[i] - state.lag[i];
        state.shortening[i] = one_minus_cos(tables, bent) * density[i];
    }
    for i in 0..N {
        let y2 = y[i] * y[i];
        state.bending[i] = dot(&tables.integral[i], &state.shortening) * (y2 * y2 * y[i]);
    }
    let scale = of(4.0) * q * m * m * g4;
    let mut sine = [one; N];
    for i in 0..N {
        state.lag[i] = scale * dot(&tables.integral[i], &state.bending);
        sine[i] = (state.lag[i] + x_minus_sin(tables, psi[i] - state.lag[i])) * density[i];
    }
    let ds = of(2.0) * g2 * m;
    let short = ds * dot(&tables.weights, &state.shortening);
    let lag = scale * dot(&tables.weights, &state.bending);
    let sigma = ds * dot(&tables.weights, &sine);
    let c2 = c * c;
    let base = q * c2 * g4 * of(1.0 / 6.0) * g2.mul_add(of(2.0), one) - lag;
    let eta = q * c2 * c * g4 * of(1.0 / 6.0) - sigma;

    let (cosine, sine) = (one_minus_cos(tables, base), x_minus_sin(tables, base));
    let (reach, back) = (c + tap.hub, short + tap.hub * cosine);
    let (x, height) = (reach - back, eta + tap.hub * (base - sine));
    let beta = base - tap.angle;
    let correction = x * x_minus_sin(tables, beta) - height * one_minus_cos(tables, beta) - tap.angle * back
        + c * lag
        + short * base
        - sigma
        + tap.hub * (base * cosine - sine);
    let excess = correction / (tap.angle * reach);

    let arc = (of(2.0) * reach * back - back * back - height * height) / (reach + axis);
    let arc = arc.max(of(LEAST_ARC)).min(of(MOST_ARC));
    // c³ C₁/(C (1 − τc)) (1 − τ) − 1, each factor as one plus a small number.
    let slimmer = tap.taper * arc;
    let slim = slimmer / (tap.rest - slimmer).max(of(APEX) * tap.rest);
    let cube = arc * arc.mul_add(arc + of(3.0), of(3.0));
    let grown = cube + slim + cube * slim;
    let farther = arc / axis;
    let stiffness = (grown - farther) / (one + farther);
    state.force = (excess - stiffness) / (one + stiffness);
    state.arc = arc;
    state.base = base.abs();
}

#[inline(always)]
fn one_minus_cos<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    x: Pack<T, L, FMA>,
) -> Pack<T, L, FMA> {
    let z = x * x;
    z * polynomial(&tables.one_minus_cos, z)
}

#[inline(always)]
fn x_minus_sin<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    x: Pack<T, L, FMA>,
) -> Pack<T, L, FMA> {
    let z = x * x;
    x * z * polynomial(&tables.x_minus_sin, z)
}

/// Strain deviation and error estimate from a converged state.
#[inline(always)]
fn gauge<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    rule: &Rule,
    tap: &Tap<Pack<T, L, FMA>>,
    state: &State<Pack<T, L, FMA>, N>,
    error: Pack<T, L, FMA>,
    sweeps: Pack<T, L, FMA>,
) -> Solution<Pack<T, L, FMA>> {
    let of = Pack::<T, L, FMA>::of;
    let (zero, one, tiny) = (of(0.0), of(1.0), of(TINY));
    let c = one + state.arc;
    let g2 = (tap.rest - tap.taper * state.arc).max(of(APEX) * tap.rest);
    let g = g2.sqrt();
    let m = c / (one + g);
    let k = tap.taper * m;

    // Lever mean ℓ and its relative change h; past = the part of the lever beyond the contact that has no moment.
    let (c1, c2) = (tap.near + state.arc, tap.far + state.arc);
    let (u1, u2) = (tap.taper.mul_add(tap.near, tap.rest), tap.taper.mul_add(tap.far, tap.rest));
    let (b1, b2) = (one / u1, one / u2.max(tiny));
    let past = |end: Pack<T, L, FMA>| end * end * b2 * b2 / (of(2.0) * g2 * tap.width);
    let clear = of(0.5) * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let clear_h = (of(0.5) * b1 * b2 * state.arc * (b1 + b2) + past(c2.min(zero))) / clear.max(tiny);
    let on_gauge = tap.near * tap.near * b1 * b1 / (of(2.0) * tap.rest * tap.width);
    let (farther, slim) = (state.arc / tap.near.max(tiny), tap.taper * state.arc / g2);
    let longer = farther * (of(2.0) + farther);
    let on_gauge_h = longer + slim + longer * slim - past(c2.max(zero)) / on_gauge.max(tiny);
    let lever = tap.far.if_less(zero, on_gauge, clear).max(tiny);
    let h = tap.far.if_less(zero, on_gauge_h, clear_h);

    // Mean of Δξ/(1 − τs)³ over the bent part of the gauge.
    let mut series = [zero; N];
    for i in 0..N {
        series[i] = dot(&tables.legendre[i], &state.shortening);
    }
    let place = |from_contact: Pack<T, L, FMA>, u: Pack<T, L, FMA>| {
        let root = u.max(tiny).sqrt();
        from_contact.max(zero) * (one + g) / (c * root * (root + g))
    };
    let (w1, w2) = (place(c1, u1).min(one), place(c2, u2));
    let (mut sum, mut length) = (zero, zero);
    for &(point, weight) in &tables.gauge {
        let w = w2 + (w1 - w2) * Pack::splat(point);
        let y = one - k * w;
        let y3 = y * y * y;
        sum = sum + Pack::splat(weight) * primitive(&series, w) * y3;
        length = length + Pack::splat(weight) / y3;
    }
    let bent = c2.if_less(zero, c1.max(zero) / tap.width, one);
    let mean = bent * of(2.0) * m * sum / (g2 * g2 * length);
    let strain = state.force + (one + state.force) * (h - mean / lever);

    let error = error + truncation(tables, tap, state, &series, m, g2);
    let error = of(rule.max_angle()).if_less(state.base, of(HOPELESS), error);
    Solution { force: state.force, arc: state.arc, strain, error, sweeps }
}

/// ∫₀^w of a series of shifted Legendre polynomials.
#[inline(always)]
fn primitive<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    series: &[Pack<T, L, FMA>; N],
    w: Pack<T, L, FMA>,
) -> Pack<T, L, FMA> {
    let of = Pack::<T, L, FMA>::of;
    let x = w.mul_add(of(2.0), of(-1.0));
    let mut sum = series[0] * w;
    let (mut before, mut now) = (of(1.0), x);
    for k in 1..N {
        let kf = k as f64;
        let next = (of(2.0 * kf + 1.0) * x * now - of(kf) * before) * of(1.0 / (kf + 1.0));
        sum = sum + series[k] * (next - before) * of(0.5 / (2.0 * kf + 1.0));
        (before, now) = (now, next);
    }
    sum
}

/// Bound on the truncation error of the strain from the last two Legendre coefficients of both integrands. Sums over Gauss
/// nodes converge faster than the interpolant, hence the power; both factors were fitted to 20 000 random taps (d/D
/// 0.02…1.3, θ 0.1…60°, gauges of all lengths) at n = 6…16, where no accepted tap exceeded its tolerance.
#[inline(always)]
fn truncation<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    tap: &Tap<Pack<T, L, FMA>>,
    state: &State<Pack<T, L, FMA>, N>,
    series: &[Pack<T, L, FMA>; N],
    m: Pack<T, L, FMA>,
    g2: Pack<T, L, FMA>,
) -> Pack<T, L, FMA> {
    let of = Pack::<T, L, FMA>::of;
    let last = |k: usize| dot(&tables.legendre[k], &state.bending).abs();
    let bending = of(12.0) * m * m * (of(1.0) + tap.hub) * tap.rest / (g2 * g2) * (last(N - 1) + last(N - 2));
    let shortening = of(2.0) * g2 * m * (series[N - 1].abs() + series[N - 2].abs());
    of(BENDING_TAIL) * bending * bending.sqrt() + of(SHORTENING_TAIL) * shortening
}
