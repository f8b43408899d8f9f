// The estimate's theory: f, how it grows, and its inverse.

// f(a/(1 + η)) over f(a), less 1, as the product of the growths of its factors; `vertex` is η at the peak.
struct Growth { steep: f32, gauge: f32, hub: f32, shear: f32, vertex: f32 }

struct Grown { value: f32, slope: f32, curvature: f32 }

fn peak_of(D: f32, tau: f32, x1: f32, x2: f32) -> f32 {
    let b1 = 1.0 / (1.0 - tau * x1);
    let b2 = 1.0 / (1.0 - tau * x2);
    let sum = b1 + b2;
    let moment = x1 * b1 + x2 * b2;
    var u = 0.5 * (sum / moment + tau);
    if PLAIN { return u; }
    let shear = SHEAR * D * D;
    for (var step = 0u; step < 8u; step++) {
        let rise = u - tau;
        let room = sum - moment * u;
        var factor = 1.0 / u;
        if !DISPLACED { factor = HUB / (1.0 + HUB * u); }
        let below = 1.0 / (1.0 + shear * u * u);
        let bend = 2.0 * shear * u * below;
        let k = factor - bend;
        let dk = -(factor * factor) - 2.0 * shear * below + bend * bend;
        let miss = room - moment * rise + rise * room * k;
        let slope = -(2.0 * moment) + (room - moment * rise) * k + rise * room * dk;
        let furthest = 0.5 * min(rise, room / moment);
        u -= max(min(miss / slope, furthest), -furthest);
    }
    return u;
}

fn product(a: Grown, b: Grown) -> Grown {
    let more_a = 1.0 + a.value;
    let more_b = 1.0 + b.value;
    let both = a.slope * b.slope;
    return Grown(
        a.value + b.value + a.value * b.value,
        a.slope * more_b + b.slope * more_a,
        a.curvature * more_b + (both + both) + b.curvature * more_a
    );
}

fn grown(g: Growth, eta: f32) -> Grown {
    var all = product(Grown(g.steep * eta, g.steep, 0.0), Grown(-(g.gauge * eta), -g.gauge, 0.0));
    if PLAIN { return all; }
    all = product(all, Grown(g.hub * eta, g.hub, 0.0));
    let more = 1.0 + eta;
    let below = 1.0 / (1.0 + g.shear * more * more);
    let value = -(g.shear * eta * (2.0 + eta) * below);
    let fall = 2.0 * g.shear * (1.0 + g.shear) * below * below;
    let curvature = fall * (4.0 * g.shear * more * more * below - 1.0);
    return product(all, Grown(value, -(fall * more), curvature));
}

// f = C (u − τ)(S − M u), u = 1/a, to which hub, displacement and shear add factors: C, S, M, shear; u at its peak.
// f at which words begin: from `low` to `high` the near root is within the range of interest; at the peak; at infinite distance; and of a widening
// whisker at its end, for taps beyond the peak and before it.
struct Theory {
    scale: f32, tau: f32, sum: f32, moment: f32, shear: f32, peak: f32,
    low: f32, high: f32, highest: f32, farthest: f32, ends: array<f32, 2>
}

// f at u.
fn strain_of(t: Theory, u: f32) -> f32 {
    let f = t.scale * (u - t.tau) * (t.sum - t.moment * u);
    if PLAIN { return f; }
    var lever = u;
    if !DISPLACED { lever = 1.0 + HUB * u; }
    return f * lever / (1.0 + t.shear * u * u);
}

fn theory_of(D: f32, tau: f32, L_a: f32, x1: f32, x2: f32) -> Theory {
    let u1 = 1.0 - tau * x1;
    let u2 = 1.0 - tau * x2;
    let b = 1.0 / (u1 * u2);
    var t = Theory();
    t.scale = 0.75 * D * b * b;
    t.tau = tau;
    t.sum = u1 + u2;
    t.moment = x1 * u2 + x2 * u1;
    t.shear = SHEAR * D * D;
    t.peak = peak_of(D, tau, x1, x2);
    t.highest = strain_of(t, t.peak);
    t.low = select(strain_of(t, END_LO), 1e30, END_LO < t.peak);
    t.high = min(select(1e30, strain_of(t, END_HI), t.peak < END_HI), t.highest);
    t.farthest = strain_of(t, 0.0);
    for (var k = 0u; k < 2u; k++) {
        let u = 1.0 / (L_a * select(1.0, FAR, k == 0u));
        t.ends[k] = select(-1e30, select(strain_of(t, u), t.highest, t.peak < u), t.farthest > 0.0);
    }
    return t;
}

// f of the tap at distance `n`, and q at which words begin.
struct Limits { strain: f32, low: f32, high: f32, peak: f32, farthest: f32, end: f32 }

fn limits_of(t: Theory, n: u32) -> Limits {
    let f = strain_of(t, of_distance(n, INVERSE));
    let end = select(t.ends[0], t.ends[1], t.peak * of_distance(n, A) < 1.0);
    return Limits(f, t.low / f - 1.0, t.high / f - 1.0, t.highest / f - 1.0, t.farthest / f - 1.0, end / f - 1.0);
}

fn growth_of(t: Theory, n: u32) -> Growth {
    let u = of_distance(n, INVERSE);
    var hub = HUB * u / (1.0 + HUB * u);
    if DISPLACED { hub = 1.0; }
    let beta = t.moment * u;
    return Growth(u / (u - t.tau), beta / (t.sum - beta), hub, t.shear * u * u, t.peak * of_distance(n, A) - 1.0);
}

struct Root { eta: f32, slope: f32 }

fn root_of(g: Growth, q: f32, peak: f32) -> Root {
    if PLAIN {
        let linear = g.steep - g.gauge;
        let square = g.steep * g.gauge;
        let slope = sqrt(max(linear * linear - 4.0 * square * q, 0.0));
        let beyond = 2.0 * q / (linear + slope);
        let before = (linear - slope) / (2.0 * square);
        return Root(select(beyond, before, linear < 0.0), select(slope, 0.0, peak < q));
    }
    var lo = max(-1.0 / g.steep, -1.0);
    var hi = g.vertex;
    var eta = min(g.vertex, 0.0);
    var slope = 0.0;
    for (var step = 0u; step < 6u; step++) {
        let now = grown(g, eta);
        let rest = q - now.value;
        lo = select(lo, eta, now.value < q);
        hi = select(eta, hi, now.value < q);
        slope = max(sqrt(max(now.slope * now.slope + 2.0 * now.curvature * rest, 0.0)), 1e-6);
        eta += 2.0 * rest / (max(now.slope, 0.0) + slope);
        let middle = 0.5 * (lo + hi);
        eta = select(select(eta, middle, hi < eta), middle, eta < lo);
    }
    return Root(eta, select(slope, 0.0, peak < q));
}
