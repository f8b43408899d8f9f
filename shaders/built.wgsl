// Built whiskers (all but a cone clamped at its base). Twin of crates/built/src/lanes.rs and newton.rs, where the method is described.
//
// Emitted from Rust before this text: real, named numbers, the switches SHEAR, EXTENSION, SURFACE, STICK, LAW, FAR, CURVED, INNER and POWER, the
// structures Tap, Piece and Solution, where the parts of the tableau begin in `numbers` (PLACES, FIRST, BEFORE, SHARES, ENDS, GAUSS, PIECES),
// one_minus_cos, x_minus_sin and section. The tables are a buffer: a constant array indexed in a loop would be copied for each of its numbers.

@group(0) @binding(0) var<uniform> batch: vec4<u32>;
@group(0) @binding(1) var<storage, read> taps: array<Tap>;
@group(0) @binding(2) var<storage, read_write> solutions: array<Solution>;
@group(0) @binding(3) var<storage, read> numbers: array<real>;

// P and T at the arc c; see the Rust twin.
struct Load {
    arc: real,
    normal: real,
    tangential: real,
    height: real,
    force: vec2<real>,
}

struct Slope {
    bent: vec4<real>,
    rest: vec2<real>,
}

struct Bent {
    state: Slope,
    errors: vec3<real>,
    load: real,
    beyond: real,
}

struct Shot {
    load: Load,
    bent: Bent,
    miss: vec2<real>,
    wrench: vec3<real>,
}

fn piece_at(k: u32) -> Piece {
    let at = PIECES + 8u * k;
    return Piece(
        numbers[at], numbers[at + 1u], numbers[at + 2u], numbers[at + 3u],
        numbers[at + 4u], numbers[at + 5u], numbers[at + 6u], numbers[at + 7u],
    );
}

fn turn(x: real) -> vec2<real> {
    return vec2<real>(one_minus_cos(x), x - x_minus_sin(x));
}

fn rotated(v: vec2<real>, by: vec2<real>) -> vec2<real> {
    return vec2<real>(v.x - by.x * v.x - by.y * v.y, v.y - by.x * v.y + by.y * v.x);
}

fn back(by: vec2<real>) -> vec2<real> {
    return vec2<real>(by.x, -by.y);
}

// ((1 + u)^n - 1)/(n u) for |u| up to 1/8.
fn binomial(n: real, u: real) -> real {
    var sum = ONE;
    for (var k = 8u; k > 0u; k--) {
        sum = ONE + (n - real(k)) / real(k + 1u) * u * sum;
    }
    return sum;
}

// R and R' at a + x less those at a, by the piece that holds a. A difference of both would be all rounding for small drives.
fn widened(tap: Tap, x: real) -> vec2<real> {
    if !POWER {
        return vec2<real>(tap.contact_slope * x, ZERO);
    }
    let n = tap.exponent;
    let left = tap.length - tap.a;
    if abs(x) < EIGHTH * left {
        let u = -x / left;
        return tap.contact_slope * vec2<real>(x * binomial(n, u), (n - ONE) * u * binomial(n - ONE, u));
    }
    let v = max(left - x, ZERO) / tap.length;
    let steep = select(ZERO, power(v, n - ONE), v > ZERO);
    return vec2<real>(
        tap.wider * power(v, n) - (tap.contact - tap.tip),
        -tap.wider * n / tap.length * steep - tap.contact_slope,
    );
}

fn touched(tap: Tap) -> vec3<real> {
    if !SURFACE {
        return vec3<real>(ZERO, ZERO, ONE);
    }
    var tangent = -tap.contact_slope;
    if CURVED {
        tangent = tangent / (ONE + (tap.curvature + tap.curvature_slope * tap.a) * tap.contact);
    }
    let cosine = ONE / sqrt(ONE + tangent * tangent);
    return vec3<real>(tap.contact, tangent * cosine, cosine);
}

