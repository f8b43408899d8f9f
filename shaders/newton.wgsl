// The Newton step of a contact whose force does not simply act across the centreline. Twin of crates/kernel/src/cpu/exact/newton.rs.

// Results of the sweep that the step needs; see the Rust twin.
struct Bent {
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

struct Turned {
    nodes: Nodes,
    base: real,
}

struct Step {
    force: real,
    other: real,
    noise_force: real,
    noise_other: real,
    fold: real,
}

fn newton(tap: Tap, bent: Bent, state: ptr<function, State>, y: Nodes, density: Nodes, heights: Nodes, across: real, along: real, noise_across: real, noise_along: real) -> Step {
    let c = 1.0 + bent.x;
    let g2 = max(tap.rest - tap.taper * bent.x, APEX * tap.rest);
    let m = c / (1.0 + sqrt(g2));
    let ig2 = 1.0 / g2;
    let g4 = ig2 * ig2;
    let ds = 2.0 * g2 * m;
    let spread = 2.0 * m * g4 * ig2;
    var sines: Nodes;
    var cosines: Nodes;
    var raised: Nodes;
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        let angle = state.angle[i];
        let weight = density[i] * ds;
        sines[i] = weight * (angle - x_minus_sin(angle));
        cosines[i] = weight * (1.0 - one_minus_cos(angle));
        raised[i] = heights[i] * (y2 * y2 * y[i]);
    }
    var lift: Nodes;
    var lift_base = ZERO;
    if STICK {
        lift = integrate(raised);
        lift_base = weigh(raised);
    }
    var first: Turned;
    var second: Turned;
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        let reach = POINTS[i] * (1.0 + y[i]);
        let lever = m * m * g4 * SIXTH * reach * reach * fma(y2, TWO, ONE);
        let pivot = m * g4 * ig2 * THIRD * reach * fma(y2, y2 + 1.0, ONE);
        first.nodes[i] = unit_force(tap, bent, lever, pivot);
        second.nodes[i] = unit_other(bent, pivot) + spread * lift[i];
    }
    let lever = c * c * g4 * SIXTH * fma(g2, TWO, ONE);
    let pivot = c * (1.0 + g2 + g2 * g2) * g4 * ig2 * THIRD;
    first.base = unit_force(tap, bent, lever, pivot);
    second.base = unit_other(bent, pivot) + spread * lift_base;
    var turn1: Nodes;
    var climb1: Nodes;
    var turn2: Nodes;
    var climb2: Nodes;
    for (var i = 0u; i < N; i++) {
        turn1[i] = sines[i] * first.nodes[i];
        climb1[i] = cosines[i] * first.nodes[i];
        turn2[i] = sines[i] * second.nodes[i];
        climb2[i] = cosines[i] * second.nodes[i];
    }
    var stretch = ZERO;
    if EXTENSION {
        stretch = 0.25 * tap.radius * tap.radius * c * ig2;
    }
    var slack = ZERO;
    if SHEAR {
        slack = tap.shear * c * ig2;
    }
    let pull1 = select(tap.ratio * stretch, ZERO, STICK);
    let pull2 = select(ONE, stretch, STICK);
    let thin2 = select(tap.slope, ZERO, STICK);
    let unit2 = select(ONE, tap.force, STICK);
    let sine_b = bent.base - x_minus_sin(bent.base);
    let cosine_b = 1.0 - one_minus_cos(bent.base);
    let move1_x = pull1 - weigh(turn1) - tap.hub * sine_b * first.base;
    let move1_y = weigh(climb1) - slack + tap.hub * cosine_b * first.base;
    let move2_x = pull2 - weigh(turn2) - tap.hub * sine_b * second.base;
    let move2_y = weigh(climb2) - thin2 + tap.hub * cosine_b * second.base;
    let beta_sine = bent.base - tap.angle - bent.sine;
    let beta_cosine = 1.0 - bent.cosine;
    let toward_x = bent.centre_x * beta_cosine - bent.centre_y * beta_sine;
    let toward_y = bent.centre_x * beta_sine + bent.centre_y * beta_cosine;
    let along_both = bent.pole_x * toward_x + bent.pole_y * toward_y;
    let m11 = tap.force * (move1_x * toward_y - move1_y * toward_x + first.base * along_both);
    let m12 = unit2 * (move2_x * toward_y - move2_y * toward_x + second.base * along_both);
    let m21 = tap.force * (bent.pole_x * move1_x + bent.pole_y * move1_y);
    let m22 = unit2 * (bent.pole_x * move2_x + bent.pole_y * move2_y);
    let det = m11 * m22 - m12 * m21;
    let id = 1.0 / det;
    let size = abs(id);
    return Step(
        (m22 * across - m12 * along) * id,
        (m11 * along - m21 * across) * id,
        (abs(m22) * noise_across + abs(m12) * noise_along) * size,
        (abs(m11) * noise_along + abs(m21) * noise_across) * size,
        det,
    );
}

fn unit_force(tap: Tap, bent: Bent, lever: real, pivot: real) -> real {
    return select(lever + tap.ratio * bent.contact_radius * pivot, lever, STICK);
}

fn unit_other(bent: Bent, pivot: real) -> real {
    return select(bent.w_force, bent.contact_radius, STICK) * pivot;
}
