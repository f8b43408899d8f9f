// Strain deviation and error estimate from a converged state. Twin of crates/kernel/src/cpu/exact/gauge.rs.

// Change of the strain per error of the arc, relative to max(|eps|, 1e-3 theta f_max), for a contact at 1 + x.
fn sensitivity(tap: Tap, x: real) -> real {
    let near = max(tap.near + x, TINY);
    let far = tap.far + x;
    let u1 = fma(tap.taper, tap.near, tap.rest);
    let u2 = fma(tap.taper, tap.far, tap.rest);
    let clear = (u1 + u2) / max(near * u2 + far * u1, TINY);
    let on_gauge = 2.0 / near + tap.taper / tap.rest;
    let growth = min(near / max(tap.near, TINY), MOST_GROWTH);
    let share = select(growth * growth, max(growth, growth * growth), OFFSET);
    let weight = min(tap.weight * share, ONE);
    return 1.0 + weight * select(clear, on_gauge, far < 0.0);
}

// Change of the strain per relative error of W, and of the section law; see the Rust twin.
struct Shares {
    across: real,
    strains: real,
}

fn shares(tap: Tap) -> Shares {
    if !OFFSET {
        return Shares(ONE, ONE);
    }
    let b1 = 1.0 / fma(tap.taper, tap.near, tap.rest);
    let b2 = 1.0 / max(fma(tap.taper, tap.far, tap.rest), TINY);
    let end = select(b2, 1.0 / tap.rest, tap.far < 0.0);
    let bent = select(ONE, max(tap.near, ZERO) / tap.width, tap.far < 0.0);
    let clear = 0.5 * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let lever = select(clear, 0.5 * tap.near * b1 * b1 * bent / tap.rest, tap.far < 0.0);
    var along = tap.contact_radius * 0.5 * bent * b1 * end * (b1 + end);
    if EXTENSION {
        along += 0.25 * tap.radius * bent * b1 * end;
    }
    let scale = tap.weight * tap.radius / max(abs(tap.strain), TINY);
    let across = scale * abs(tap.force * lever);
    let held = scale * abs(tap.along * along);
    return Shares(max(across, ONE), max(across + held, ONE));
}

fn past(end: real, b2: real, g2: real, width: real) -> real {
    return end * end * b2 * b2 / (2.0 * g2 * width);
}

fn place(from_contact: real, u: real, c: real, g: real) -> real {
    let root = sqrt(max(u, TINY));
    return max(from_contact, ZERO) * (1.0 + g) / (c * root * (root + g));
}

