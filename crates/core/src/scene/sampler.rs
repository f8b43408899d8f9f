//! Coordinate `dimension` of point `index` of a seed, a pure function in `u32` arithmetic that any backend or shard can evaluate.
//!
//! - `sobol`: direction numbers *new-joe-kuo-6* (S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30, 2008), in natural (not Gray-code) order. Seeds
//!   other than 0 apply an Owen scramble per dimension, by the Laine–Karras hash with N. Vegdahl's constants, which keeps the stratification.
//! - `random`: the counter-based generator Philox4x32-10 (J. K. Salmon et al., SC11), key = seed, counter = (index, dimension / 4), lane =
//!   dimension mod 4.

words! {
    /// Kind of the points of sampled axes.
    Sampler {
        /// Low-discrepancy points: fill evenly.
        Sobol = "sobol",
        /// Independent uniform numbers.
        Random = "random",
    }
}

/// Largest number of points of one set.
pub const MAX_SAMPLES: u64 = 1 << 32;
/// Largest number of axes that can be sampled together.
pub const MAX_DIMENSIONS: u32 = JOE_KUO.len() as u32;

impl Sampler {
    /// Coordinate `dimension` of point `index`, as a fraction of 2³². `dimension` is below [`MAX_DIMENSIONS`].
    pub fn coordinate(self, seed: u64, dimension: u32, index: u32) -> u32 {
        match (self, Self::scramble(seed, dimension)) {
            (Self::Sobol, None) => sobol(dimension, index),
            (Self::Sobol, Some(key)) => owen(sobol(dimension, index), key),
            (Self::Random, _) => philox([index, dimension / 4, 0, 0], words(seed))[(dimension % 4) as usize],
        }
    }

    /// Calls `put` with [`Self::coordinate`] of each of `points` and its place among them.
    pub fn each(self, seed: u64, dimension: u32, points: &[u64], mut put: impl FnMut(usize, u32)) {
        let all = points.iter().map(|index| *index as u32).enumerate();
        match (self, Self::scramble(seed, dimension)) {
            (Self::Sobol, None) => all.for_each(|(n, index)| put(n, sobol(dimension, index))),
            (Self::Sobol, Some(key)) => all.for_each(|(n, index)| put(n, owen(sobol(dimension, index), key))),
            (Self::Random, _) => all.for_each(|(n, index)| put(n, self.coordinate(seed, dimension, index))),
        }
    }

    /// Key of the scramble of a Sobol dimension; `None` for seed 0, which leaves the points as they are.
    pub fn scramble(seed: u64, dimension: u32) -> Option<u32> {
        let [low, high] = words(seed);
        (seed != 0).then(|| hash(hash(hash(dimension) ^ low) ^ high))
    }
}

fn words(seed: u64) -> [u32; 2] {
    [seed as u32, (seed >> 32) as u32]
}

/// Primitive polynomial with all its coefficients (x² + x + 1 is 7) and initial direction integers of each dimension, *new-joe-kuo-6*.
const JOE_KUO: [(u32, [u32; 7]); 24] = [
    (1, [1, 0, 0, 0, 0, 0, 0]),
    (3, [1, 0, 0, 0, 0, 0, 0]),
    (7, [1, 3, 0, 0, 0, 0, 0]),
    (11, [1, 3, 1, 0, 0, 0, 0]),
    (13, [1, 1, 1, 0, 0, 0, 0]),
    (19, [1, 1, 3, 3, 0, 0, 0]),
    (25, [1, 3, 5, 13, 0, 0, 0]),
    (37, [1, 1, 5, 5, 17, 0, 0]),
    (41, [1, 1, 5, 5, 5, 0, 0]),
    (47, [1, 1, 7, 11, 19, 0, 0]),
    (55, [1, 1, 5, 1, 1, 0, 0]),
    (59, [1, 1, 1, 3, 11, 0, 0]),
    (61, [1, 3, 5, 5, 31, 0, 0]),
    (67, [1, 3, 3, 9, 7, 49, 0]),
    (91, [1, 1, 1, 15, 21, 21, 0]),
    (97, [1, 3, 1, 13, 27, 49, 0]),
    (103, [1, 1, 1, 15, 7, 5, 0]),
    (109, [1, 3, 1, 15, 13, 25, 0]),
    (115, [1, 1, 5, 5, 19, 61, 0]),
    (131, [1, 3, 7, 11, 23, 15, 103]),
    (137, [1, 3, 7, 13, 13, 15, 69]),
    (143, [1, 1, 3, 13, 7, 35, 63]),
    (145, [1, 3, 5, 9, 1, 25, 53]),
    (157, [1, 3, 1, 13, 9, 35, 107]),
];

/// Direction numbers: bit k of the index flips `DIRECTIONS[dimension][k]`.
pub const DIRECTIONS: [[u32; 32]; JOE_KUO.len()] = directions();

