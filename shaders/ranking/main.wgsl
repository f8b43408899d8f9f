// Ranked rows of whole designs, read from charts; an invocation takes one design. Twin of crates/chart/src/lanes, which has the derivation. The
// charts are data: `numbers`, `shape` and `rows` hold them. The constants before this text (lanes/sheet.rs there) give their sizes.

struct Job {
    // Designs of this batch, bound of the rank.
    count: u32,
    bound: f32,
    // Digits of the first design, one per factor.
    first: array<vec4<u32>, 2>,
}

// Taps per combination of status words, and rows (designs, where designs compete) that are complete.
struct Words { taps: array<u32, COMBINED>, invalid: u32, complete: u32 }

@group(0) @binding(0) var<uniform> job: Job;
// `numbers`, `shape` and `rows`, bindings 1 to 3, are declared before this text: uniform where they fit, else storage.
@group(0) @binding(4) var<storage, read_write> tally: array<atomic<u32>, COUNTERS>;
// Designs with a row below the bound, and those that must be solved tap by tap, counted from 1.
@group(0) @binding(5) var<storage, read_write> best: array<u32>;
@group(0) @binding(6) var<storage, read_write> hard: array<u32>;
// Listed values of the designs' axes.
@group(0) @binding(7) var<storage, read> axes: array<f32>;

fn number(i: u32) -> f32 { return numbers[i / 4u][i % 4u]; }

fn size(i: u32) -> u32 { return shape[i / 4u][i % 4u]; }

// Number `k` of distance `n`: SCALE … INVERSE, then the points of its gauge.
fn of_distance(n: u32, k: u32) -> f32 { return number(DISTANCE * n + k); }

struct Whisker { D: f32, d: f32, L_a: f32, x_ss: f32, l: f32, drive: f32 }

// A whisker: D, τ, L_a, x1, x2, drive (rad or mm) and its power e.
struct Design { D: f32, tau: f32, L_a: f32, x1: f32, x2: f32, drive: f32, power: f32, theory: Theory }

fn width_of(w: Whisker) -> f32 {
    let slope = 0.5 * (w.D - w.d) / w.L_a;
    return w.l * inverseSqrt(fma(slope, slope, 1.0));
}

// 0 charted, 1 tap by tap, 2 not a whisker with a gauge. Close to a border of the valid whiskers the host decides.
fn case_of(w: Whisker) -> u32 {
    let room = w.L_a - w.x_ss - w.l;
    let near = 1e-6 * w.L_a;
    if room < -near { return 2u; }
    let tau = (w.D - w.d) / (w.D * w.L_a);
    let width = width_of(w);
    let charted = w.L_a >= REACH && (room > near || room == 0.0)
        && w.D >= D_LO && w.D <= D_HI && tau >= TAU_LO && tau <= TAU_HI
        && w.x_ss >= X_LO && w.x_ss + width <= X_HI && width <= WIDTH
        && (!OWN || APART || (w.drive >= DRIVE_LO && w.drive <= DRIVE_HI));
    return select(1u, 0u, charted);
}

fn design_of(w: Whisker) -> Design {
    var drive = w.drive;
    if !OWN { drive = drive_at(DRIVES - 1u); }
    let x2 = w.x_ss + width_of(w);
    let tau = (w.D - w.d) / (w.D * w.L_a);
    return Design(w.D, tau, w.L_a, w.x_ss, x2, drive, powered(drive), theory_of(w.D, tau, w.L_a, w.x_ss, x2));
}

fn list_hard(i: u32) {
    hard[atomicAdd(&tally[1], 1u)] = i + 1u;
}

fn rank_design(i: u32, words: ptr<function, Words>) {
    let w = whisker(i);
    let kind = case_of(w);
    if kind == 2u {
        (*words).invalid += DISTANCES * DRIVES;
        return;
    }
    if kind == 1u {
        list_hard(i);
        return;
    }
    var design = design_of(w);
    var counts = Tally();
    var found = false;
    let times = select(1u, DRIVES, APART);
    for (var j = 0u; j < times; j++) {
        if APART {
            design.drive = drive_at(j);
            design.power = powered(design.drive);
        }
        found = rows_of(design, &counts) || found;
    }
    if counts.hard {
        list_hard(i);
        return;
    }
    if found { best[atomicAdd(&tally[0], 1u)] = i + 1u; }
    (*words).taps = counts.taps;
    (*words).complete += select(counts.complete, min(counts.complete, 1u), PER_DESIGN);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    var words = Words();
    if id.x >= job.count { return; }
    rank_design(id.x, &words);
    for (var k = 0u; k < COMBINED; k++) {
        if words.taps[k] > 0u { atomicAdd(&tally[2u + k], words.taps[k]); }
    }
    atomicAdd(&tally[COMBINED + 2u], words.invalid);
    atomicAdd(&tally[COMBINED + 3u], words.complete);
    atomicAdd(&tally[COMBINED + 4u], 1u);
}
