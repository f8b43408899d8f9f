// The exact rod: collocation in deviation form. Twin of crates/kernel/src/cpu/exact/mod.rs, where the equations are derived.
//
// Emitted from Rust before this text: real, Nodes, N, POINTS, GAUGE_POINTS, GAUGE_WEIGHTS, the switches PLAIN, SHEAR, EXTENSION, OFFSET, LAW,
// SIDE, the sums weigh, integrate and coefficients over the nodes, one_minus_cos, x_minus_sin, primitive, legendre and section.

// State passed between sweeps; see the Rust twin.
struct State {
    force: real,
    along: real,
    arc: real,
    step_force: real,
    step_other: real,
    noise_force: real,
    noise_other: real,
    fold: real,
    base: real,
    load: real,
    beyond: real,
    lag: Nodes,
    angle: Nodes,
    shortening: Nodes,
    climb: Nodes,
    bending: Nodes,
    extra: Nodes,
}

fn solve(tap: Tap) -> Solution {
    var state = State();
    var error = ONE;
    var last = ONE;
    var rate = ZERO;
    var sweeps = ZERO;
    var rounded = ZERO;
    let stop = STOP * TOLERANCE;
    let felt = shares(tap);
    for (var i = 0u; i < SWEEPS; i++) {
        sweep(tap, &state);
        let moved = sensitivity(tap, tap.arc + state.arc);
        let change = shows(felt, moved, state.step_force, state.step_other);
        let expected = rate * last;
        rate = max(min(max(change / last, 0.5 * rate), LARGEST_RATE), SMALLEST_RATE);
        last = max(change, TINY);
        sweeps += ONE;
        let wary = OFFSET || tap.near + state.arc > GROWN * tap.near;
        let believed = select(change, max(change, CHANCE * expected), wary);
        error = believed * rate / (1.0 - rate);
        rounded = shows(felt, moved, state.noise_force, state.noise_other);
        if !(error > stop) && i + 1u >= LEAST_SWEEPS {
            break;
        }
    }
    if LAW {
        let x = tap.arc + state.arc;
        let turned = select(tap.angle * tap.angle, tap.angle, OFFSET);
        let moved = felt.across * (sensitivity(tap, x) - 1.0) * (abs(x) + turned);
        error += (felt.strains + moved) * CHART_ERROR;
    }
    if PLAIN {
        let x = abs(state.arc) * (ARC_ROUNDINGS * ROUNDING);
        rounded = abs(state.force) * (ROUNDINGS * ROUNDING) + sensitivity(tap, state.arc) * x;
    }
    return gauge(tap, &state, error, rounded, felt.across, sweeps);
}

fn shows(felt: Shares, moved: real, force: real, other: real) -> real {
    return abs(force) + felt.across * moved * abs(other);
}
