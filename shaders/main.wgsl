// Entry point of every tap kernel: one invocation, one tap.

// x: taps in this batch; invocations beyond do nothing.
@group(0) @binding(0) var<uniform> batch: vec4<u32>;
@group(0) @binding(1) var<storage, read> taps: array<Tap>;
@group(0) @binding(2) var<storage, read_write> solutions: array<Solution>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < batch.x && id.x < arrayLength(&taps) && id.x < arrayLength(&solutions) {
        solutions[id.x] = solve(taps[id.x]);
    }
}
