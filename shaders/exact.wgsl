// The exact rod, frictionless, on its centreline, Hooke: collocation in deviation form. Twin of
// src/kernel/cpu/exact.rs, where the equations are derived; same functions, same names, same order.
//
// Emitted from Rust before this text: real, Nodes, N, POINTS, GAUGE_POINTS, GAUGE_WEIGHTS, the sums weigh, integrate
// and coefficients over the nodes, one_minus_cos, x_minus_sin, primitive.

// What one sweep passes to the next.
struct State {
    // P/P_linear - 1.
    force: real,
    // c - 1.
    arc: real,
    // Delta psi at the nodes.
    lag: Nodes,
    // (1 - cos psi) y^-3 at the nodes: integrand of X.
    shortening: Nodes,
    // X y^5 at the nodes: integrand of Delta psi.
    bending: Nodes,
    // |psi| at the base.
    base: real,
}

fn solve(tap: Tap) -> Solution {
    let lever = lever_change(tap);
    var state = State();
    var error = ONE;
    var last = ONE;
    var sweeps = ZERO;
    let stop = 0.25 * TOLERANCE;
    for (var i = 0u; i < SWEEPS; i++) {
        let force = state.force;
        let arc = state.arc;
        sweep(tap, &state);
        let change = abs(state.force - force) + (1.0 + tap.weight * lever) * abs(state.arc - arc);
        // What is left if the contraction goes on: change * rate / (1 - rate).
        let rate = max(min(change / last, LARGEST_RATE), SMALLEST_RATE);
        last = max(change, TINY);
        sweeps += 1.0;
        error = change * rate / (1.0 - rate);
        if error <= stop {
            break;
        }
    }
    return gauge(tap, &state, error, sweeps);
}

// d(lever mean)/dc over the lever mean at c = 1.
fn lever_change(tap: Tap) -> real {
    let u1 = fma(tap.taper, tap.near, tap.rest);
    let u2 = fma(tap.taper, tap.far, tap.rest);
    let clear = (u1 + u2) / max(tap.near * u2 + tap.far * u1, TINY);
    let on_gauge = 2.0 / max(tap.near, TINY) + tap.taper / tap.rest;
    return select(clear, on_gauge, tap.far < 0.0);
}

// One Picard sweep.
fn sweep(tap: Tap, state: ptr<function, State>) {
    let axis = 1.0 + tap.hub;
    let q = 3.0 * tap.angle * tap.rest * axis * (1.0 + state.force);
    let c = 1.0 + state.arc;
    let g2 = max(tap.rest - tap.taper * state.arc, APEX * tap.rest);
    let g = sqrt(g2);
    let m = c / (1.0 + g);
    let k = tap.taper * m;
    let g4 = 1.0 / (g2 * g2);
    let lever = q * m * m * g4 * SIXTH;

    var y: Nodes;
    var psi: Nodes;
    var density: Nodes;
    var shortening: Nodes;
    for (var i = 0u; i < N; i++) {
        let w = POINTS[i];
        y[i] = 1.0 - k * w;
        let y2 = y[i] * y[i];
        let reach = w * (1.0 + y[i]);
        psi[i] = lever * reach * reach * fma(y2, TWO, ONE);
        let z = 1.0 / y[i];
        density[i] = z * z * z;
        let bent = psi[i] - state.lag[i];
        shortening[i] = one_minus_cos(bent) * density[i];
    }
    var bending = integrate(shortening);
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        bending[i] *= y2 * y2 * y[i];
    }
    let scale = 4.0 * q * m * m * g4;
    var lags = integrate(bending);
    var sines: Nodes;
    for (var i = 0u; i < N; i++) {
        lags[i] *= scale;
        sines[i] = (lags[i] + x_minus_sin(psi[i] - lags[i])) * density[i];
    }
    let ds = 2.0 * g2 * m;
    let short = ds * weigh(shortening);
    let lag = scale * weigh(bending);
    let sigma = ds * weigh(sines);
    let c2 = c * c;
    let base = q * c2 * g4 * SIXTH * fma(g2, TWO, ONE) - lag;
    let eta = q * c2 * c * g4 * SIXTH - sigma;

    let cosine = one_minus_cos(base);
    let sine = x_minus_sin(base);
    let reach = c + tap.hub;
    let back = short + tap.hub * cosine;
    let x = reach - back;
    let height = eta + tap.hub * (base - sine);
    let beta = base - tap.angle;
    let correction = x * x_minus_sin(beta) - height * one_minus_cos(beta) - tap.angle * back + c * lag
        + short * base
        - sigma
        + tap.hub * (base * cosine - sine);
    let excess = correction / (tap.angle * reach);

    let arc = clamp((2.0 * reach * back - back * back - height * height) / (reach + axis), LEAST_ARC, MOST_ARC);
    // c^3 C1/(C (1 - tau c)) (1 - tau) - 1, each factor as one plus a small number.
    let slimmer = tap.taper * arc;
    let slim = slimmer / max(tap.rest - slimmer, APEX * tap.rest);
    let cube = arc * fma(arc, arc + 3.0, THREE);
    let grown = cube + slim + cube * slim;
    let farther = arc / axis;
    let stiffness = (grown - farther) / (1.0 + farther);
    state.force = (excess - stiffness) / (1.0 + stiffness);
    state.arc = arc;
    state.lag = lags;
    state.shortening = shortening;
    state.bending = bending;
    state.base = abs(base);
}