// R, sin α and cos α of a contact at a + x less those `at` a.
fn slid(tap: Tap, at: vec3<real>, x: real) -> vec3<real> {
    if !SURFACE {
        return vec3<real>(ZERO, ZERO, ZERO);
    }
    let more = widened(tap, x);
    if !POWER && !CURVED {
        return vec3<real>(more.x, ZERO, ZERO);
    }
    // tan α = -R'/(1 + κ0 R) at both; `excess`: increase of the denominator.
    let slope = tap.contact_slope;
    var here = ONE;
    var excess = ZERO;
    if CURVED {
        let curvature = tap.curvature + tap.curvature_slope * tap.a;
        here = ONE + curvature * tap.contact;
        excess = (curvature + tap.curvature_slope * x) * more.x + tap.curvature_slope * x * tap.contact;
    }
    let there = here + excess;
    let grown = (slope * excess - more.y * here) / (here * there);
    let turned = grown / (ONE + slope * (slope + more.y) / (here * there));
    let cosine = ONE / sqrt(ONE + turned * turned);
    let sine = turned * cosine;
    let versine = sine * sine / (ONE + cosine);
    return vec3<real>(more.x, sine * at.z - versine * at.y, -versine * at.z - sine * at.y);
}

// P and T at a + x; `at`: touched(a), `more`: its change.
fn loaded(tap: Tap, at: vec3<real>, more: vec3<real>, x: real, normal: real, tangential: real) -> Load {
    let now = at + more;
    let force = vec2<real>(tangential * now.z - normal * now.y, -normal * now.z - tangential * now.y);
    return Load(tap.a + x, normal, tangential, now.x, force);
}

fn radius_of(tap: Tap, piece: Piece, s: real) -> real {
    if POWER {
        return tap.tip + tap.wider * power(max(ONE - s / tap.length, ZERO), tap.exponent);
    }
    return piece.radius + piece.slope * (s - piece.near);
}

// 1 − cos and sin of the angle by which the resting whisker turns over `length` from the arc `begin`, back to it.
fn rest(tap: Tap, begin: real, length: real) -> vec2<real> {
    return turn(length * (tap.curvature + tap.curvature_slope * (begin + HALF * length)));
}

fn slope(tap: Tap, load: Load, piece: Piece, s: real, rate: real, state: Slope, seen: ptr<function, vec2<real>>) -> Slope {
    let bent = state.bent;
    let distance = load.arc - s;
    let turned = turn(bent.x);
    var arm = vec2<real>(distance - bent.y, load.height - bent.z);
    var resting = vec2<real>(ZERO, ZERO);
    if CURVED {
        resting = rest(tap, s, distance);
        arm -= state.rest;
    }
    let upright = ONE - resting.x;
    var d = vec2<real>(-turned.x, turned.y);
    if CURVED {
        d = vec2<real>(-upright * turned.x - resting.y * turned.y, upright * turned.y - resting.y * turned.x);
    }
    let cosine = upright + d.x;
    let sine = resting.y + d.y;
    let moment = arm.x * load.force.y - arm.y * load.force.x;
    let axial = load.force.x * cosine + load.force.y * sine;

    let r = radius_of(tap, piece, s);
    let r2 = r * r;
    let skin = PI * tap.modulus;
    var area = skin * r2;
    var inertia = QUARTER * skin * r2 * r2;
    var p = ZERO;
    var g = ZERO;
    if INNER {
        let i = piece.inner + piece.inner_slope * (s - piece.near);
        let i2 = i * i;
        g = tap.core / tap.modulus;
        p = i2 / r2;
        let other = skin * (g - ONE);
        area += other * i2;
        inertia += QUARTER * other * i2 * i2;
    }
    var bending = moment * r / inertia;
    var stretch = ZERO;
    if EXTENSION {
        stretch = axial / area;
    }
    if LAW {
        let law = section(stretch, abs(bending));
        stretch += law.extra;
        bending *= ONE + law.chi;
        let size = abs(bending);
        *seen = max(*seen, vec2<real>(max(stretch + size, TWO * (size - stretch)), law.load));
    }
    let fibre = stretch - SIDE * bending;
    var moved = -d;
    if EXTENSION {
        moved -= stretch * vec2<real>(cosine, sine);
    }
    if SHEAR {
        let across = load.force.y * cosine - load.force.x * sine;
        let over = -(ONE - g) * tap.shear * (ONE - p) / (ONE + g - (ONE - g) * p);
        let b = p * over;
        let a = b - tap.shear;
        let j = QUARTER * a * (ONE - p * p) + HALF * b * (ONE - p) + TWENTY_FOURTH * (ONE - p * p * p)
            + g * (QUARTER * (a + over) * p * p + TWENTY_FOURTH * p * p * p);
        let slide = -across * skin * r2 * r2 * r2 * j / (inertia * inertia);
        moved += slide * vec2<real>(sine, -cosine);
    }
    return Slope(
        rate * vec4<real>(-bending / r, moved.x, moved.y, piece.gauge * fibre),
        rate * vec2<real>(resting.x, -resting.y),
    );
}