const fn directions() -> [[u32; 32]; JOE_KUO.len()] {
    let mut all = [[0; 32]; JOE_KUO.len()];
    let mut dimension = 0;
    while dimension < all.len() {
        let (polynomial, initial) = JOE_KUO[dimension];
        let degree = polynomial.ilog2() as usize;
        let mut k = 0;
        while k < 32 {
            all[dimension][k] = if degree == 0 {
                1 << (31 - k)
            } else if k < degree {
                initial[k] << (31 - k)
            } else {
                let oldest = all[dimension][k - degree];
                let mut v = oldest ^ (oldest >> degree);
                let mut j = 1;
                while j < degree {
                    if polynomial >> (degree - j) & 1 == 1 {
                        v ^= all[dimension][k - j];
                    }
                    j += 1;
                }
                v
            };
            k += 1;
        }
        dimension += 1;
    }
    all
}

static FLIPS: [[[u32; 256]; 4]; JOE_KUO.len()] = flips();

const fn flips() -> [[[u32; 256]; 4]; JOE_KUO.len()] {
    let mut all = [[[0; 256]; 4]; JOE_KUO.len()];
    let mut at = 0;
    while at < JOE_KUO.len() * 4 * 256 {
        let (dimension, byte, bits) = (at / 1024, at / 256 % 4, at % 256);
        if bits > 0 {
            let rest = all[dimension][byte][bits & (bits - 1)];
            all[dimension][byte][bits] =
                rest ^ DIRECTIONS[dimension][8 * byte + bits.trailing_zeros() as usize];
        }
        at += 1;
    }
    all
}

fn sobol(dimension: u32, index: u32) -> u32 {
    let flips = &FLIPS[dimension as usize];
    let [a, b, c, d] = index.to_le_bytes().map(usize::from);
    flips[0][a] ^ flips[1][b] ^ flips[2][c] ^ flips[3][d]
}

/// Nested uniform scramble: each bit is flipped depending on the bits above it only.
fn owen(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// C. Wellons' *lowbias32*, one to one.
fn hash(x: u32) -> u32 {
    let mut x = x ^ 0x9e37_79b9;
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let (mut c, mut k) = (counter, key);
    for _ in 0..10 {
        let (high0, low0) = multiply(0xd251_1f53, c[0]);
        let (high1, low1) = multiply(0xcd9e_8d57, c[2]);
        c = [high1 ^ c[1] ^ k[0], low1, high0 ^ c[3] ^ k[1], low0];
        k = [k[0].wrapping_add(0x9e37_79b9), k[1].wrapping_add(0xbb67_ae85)];
    }
    c
}

/// High and low word of a 32 × 32 bit product, in 16-bit halves so that no wider integer is needed.
fn multiply(a: u32, b: u32) -> (u32, u32) {
    let (a1, a0) = (a >> 16, a & 0xffff);
    let (b1, b0) = (b >> 16, b & 0xffff);
    let middle = a1 * b0 + ((a0 * b0) >> 16);
    let carry = (middle & 0xffff) + a0 * b1;
    (a1 * b1 + (middle >> 16) + (carry >> 16), a.wrapping_mul(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `scipy.stats.qmc.Sobol(24, scramble=False, bits=32)`, whose point n is our point n ^ (n >> 1).
    #[test]
    fn sobol_agrees_with_scipy() {
        let last_of = |n: u32| -> Vec<u32> { (0..24).map(|j| sobol(j, n ^ (n >> 1))).collect() };
        assert_eq!(
            last_of(100),
            [
                1778384896, 1107296256, 3321888768, 3120562176, 3791650816, 3187671040, 100663296,
                2046820352, 2717908992, 2986344448, 1979711488, 2919235584, 2046820352, 3657433088,
                1375731712, 2113929216, 2919235584, 3187671040, 3590324224, 1442840576, 3254779904,
                1711276032, 33554432, 2113929216
            ]
        );
        assert_eq!(
            last_of(2047),
            [
                2097152, 2694840320, 3999268864, 1507852288, 2707423232, 2824863744, 505413632, 136314880,
                3927965696, 1914699776, 2141192192, 3802136576, 2510290944, 4242538496, 2099249152,
                2912944128, 2325741568, 3537895424, 471859200, 157286400, 1537212416, 463470592, 404750336,
                2996830208
            ]
        );
        assert!(last_of(0).iter().all(|&x| x == 0));
        assert!(last_of(1).iter().all(|&x| x == 1 << 31));
    }

    /// Each of the first 2^k points lies in a stratum of its own, in every dimension and for every seed.
    #[test]
    fn scramble_keeps_strata() {
        for seed in [0, 1, 2, 0x1234_5678_9abc_def0] {
            for dimension in 0..MAX_DIMENSIONS {
                let mut seen = [false; 256];
                for i in 0..256 {
                    let stratum = (Sampler::Sobol.coordinate(seed, dimension, i) >> 24) as usize;
                    assert!(
                        !std::mem::replace(&mut seen[stratum], true),
                        "seed {seed}, dimension {dimension}"
                    );
                }
            }
        }
    }

    #[test]
    fn seeds_differ() {
        let first = |seed| Sampler::Sobol.coordinate(seed, 0, 0);
        assert_ne!(first(1), first(2));
        assert_ne!(first(1), first(1 << 32));
        assert_ne!(Sampler::Sobol.coordinate(1, 0, 0), Sampler::Sobol.coordinate(1, 1, 0));
    }

    /// Known answers published with Random123 (`kat_vectors`).
    #[test]
    fn philox_known_answers() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }
}
