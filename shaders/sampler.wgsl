// Sampled points on the device: the same integers as crates/core/src/scene/sampler.rs. Coordinates of unscrambled Sobol points are emitted per
// dimension (`sobol0`, `sobol1`, …).

// Nested uniform scramble (Laine–Karras): each bit is flipped depending on the bits above it only.
fn owen(point: u32, seed: u32) -> u32 {
    var x = reverseBits(point);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverseBits(x);
}

// High word of a 32 × 32 bit product, in 16-bit halves.
fn high(a: u32, b: u32) -> u32 {
    let a1 = a >> 16u;
    let a0 = a & 0xffffu;
    let b1 = b >> 16u;
    let b0 = b & 0xffffu;
    let middle = a1 * b0 + ((a0 * b0) >> 16u);
    let carry = (middle & 0xffffu) + a0 * b1;
    return a1 * b1 + (middle >> 16u) + (carry >> 16u);
}

// Philox4x32 with ten rounds.
fn philox(counter: vec4<u32>, key: vec2<u32>) -> vec4<u32> {
    var c = counter;
    var k = key;
    for (var round = 0u; round < 10u; round++) {
        c = vec4<u32>(
            high(0xcd9e8d57u, c.z) ^ c.y ^ k.x,
            c.z * 0xcd9e8d57u,
            high(0xd2511f53u, c.x) ^ c.w ^ k.y,
            c.x * 0xd2511f53u,
        );
        k += vec2<u32>(0x9e3779b9u, 0xbb67ae85u);
    }
    return c;
}

// A coordinate as a number of [0, 1].
fn fraction(coordinate: u32) -> f32 {
    return (f32(coordinate) + 0.5) * 2.3283064e-10;
}
