// The exact rod: collocation in deviation form. Twin of src/kernel/cpu/exact/mod.rs, where the equations are derived.
//
// Emitted from Rust before this text: real, Nodes, N, POINTS, GAUGE_POINTS, GAUGE_WEIGHTS, the switches PLAIN, SHEAR,
// EXTENSION, OFFSET, STICK, LAW, FAR, the sums weigh, integrate and coefficients over the nodes, one_minus_cos,
// x_minus_sin, primitive, legendre and section.

// What one sweep passes to the next; see the Rust twin.
struct State {
    force: real,
    along: real,
    arc: real,
    step_force: real,
    step_other: real,
    base: real,
    load: real,
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
    let stop = STOP * TOLERANCE;
    let felt = shares(tap);
    for (var i = 0u; i < SWEEPS; i++) {
        let stepping = (i + 1u) % SETTLE == 0u;
        sweep(tap, &state, stepping);
        if !stepping {
            continue;
        }
        var change = felt.across * abs(state.step_force) + felt.along * abs(state.step_other);
        if !STICK {
            change = abs(state.step_force) + felt.across * sensitivity(tap, tap.arc + state.arc) * abs(state.step_other);
        }
        let expected = rate * last;
        // What is left if the contraction goes on: change * rate / (1 - rate). One good sweep is half believed.
        rate = max(min(max(change / last, 0.5 * rate), LARGEST_RATE), SMALLEST_RATE);
        last = max(change, TINY);
        sweeps += real(SETTLE);
        // Where two unknowns turn around each other a step may be small by chance.
        let believed = select(change, max(change, CHANCE * expected), OFFSET);
        error = believed * rate / (1.0 - rate);
        if !(error > stop) && i + 1u >= LEAST_SWEEPS {
            break;
        }
    }
    if LAW {
        // What the law is off shows in the strains, and in the arc by what the force and the angle made of it.
        let x = tap.arc + state.arc;
        let turned = select(tap.angle * tap.angle, tap.angle, OFFSET);
        let moved = felt.across * (sensitivity(tap, x) - 1.0) * (abs(x) + turned);
        error += (felt.strains + moved) * CHART_ERROR;
    }
    return gauge(tap, &state, error, felt.across, sweeps);
}
