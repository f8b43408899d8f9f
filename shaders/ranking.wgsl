// Ranked rows of whole designs, read from charts: one invocation, some designs. Twin of src/chart/lanes, where the
// derivation stands. The charts are data: `numbers`, `shape` and `rows` hold them, and the constants before this text say how many there are of each.

struct Job {
    // Designs of this batch, invocations that run at once, bound of the rank.
    count: u32,
    stride: u32,
    bound: f32,
    // Number of the batch, in the upper bits of every entry of the lists.
    stamp: u32,
    // Digits of the first design, one per factor.
    first: array<vec4<u32>, 2>,
}

// Taps per status word, and rows (designs, where designs compete) that are complete.
struct Words { ok: u32, slipped: u32, strain: u32, rootless: u32, ambiguous: u32, invalid: u32, complete: u32 }

@group(0) @binding(0) var<uniform> job: Job;
// `numbers`, `shape` and `rows`, bindings 1 to 3, are declared before this text: uniform where they fit, else storage.
@group(0) @binding(4) var<storage, read_write> tally: array<atomic<u32>, 16>;
// Designs with a row below the bound, and those that must be solved tap by tap.
@group(0) @binding(5) var<storage, read_write> best: array<u32>;
@group(0) @binding(6) var<storage, read_write> hard: array<u32>;

@group(0) @binding(7) var<storage, read> axes: array<f32>;

fn number(i: u32) -> f32 { return numbers[i / 4u][i % 4u]; }

fn size(i: u32) -> u32 { return shape[i / 4u][i % 4u]; }

struct Whisker { D: f32, d: f32, L_a: f32, x_ss: f32, l: f32, drive: f32 }

// A whisker: D, τ, L_a, x1, x2, u = 1/a at the peak of the theory, drive (rad or mm) and its power e.
struct Design { D: f32, tau: f32, L_a: f32, x1: f32, x2: f32, peak: f32, drive: f32, power: f32 }

// f(a/(1 + η)) over f(a), less 1, as the product of the growths of its factors; the last is η at the peak.
struct Growth { steep: f32, gauge: f32, hub: f32, shear: f32, vertex: f32 }

struct Grown { value: f32, slope: f32, curvature: f32 }

// Of a row: taps per word, and 1 of a design that must be solved tap by tap.
struct Tally { ok: f32, slipped: f32, strain: f32, rootless: f32, ambiguous: f32, complete: f32, hard: f32 }

// Means over a gauge of the polynomials over x/a.
var<private> places: array<f32, PLACES>;
// Polynomials over the drive, or a series over it.
var<private> over: array<f32, ORDERS>;
var<private> kappa: array<f32, POINTS>;
var<private> arc: array<f32, POINTS>;
var<private> mean: array<f32, POINTS>;
var<private> least: array<f32, POINTS>;
var<private> most: array<f32, POINTS>;
var<private> spread: array<f32, PAIRS>;
// Polynomials at a drive that designs share.
var<private> basis: array<f32, POINTS>;
// Of each tap: κ, then f, the growths of taper and gauge, η at the peak, places from which it is above the strain limit and slipped off.
var<private> keep: array<f32, KEPT_ALL>;

// 0 charted, 1 tap by tap, 2 no whisker with a gauge. Next to a border of the whiskers the host decides.
fn case_of(w: Whisker) -> u32 {
    let room = w.L_a - w.x_ss - w.l;
    let near = 1e-6 * w.L_a;
    if room < -near { return 2u; }
    let tau = (w.D - w.d) / (w.D * w.L_a);
    let slope = 0.5 * (w.D - w.d) / w.L_a;
    let width = w.l / sqrt(fma(slope, slope, 1.0));
    let charted = w.L_a >= REACH && (room > near || room == 0.0)
        && w.D >= D_LO && w.D <= D_HI && tau >= TAU_LO && tau <= TAU_HI
        && w.x_ss >= X_LO && w.x_ss + width <= X_HI && width <= WIDTH
        && (!OWN || APART || (w.drive >= DRIVE_LO && w.drive <= DRIVE_HI));
    return select(1u, 0u, charted);
}

fn powered(drive: f32) -> f32 {
    if POWER == 2u { return drive * drive; }
    if POWER == 1u { return drive; }
    return 1.0;
}

