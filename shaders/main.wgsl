// Entry point of every tap kernel: one invocation, one tap.

struct Batch {
    // Taps in this batch; invocations beyond do nothing.
    count: u32,
    // Number of the batch; it is in the seal of every answer.
    stamp: u32,
}

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taps: array<Tap>;
@group(0) @binding(2) var<storage, read_write> solutions: array<Solution>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < batch.count {
        solutions[id.x] = seal(solve(taps[id.x]), id.x, batch.stamp);
    }
}
