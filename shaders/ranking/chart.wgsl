// A tap read from its chart.

// Means over a gauge of the polynomials over x/a.
var<private> places: array<f32, PLACES>;
// Polynomials over the drive, or a series over it.
var<private> over: array<vec4<f32>, GROUPS>;
var<private> kappa: array<f32, POINTS>;
var<private> arc: array<f32, POINTS>;
// driveᵉ.
fn powered(drive: f32) -> f32 {
    if POWER == 2u { return drive * drive; }
    if POWER == 1u { return drive; }
    return 1.0;
}

fn variable(drive: f32) -> f32 {
    if FOURTH { return sqrt(sqrt(drive)); }
    return select(drive, drive * drive, POWER == 2u);
}

// The place in [−1, 1] of the variable `y` on an axis of distance `n`, whose scale and shift begin at `axis`.
fn placed(n: u32, axis: u32, y: f32) -> f32 {
    return fma(y, of_distance(n, axis), of_distance(n, axis + 1u));
}

// The polynomials over x/a at distance `n`, as means over a gauge from s1 to s2 that give its δ.
fn fold(n: u32, s1: f32, s2: f32, p: f32) {
    for (var k = 0u; k < PLACES; k++) { places[k] = 0.0; }
    var total = 0.0;
    for (var g = 0u; g < GAUGE; g++) {
        let s = fma(s2 - s1, of_distance(n, HEAD + 2u * g), s1);
        let u = 1.0 - p * s;
        var last = of_distance(n, HEAD + 2u * g + 1u) / (u * u * u);
        total = fma(last, 1.0 - s, total);
        let x = placed(n, PLACE_AXIS, s);
        var now = last * x;
        for (var k = 0u; k < PLACES; k++) {
            places[k] += last;
            let next = fma(x + x, now, -last);
            last = now;
            now = next;
        }
    }
    let share = 1.0 / total;
    for (var k = 0u; k < PLACES; k++) { places[k] *= share; }
}

// A series over the axes: at each design's drive, whose polynomials `over` holds; or, if designs share drives, its coefficients over the drive go to
// `over`. `whole`: the function does not depend on the place.
fn series(start: vec2<u32>, base: f32, taper: f32, whole: bool) -> f32 {
    var at = start.x;
    var row = start.y;
    var sum = 0.0;
    for (var group = 0u; group < GROUPS; group++) {
        var c = vec4<f32>();
        if OWN { c = over[group]; }
        let n_places = size(at);
        at++;
        for (var n = 0u; n < n_places; n++) {
            let n_tapers = size(at);
            at++;
            var t0 = 1.0;
            if !whole { t0 = places[n]; }
            var t1 = t0 * taper;
            for (var m = 0u; m < n_tapers; m++) {
                let end = row + size(at);
                at++;
                var b0 = t0;
                var b1 = t0 * base;
                for (; row < end; row++) {
                    let term = rows[row];
                    if OWN { sum = fma(dot(term, c), b0, sum); } else { c = fma(term, vec4(b0), c); }
                    let next = fma(base + base, b1, -b0);
                    b0 = b1;
                    b1 = next;
                }
                let next = fma(taper + taper, t1, -t0);
                t0 = t1;
                t1 = next;
            }
        }
        if !OWN { over[group] = c; }
    }
    return sum;
}

// Start of a series of branch `b` at distance `n`: 0 strain, 1 arc.
fn start_of(n: u32, b: u32, function: u32) -> vec2<u32> {
    let at = 4u * (n * BRANCHES + b) + 2u * function;
    return vec2<u32>(size(at), size(at + 1u));
}

struct Sum { value: f32, slope: f32 }

// Strain and arc of a tap.
struct Held { strain: f32, arc: f32 }

fn polynomial(powers: array<f32, BRANCHES>, count: u32, x: f32) -> Sum {
    var c = powers;
    var all = Sum(c[count - 1u], 0.0);
    for (var k = count - 1u; k > 0u; k--) {
        all.slope = fma(all.slope, x, all.value);
        all.value = fma(all.value, x, c[k - 1u]);
    }
    return all;
}

