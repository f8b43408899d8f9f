//! Common samples of manufacture: independent normal deviations cut at ±3σ.

// Coefficients as published, with more digits than f64 holds.
#![allow(clippy::excessive_precision)]

use crate::scene::sampler::Sampler;
use crate::scene::{COLUMNS, Column};

/// Φ(−3).
const BELOW: f64 = 1.349_898_031_630_094_5e-3;

/// Columns by the dimension of the Sobol points that they take: those of the pole's direction after those of whisker and drive.
const DIMENSIONS: [Column; COLUMNS] = [
    Column::BaseDiameter,
    Column::TipDiameter,
    Column::Length,
    Column::GaugePosition,
    Column::GridLength,
    Column::Distance,
    Column::Drive,
    Column::Tilt,
    Column::Lean,
];

/// Standard normal deviations cut at ±3, by sample and column: scrambled Sobol points, the same for every candidate.
pub fn deviations(seed: u64, samples: u32) -> Vec<[f64; COLUMNS]> {
    let one = |i| {
        let mut z = [0.0; COLUMNS];
        for (dimension, column) in (0..).zip(DIMENSIONS) {
            z[column as usize] = normal(seed, i, dimension);
        }
        z
    };
    (0..samples).map(one).collect()
}

/// That of sample `i` for the `k`-th property of the rig.
pub fn deviation(seed: u64, i: usize, k: u32) -> f64 {
    normal(seed, i as u32, COLUMNS as u32 + k)
}

fn normal(seed: u64, i: u32, dimension: u32) -> f64 {
    // Any seed but 0 scrambles.
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let uniform = (f64::from(Sampler::Sobol.coordinate(seed, dimension, i)) + 0.5) / 4_294_967_296.0;
    quantile(BELOW + (1.0 - 2.0 * BELOW) * uniform)
}

/// Quantile of the standard normal distribution for 1e-10 < p < 1 − 1e-10, relative error 1e-15 (M. J. Wichura, algorithm AS 241, Appl.
/// Statist. 37, 1988; without its outermost branch).
pub(crate) fn quantile(p: f64) -> f64 {
    const A: [f64; 8] = [
        3.387_132_872_796_366_608,
        133.141_667_891_784_377_45,
        1_971.590_950_306_551_442_7,
        13_731.693_765_509_461_125,
        45_921.953_931_549_871_457,
        67_265.770_927_008_700_853,
        33_430.575_583_588_128_105,
        2_509.080_928_730_122_672_7,
    ];
    const B: [f64; 8] = [
        1.0,
        42.313_330_701_600_911_252,
        687.187_007_492_057_908_3,
        5_394.196_021_424_751_107_7,
        21_213.794_301_586_595_867,
        39_307.895_800_092_710_61,
        28_729.085_735_721_942_674,
        5_226.495_278_852_854_561,
    ];
    const C: [f64; 8] = [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        2.417_807_251_774_506_117_7e-1,
        2.272_384_498_926_918_458_33e-2,
        7.745_450_142_783_414_076_4e-4,
    ];
    const E: [f64; 8] = [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        6.897_673_349_851_000_045_5e-1,
        1.481_039_764_274_800_745_9e-1,
        1.519_866_656_361_645_719_66e-2,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ];
    let ratio = |n: &[f64; 8], d: &[f64; 8], r: f64| {
        let poly = |c: &[f64; 8]| c.iter().rev().fold(0.0, |s, c| s * r + c);
        poly(n) / poly(d)
    };
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(&A, &B, 0.180_625 - q * q);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    ratio(&C, &E, (-tail.ln()).sqrt() - 1.6).copysign(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution() {
        let known = [
            (0.5, 0.0),
            (BELOW, -3.0),
            (0.975, 1.959_963_984_540_054),
            (0.25, -0.674_489_750_196_081_7),
            (0.9999, 3.719_016_485_455_709),
        ];
        for (p, z) in known {
            assert!((quantile(p) - z).abs() < 4e-15 * (1.0 + f64::abs(z)), "{p}: {}", quantile(p));
        }
    }

    #[test]
    fn samples_are_normal_cut_at_three_sigma() {
        for seed in [0, 1, 7, u64::MAX] {
            let all = deviations(seed, 1024);
            for column in 0..COLUMNS {
                let of = |power: i32| all.iter().map(|s| s[column].powi(power)).sum::<f64>() / 1024.0;
                assert!(all.iter().all(|s| s[column].abs() <= 3.0));
                // Variance of a normal distribution cut at ±3σ: 0.97334.
                assert!(of(1).abs() < 5e-3 && (of(2) - 0.973_34).abs() < 5e-3, "{} {}", of(1), of(2));
            }
        }
        assert_ne!(deviations(1, 2), deviations(2, 2));
    }
}