// A quantity's place in [−1, 1] on axis `k` of the chart whose numbers begin at `at`.
fn placed(at: u32, k: u32, y: f32) -> f32 {
    return fma(y, number(at + k), number(at + k + 1u));
}

// u = 1/a at the peak of the theory: that of the quadratic, then Newton's steps for what the rest adds.
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

// The growth, its slope and its curvature at η.
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

struct Limits { low: f32, high: f32, peak: f32 }

// q from which, and up to which, the near root is within the range of interest from `lo` to `hi`, and q at the peak.
fn bounds(g: Growth, lo: f32, hi: f32) -> Limits {
    let peak = grown(g, g.vertex).value;
    let low = select(grown(g, lo).value, 1e30, lo < g.vertex);
    let high = select(1e30, grown(g, hi).value, g.vertex < hi);
    return Limits(low, min(high, peak), peak);
}

struct Root { eta: f32, slope: f32 }

// η of the far root of a growth of `q`, and the slope there; the slope is 0 where there is none.
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

// The polynomials over x/a at distance `at`, as means over a gauge from s1 to s2 that give its δ.
fn fold(at: u32, s1: f32, s2: f32, p: f32) {
    for (var k = 0u; k < PLACES; k++) { places[k] = 0.0; }
    var total = 0.0;
    for (var g = 0u; g < GAUGE; g++) {
        let s = fma(s2 - s1, number(at + HEAD + 2u * g), s1);
        let u = 1.0 - p * s;
        var last = number(at + HEAD + 2u * g + 1u) / (u * u * u);
        total = fma(last, 1.0 - s, total);
        let x = placed(at, 12u, s);
        var this_one = last * x;
        for (var k = 0u; k < PLACES; k++) {
            places[k] += last;
            let next = fma(x + x, this_one, -last);
            last = this_one;
            this_one = next;
        }
    }
    let share = 1.0 / total;
    for (var k = 0u; k < PLACES; k++) { places[k] *= share; }
}

// A series over the axes: at each design's own drive, whose polynomials `over` holds; or, of drives that designs share, its coefficients over the
// drive go to `over`. `whole`: of a function that knows no place.
fn series(start: vec2<u32>, base: f32, taper: f32, whole: bool) -> f32 {
    var at = start.x;
    var row = start.y;
    var sum = 0.0;
    for (var group = 0u; group < GROUPS; group++) {
        var c = array<f32, 4>();
        if OWN {
            for (var k = 0u; k < 4u; k++) { c[k] = over[4u * group + k]; }
        }
        var c0 = c[0];
        var c1 = c[1];
        var c2 = c[2];
        var c3 = c[3];
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
                    if OWN {
                        let value = fma(term.x, c0, fma(term.y, c1, fma(term.z, c2, term.w * c3)));
                        sum = fma(value, b0, sum);
                    } else {
                        c0 = fma(term.x, b0, c0);
                        c1 = fma(term.y, b0, c1);
                        c2 = fma(term.z, b0, c2);
                        c3 = fma(term.w, b0, c3);
                    }
                    let next = fma(base + base, b1, -b0);
                    b0 = b1;
                    b1 = next;
                }
                let next = fma(taper + taper, t1, -t0);
                t0 = t1;
                t1 = next;
            }
        }
        if !OWN {
            over[4u * group] = c0;
            over[4u * group + 1u] = c1;
            over[4u * group + 2u] = c2;
            over[4u * group + 3u] = c3;
        }
    }
    return sum;
}

// Where a series of branch `b` at distance `n` begins: 0 strain, 1 arc.
fn start_of(n: u32, b: u32, function: u32) -> vec2<u32> {
    let at = 4u * (n * BRANCHES + b) + 2u * function;
    return vec2<u32>(size(at), size(at + 1u));
}

struct Sum { value: f32, slope: f32 }

// What a tap gives, of strain and arc.
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

