// The Newton step of a contact whose force does not simply act across the centreline. Twin of
// src/kernel/cpu/exact/newton.rs.

// What the step needs of the sweep; see the Rust twin.
struct Turned {
    x: real,
    w_force: real,
    contact_radius: real,
    base: real,
    pole_x: real,
    pole_y: real,
    centre_x: real,
    centre_y: real,
    cosine: real,
    sine: real,
}

fn newton(tap: Tap, at: Turned, y: Nodes, density: Nodes, angle: Nodes, height: Nodes, across: real, along: real) -> vec2<real> {
    let c = 1.0 + at.x;
    let g2 = max(tap.rest - tap.taper * at.x, APEX * tap.rest);
    let m = c / (1.0 + sqrt(g2));
    let ig2 = 1.0 / g2;
    let g4 = ig2 * ig2;
    let ds = 2.0 * g2 * m;
    let spread = 2.0 * m * g4 * ig2;
    var raised: Nodes;
    var drag: Nodes;
    if STICK {
        for (var i = 0u; i < N; i++) {
            let y2 = y[i] * y[i];
            raised[i] = height[i] * (y2 * y2 * y[i]);
        }
        drag = integrate(raised);
    }
    var turn1: Nodes;
    var climb1: Nodes;
    var turn2: Nodes;
    var climb2: Nodes;
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        let reach = POINTS[i] * (1.0 + y[i]);
        let lever = m * m * g4 * SIXTH * reach * reach * fma(y2, TWO, ONE);
        let pivot = m * g4 * ig2 * THIRD * reach * fma(y2, y2 + 1.0, ONE);
        var first = lever;
        var second = at.w_force * pivot;
        if STICK {
            second = at.contact_radius * pivot + spread * drag[i];
        } else {
            first += tap.ratio * at.contact_radius * pivot;
        }
        let sine = (angle[i] - x_minus_sin(angle[i])) * density[i];
        let cosine = (1.0 - one_minus_cos(angle[i])) * density[i];
        turn1[i] = sine * first;
        climb1[i] = cosine * first;
        turn2[i] = sine * second;
        climb2[i] = cosine * second;
    }
    let lever = c * c * g4 * SIXTH * fma(g2, TWO, ONE);
    let pivot = c * (1.0 + g2 + g2 * g2) * g4 * ig2 * THIRD;
    var stretch = ZERO;
    if EXTENSION {
        stretch = 0.25 * tap.radius * tap.radius * c * ig2;
    }
    var slack = ZERO;
    if SHEAR {
        slack = tap.shear * c * ig2;
    }
    var base1 = lever;
    var base2 = at.w_force * pivot;
    var pull1 = tap.ratio * stretch;
    var pull2 = ONE;
    var thin2 = tap.slope;
    var unit2 = ONE;
    if STICK {
        base2 = at.contact_radius * pivot + spread * weigh(raised);
        pull1 = ZERO;
        pull2 = stretch;
        thin2 = ZERO;
        unit2 = tap.force;
    } else {
        base1 += tap.ratio * at.contact_radius * pivot;
    }
    let sine_b = at.base - x_minus_sin(at.base);
    let cosine_b = 1.0 - one_minus_cos(at.base);
    let move1_x = pull1 - ds * weigh(turn1) - tap.hub * sine_b * base1;
    let move1_y = ds * weigh(climb1) - slack + tap.hub * cosine_b * base1;
    let move2_x = pull2 - ds * weigh(turn2) - tap.hub * sine_b * base2;
    let move2_y = ds * weigh(climb2) - thin2 + tap.hub * cosine_b * base2;
    let beta_sine = at.base - tap.angle - at.sine;
    let beta_cosine = 1.0 - at.cosine;
    let toward_x = at.centre_x * beta_cosine - at.centre_y * beta_sine;
    let toward_y = at.centre_x * beta_sine + at.centre_y * beta_cosine;
    let along_both = at.pole_x * toward_x + at.pole_y * toward_y;
    let m11 = tap.force * (move1_x * toward_y - move1_y * toward_x + base1 * along_both);
    let m12 = unit2 * (move2_x * toward_y - move2_y * toward_x + base2 * along_both);
    let m21 = tap.force * (at.pole_x * move1_x + at.pole_y * move1_y);
    let m22 = unit2 * (at.pole_x * move2_x + at.pole_y * move2_y);
    let det = m11 * m22 - m12 * m21;
    return vec2<real>((m22 * across - m12 * along) / det, (m11 * along - m21 * across) / det);
}
