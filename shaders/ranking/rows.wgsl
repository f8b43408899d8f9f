// Words and rows of a design, from its taps.

// Taps of a design per combination of words; `hard`: it must be solved tap by tap.
struct Tally { taps: array<u32, COMBINED>, complete: u32, hard: bool }

var<private> mean: array<f32, POINTS>;
var<private> least: array<f32, POINTS>;
var<private> most: array<f32, POINTS>;
var<private> spread: array<f32, PAIRS>;
// Polynomials at a drive that designs share.
var<private> basis: array<f32, POINTS>;
// For each tap: κ, then the numbers named below.
var<private> keep: array<f32, KEPT_ALL>;

// Numbers kept of a tap after its κ: the first drives above the strain limit and slipped off.
const ABOVE = POINTS;
const SLIPPED = POINTS + 1u;

fn drive_at(j: u32) -> f32 { return number(DRIVES_AT + j); }

fn common_place(drive: f32) -> f32 {
    return fma(variable(drive), COMMON_SCALE, COMMON_SHIFT);
}

fn to_drive(j: u32) -> f32 {
    let drive = drive_at(j);
    let x = common_place(drive);
    var last = 1.0;
    var now = x;
    for (var k = 0u; k < POINTS; k++) {
        basis[k] = last;
        let next = fma(x + x, now, -last);
        last = now;
        now = next;
    }
    return drive;
}

// Drive over K and c/a − 1, from the series `kappa` and `arc`, at shared drive `j` (Clenshaw's recurrence).
// Does not use `basis`: Mesa's software device takes 76 s to compile one more writer of that array, and 4 s this.
fn at_drive(j: u32) -> Held {
    let drive = drive_at(j);
    let x = common_place(drive);
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

// First drive from which the strain over f, or with `arc_asked` the arc, exceeds `limit`; it grows with the drive.
fn first_beyond(limit: f32, arc_asked: bool) -> u32 {
    var lo = 0u;
    var hi = DRIVES;
    for (var step = 0u; step < DRIVE_BITS; step++) {
        let middle = min((lo + hi) / 2u, DRIVES - 1u);
        let found = at_drive(middle);
        let beyond = select(found.strain, found.arc, arc_asked) > limit;
        let open = lo < hi;
        hi = select(hi, middle, open && beyond);
        lo = select(lo, middle + 1u, open && !beyond);
    }
    return lo;
}

fn kept(n: u32, k: u32) -> f32 { return keep[KEPT * n + k]; }

// κ of tap `n` at the drive of `basis`.
fn kappa_at(n: u32) -> f32 {
    var sum = kept(n, 0u);
    if OWN { return sum; }
    for (var k = 1u; k < POINTS; k++) { sum = fma(basis[k], kept(n, k), sum); }
    return sum;
}

fn mean_at() -> f32 {
    var sum = mean[0];
    if OWN { return sum; }
    for (var k = 1u; k < POINTS; k++) { sum = fma(basis[k], mean[k], sum); }
    return sum;
}

fn calibration(power: f32) -> f32 {
    if FIXED_GIVEN { return FIXED; }
    return power * mean_at();
}

// q = K̄/K − 1 of tap `n` of a row.
fn miss(power: f32, known: f32, n: u32) -> f32 {
    let deviation = power * kappa_at(n);
    return (known - deviation) / (1.0 + deviation);
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

fn rows_of(w: Design, words: ptr<function, Tally>) -> bool {
    var largest = 0.0;
    for (var k = 0u; k < POINTS; k++) {
        mean[k] = 0.0;
        least[k] = 1e30;
        most[k] = -1e30;
    }
    for (var k = 0u; k < PAIRS; k++) { spread[k] = 0.0; }
    // First drive at which any tap of the design has slipped: from there its rows are not complete.
    var complete = ROW_DRIVES;
    for (var n = 0u; n < DISTANCES; n++) {
        largest = max(largest, read_tap(w, n));
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
        let f = strain_of(w.theory, of_distance(n, INVERSE));
        let room = (w.L_a - of_distance(n, A)) * of_distance(n, INVERSE);
        var above = ROW_DRIVES;
        var slipped = ROW_DRIVES;
        if OWN {
            if f * w.drive / (1.0 + w.power * kappa[0]) > STRAIN_LIMIT { above = 0u; }
            if w.power * arc[0] > room { slipped = 0u; }
        } else {
            let last = at_drive(DRIVES - 1u);
            if f * last.strain > STRAIN_LIMIT { above = first_beyond(STRAIN_LIMIT / f, false); }
            if last.arc > room { slipped = first_beyond(room, true); }
        }
        keep[KEPT * n + ABOVE] = f32(above);
        keep[KEPT * n + SLIPPED] = f32(slipped);
        complete = min(complete, slipped);
    }
    // True also for NaN.
    (*words).hard = (*words).hard || !(largest < MOST_DEVIATION);
    if !ESTIMATES {
        for (var n = 0u; n < DISTANCES; n++) { count(w, n, complete, largest, words); }
    }
    var scale = inverseSqrt(f32(DISTANCES) - 1.0);
    if ELONGATION { scale *= w.x2 - w.x1; }
    if !ESTIMATES { (*words).complete += complete; }
    var found = false;
    for (var j = 0u; j < ROW_DRIVES; j++) {
        var drive = w.drive;
        var power = w.power;
        if !OWN {
            drive = to_drive(j);
            power = powered(drive);
        }
        var row = Row(0.0, true);
        if ESTIMATES {
            row = estimate(w, drive, power, j, words);
            (*words).complete += u32(row.whole && j < complete);
        } else {
            row.rank = power * deviation_at() * scale;
        }
        found = found || (row.whole && j < complete && row.rank < job.bound);
    }
    return found;
}
