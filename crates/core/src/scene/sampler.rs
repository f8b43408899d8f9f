//! Coordinate `dimension` of point `index` of a seed, a pure function that any backend or shard can evaluate.
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
        let mut found = 0;
        self.each((seed, dimension), [index].into_iter(), |_, coordinate| found = coordinate);
        found
    }

    /// [`Self::coordinate`] in the middle of its step, between 0 and 1.
    pub fn uniform(self, seed: u64, dimension: u32, index: u32) -> f64 {
        middle(self.coordinate(seed, dimension, index))
    }

    /// Gives [`Self::coordinate`] of many points to `put`, each with its place among them.
    pub fn each(
        self,
        (seed, dimension): (u64, u32),
        points: impl Iterator<Item = u32>,
        mut put: impl FnMut(usize, u32),
    ) {
        let all = points.enumerate();
        match (self, Self::scramble(seed, dimension)) {
            (Self::Sobol, None) => all.for_each(|(n, index)| put(n, sobol(dimension, index))),
            (Self::Sobol, Some(key)) => all.for_each(|(n, index)| put(n, owen(sobol(dimension, index), key))),
            (Self::Random, _) => {
                let (lane, key) = ((dimension % 4) as usize, words(seed));
                all.for_each(|(n, index)| put(n, philox([index, dimension / 4, 0, 0], key)[lane]));
            }
        }
    }

    /// Key of the scramble of a Sobol dimension; `None` for seed 0, which leaves the points as they are.
    pub fn scramble(seed: u64, dimension: u32) -> Option<u32> {
        let [low, high] = words(seed);
        (seed != 0).then(|| hash(hash(hash(dimension) ^ low) ^ high))
    }
}

/// The middle of a step of 2⁻³².
pub(super) fn middle(coordinate: u32) -> f64 {
    (f64::from(coordinate) + 0.5) / 4_294_967_296.0
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

/// High and low word of a product.
fn multiply(a: u32, b: u32) -> (u32, u32) {
    let product = u64::from(a) * u64::from(b);
    ((product >> 32) as u32, product as u32)
}