// How far beyond the contact the lever reaches where it has no moment.
fn past(end: real, b2: real, g2: real, width: real) -> real {
    return end * end * b2 * b2 / (2.0 * g2 * width);
}

// Place w on the rod of a point at distance from_contact, u^2 = 1 - tau s there.
fn place(from_contact: real, u: real, c: real, g: real) -> real {
    let root = sqrt(max(u, TINY));
    return max(from_contact, ZERO) * (1.0 + g) / (c * root * (root + g));
}

// Strain deviation and error estimate from a converged state.
fn gauge(tap: Tap, state: ptr<function, State>, residual: real, sweeps: real) -> Solution {
    let c = 1.0 + state.arc;
    let g2 = max(tap.rest - tap.taper * state.arc, APEX * tap.rest);
    let g = sqrt(g2);
    let m = c / (1.0 + g);
    let k = tap.taper * m;

    let c1 = tap.near + state.arc;
    let c2 = tap.far + state.arc;
    let u1 = fma(tap.taper, tap.near, tap.rest);
    let u2 = fma(tap.taper, tap.far, tap.rest);
    let b1 = 1.0 / u1;
    let b2 = 1.0 / max(u2, TINY);
    let clear = 0.5 * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let clear_h = (0.5 * b1 * b2 * state.arc * (b1 + b2) + past(min(c2, ZERO), b2, g2, tap.width)) / max(clear, TINY);
    let on_gauge = tap.near * tap.near * b1 * b1 / (2.0 * tap.rest * tap.width);
    let farther = state.arc / max(tap.near, TINY);
    let slim = tap.taper * state.arc / g2;
    let longer = farther * (2.0 + farther);
    let on_gauge_h = longer + slim + longer * slim - past(max(c2, ZERO), b2, g2, tap.width) / max(on_gauge, TINY);
    let lever = max(select(clear, on_gauge, tap.far < 0.0), TINY);
    let h = select(clear_h, on_gauge_h, tap.far < 0.0);

    let series = coefficients(state.shortening);
    let w1 = min(place(c1, u1, c, g), ONE);
    let w2 = place(c2, u2, c, g);
    var sum = ZERO;
    var length = ZERO;
    for (var i = 0u; i < GAUGE_N; i++) {
        let w = w2 + (w1 - w2) * GAUGE_POINTS[i];
        let y = 1.0 - k * w;
        let y3 = y * y * y;
        sum += GAUGE_WEIGHTS[i] * primitive(series, w) * y3;
        length += GAUGE_WEIGHTS[i] / y3;
    }
    let bent = select(ONE, max(c1, ZERO) / tap.width, c2 < 0.0);
    let mean = bent * 2.0 * m * sum / (g2 * g2 * length);
    let strain = state.force + (1.0 + state.force) * (h - mean / lever);
    let error = residual + truncation(tap, state, series, m, g2);
    return Solution(state.force, state.arc, strain, select(error, HOPELESS, state.base > MAX_ANGLE), sweeps);
}

// Bound on the truncation error of the strain from the last two Legendre coefficients of both integrands.
fn truncation(tap: Tap, state: ptr<function, State>, series: Nodes, m: real, g2: real) -> real {
    let last = coefficients(state.bending);
    let bending = 12.0 * m * m * (1.0 + tap.hub) * tap.rest / (g2 * g2) * (abs(last[N - 1]) + abs(last[N - 2]));
    let shortening = 2.0 * g2 * m * (abs(series[N - 1]) + abs(series[N - 2]));
    return BENDING_TAIL * bending * sqrt(bending) + SHORTENING_TAIL * shortening;
}
