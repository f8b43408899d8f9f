// The Newton step of a contact whose force does not simply act across the centreline. Twin of
// crates/kernel/src/cpu/exact/newton.rs.

// What the step needs of the sweep; see the Rust twin.
struct Bent {
    x: real,
    w_force: real,
    h_force: real,
    contact_radius: real,
    base: real,
    pole_x: real,
    pole_y: real,
    centre_x: real,
    centre_y: real,
    cosine: real,
    sine: real,
}

// How the rod turns with one of the unknowns, at the nodes and at the base.
struct Turned {
    nodes: Nodes,
    base: real,
}

// What both `follow` need; see the Rust twin.
struct Rod {
    w_force: real,
    h_force: real,
    spread: real,
    fifth: Nodes,
    sine: Nodes,
    cosine: Nodes,
}

// Turn of the rod when its lag follows.
fn follow(rod: ptr<function, Rod>, fixed: Turned) -> Turned {
    var turned = fixed;
    for (var k = 0u; k < PASSES; k++) {
        var pulled: Nodes;
        for (var i = 0u; i < N; i++) {
            pulled[i] = (rod.h_force * rod.cosine[i] - rod.w_force * rod.sine[i]) * turned.nodes[i];
        }
        var bending = integrate(pulled);
        for (var i = 0u; i < N; i++) {
            bending[i] *= rod.fifth[i];
        }
        let more = integrate(bending);
        for (var i = 0u; i < N; i++) {
            turned.nodes[i] = fixed.nodes[i] + rod.spread * more[i];
        }
        turned.base = fixed.base + rod.spread * weigh(bending);
    }
    return turned;
}

// A Newton step; see the Rust twin.
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
    var rod: Rod;
    rod.w_force = bent.w_force;
    rod.h_force = bent.h_force;
    rod.spread = 2.0 * m * g4 * ig2;
    // Moment over y^-5 that a unit of W, and of H where it is an unknown, takes away and adds through dxi and eta.
    var drawn: Nodes;
    var raised: Nodes;
    if PASSES > 0u {
        drawn = integrate(state.shortening);
    }
    for (var i = 0u; i < N; i++) {
        let y2 = y[i] * y[i];
        rod.fifth[i] = y2 * y2 * y[i];
        let angle = state.angle[i];
        let weight = density[i] * ds;
        rod.sine[i] = weight * (angle - x_minus_sin(angle));
        rod.cosine[i] = weight * (1.0 - one_minus_cos(angle));
        raised[i] = heights[i] * rod.fifth[i];
        drawn[i] *= ds * rod.fifth[i];
    }
    var drag: Nodes;
    var drag_base = ZERO;
    if PASSES > 0u {
        drag = integrate(drawn);
        drag_base = weigh(drawn);
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
        first.nodes[i] = unit_force(tap, bent, lever, pivot) - rod.spread * drag[i];
        second.nodes[i] = unit_other(bent, pivot) + rod.spread * lift[i];
    }
    let lever = c * c * g4 * SIXTH * fma(g2, TWO, ONE);
    let pivot = c * (1.0 + g2 + g2 * g2) * g4 * ig2 * THIRD;
    first.base = unit_force(tap, bent, lever, pivot) - rod.spread * drag_base;
    second.base = unit_other(bent, pivot) + rod.spread * lift_base;
    first = follow(&rod, first);
    second = follow(&rod, second);
    var turn1: Nodes;
    var climb1: Nodes;
    var turn2: Nodes;
    var climb2: Nodes;
    for (var i = 0u; i < N; i++) {
        turn1[i] = rod.sine[i] * first.nodes[i];
        climb1[i] = rod.cosine[i] * first.nodes[i];
        turn2[i] = rod.sine[i] * second.nodes[i];
        climb2[i] = rod.cosine[i] * second.nodes[i];
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

// Turn by a unit of W at a fixed shape.
fn unit_force(tap: Tap, bent: Bent, lever: real, pivot: real) -> real {
    return select(lever + tap.ratio * bent.contact_radius * pivot, lever, STICK);
}

// Turn by a unit of c, or of H of a sticking contact, at a fixed shape.
fn unit_other(bent: Bent, pivot: real) -> real {
    return select(bent.w_force, bent.contact_radius, STICK) * pivot;
}