fn bend(tap: Tap, load: Load, judging: bool) -> Bent {
    var state = Slope();
    var errors = vec3<real>(ZERO, ZERO, ZERO);
    var seen = vec2<real>(ZERO, ZERO);
    var slopes: array<Slope, STAGES>;
    let first = u32(tap.first);
    for (var k = u32(tap.count); k > 0u; k--) {
        let piece = piece_at(first + k - 1u);
        let high = min(piece.far, load.arc);
        let low = min(piece.near, load.arc);
        let length = high - low;
        if !(length > ZERO) {
            continue;
        }
        let ratio = clamp(radius_of(tap, piece, low) / max(radius_of(tap, piece, high), TINY), ONE / STEEPEST, STEEPEST);
        let steps = u32(piece.steps);
        let step = ONE / piece.steps;
        for (var number = 0u; number < steps; number++) {
            for (var stage = 0u; stage < STAGES; stage++) {
                var begun = state;
                let last = u32(numbers[FIRST + stage + 1u]);
                for (var n = u32(numbers[FIRST + stage]); n < last; n++) {
                    let weight = step * numbers[SHARES + n];
                    let before = u32(numbers[BEFORE + n]);
                    begun.bent += weight * slopes[before].bent;
                    if CURVED {
                        begun.rest += weight * slopes[before].rest;
                    }
                }
                let t = step * (real(number) + numbers[PLACES + stage]);
                let spread = t + (ONE - t) * ratio;
                let s = high - length * t / spread;
                let rate = length * ratio / (spread * spread);
                slopes[stage] = slope(tap, load, piece, s, rate, begun, &seen);
            }
            var fifth = vec3<real>(ZERO, ZERO, ZERO);
            var third = fifth;
            for (var stage = 0u; stage < STAGES; stage++) {
                let at = ENDS + 3u * stage;
                let ends = step * vec3<real>(numbers[at], numbers[at + 1u], numbers[at + 2u]);
                state.bent += ends.x * slopes[stage].bent;
                if CURVED {
                    state.rest += ends.x * slopes[stage].rest;
                }
                if judging {
                    fifth += ends.y * slopes[stage].bent.xzw;
                    third += ends.z * slopes[stage].bent.xzw;
                }
            }
            if judging {
                let both = fifth * fifth + HUNDREDTH * third * third;
                errors += fifth * fifth / sqrt(max(both, vec3<real>(LEAST_SQUARE)));
            }
        }
    }
    return Bent(state, errors, seen.x, seen.y);
}

// Vector along the resting whisker over `length` from the arc `begin`, in the frame of its base.
fn path(tap: Tap, begin: real, length: real, parts: u32) -> vec2<real> {
    var way = vec2<real>(ZERO, ZERO);
    let part = length / real(parts);
    for (var k = 0u; k < parts; k++) {
        for (var n = 0u; n < 4u; n++) {
            let s = begin + part * (real(k) + numbers[GAUSS + 2u * n]);
            let at = rest(tap, ZERO, s);
            way += part * numbers[GAUSS + 2u * n + 1u] * vec2<real>(ONE - at.x, -at.y);
        }
    }
    return way;
}

