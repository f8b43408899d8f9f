// Words of taps, and distance errors of rows.

// Least and largest q of tap `n` over all drives; `every`: no drive has slipped.
fn range_of(n: u32, every: bool, largest: f32) -> array<f32, 2> {
    var middle = -kept(n, 0u);
    if !FIXED_GIVEN { middle += mean[0]; }
    var around = 0.0;
    for (var k = 1u; k < POINTS; k++) {
        let series_mean = select(mean[k], 0.0, FIXED_GIVEN);
        around += abs(series_mean - kept(n, k));
    }
    var lo = middle - around;
    var hi = middle + around;
    if !every && !FIXED_GIVEN {
        var apart = 0.0;
        for (var k = 0u; k < POINTS; k++) {
            let own = kept(n, k);
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

// First index of the combinations of words for each result of an estimate.
const CLEAR = 0u;
const AMBIGUOUS = 4u;
const ROOTLESS = 8u;

// Adds the drives from `begin` to `end` of tap `n`, with result `told`, each with the words that do not depend on it.
fn note(told: u32, n: u32, begin: u32, end: u32, words: ptr<function, Tally>) {
    let above = clamp(u32(kept(n, ABOVE)), begin, end);
    let slipped = clamp(u32(kept(n, SLIPPED)), begin, end);
    let clean = min(above, slipped);
    (*words).taps[told] += clean - begin;
    (*words).taps[told + 1u] += slipped - clean;
    (*words).taps[told + 2u] += above - clean;
    (*words).taps[told + 3u] += end - max(above, slipped);
}

// Adds the words of tap `n` over all drives to `words`; `complete`: first drive from which rows are not complete.
fn count(w: Design, n: u32, complete: u32, largest: f32, words: ptr<function, Tally>) {
    let whole = complete >= ROW_DRIVES;
    var between = array<f32, 2>();
    if OWN {
        let q = miss(w.power, calibration(w.power), n);
        between = array<f32, 2>(q - 1e-7, q + 1e-7);
    } else {
        between = range_of(n, whole, largest);
    }
    let lowest = between[0];
    let highest = between[1];
    let limits = limits_of(w.theory, n);
    let beyond = lowest < max(0.9 * limits.farthest, BEYOND_LO) || BEYOND_HI < highest;
    let certain = !beyond && highest < limits.peak;
    let away = highest < limits.low || limits.high < lowest;
    let twofold = certain && !away && limits.low < lowest && highest < limits.high;
    let out = beyond || (!twofold && lowest < limits.end);
    let is_clear = certain && away && !out;
    let open = !out && !is_clear && !twofold;
    if is_clear || twofold { note(select(AMBIGUOUS, CLEAR, is_clear), n, 0u, ROW_DRIVES, words); }
    (*words).hard = (*words).hard || out || (open && !whole);
    if open && whole {
        for (var j = 0u; j < ROW_DRIVES; j++) {
            var power = w.power;
            if !OWN { power = powered(to_drive(j)); }
            let q = miss(power, calibration(power), n);
            let none = limits.peak < q;
            let two = q >= limits.low && q <= limits.high;
            note(select(select(CLEAR, AMBIGUOUS, two), ROOTLESS, none), n, j, j + 1u, words);
        }
    }
}

// Rank of a row; `whole`: every tap of it has a distance.
struct Row { rank: f32, whole: bool }

// The row at drive `j`, ranked by its distance errors; the words of its taps are added to `words`.
fn estimate(w: Design, drive: f32, power: f32, j: u32, words: ptr<function, Tally>) -> Row {
    var squares = 0.0;
    var largest = 0.0;
    var noises = 0.0;
    var lacking = 0u;
    let known = calibration(power);
    let noise = (1.0 + known) * NOISE / drive;
    for (var n = 0u; n < DISTANCES; n++) {
        let a = of_distance(n, A);
        let q = miss(power, known, n);
        let limits = limits_of(w.theory, n);
        let root = root_of(growth_of(w.theory, n), q, limits.peak);
        let whole = 1.0 / (1.0 + root.eta);
        let error = a * root.eta * whole;
        squares = fma(error, error, squares);
        largest = max(largest, abs(error));
        let sigma = noise * a * whole * whole / max(limits.strain * root.slope, 1e-30);
        noises = fma(sigma, sigma, noises);
        let none = limits.peak < q;
        let lost = 1.0 + root.eta < FARTHEST || q < limits.farthest;
        let two = q >= limits.low && q <= limits.high && !none;
        let out = lost || (!two && q < limits.end);
        (*words).hard = (*words).hard || (out && !none);
        lacking += u32(none);
        note(select(select(CLEAR, AMBIGUOUS, two), ROOTLESS, none), n, j, j + 1u, words);
    }
    let share = 1.0 / f32(DISTANCES);
    return Row(rank_of(squares * share, largest, noises * share), lacking == 0u);
}
