// Values of a planar tap, besides its strain, that a tilted pole needs. Twin of crates/kernel/src/cpu/exact/spatial.rs.

struct Spatial {
    base: real,
    // Over the first-order strain.
    axial: real,
}

fn spatial(tap: Tap, state: ptr<function, State>, series: Nodes, climbs: Nodes, angles: Nodes) -> Spatial {
    let x = tap.arc + state.arc;
    let c = 1.0 + x;
    let g2 = max(tap.rest - tap.taper * x, APEX * tap.rest);
    let g = sqrt(g2);
    let m = c / (1.0 + g);
    let k = tap.taper * m;
    let ig2 = 1.0 / g2;
    let g4 = ig2 * ig2;
    let w_force = tap.force * (1.0 + state.force);
    var h_force = ZERO;
    var contact_radius = ZERO;
    if OFFSET {
        h_force = tap.along + tap.force * state.along;
        contact_radius = tap.contact_radius - tap.slope * x;
    }

    var base = w_force * c * c * g4 * fma(g2, TWO, ONE) * SIXTH;
    if OFFSET {
        base += h_force * contact_radius * c * g4 * ig2 * (1.0 + g2 + g2 * g2) * THIRD;
    }
    let scale = select(2.0 * m * g4 * ig2, 4.0 * w_force * m * m * g4, PLAIN);
    base -= scale * weigh(state.bending);
    if !EXTENSION && !LAW {
        return Spatial(base, ZERO);
    }

    let c1 = tap.near + x;
    let c2 = tap.far + x;
    let u1 = fma(tap.taper, tap.near, tap.rest);
    let u2 = fma(tap.taper, tap.far, tap.rest);
    let w1 = min(place(c1, u1, c, g), ONE);
    let w2 = place(c2, u2, c, g);
    var sum = ZERO;
    var length = ZERO;
    for (var i = 0u; i < GAUGE_N; i++) {
        let w = w2 + (w1 - w2) * GAUGE_POINTS[i];
        let weight = GAUGE_WEIGHTS[i];
        let y = 1.0 - k * w;
        let y2 = y * y;
        let y3 = y2 * y;
        length += weight / y3;
        var direct = ZERO;
        if EXTENSION {
            let angle = legendre(angles, w);
            let cosine = one_minus_cos(angle);
            let sine = angle - x_minus_sin(angle);
            let unit = 0.25 * tap.radius * tap.radius * y2 * y2 * g4;
            direct = (h_force - h_force * cosine - w_force * sine) * unit;
        }
        if LAW {
            var moment = w_force * 2.0 * g2 * m * primitive(series, w);
            if OFFSET {
                moment -= h_force * 2.0 * g2 * m * primitive(climbs, w);
            }
            let arm = g2 * m * w * (1.0 + y) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = tap.radius * whole * y3 * y3 * g4 * ig2;
            let law = section(direct, abs(b));
            direct += law.extra;
        }
        sum += weight * direct / y3;
    }
    let bent = select(ONE, max(c1, ZERO) / tap.width, c2 < 0.0);
    return Spatial(base, bent * sum / (length * tap.strain));
}