// δ and c/a − 1 over driveᵉ of the tap at distance `n`, whose numbers begin at `at`. A contact with friction chooses among its branches, each of which
// slides at a T/P of its own.
fn choose(n: u32, at: u32, base: f32, taper: f32) -> Held {
    let count = u32(number(at + 4u));
    let final_one = count - 1u;
    let high = series(start_of(n, final_one, 1u), base, taper, true);
    let outwards = series(start_of(n, final_one, 0u), base, taper, false);
    if BRANCHES == 1u || count == 1u || 0.0 <= high { return Held(outwards, high); }
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
            let weight = number(CHOICE + u32(number(at + 5u)) + p * count + b);
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

// Coefficients over the drives from values at the points.
fn back_to_series(values: array<f32, POINTS>) -> array<f32, POINTS> {
    var from_points = values;
    var found: array<f32, POINTS>;
    for (var k = 0u; k < POINTS; k++) {
        var sum = 0.0;
        for (var j = 0u; j < POINTS; j++) { sum = fma(number(BACK + k * POINTS + j), from_points[j], sum); }
        found[k] = sum;
    }
    return found;
}

// The value at point `k` of the series that `over` holds at distance `n`.
fn at_point(n: u32, k: u32) -> f32 {
    var sum = 0.0;
    for (var group = 0u; group < GROUPS; group++) {
        let t = rows[AT_POINTS + (n * POINTS + k) * GROUPS + group];
        sum = fma(t.x, over[4u * group], fma(t.y, over[4u * group + 1u], sum));
        sum = fma(t.z, over[4u * group + 2u], fma(t.w, over[4u * group + 3u], sum));
    }
    return sum;
}

// κ and the arc of the tap at distance `n`, whose numbers begin at `at`, to `kappa` and `arc`; the largest |δ|.
fn read_tap(w: Design, n: u32, at: u32) -> f32 {
    let inverse = number(at + 15u);
    let p = w.tau * number(at + 14u);
    fold(at, w.x1 * inverse, w.x2 * inverse, p);
    let base = placed(at, 8u, w.D * inverse);
    var y = 1.0 / (1.0 - p);
    if POWER != 2u { y = sqrt(y); }
    let taper = placed(at, 10u, y);
    let scale = number(at + 2u);
    var largest = 0.0;
    if OWN {
        var own = w.drive;
        if DISPLACED { own = w.drive * inverse; }
        if POWER == 2u { own = own * own; }
        let x = placed(at, 6u, own);
        over[0] = 1.0;
        over[1] = x;
        for (var k = 2u; k < ORDERS; k++) { over[k] = fma(x + x, over[k - 1u], -over[k - 2u]); }
        let held = choose(n, at, base, taper);
        let deviation = scale * held.strain;
        let delta = w.power * deviation;
        kappa[0] = -(deviation / (1.0 + delta));
        arc[0] = scale * held.arc;
        return abs(delta);
    }
    _ = series(start_of(n, 0u, 0u), base, taper, false);
    for (var k = 0u; k < POINTS; k++) {
        let deviation = scale * at_point(n, k);
        let delta = number(POWERS + k) * deviation;
        kappa[k] = -(deviation / (1.0 + delta));
        largest = max(largest, abs(delta));
    }
    kappa = back_to_series(kappa);
    let room = (w.L_a - number(at + 14u)) * inverse;
    if w.power * number(at + 3u) > room {
        _ = series(start_of(n, 0u, 1u), base, taper, true);
        for (var k = 0u; k < POINTS; k++) { arc[k] = scale * at_point(n, k); }
        arc = back_to_series(arc);
    } else {
        for (var k = 0u; k < POINTS; k++) { arc[k] = 0.0; }
    }
    return largest;
}

// Drive `j` of those that designs share.
fn drive_at(j: u32) -> f32 { return number(DRIVES_AT + j); }

// Its polynomials to `basis`.
fn to_drive(drive: f32) {
    var y = drive;
    if POWER == 2u { y = drive * drive; }
    let x = fma(y, COMMON_SCALE, COMMON_SHIFT);
    var last = 1.0;
    var now = x;
    for (var k = 0u; k < POINTS; k++) {
        basis[k] = last;
        let next = fma(x + x, now, -last);
        last = now;
        now = next;
    }
}

// Drive over K and c/a − 1, of the series `kappa` and `arc`, at place `j` of the drives of each design.
fn at_drives(j: u32) -> Held {
    let drive = drive_at(j);
    var y = drive;
    if POWER == 2u { y = drive * drive; }
    let x = fma(y, COMMON_SCALE, COMMON_SHIFT);
    var one = Held(0.0, 0.0);
    var two = Held(0.0, 0.0);
    for (var k = POINTS - 1u; k > 0u; k--) {
        let next = Held(fma(x + x, one.strain, kappa[k]) - two.strain, fma(x + x, one.arc, arc[k]) - two.arc);
        two = one;
        one = next;
    }
    let power = powered(drive);
    let deviation = power * (fma(x, one.strain, kappa[0]) - two.strain);
    return Held(drive / (1.0 + deviation), power * (fma(x, one.arc, arc[0]) - two.arc));
}

// First drives at which the strain is above its limit, or the contact has slipped; `which`: 0 strain, 1 arc.
fn first_beyond(limit: f32, which: u32) -> f32 {
    var lo = 0u;
    var hi = DRIVES;
    for (var step = 0u; step < DRIVE_BITS; step++) {
        let middle = min((lo + hi) / 2u, DRIVES - 1u);
        let found = at_drives(middle);
        let beyond = select(found.strain, found.arc, which == 1u) > limit;
        let open = lo < hi;
        hi = select(hi, middle, open && beyond);
        lo = select(lo, middle + 1u, open && !beyond);
    }
    return f32(lo);
}

// The growth of the tap kept at `n`.
fn growth_of(w: Design, n: u32) -> Growth {
    let at = KEPT * n + POINTS;
    let inverse = number(DISTANCE * n + 15u);
    var hub = HUB * inverse / (1.0 + HUB * inverse);
    if DISPLACED { hub = 1.0; }
    return Growth(keep[at + 1u], keep[at + 2u], hub, SHEAR * w.D * w.D * inverse * inverse, keep[at + 3u]);
}

// f of the theory, and how it grows, to the numbers kept of tap `n`.
fn told(w: Design, n: u32) {
    let at = DISTANCE * n;
    let a = number(at + 14u);
    let inverse = number(at + 15u);
    let p = w.tau * a;
    let s1 = w.x1 * inverse;
    let s2 = w.x2 * inverse;
    let rest = 1.0 - p;
    let u1 = 1.0 - p * s1;
    let u2 = 1.0 - p * s2;
    let lever = (1.0 - s1) * u2 + (1.0 - s2) * u1;
    let beta = s1 * u2 + s2 * u1;
    let b = 1.0 / (u1 * u2);
    var f = 0.75 * w.D * inverse * rest * lever * b * b;
    if !PLAIN {
        var reach = 1.0 + HUB * inverse;
        if DISPLACED { reach = inverse; }
        f *= reach / (1.0 + SHEAR * w.D * w.D * inverse * inverse);
    }
    let k = KEPT * n + POINTS;
    keep[k] = f;
    keep[k + 1u] = 1.0 / rest;
    keep[k + 2u] = beta / lever;
    keep[k + 3u] = w.peak * a - 1.0;
}

// The series of κ of tap `n`, or of the mean, at the drive of `basis`.
fn kappa_at(n: u32) -> f32 {
    var sum = keep[KEPT * n];
    if OWN { return sum; }
    for (var k = 1u; k < POINTS; k++) { sum = fma(basis[k], keep[KEPT * n + k], sum); }
    return sum;
}

fn mean_at() -> f32 {
    var sum = mean[0];
    if OWN { return sum; }
    for (var k = 1u; k < POINTS; k++) { sum = fma(basis[k], mean[k], sum); }
    return sum;
}

// K̄ − 1 of a row.
fn calibration(power: f32) -> f32 {
    if FIXED_GIVEN { return FIXED; }
    return power * mean_at();
}

// q = K̄/K − 1 of tap `n` of a row.
fn miss(power: f32, known: f32, n: u32) -> f32 {
    let deviation = power * kappa_at(n);
    return (known - deviation) / (1.0 + deviation);
}

fn ones(which: bool) -> f32 { return select(0.0, 1.0, which); }

// Least and largest q of tap `n` over all drives; `every`: no drive has slipped.
fn range_of(n: u32, every: bool, largest: f32) -> array<f32, 2> {
    var middle = -keep[KEPT * n];
    if !FIXED_GIVEN { middle += mean[0]; }
    var around = 0.0;
    for (var k = 1u; k < POINTS; k++) {
        let series_mean = select(mean[k], 0.0, FIXED_GIVEN);
        around += abs(series_mean - keep[KEPT * n + k]);
    }
    var lo = middle - around;
    var hi = middle + around;
    if !every && !FIXED_GIVEN {
        var apart = 0.0;
        for (var k = 0u; k < POINTS; k++) {
            let own = keep[KEPT * n + k];
            apart += max(most[k] - own, own - least[k]);
        }
        lo = -apart;
        hi = apart;
    }
    let first = powered(drive_at(0u));
    let last = powered(drive_at(DRIVES - 1u));
    lo = fma(lo, select(first, last, lo < 0.0), FIXED);
    hi = fma(hi, select(last, first, hi < 0.0), FIXED);
    let less = 0.99999 - largest;
    let more = 1.00001 + largest;
    return array<f32, 2>(lo * select(less, more, lo < 0.0) - 1e-7, hi * select(more, less, hi < 0.0) + 1e-7);
}

// Adds the words of tap `n` over all drives to `all`.
fn count(w: Design, n: u32, complete: f32, largest: f32, all_words: ptr<function, Tally>) {
    let drives = f32(ROW_DRIVES);
    let at = DISTANCE * n;
    let k = KEPT * n + POINTS;
    let above = keep[k + 4u];
    let slipped = keep[k + 5u];
    let whole_design = drives <= complete;
    var between = array<f32, 2>();
    if OWN {
        let q = miss(w.power, calibration(w.power), n);
        between = array<f32, 2>(q - 1e-7, q + 1e-7);
    } else {
        between = range_of(n, whole_design, largest);
    }
    let lowest = between[0];
    let highest = between[1];
    let g = growth_of(w, n);
    let limits = bounds(g, number(at), number(at + 1u));
    let farthest = -grown(g, -1.0).value;
    let certain = highest < limits.peak;
    let is_clear = certain && ((highest < limits.low) || (limits.high < lowest));
    let twofold = certain && (limits.low < lowest) && (highest < limits.high) && !is_clear;
    let beyond = (lowest < max(-0.9 * farthest, BEYOND_LO)) || (BEYOND_HI < highest);
    let near = !beyond;
    (*all_words).strain += drives - above;
    (*all_words).slipped += drives - slipped;
    let clean = min(above, slipped);
    (*all_words).ok += ones(near && is_clear) * clean;
    (*all_words).ambiguous += ones(near && twofold) * drives;
    let rest = near && !is_clear && !twofold;
    let whole = complete >= drives;
    (*all_words).hard = max((*all_words).hard, ones(beyond || (rest && !whole)));
    let open = ones(rest && whole);
    if open == 0.0 { return; }
    for (var j = 0u; j < ROW_DRIVES; j++) {
        var power = w.power;
        if !OWN {
            to_drive(drive_at(j));
            power = powered(drive_at(j));
        }
        let q = miss(power, calibration(power), n);
        let none = limits.peak < q;
        let two = (q >= limits.low) && (q <= limits.high);
        (*all_words).rootless += open * ones(none);
        (*all_words).ambiguous += open * ones(two);
        (*all_words).ok += open * ones(!none && !two && (f32(j) < clean));
    }
}

// Distance errors of the row at drive `j`, reduced to its ranked value, and 1 where every tap has a distance.
struct Row { rank: f32, whole: f32 }

fn estimate(w: Design, drive: f32, power: f32, j: u32, all_words: ptr<function, Tally>) -> Row {
    var squares = 0.0;
    var largest = 0.0;
    var noises = 0.0;
    var lacking = 0.0;
    let known = calibration(power);
    let noise = (1.0 + known) * NOISE / drive;
    for (var n = 0u; n < DISTANCES; n++) {
        let at = DISTANCE * n;
        let k = KEPT * n + POINTS;
        let a = number(at + 14u);
        let q = miss(power, known, n);
        let g = growth_of(w, n);
        let limits = bounds(g, number(at), number(at + 1u));
        let root = root_of(g, q, limits.peak);
        let whole = 1.0 / (1.0 + root.eta);
        let error = a * root.eta * whole;
        squares = fma(error, error, squares);
        largest = max(largest, abs(error));
        let sigma = noise * a * whole * whole / max(keep[k] * root.slope, 1e-30);
        noises = fma(sigma, sigma, noises);
        let none = (limits.peak < q) || (1.0 + root.eta < 1.1e-3);
        let two = (q >= limits.low) && (q <= limits.high) && !none;
        let over_limit = f32(j) >= keep[k + 4u];
        let off = f32(j) >= keep[k + 5u];
        lacking += ones(none);
        (*all_words).rootless += ones(none);
        (*all_words).ambiguous += ones(two);
        (*all_words).strain += ones(over_limit);
        (*all_words).slipped += ones(off);
        (*all_words).ok += ones(!(none || two || over_limit || off));
    }
    let share = 1.0 / f32(DISTANCES);
    var rank = sqrt(squares * share);
    if BY == 1u { rank = largest; }
    if BY == 2u { rank = sqrt(noises * share); }
    if BY == 3u { rank = sqrt((squares + noises) * share); }
    return Row(rank, ones(lacking < 0.5));
}

// √ of the sum of squares of K − K̄ over the distances, over the power of the drive of `basis`.
fn deviation_at() -> f32 {
    if OWN { return sqrt(max(spread[0], 0.0)); }
    var sum = 0.0;
    var at = 0u;
    for (var k = 0u; k < POINTS; k++) {
        var line = 0.5 * spread[at] * basis[k];
        at++;
        for (var l = k + 1u; l < POINTS; l++) {
            line = fma(basis[l], spread[at], line);
            at++;
        }
        sum = fma(basis[k], line, sum);
    }
    return sqrt(max(2.0 * sum, 0.0));
}

// Words and rows of four designs; 1 in the answer of those that have a row below the bound.
fn rows_of(w: Design, all_words: ptr<function, Tally>) -> f32 {
    var largest = 0.0;
    for (var k = 0u; k < POINTS; k++) {
        mean[k] = 0.0;
        least[k] = 1e30;
        most[k] = -1e30;
    }
    for (var k = 0u; k < PAIRS; k++) { spread[k] = 0.0; }
    let drives = f32(ROW_DRIVES);
    // First drive at which any tap of the design has slipped: from there its rows are not complete.
    var complete = drives;
    for (var n = 0u; n < DISTANCES; n++) {
        let at = DISTANCE * n;
        largest = max(largest, read_tap(w, n, at));
        told(w, n);
        let share = 1.0 / f32(n + 1u);
        var before: array<f32, POINTS>;
        for (var k = 0u; k < POINTS; k++) {
            let own = kappa[k];
            before[k] = own - mean[k];
            mean[k] = fma(before[k], share, mean[k]);
            if !OWN {
                least[k] = min(least[k], own);
                most[k] = max(most[k], own);
            }
            keep[KEPT * n + k] = own;
        }
        var pair = 0u;
        for (var k = 0u; k < POINTS; k++) {
            for (var l = k; l < POINTS; l++) {
                spread[pair] = fma(before[k], kappa[l] - mean[l], spread[pair]);
                pair++;
            }
        }
        let f = keep[KEPT * n + POINTS];
        let room = (w.L_a - number(at + 14u)) * number(at + 15u);
        var above = drives;
        var slipped = drives;
        if OWN {
            let strain = f * w.drive / (1.0 + w.power * kappa[0]);
            above = select(drives, 0.0, strain > STRAIN_LIMIT);
            slipped = select(drives, 0.0, w.power * arc[0] > room);
        } else {
            let last = at_drives(DRIVES - 1u);
            let over_limit = f * last.strain > STRAIN_LIMIT;
            let off = last.arc > room;
            if over_limit { above = select(drives, first_beyond(STRAIN_LIMIT / f, 0u), over_limit); }
            if off { slipped = select(drives, first_beyond(room, 1u), off); }
        }
        keep[KEPT * n + POINTS + 4u] = above;
        keep[KEPT * n + POINTS + 5u] = slipped;
        complete = min(complete, slipped);
    }
    (*all_words).hard = max((*all_words).hard, ones(!(largest < MOST_DEVIATION)));
    if !ESTIMATES {
        for (var n = 0u; n < DISTANCES; n++) { count(w, n, complete, largest, all_words); }
    }
    var scale = inverseSqrt(f32(DISTANCES) - 1.0);
    if ELONGATION { scale *= w.x2 - w.x1; }
    var found = 0.0;
    var rows_complete = select(complete, 0.0, ESTIMATES);
    for (var j = 0u; j < ROW_DRIVES; j++) {
        var drive = w.drive;
        var power = w.power;
        if !OWN {
            to_drive(drive_at(j));
            drive = drive_at(j);
            power = powered(drive);
        }
        let on = f32(j) < complete;
        if ESTIMATES {
            let row = estimate(w, drive, power, j, all_words);
            let whole = row.whole * ones(on);
            rows_complete += whole;
            found = max(found, whole * ones(row.rank < job.bound));
        } else {
            let rank = power * deviation_at() * scale;
            found = max(found, ones(on && (rank < job.bound)));
        }
    }
    (*all_words).complete += rows_complete;
    return found;
}

fn design_of(w: Whisker) -> Design {
    // The largest counts where contacts slip off.
    var drive = w.drive;
    if !OWN { drive = drive_at(DRIVES - 1u); }
    let slope = 0.5 * (w.D - w.d) / w.L_a;
    let x2 = w.x_ss + w.l * inverseSqrt(fma(slope, slope, 1.0));
    let tau = (w.D - w.d) / (w.D * w.L_a);
    return Design(w.D, tau, w.L_a, w.x_ss, x2, peak_of(w.D, tau, w.x_ss, x2), drive, powered(drive));
}

// Notes that design `i` must be solved tap by tap; 1.
fn list_hard(i: u32) -> u32 {
    hard[atomicAdd(&tally[1], 1u)] = job.stamp | i;
    return 1u;
}

// Words, rows and lists of design `i`; 1 where it must be solved tap by tap.
fn rank_design(i: u32, words: ptr<function, Words>) -> u32 {
    let w = whisker(i);
    let kind = case_of(w);
    if kind == 2u {
        (*words).invalid += DISTANCES * DRIVES;
        return 0u;
    }
    if kind == 1u { return list_hard(i); }
    var design = design_of(w);
    var counts = Tally();
    var found = 0.0;
    // Where a contact may stick its taps are no series over the drive: every drive is read on its own.
    let times = select(1u, DRIVES, APART);
    for (var j = 0u; j < times; j++) {
        if APART {
            design.drive = drive_at(j);
            design.power = powered(design.drive);
        }
        found = max(found, rows_of(design, &counts));
    }
    if counts.hard > 0.5 { return list_hard(i); }
    if found > 0.5 { best[atomicAdd(&tally[0], 1u)] = job.stamp | i; }
    (*words).ok += u32(counts.ok + 0.5);
    (*words).slipped += u32(counts.slipped + 0.5);
    (*words).strain += u32(counts.strain + 0.5);
    (*words).rootless += u32(counts.rootless + 0.5);
    (*words).ambiguous += u32(counts.ambiguous + 0.5);
    (*words).complete += u32(select(counts.complete, min(counts.complete, 1.0), PER_DESIGN) + 0.5);
    return 0u;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    var words = Words();
    // Designs gone through, and those of them that go to the list of hard ones here.
    var seen = 0u;
    var left = 0u;
    for (var i = id.x; i < job.count; i += job.stride) {
        seen += 1u;
        left += rank_design(i, &words);
    }
    atomicAdd(&tally[2], words.ok);
    atomicAdd(&tally[3], words.slipped);
    atomicAdd(&tally[4], words.strain);
    atomicAdd(&tally[5], words.rootless);
    atomicAdd(&tally[6], words.ambiguous);
    atomicAdd(&tally[7], words.invalid);
    atomicAdd(&tally[8], words.complete);
    atomicAdd(&tally[9], seen);
    let counts = array<u32, 8>(
        left, words.ok, words.slipped, words.strain, words.rootless, words.ambiguous, words.invalid, words.complete
    );
    var sum = 0u;
    for (var k = 0u; k < 8u; k++) {
        sum += WEIGHTS[k] * counts[k];
    }
    atomicAdd(&tally[10], sum);
}
