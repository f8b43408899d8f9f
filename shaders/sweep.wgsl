// One Picard sweep, with a Newton step for the two unknowns of the contact. Twin of crates/kernel/src/cpu/exact/sweep.rs.

fn then(a: real, b: real) -> real {
    return fma(a, b, a + b);
}

fn sweep(tap: Tap, state: ptr<function, State>) {
    let w_force = tap.force * (1.0 + state.force);
    var h_force = ZERO;
    var contact_radius = ZERO;
    let x = tap.arc + state.arc;
    if OFFSET {
        h_force = tap.along + tap.force * state.along;
        contact_radius = tap.contact_radius - tap.slope * x;
    }
    let c = 1.0 + x;
    let g2 = max(tap.rest - tap.taper * x, APEX * tap.rest);
    let g = sqrt(g2);
    let m = c / (1.0 + g);
    let k = tap.taper * m;
    let ig2 = 1.0 / g2;
    let g4 = ig2 * ig2;
    let lever = w_force * m * m * g4 * SIXTH;
    let ds = 2.0 * g2 * m;
    let pivot = h_force * contact_radius * m * g4 * ig2 * THIRD;
    let area = 0.25 * tap.radius * tap.radius * g4;

    var y: Nodes;
    var psi: Nodes;
    var density: Nodes;
    var gamma: Nodes;
    var axial: Nodes;
    var climb: Nodes;
    var pure: Nodes;
    var shortening: Nodes;
    for (var i = 0u; i < N; i++) {
        let w = POINTS[i];
        y[i] = 1.0 - k * w;
        let y2 = y[i] * y[i];
        let reach = w * (1.0 + y[i]);
        psi[i] = lever * reach * reach * fma(y2, TWO, ONE);
        if OFFSET {
            psi[i] += pivot * reach * fma(y2, y2 + 1.0, ONE);
        }
        let z = 1.0 / y[i];
        density[i] = z * z * z;
        let bent = psi[i] - state.lag[i];
        let cosine = one_minus_cos(bent);
        var short = cosine;
        if SHEAR || EXTENSION || OFFSET {
            let sine = bent - x_minus_sin(bent);
            let y4 = y2 * y2;
            if SHEAR {
                gamma[i] = -(h_force * sine + w_force * (1.0 - cosine)) * tap.shear * g4 * y4;
            }
            var stretch = ZERO;
            if EXTENSION {
                let unit = area * y4;
                let excess = -(h_force * cosine + w_force * sine) * unit;
                axial[i] = h_force * unit + excess;
                stretch = axial[i] + state.extra[i];
                short = cosine * (1.0 + stretch) - (excess + state.extra[i]);
            }
            if SHEAR {
                short += gamma[i] * sine;
            }
            if OFFSET {
                climb[i] = ((1.0 + stretch) * sine + gamma[i] * (1.0 - cosine)) * density[i];
            }
            pure[i] = short * density[i];
            if EXTENSION {
                short -= h_force * area * y4;
            }
        }
        shortening[i] = short * density[i];
    }
    var bending = integrate(shortening);
    var heights: Nodes;
    if OFFSET {
        heights = integrate(climb);
    }
    var load = ZERO;
    var beyond = ZERO;
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        if PLAIN {
            bending[i] *= y2 * y2 * y[i];
            continue;
        }
        var moment = w_force * ds * bending[i];
        if OFFSET {
            heights[i] *= ds;
            moment -= h_force * heights[i];
        }
        if LAW {
            let arm = g2 * m * POINTS[i] * (1.0 + y[i]) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = abs(tap.radius * whole * (y2 * y2 * y2) * g4 * ig2);
            let law = section(axial[i], b);
            state.extra[i] = law.extra;
            moment -= whole * law.chi;
            let e = axial[i] + law.extra;
            let kr = b * (1.0 + law.chi);
            load = max(load, max(e + kr, 2.0 * (kr - e)));
            beyond = max(beyond, law.load);
        }
        bending[i] = moment * (y2 * y2 * y[i]);
    }
    let scale = select(2.0 * m * g4 * ig2, 4.0 * w_force * m * m * g4, PLAIN);
    var lags = integrate(bending);
    var sines: Nodes;
    var nearer: Nodes;
    for (var i = 0u; i < N; i++) {
        lags[i] *= scale;
        let angle = psi[i] - lags[i];
        state.angle[i] = angle;
        let behind = x_minus_sin(angle);
        if OFFSET {
            let step = lags[i] - state.lag[i];
            nearer[i] = (angle - behind + 0.5 * step) * step * density[i];
        }
        var sum = lags[i] + behind;
        if SHEAR || EXTENSION {
            let sine = angle - behind;
            let cosine = one_minus_cos(angle);
            if EXTENSION {
                sum -= (axial[i] + state.extra[i]) * sine;
            }
            if SHEAR {
                let y2 = y[i] * y[i];
                sum += tap.shear * g4 * y2 * y2 * sine * (h_force * (1.0 - cosine) - w_force * sine);
            }
        }
        sines[i] = sum * density[i];
    }
    let lag = scale * weigh(bending);
    let sigma = ds * weigh(sines);

    let v = tap.rest;
    let iv = 1.0 / v;
    let hub = tap.hub;
    let tx = tap.taper * x;
    let slim = tx * ig2;
    let slim2 = slim * (2.0 + slim);
    let square = x * (2.0 + x);
    let cube = x * fma(x, x + 3.0, THREE);
    let psi1 = fma(v, TWO, ONE) * iv * iv * SIXTH;
    let d_psi1 = psi1 * then(then(square, slim2), -2.0 * tx / fma(v, TWO, ONE));
    let eta_b = iv * iv * SIXTH;
    var eta1 = eta_b;
    var d_eta1 = eta_b * then(cube, slim2);
    if SHEAR {
        eta1 -= tap.shear * iv;
        d_eta1 -= tap.shear * iv * then(x, slim);
    }
    let x0 = select(tap.pole_x, 1.0 + hub, PLAIN);
    let y0 = select(tap.pole_y, ZERO, PLAIN);
    var s1 = x0;
    var turn = x0;
    if OFFSET {
        s1 = x0 - y0 * tap.slope;
        turn = x0 * x0 + y0 * y0 - hub * x0;
    }
    let turn_c = turn + x * s1;
    var a1 = turn * psi1 - x0 * eta1;
    var d_a1 = turn * d_psi1 + x * s1 * (psi1 + d_psi1) - x0 * d_eta1;
    if PLAIN {
        a1 = x0 * iv * THIRD;
        d_a1 = a1 * then(cube, slim);
    }
    var base = w_force * (psi1 + d_psi1) - lag;
    var height = w_force * (eta1 + d_eta1) - sigma;
    var a0 = ZERO;
    var d_a0 = ZERO;
    var b0 = ZERO;
    var d_b0 = ZERO;
    var f = ZERO;
    var d_f = ZERO;
    if OFFSET {
        let slim3 = then(slim2, slim);
        let psi0 = tap.contact_radius * (1.0 + v + v * v) * iv * iv * iv * THIRD;
        let eta0 = tap.contact_radius * (2.0 + v) * iv * iv * iv * SIXTH;
        let thin = -tap.slope * x / max(tap.contact_radius, TINY);
        let d_psi0 = psi0 * then(then(thin, x), then(slim3, -tx * (1.0 + 2.0 * v - tx) / (1.0 + v + v * v)));
        let d_eta0 = eta0 * then(then(thin, square), then(slim3, -tx / (2.0 + v)));
        a0 = turn * psi0 - x0 * eta0;
        d_a0 = turn * d_psi0 + x * s1 * (psi0 + d_psi0) - x0 * d_eta0;
        b0 = eta0 + hub * psi0;
        d_b0 = d_eta0 + hub * d_psi0;
        base += h_force * (psi0 + d_psi0);
        height += h_force * (eta0 + d_eta0);
        if EXTENSION {
            f = 0.25 * tap.radius * tap.radius * iv;
            d_f = f * then(x, slim);
        }
    }

    let cosine_b = one_minus_cos(base);
    let sine_b = x_minus_sin(base);
    let beta = base - tap.angle;
    let cosine = one_minus_cos(beta);
    let sine = x_minus_sin(beta);
    var short = ZERO;
    if SHEAR || EXTENSION || OFFSET {
        short = ds * weigh(pure);
    } else {
        short = ds * weigh(shortening);
    }
    if OFFSET {
        short -= ds * weigh(nearer);
    }
    let back_more = short + hub * cosine_b;
    let rise = height + hub * (base - sine_b);
    var back = back_more;
    var step_y = rise;
    if OFFSET {
        back -= h_force * (f + d_f);
        step_y -= tap.slope * x;
    }
    let step_x = x - back;
    let pole_x = x0 + step_x;
    let pole_y = y0 + step_y;
    var higher = -back * x0 * beta - pole_x * x0 * sine + pole_y * x0 * cosine;
    if OFFSET {
        higher += rise * y0 * beta - pole_x * y0 * cosine - pole_y * y0 * sine;
    }
    let known = turn_c * lag - hub * x0 * sine_b - x0 * sigma - higher;
    let grown = state.force;
    var across = tap.force * (a1 * grown + (1.0 + grown) * d_a1) - tap.angle * x * s1 - known;
    var along = s1 * state.arc - x0 * back_more + 0.5 * (step_x * step_x + step_y * step_y);
    if OFFSET {
        let dh = tap.force * state.along;
        let pulled = dh * f + h_force * d_f;
        across += dh * a0 + h_force * d_a0 + state.arc * (y0 + x0 * tap.slope) - y0 * (back_more - pulled);
        let b1 = eta1 + hub * psi1;
        let d_b1 = d_eta1 + hub * d_psi1;
        along += x0 * pulled
            + y0 * (tap.force * (b1 * grown + (1.0 + grown) * d_b1) + dh * b0 + h_force * d_b0 - sigma - hub * (lag + sine_b));
    }

    state.base = abs(base);
    state.load = load;
    state.beyond = beyond;
    state.lag = lags;
    state.shortening = shortening;
    state.climb = climb;
    state.bending = bending;

    var noise_across = ZERO;
    var noise_along = ZERO;
    if !PLAIN {
        noise_across = abs(tap.force)
            * ((abs(turn * psi1) + abs(x0 * eta1)) * abs(grown) + abs(1.0 + grown) * (abs(turn * d_psi1) + abs(x0 * d_eta1)))
            + abs(turn_c * lag) + abs(x0 * sigma) + abs(back * x0 * beta) + abs(pole_y * x0 * cosine) + abs(tap.angle * x * s1);
        noise_along = abs(x * s1) + abs(x0 * back_more);
        if OFFSET {
            let dh = abs(tap.force * state.along);
            noise_across += dh * abs(a0) + abs(h_force * d_a0) + abs(rise * y0 * beta) + abs(y0 * back_more);
            noise_along += abs(y0) * (dh * abs(b0) + abs(sigma) + abs(h_force * d_b0) + abs(rise));
        }
        noise_across *= ROUNDINGS * ROUNDING;
        noise_along *= ROUNDINGS * ROUNDING;
    }
    state.fold = ONE;

    var dw = ZERO;
    var dx = ZERO;
    if OFFSET {
        let bent = Bent(x, w_force, contact_radius, base, pole_x, pole_y, x0, y0, cosine, sine);
        let step = newton(tap, bent, state, y, density, across, along, noise_across, noise_along);
        dw = step.force;
        dx = step.other;
        state.noise_force = step.noise_force;
        state.noise_other = step.noise_other;
        let b1 = eta1 + hub * psi1;
        let sliding = (a1 + tap.ratio * (a0 + y0 * f)) * s1 - (y0 + x0 * tap.slope) * (tap.ratio * x0 * f + y0 * (b1 + tap.ratio * b0));
        state.fold = step.fold * sliding * tap.force;
    } else {
        let m12 = w_force * (a1 + d_a1) * (3.0 / c + tap.taper * ig2) - tap.angle * s1;
        let m11 = tap.force * (a1 + d_a1);
        dx = along / pole_x;
        dw = (across - m12 * dx) / m11;
        state.noise_other = noise_along / abs(pole_x);
        state.noise_force = (noise_across + abs(m12) * state.noise_other) / abs(m11);
    }
    state.step_force = dw;
    state.step_other = dx;
    state.force = clamp(state.force - dw, LEAST_FORCE, MOST_FORCE);
    state.arc = clamp(state.arc - dx, LEAST_ARC, MOST_ARC);
    if OFFSET {
        state.along = tap.ratio * state.force;
    }
}
