// Ranked rows of whole designs from the chart of the rod: one invocation, some designs. Twin of crates/kernel/src/smooth/lanes; the
// derivation stands there. What depends on the sizes of the chart is emitted (`tap`, `push`, `spread_at`, …).

struct Job {
    // Designs of this batch, designs that run at once, bound of the rank.
    count: u32,
    stride: u32,
    bound: f32,
    // Number of the batch, in the upper bits of every entry of the lists.
    stamp: u32,
    // Digits of the first design, one per factor.
    first: array<vec4<u32>, 2>,
}

// Numbers of taps per status word, and of rows (designs, where designs compete) that are complete.
struct Words { ok: u32, slipped: u32, strain: u32, rootless: u32, ambiguous: u32, invalid: u32, complete: u32 }

@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var<storage, read> tables: array<f32>;
@group(0) @binding(2) var<storage, read_write> tally: array<atomic<u32>, 16>;
// Designs with a row below the bound, and those that must be solved tap by tap.
@group(0) @binding(3) var<storage, read_write> best: array<u32>;
@group(0) @binding(4) var<storage, read_write> hard: array<u32>;

struct Whisker { D: f32, d: f32, L_a: f32, x_ss: f32, l: f32, angle: f32 }

// 0 charted, 1 tap by tap, 2 no whisker with a gauge. Next to a border the host decides.
fn case_of(w: Whisker) -> u32 {
    let room = w.L_a - w.x_ss - w.l;
    let near = 1e-6 * w.L_a;
    if room < -near { return 2u; }
    let tau = (w.D - w.d) / (w.D * w.L_a);
    let p = vec2<f32>(tau * NEAREST, tau * FARTHEST);
    let charted = w.L_a >= FARTHEST && (room > near || room == 0.0)
        && max(p.x, p.y) <= TAPER_HI && min(p.x, p.y) >= TAPER_LO
        && w.x_ss >= PLACE_LO * FARTHEST && w.x_ss + w.l <= PLACE_HI * NEAREST;
    return select(1u, 0u, charted);
}

// q from which, and up to which, the near root is within the range of interest, and q at the peak.
fn bounds(value: f32, slope: f32, beta: f32, lo: f32, hi: f32) -> vec3<f32> {
    let whole = 1.0 / value;
    let vertex = slope / (2.0 * beta);
    let peak = vertex * (slope - beta * vertex) * whole;
    let low = select(lo * (slope - beta * lo) * whole, 1e30, lo < vertex);
    let high = select(1e30, hi * (slope - beta * hi) * whole, vertex < hi);
    return vec3<f32>(low, min(high, peak), peak);
}

// Notes that design `i` must be solved tap by tap; 1.
fn list_hard(i: u32) -> u32 {
    hard[atomicAdd(&tally[1], 1u)] = job.stamp | i;
    return 1u;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    var words = Words();
    // Designs gone through, and those of them that go to the list of hard ones here.
    var seen = 0u;
    var left = 0u;
    for (var i = id.x; i < job.count; i += job.stride) {
        seen += 1u;
        let w = whisker(i);
        let c = case_of(w);
        if c == 2u {
            words.invalid += NA * DRIVES;
        } else if c == 1u {
            left += list_hard(i);
        } else {
            left += design(i, w, &words);
        }
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