// δ and c/a − 1 over driveᵉ of the tap at distance `n`. A contact with friction chooses among its branches, each with a different T/P.
fn choose(n: u32, base: f32, taper: f32) -> Held {
    let count = u32(of_distance(n, COUNT));
    let final_one = count - 1u;
    let high = series(start_of(n, final_one, 1u), base, taper, true);
    let outwards = series(start_of(n, final_one, 0u), base, taper, false);
    if count == 1u || 0.0 <= high { return Held(outwards, high); }
    var strain_powers: array<f32, BRANCHES>;
    var arc_powers: array<f32, BRANCHES>;
    var low = high;
    var inwards = outwards;
    for (var b = 0u; b < count; b++) {
        var moved = high;
        var strain = outwards;
        if b < final_one {
            moved = series(start_of(n, b, 1u), base, taper, true);
            strain = series(start_of(n, b, 0u), base, taper, false);
        }
        if b == 0u {
            low = moved;
            inwards = strain;
        }
        for (var p = 0u; p < count; p++) {
            let weight = number(CHOICE + u32(of_distance(n, CHOICE_OF)) + p * count + b);
            strain_powers[p] = fma(weight, strain, strain_powers[p]);
            arc_powers[p] = fma(weight, moved, arc_powers[p]);
        }
    }
    var share = (low + high) / (low - high);
    for (var step = 0u; step < 4u; step++) {
        let now = polynomial(arc_powers, count, share);
        share = min(max(share - now.value / now.slope, -1.0), 1.0);
    }
    let strain = polynomial(strain_powers, count, share).value;
    let moved = select(polynomial(arc_powers, count, share).value, 0.0, abs(share) < 1.0);
    let out = 0.0 <= high;
    let back = !out && (low <= 0.0);
    return Held(select(select(strain, inwards, back), outwards, out), select(select(moved, low, back), high, out));
}

fn to_series(values: array<f32, POINTS>) -> array<f32, POINTS> {
    var from_points = values;
    var found: array<f32, POINTS>;
    for (var k = 0u; k < POINTS; k++) {
        var sum = 0.0;
        for (var j = 0u; j < POINTS; j++) { sum = fma(number(BACK + k * POINTS + j), from_points[j], sum); }
        found[k] = sum;
    }
    return found;
}

// The value at point `k` of the series in `over` at distance `n`.
fn at_point(n: u32, k: u32) -> f32 {
    var sum = 0.0;
    for (var group = 0u; group < GROUPS; group++) {
        sum += dot(rows[AT_POINTS + (n * POINTS + k) * GROUPS + group], over[group]);
    }
    return sum;
}

// Reads κ and the arc of the tap at distance `n` into `kappa` and `arc`; returns the largest |δ|.
fn read_tap(w: Design, n: u32) -> f32 {
    let a = of_distance(n, A);
    let inverse = of_distance(n, INVERSE);
    let p = w.tau * a;
    fold(n, w.x1 * inverse, w.x2 * inverse, p);
    let base = placed(n, BASE_AXIS, w.D * inverse);
    var y = 1.0 / (1.0 - p);
    if POWER != 2u { y = sqrt(y); }
    let taper = placed(n, TAPER_AXIS, y);
    let scale = of_distance(n, SCALE);
    if OWN {
        var own = w.drive;
        if DISPLACED { own = w.drive * inverse; }
        let x = placed(n, DRIVE_AXIS, variable(own));
        var last = 1.0;
        var now = x;
        for (var group = 0u; group < GROUPS; group++) {
            let second = fma(x + x, now, -last);
            let third = fma(x + x, second, -now);
            over[group] = vec4(last, now, second, third);
            last = fma(x + x, third, -second);
            now = fma(x + x, last, -third);
        }
        let held = choose(n, base, taper);
        let deviation = scale * held.strain;
        let delta = w.power * deviation;
        kappa[0] = -(deviation / (1.0 + delta));
        arc[0] = scale * held.arc;
        return abs(delta);
    }
    var largest = 0.0;
    _ = series(start_of(n, 0u, 0u), base, taper, false);
    for (var k = 0u; k < POINTS; k++) {
        let deviation = scale * at_point(n, k);
        let delta = number(POWERS + k) * deviation;
        kappa[k] = -(deviation / (1.0 + delta));
        largest = max(largest, abs(delta));
    }
    kappa = to_series(kappa);
    let room = (w.L_a - a) * inverse;
    if w.power * of_distance(n, MOST_ARC) > room {
        _ = series(start_of(n, 0u, 1u), base, taper, true);
        for (var k = 0u; k < POINTS; k++) { arc[k] = scale * at_point(n, k); }
        arc = to_series(arc);
    } else {
        for (var k = 0u; k < POINTS; k++) { arc[k] = 0.0; }
    }
    return largest;
}