fn shoot(tap: Tap, share: real, z: vec2<real>, judging: bool) -> Shot {
    let normal = tap.force * z.x;
    var x = tap.a * z.y;
    var tangential = tap.ratio * normal;
    if STICK {
        x = ZERO;
        tangential = tap.force * z.y;
    }
    let at = touched(tap);
    let more = slid(tap, at, x);
    let load = loaded(tap, at, more, x, normal, tangential);
    let bent = bend(tap, load, judging);
    let state = bent.state;
    let base = vec2<real>(load.arc - state.bent.y, load.height - state.bent.z) - state.rest;
    let moment = base.x * load.force.y - base.y * load.force.x;
    var leaned = vec2<real>(ZERO, ZERO);
    if CURVED {
        leaned = rest(tap, ZERO, load.arc);
    }
    let beta = moment * tap.soft_theta - state.bent.x;
    let by = turn(beta);
    let force = rotated(rotated(load.force, back(leaned)), by);
    let moved = rotated(state.bent.yz, back(leaned));

    let here = vec2<real>(tap.pole * at.y, at.x + tap.pole * at.z);
    let aside = vec2<real>(tap.pole * more.y, more.x + tap.pole * more.z);
    var pole = vec2<real>(tap.a + here.x, here.y);
    var shift = vec2<real>(x + aside.x, aside.y);
    if CURVED {
        let out = back(rest(tap, ZERO, tap.a));
        let by = rest(tap, tap.a, x);
        let there = here + aside;
        let turned = vec2<real>(by.y * there.y - by.x * there.x, -by.y * there.x - by.x * there.y);
        pole = path(tap, ZERO, tap.a, 6u) + rotated(here, out);
        shift = path(tap, tap.a, x, 2u) + rotated(aside + turned, out);
    }
    let theta = tap.turn * share;
    let swung = turn(theta);
    let apart = TWO * turn(HALF * (beta + theta)).y;
    let mean = turn(HALF * (beta - theta));
    let crossed = rotated(pole, mean);
    let swing = apart * vec2<real>(-crossed.y, crossed.x);
    let carried = rotated(shift - moved, by);
    let miss = force * vec2<real>(tap.soft_x, tap.soft_y) + carried + swing + tap.hub * swung
        + vec2<real>(ZERO, tap.lift * share);
    return Shot(load, bent, miss / tap.a, vec3<real>(moment, force));
}

fn scale(z: vec2<real>) -> vec2<real> {
    let force = max(abs(z.x), LEAST_FORCE);
    if STICK {
        return vec2<real>(force, force + abs(z.y));
    }
    return vec2<real>(force, ONE);
}

fn seen(shot: Shot) -> vec3<real> {
    return vec3<real>(shot.miss, shot.bent.state.bent.w);
}

// Relative change of the strain by changes of the unknowns, or the largest relative change of an unknown if that is larger.
fn of_strain(tap: Tap, fibre: real, by_x: vec3<real>, by_y: vec3<real>, change: vec2<real>, unit: vec2<real>) -> real {
    let relative = abs(change / unit);
    let measure = max(max(tap.least * (tap.end - tap.begin), abs(fibre)), TINY);
    return max(max(relative.x, relative.y), (abs(by_x.z * change.x) + abs(by_y.z * change.y)) / measure);
}

// Purpose of a shot: the start of a stride, the two columns of the Jacobian there, a step of Broyden's method, the error estimate at the end.
const BEGIN = 0u;
const ALONG_X = 1u;
const ALONG_Y = 2u;
const STEP = 3u;
const JUDGE = 4u;