fn gauge(tap: Tap, state: ptr<function, State>, residual: real, rounded: real, across: real, sweeps: real) -> Solution {
    let x = tap.arc + state.arc;
    let c = 1.0 + x;
    let g2 = max(tap.rest - tap.taper * x, APEX * tap.rest);
    let g = sqrt(g2);
    let m = c / (1.0 + g);
    let k = tap.taper * m;

    let c1 = tap.near + x;
    let c2 = tap.far + x;
    let u1 = fma(tap.taper, tap.near, tap.rest);
    let u2 = fma(tap.taper, tap.far, tap.rest);
    let b1 = 1.0 / u1;
    let b2 = 1.0 / max(u2, TINY);
    let clear = 0.5 * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let clear_change = 0.5 * b1 * b2 * x * (b1 + b2) + past(min(c2, ZERO), b2, g2, tap.width);
    let on_gauge = tap.near * tap.near * b1 * b1 / (2.0 * tap.rest * tap.width);
    let farther = clamp(x / max(tap.near, TINY), -MOST_GROWTH, MOST_GROWTH);
    let slim = tap.taper * x / g2;
    let longer = farther * (2.0 + farther);
    let left = 0.5 * b1 * b2 * (c1 * b1 + c2 * b2) - on_gauge;
    let leaving = on_gauge * (longer + slim + longer * slim) - past(max(c2, ZERO), b2, g2, tap.width);
    let on_gauge_change = select(leaving, left, c2 > LEFT * tap.width);
    let lever = max(select(clear, on_gauge, tap.far < 0.0), TINY);
    let change = select(clear_change, on_gauge_change, tap.far < 0.0);

    let series = coefficients(state.shortening);
    var climbs: Nodes;
    var angles: Nodes;
    if OFFSET {
        climbs = coefficients(state.climb);
    }
    if EXTENSION {
        angles = coefficients(state.angle);
    }
    let w1 = min(place(c1, u1, c, g), ONE);
    let w2 = place(c2, u2, c, g);
    let w_force = tap.force * (1.0 + state.force);
    var h_force = ZERO;
    var contact_radius = ZERO;
    if OFFSET {
        h_force = tap.along + tap.force * state.along;
        contact_radius = tap.contact_radius - tap.slope * x;
    }
    let ig2 = 1.0 / g2;
    let ig6 = ig2 * ig2 * ig2;
    var sum = ZERO;
    var length = ZERO;
    for (var i = 0u; i < GAUGE_N; i++) {
        let w = w2 + (w1 - w2) * GAUGE_POINTS[i];
        let weight = GAUGE_WEIGHTS[i];
        let y = 1.0 - k * w;
        let y2 = y * y;
        let y3 = y2 * y;
        length += weight / y3;
        if PLAIN {
            sum += weight * primitive(series, w) * y3;
            continue;
        }
        var moment = w_force * 2.0 * g2 * m * primitive(series, w);
        if OFFSET {
            moment -= h_force * 2.0 * g2 * m * primitive(climbs, w);
        }
        var strain = -tap.radius * moment * y3 * y3 * ig6;
        var direct = ZERO;
        if EXTENSION {
            let angle = legendre(angles, w);
            let cosine = one_minus_cos(angle);
            let sine = angle - x_minus_sin(angle);
            let unit = 0.25 * tap.radius * tap.radius * y2 * y2 * ig2 * ig2;
            let excess = -(h_force * cosine + w_force * sine) * unit;
            direct = h_force * unit + excess;
            strain += SIDE * excess;
        }
        if LAW {
            let arm = g2 * m * w * (1.0 + y) / y2;
            let b = tap.radius * (w_force * arm + h_force * contact_radius - moment) * y3 * y3 * ig6;
            let law = section(direct, abs(b));
            strain += b * law.chi + SIDE * law.extra;
        }
        sum += weight * strain / y3;
    }
    let bent = select(ONE, max(c1, ZERO) / tap.width, c2 < 0.0);
    let growth = 1.0 + state.force;
    var strain = ZERO;
    if PLAIN {
        let mean = bent * 2.0 * m * sum / (g2 * g2 * length);
        strain = state.force + growth * (change - mean) / lever;
    } else {
        var more = tap.radius * tap.force * (lever * state.force + growth * change) + bent * sum / length;
        if OFFSET {
            let end = select(b2, ig2, c2 < 0.0);
            let first = select(b2, 1.0 / tap.rest, tap.far < 0.0);
            let share = select(ONE, max(tap.near, ZERO) / tap.width, tap.far < 0.0);
            let now = 0.5 * bent * b1 * end * (b1 + end);
            let before = 0.5 * share * b1 * first * (b1 + first);
            let dh = tap.force * state.along;
            let dr = -tap.slope * x;
            more += tap.radius
                * ((dh * (tap.contact_radius + dr) + tap.along * dr) * now + tap.along * tap.contact_radius * (now - before));
            if EXTENSION {
                let area = 0.25 * tap.radius * tap.radius;
                let direct = bent * b1 * end;
                more += SIDE * area * (dh * direct + tap.along * (direct - share * b1 * first));
            }
        }
        strain = more / tap.strain;
    }
    var error = residual + rounded + across * truncation(tap, state, series, m, g2, sensitivity(tap, x));
    if OFFSET {
        let height = 2.0 * g2 * m * (abs(climbs[N - 1]) + abs(climbs[N - 2]));
        let lost = tap.radius * abs(h_force) * height / max(abs(tap.strain), TINY);
        error += HEIGHT_TAIL * tap.weight * lost;
    }
    error = error / clamp(abs(1.0 + strain), 1e-3, ONE);
    var outside = state.base > MAX_ANGLE || state.fold < 0.0;
    var load = ZERO;
    if LAW {
        load = state.load;
        for (var end = 0u; end < 2u; end++) {
            let w = real(end);
            let y = select(ONE, g, end == 1u);
            let y2 = y * y;
            var angle = ZERO;
            var direct = ZERO;
            if EXTENSION {
                angle = legendre(angles, w);
                let unit = 0.25 * tap.radius * tap.radius * y2 * y2 * ig2 * ig2;
                let sine = angle - x_minus_sin(angle);
                direct = h_force * unit - (h_force * one_minus_cos(angle) + w_force * sine) * unit;
            }
            let moment = w * (2.0 * g2 * m * (w_force * series[0] - h_force * climbs[0]));
            let arm = g2 * m * w * (1.0 + y) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = abs(tap.radius * whole * (y2 * y2 * y2) * ig6);
            let law = section(direct, b);
            let e = direct + law.extra;
            let kr = b * (1.0 + law.chi);
            load = max(load, max(e + kr, 2.0 * (kr - e)));
            outside = outside || law.load > 1.0;
        }
        outside = outside || state.beyond > 1.0;
    }
    let astray = !(residual < ASTRAY);
    if OFFSET && tap.rest < LEAST_REST {
        error = LOST;
    }
    if outside || load > 1.0 {
        error = select(HOPELESS, LOST, astray);
    }
    load = select(load, ZERO, outside || astray);
    return Solution(state.force, state.along, state.arc, strain, error, load, sweeps);
}

// Bound on the truncation error of the strain from the last two Legendre coefficients of both integrands.
fn truncation(tap: Tap, state: ptr<function, State>, series: Nodes, m: real, g2: real, felt: real) -> real {
    let last = coefficients(state.bending);
    let bending = 12.0 * m * m * (1.0 + tap.hub) * tap.rest / (g2 * g2) * (abs(last[N - 1]) + abs(last[N - 2]));
    let shortening = 2.0 * g2 * m * (abs(series[N - 1]) + abs(series[N - 2]));
    return BENDING_TAIL * bending * sqrt(bending) + SHORTENING_TAIL * felt * shortening;
}
