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

struct Step {
    force: real,
    other: real,
    noise_force: real,
    noise_other: real,
    fold: real,
}

fn newton(tap: Tap, bent: Bent, state: ptr<function, State>, y: Nodes, density: Nodes, across: real, along: real, noise_across: real, noise_along: real) -> Step {
    let c = 1.0 + bent.x;
    let g2 = max(tap.rest - tap.taper * bent.x, APEX * tap.rest);
    let m = c / (1.0 + sqrt(g2));
    let ig2 = 1.0 / g2;
    let g4 = ig2 * ig2;
    let ds = 2.0 * g2 * m;
    var turn1: Nodes;
    var climb1: Nodes;
    var turn2: Nodes;
    var climb2: Nodes;
    for (var i = 0u; i < N; i++) {
        let angle = state.angle[i];
        let weight = density[i] * ds;
        let sine = weight * (angle - x_minus_sin(angle));
        let cosine = weight * (1.0 - one_minus_cos(angle));
        let y2 = y[i] * y[i];
        let reach = POINTS[i] * (1.0 + y[i]);
        let lever = m * m * g4 * SIXTH * reach * reach * fma(y2, TWO, ONE);
        let pivot = m * g4 * ig2 * THIRD * reach * fma(y2, y2 + 1.0, ONE);
        let first = lever + tap.ratio * bent.contact_radius * pivot;
        let second = bent.w_force * pivot;
        turn1[i] = sine * first;
        climb1[i] = cosine * first;
        turn2[i] = sine * second;
        climb2[i] = cosine * second;
    }
    let lever = c * c * g4 * SIXTH * fma(g2, TWO, ONE);
    let pivot = c * (1.0 + g2 + g2 * g2) * g4 * ig2 * THIRD;
    let base1 = lever + tap.ratio * bent.contact_radius * pivot;
    let base2 = bent.w_force * pivot;
    var stretch = ZERO;
    if EXTENSION {
        stretch = 0.25 * tap.radius * tap.radius * c * ig2;
    }
    var slack = ZERO;
    if SHEAR {
        slack = tap.shear * c * ig2;
    }
    let sine_b = bent.base - x_minus_sin(bent.base);
    let cosine_b = 1.0 - one_minus_cos(bent.base);
    let move1_x = tap.ratio * stretch - weigh(turn1) - tap.hub * sine_b * base1;
    let move1_y = weigh(climb1) - slack + tap.hub * cosine_b * base1;
    let move2_x = 1.0 - weigh(turn2) - tap.hub * sine_b * base2;
    let move2_y = weigh(climb2) - tap.slope + tap.hub * cosine_b * base2;
    let beta_sine = bent.base - tap.angle - bent.sine;
    let beta_cosine = 1.0 - bent.cosine;
    let toward_x = bent.centre_x * beta_cosine - bent.centre_y * beta_sine;
    let toward_y = bent.centre_x * beta_sine + bent.centre_y * beta_cosine;
    let along_both = bent.pole_x * toward_x + bent.pole_y * toward_y;
    let m11 = tap.force * (move1_x * toward_y - move1_y * toward_x + base1 * along_both);
    let m12 = move2_x * toward_y - move2_y * toward_x + base2 * along_both;
    let m21 = tap.force * (bent.pole_x * move1_x + bent.pole_y * move1_y);
    let m22 = bent.pole_x * move2_x + bent.pole_y * move2_y;
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