fn solve(tap: Tap) -> Solution {
    let stop = max(STOP * TOLERANCE, FOUR * ROUNDING);
    let amount = max(tap.turn, tap.lift / tap.a);
    let strides = u32(clamp(ceil(amount / STRIDE), ONE, MOST_STRIDES));
    var stride = 1u;
    var share = ONE / real(strides);
    // The unknowns at the end of the last stride, those guessed for this one, and those reached.
    var before = vec2<real>(ZERO, ZERO);
    var guess = vec2<real>(share, ZERO);
    var z = guess;
    var shots = 0u;
    var steps = 0u;
    var lost = false;
    var begun = (tap.turn * (tap.a + tap.hub) + tap.lift) / tap.a;
    var by_x = vec3<real>(ZERO, ZERO, ZERO);
    var by_y = by_x;
    // Size of the last step: of the unknowns, and measured by the strain.
    var remains = ZERO;
    var owing = ZERO;
    var shot: Shot;
    // `shoot` is called in one place: drivers inline every call, and the time of compiling grows with each.
    var phase = BEGIN;
    var asked = z;
    loop {
        let fresh = shoot(tap, share, asked, phase == JUDGE);
        shots += 1u;
        if phase == JUDGE {
            shot = fresh;
            break;
        }
        if phase == BEGIN {
            shot = fresh;
            phase = ALONG_X;
            asked.x = z.x + PROBE * scale(z).x;
            continue;
        }
        if phase == ALONG_X {
            by_x = (seen(fresh) - seen(shot)) / (asked.x - z.x);
            phase = ALONG_Y;
            asked = vec2<real>(z.x, z.y + PROBE * scale(z).y);
            continue;
        }
        if phase == ALONG_Y {
            by_y = (seen(fresh) - seen(shot)) / (asked.y - z.y);
            if STICK && stride == 1u {
                begun = by_x.x * by_y.y - by_y.x * by_x.y;
            }
            phase = STEP;
            steps = 0u;
        } else {
            let unit = scale(z);
            let taken = asked - z;
            let weighted = taken / (unit * unit);
            let length = dot(taken, weighted);
            if length > ZERO {
                let lack = (seen(fresh) - seen(shot) - by_x * taken.x - by_y * taken.y) / length;
                by_x += lack * weighted.x;
                by_y += lack * weighted.y;
            }
            z = asked;
            shot = fresh;
            steps += 1u;
        }
        if steps < STEPS {
            let inverse = -ONE / (by_x.x * by_y.y - by_y.x * by_x.y);
            let wanted = inverse * vec2<real>(
                by_y.y * shot.miss.x - by_y.x * shot.miss.y,
                by_x.x * shot.miss.y - by_x.y * shot.miss.x,
            );
            let unit = scale(z);
            let relative = abs(wanted / unit);
            remains = max(relative.x, relative.y);
            owing = of_strain(tap, shot.bent.state.bent.w, by_x, by_y, wanted, unit);
            if owing >= stop {
                asked = z + min(ONE, LONGEST / remains) * wanted;
                if !STICK {
                    asked.y = clamp(asked.y, LEAST_ARC - ONE, MOST_ARC - ONE);
                }
                continue;
            }
        }
        let off = abs(z.x - guess.x);
        lost = lost || !(remains < CONTRACTED) || !((by_x.x * by_y.y - by_y.x * by_x.y) / begun > UPRIGHT)
            || !(off < FORESEEN * max(max(abs(z.x), abs(guess.x)), share));
        if stride >= strides {
            phase = JUDGE;
            share = ONE;
        } else {
            stride += 1u;
            share = real(stride) / real(strides);
            guess = z + (z - before);
            if stride == 2u {
                guess = vec2<real>(TWO * z.x, FOUR * z.y);
            }
            before = z;
            z = guess;
            phase = BEGIN;
        }
        asked = z;
    }
    let bent = shot.bent.state.bent;
    // The width of the gauge from its rounded ends, as in the integral.
    let width = tap.end - tap.begin;
    let measure = max(tap.least * width, abs(bent.w));
    let sizes = max(vec3<real>(abs(bent.x), abs(bent.z), measure), vec3<real>(TINY));
    let parts = shot.bent.errors / sizes;
    let across = shot.bent.errors.y * sqrt(sqrt(ACROSS * parts.y));
    let missed = vec2<real>(shot.bent.errors.x * abs(bent.z), shot.bent.errors.x * tap.a + across) / tap.a;
    let determinant = max(abs(by_x.x * by_y.y - by_y.x * by_x.y), TINY);
    let owed = vec2<real>(
        abs(by_y.y) * missed.x + abs(by_y.x) * missed.y,
        abs(by_x.x) * missed.y + abs(by_x.y) * missed.x,
    ) / determinant;
    let both = owed / scale(z);
    let unsure = max(both.x + both.y, of_strain(tap, bent.w, by_x, by_y, owed, scale(z)));
    let lever = shot.load.arc - HALF * (tap.begin + min(tap.end, shot.load.arc));
    var shown = abs(by_y.z);
    if STICK {
        shown = select(ZERO, shot.load.arc * abs(bent.w) / max(lever, TINY), lever > ZERO);
        // P and T may bend the gauge in opposite ways: their roundings do not cancel.
        shown += abs(by_x.z * z.x) + abs(by_y.z * z.y);
    }
    let rounded = ONE + LEVERED * shown / max(measure, TINY);
    var error = WARY * (parts.x + parts.z + unsure) + owing + ROUNDINGS * ROUNDING * rounded + TWO * CHART_ERROR;
    if lost {
        error = LOST;
    }
    if shot.bent.beyond > ONE {
        error = HOPELESS;
    }
    return Solution(
        bent.w / width, shot.load.normal, shot.load.tangential, shot.load.arc,
        shot.wrench.x, shot.wrench.y, shot.wrench.z, error, shot.bent.load, real(shots),
    );
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < batch.x {
        solutions[id.x] = solve(taps[id.x]);
    }
}
